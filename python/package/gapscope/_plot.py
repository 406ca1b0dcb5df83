"""Plots of a diagnosis. matplotlib is imported here and nowhere else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional

import matplotlib.pyplot as plt
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Nominal and corrected, told apart in grey too.
BEFORE, AFTER, FLOOR = "#b3541e", "#2a6f97", "#888888"


class Plots:
    """Each method draws on `ax`, or on a figure of its own, and returns the axes."""

    def __init__(self, found: Mapping[str, Any]) -> None:
        self._found = found

    def effects(self, ax: Optional[Axes] = None) -> Axes:
        """How sure each effect is, strongest first."""
        ax = _axes(ax)
        found = self._found["effects"]
        names = [f"{effect['kind'].replace('_', ' ')}\n{', '.join(effect['joints']) or 'robot'}" for effect in found]
        ax.barh(range(len(found)), [effect["confidence"] for effect in found], color=AFTER)
        ax.set_yticks(range(len(found)), names)
        ax.invert_yaxis()
        ax.set(xlim=(0, 1), xlabel="confidence", title=self._found["verdict"].replace("_", " "))
        return ax

    def gap(self, ax: Optional[Axes] = None) -> Axes:
        """The gap of each joint, rms on held-out data, against what noise alone gives."""
        ax = _axes(ax)
        kind = "torque" if "torque" in self._found["gap"] else "position"
        gap = self._found["gap"][kind]
        joints = [joint for joint in self._found["joints"] if joint in gap["rms"]]
        ax.bar(joints, [gap["rms"][joint] for joint in joints], color=BEFORE, label="model as described")
        floor = gap.get("floor") or {}
        if all(joint in floor for joint in joints):
            ax.plot(joints, [floor[joint] for joint in joints], "_", color="black", markersize=16, label="noise alone")
        ax.set(ylabel=f"{kind} gap, rms, {'N m (N)' if kind == 'torque' else 'rad (m)'}")
        ax.tick_params(axis="x", rotation=45)
        ax.legend()
        return ax

    def regimes(self, ax: Optional[Axes] = None) -> Axes:
        """Share of each regime in its joint's squared gap."""
        ax = _axes(ax)
        rows = self._found["gap"]["regimes"]
        joints, names = list(dict.fromkeys(r["joint"] for r in rows)), list(dict.fromkeys(r["regime"] for r in rows))
        shares = np.zeros((len(joints), len(names)))
        for row in rows:
            cell = joints.index(row["joint"]), names.index(row["regime"])
            shares[cell] = max(shares[cell], row["share"])
        image = ax.imshow(shares, vmin=0, vmax=1, cmap="viridis", aspect="auto")
        ax.set_xticks(range(len(names)), [name.replace("_", " ") for name in names], rotation=45, ha="right")
        ax.set_yticks(range(len(joints)), joints)
        ax.figure.colorbar(image, ax=ax, label="largest share of the squared gap")
        return ax

    def shrink(self, ax: Optional[Axes] = None) -> Axes:
        """The position error of rollouts over the horizon, before and after, and the torque gap in the title."""
        ax = _axes(ax)
        shrink = self._found["shrink"]
        rows = shrink.get("rollout") or []
        for name, label, color in (("before", "model as described", BEFORE), ("after", "corrected", AFTER)):
            points = [(row["horizon"], row[name]) for row in rows if row.get(name) is not None]
            if points:
                ax.loglog(*zip(*points), "o-", color=color, label=label)
        whole = shrink.get("torque") or shrink.get("position") or {}
        if whole.get("shrink") is not None:
            ax.set_title(f"gap shrinks by {100 * whole['shrink']:.1f} %")
        ax.set(xlabel="horizon, s", ylabel="position error, rms, rad (m)")
        if ax.lines:
            ax.legend()
        return ax


def _axes(ax: Optional[Axes]) -> Axes:
    return plt.subplots(layout="constrained")[1] if ax is None else ax
