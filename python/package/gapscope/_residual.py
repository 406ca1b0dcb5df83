"""Networks: a learned correction on top of physics, and one alone."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._commands import _flags, _with
from ._given import Logs, Robot, given
from ._progress import Progress, clear, teller
from ._results import save

if TYPE_CHECKING:
    from ._commands import Corrections

_NEEDED = ("weights.safetensors", "training.json")


class _Network:
    """What a residual and a network alone have in common."""

    _kind = ""

    def __init__(self, files: dict[str, bytes], model: _native.Model, told: str = "", notes: Sequence[str] = ()) -> None:
        self._files, self._model, self._told = dict(files), model, told
        #: What was wrong or odd about logs and robot.
        self.notes = list(notes)
        with tempfile.TemporaryDirectory(prefix="gapscope-") as folder:
            for name in _NEEDED:
                Path(folder, name).write_bytes(self._files[name])
            self._network = _native.Network(self._kind, folder, model)

    @classmethod
    def _train(
        cls, model: Robot, logs: Logs, settings: Mapping[str, Any], progress: Progress, options: Mapping[str, Any]
    ) -> Any:
        settings = dict(settings)
        if hidden := settings.pop("hidden"):
            settings["hidden"] = ",".join(map(str, hidden))
        told = teller(progress)
        try:
            with ExitStack() as stack:
                arguments = stack.enter_context(given(model, logs, options))
                flags = _with(stack, settings.pop("corrections", None)) + _flags(**settings)
                files, text, notes = _native.train(cls._kind, arguments, flags, told)
                files = dict(files)
                return cls(files, _held(arguments, json.loads(files["training.json"])["joints"]), text, notes)
        finally:
            clear(told)

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"], model: Robot, lock: Sequence[str] = ()) -> Any:
        """Reads the folder that `save` or `gapscope train` wrote, for this robot.

        Raises:
            Error: files that are missing, or were written for another robot or another kind of network.
        """
        robot = model if isinstance(model, _native.Model) else _native.Model(model, list(lock))
        _native.Network(cls._kind, os.fspath(path), robot)
        folder = Path(path) if Path(path).is_dir() else Path(path).parent
        return cls({file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.is_file()}, robot)

    def save(self, path: Union[str, "os.PathLike[str]"], *, force: bool = False) -> None:
        """Writes weights (safetensors, JSON, ONNX), record and learning curve into a folder.

        Raises:
            Error: files that are there already, unless `force` is given.
        """
        save(Path(path), self._files, force)

    def predict(
        self, q: npt.ArrayLike, v: npt.ArrayLike, tau: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Positions and velocities one step of `dt` later, each (..., n), under the efforts `tau` held over the step.

        Raises:
            Error: shapes other than (..., n), or not all the same.
        """
        return _halves(self._network.step(q, v, tau, True))

    @property
    def dt(self) -> float:
        """Time of a step, s."""
        return self._network.dt

    @property
    def model(self) -> _native.Model:
        """The robot's model."""
        return self._model

    @property
    def training(self) -> dict[str, Any]:
        """The record: joints, settings, best epoch, held-out errors (rad/s or m/s, rms) of physics and of what was learned."""
        return json.loads(self._files["training.json"])

    def __repr__(self) -> str:
        held = self.training["held_out"]
        head = f"{type(self).__name__} {self._about()} {self._model.name}, steps of {self.dt} s"
        return f"{head}\nHeld-out one-step velocity error, rms: physics {held['physics']:.3g}, with it {held['learned']:.3g}"

    def _about(self) -> str:
        return "of"

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (self._files, self._model, self._told, self.notes))


class Residual(_Network):
    """f_hyb = f_phys + r: a network on top of a robot's rigid-body model that corrects its step.

    Made by `Residual.train` or `Residual.load`; it can be pickled.
    """

    _kind = "residual"

    @classmethod
    def train(
        cls,
        model: Robot,
        logs: Logs,
        *,
        corrections: "Corrections" = None,
        on: str = "next-state",
        hidden: Optional[Sequence[int]] = None,
        epochs: int = 100,
        dt: Optional[float] = None,
        seed: int = 0,
        reference: str = "two-hidden-128",
        batch: Optional[int] = None,
        rate: Optional[float] = None,
        cosine: bool = False,
        penalty: Optional[float] = None,
        patience: Optional[int] = None,
        progress: Progress = None,
        **options: Any,
    ) -> Residual:
        """Trains on logs, the last fifth of each held out.

        Args:
            model, logs, options: as those of `gapscope.diagnose`; the logs must hold the effort.
            corrections: a `Diagnosis`, or the path of a `corrected.json`, as the physics below; by default the robot as described.
            on: what is corrected: "next-state", "acceleration" or "torque".
            hidden: sizes of the hidden layers, instead of the reference configuration's.
            epochs: passes over the data.
            dt: time of a step, s; by default that of `gapscope train`.
            seed: draws initial weights and the order of the data.
            reference: "two-hidden-128" or "one-hidden-64"; what is not given is as there.
            batch, rate, cosine, penalty, patience: as the options of `gapscope train`.
            progress: see `gapscope.diagnose`.

        Raises:
            LogError, RobotError, Error: bad input or settings, with the mend.
        """
        settings = dict(
            corrections=corrections, on=on, hidden=hidden, epochs=epochs, dt=dt, seed=seed, reference=reference, batch=batch,
            rate=rate, cosine=cosine, penalty=penalty, patience=patience,
        )  # fmt: skip
        return cls._train(model, logs, settings, progress, options)

    def physics(
        self, q: npt.ArrayLike, v: npt.ArrayLike, tau: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The same as `predict`, by the physics below the network alone."""
        return _halves(self._network.step(q, v, tau, False))

    def _about(self) -> str:
        return f"on {self.training['on']} of"


class Pure(_Network):
    """x⁺ = x + f(x, τ): a network alone, which knows nothing of the robot but its joints; what a residual is held against.

    Made by `Pure.train` or `Pure.load`; it can be pickled.
    """

    _kind = "pure"

    @classmethod
    def train(
        cls,
        model: Robot,
        logs: Logs,
        *,
        hidden: Optional[Sequence[int]] = None,
        epochs: int = 100,
        dt: Optional[float] = None,
        seed: int = 0,
        reference: str = "two-hidden-128",
        batch: Optional[int] = None,
        rate: Optional[float] = None,
        cosine: bool = False,
        penalty: Optional[float] = None,
        patience: Optional[int] = None,
        progress: Progress = None,
        **options: Any,
    ) -> Pure:
        """Trains on logs, the last fifth of each held out. Arguments and errors are those of `Residual.train`."""
        settings = dict(
            hidden=hidden, epochs=epochs, dt=dt, seed=seed, reference=reference, batch=batch, rate=rate, cosine=cosine,
            penalty=penalty, patience=patience,
        )  # fmt: skip
        return cls._train(model, logs, settings, progress, options)


def _halves(x: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    n = x.shape[-1] // 2
    return x[..., :n], x[..., n:]


def _held(arguments: dict[str, Any], joints: Sequence[str]) -> _native.Model:
    """The robot with the joints held that training did not have."""
    whole = _native.Model(arguments["robot"], arguments["lock"])
    lock = [*arguments["lock"], *(joint for joint in whole.joints if joint not in joints)]
    return _native.Model(whole.text, lock, arguments["robot"])
