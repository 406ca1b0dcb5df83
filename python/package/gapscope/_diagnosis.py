"""The diagnosis: where, which and how far."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from ._commands import _flags
from ._effects import Effects
from ._given import Logs, Robot, given, robot_file
from ._progress import Progress, clear, teller
from ._results import Exported, framed, save

if TYPE_CHECKING:
    from ._plot import Plots


def _trust(trust: Union[str, Mapping[str, str], None]) -> Optional[list[str]]:
    """What the command line says of links."""
    if isinstance(trust, Mapping):
        return [f"{link}={source}" for link, source in trust.items()]
    return None if trust is None else [trust]


def diagnose(
    model: Robot,
    logs: Logs,
    *,
    drive: Union[str, "os.PathLike[str]", None] = None,
    trust: Union[str, Mapping[str, str], None] = None,
    progress: Progress = None,
    **options: Any,
) -> Diagnosis:
    """Finds where the gap lies, which effects cause it and how far it shrinks. The same as `gapscope diagnose`.

    Args:
        model: path of a URDF, xacro or MJCF file; the text of one; a `Model`; or a `mujoco.MjSpec`.
        logs: paths (CSV, NumPy, MATLAB, Parquet, HDF5, MCAP, folders of ROS 2 bags and LeRobot datasets); or runs in memory:
            mappings of arrays or frames of pandas or polars, either with columns `time`, `position.<joint>`,
            `effort.<joint>`, … (T,) each, or with whole quantities `time` (T,), `position` (T, n), `effort` (T, n), … and
            `joints` where they are not in the robot's order. Units: s, rad, rad/s, N m (m, m/s, N). One or several.
        drive: path of a TOML file with what is known of the servos, where logs hold no torque.
        trust: how well the links' inertials are known: "weighed", "cad" (the default) or "guessed"; or a mapping from links to
            these.
        progress: True for a line on standard error, False for none, or a function `(stage, part)` with part from 0 to 1;
            by default a line in a terminal and in a notebook.
        options: those of the command line by name: `map` (a mapping), `map_file`, `topic`, `episodes`, `calibration`,
            `xacro_args`, `lock`, `allow_truncated`, `skip_bad_logs`, `as_logged`.

    Raises:
        LogError, RobotError, Error: what cannot be read, with its mend.
        KeyboardInterrupt: at once; the work ends in the background at its next stage.
    """
    told = teller(progress)
    try:
        with given(model, logs, options) as arguments:
            files, summary, why, sentences = _native.diagnose(arguments, _flags(drive=drive, trust=_trust(trust)), told)
            robot = _Robot.of(arguments)
    finally:
        clear(told)
    held = {name: text for name, text in files if text is not None}
    return Diagnosis(held, robot, sentences, summary, why)


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was found."""

    #: Public name, e.g. `coulomb_friction`.
    kind: str
    #: Joints affected; empty for one of the whole robot.
    joints: tuple[str, ...]
    #: Of effects reported with .9, nine in ten are there.
    confidence: float
    #: By name: an estimate with `value`, `ci95` and `unit`, or one for each joint.
    parameters: Mapping[str, Any]
    #: Kinds that these logs cannot tell from it.
    indistinguishable_from: tuple[str, ...]
    #: All that diagnosis.json says of it.
    details: Mapping[str, Any]

    def __repr__(self) -> str:
        place = f" at {', '.join(self.joints)}" if self.joints else ""
        return f"FoundEffect({self.kind}{place}, confidence {self.confidence:.3g})"


class Diagnosis:
    """What a diagnosis found. It can be pickled, saved and loaded; `print` shows the answer in three lines."""

    def __init__(
        self,
        files: Mapping[str, str],
        robot: _Robot,
        sentences: Optional[Sequence[str]] = None,
        summary: str = "",
        why_text: str = "",
    ) -> None:
        #: The files of its folder by name: diagnosis.json, corrected.json, report.html, next_experiment.csv.
        self.files = dict(files)
        self._robot = robot
        self._found: dict[str, Any] = json.loads(self.files["diagnosis.json"])
        self._sentences = list(sentences or _native.sentences(self.files["diagnosis.json"]))
        self._summary, self._why = summary, why_text

    @classmethod
    def load(cls, folder: Union[str, "os.PathLike[str]"], model: Robot, **options: Any) -> Diagnosis:
        """Reads the folder that `save` or `gapscope diagnose` wrote; `model` is the robot that it was made with.

        Raises:
            Error: files that are missing or are no diagnosis.
        """
        names = ("diagnosis.json", "corrected.json", "report.html", "next_experiment.csv")
        files = {name: Path(folder, name).read_text("utf-8") for name in names if Path(folder, name).is_file()}
        if missing := [name for name in names[:2] if name not in files]:
            raise _native.Error(f"cannot read {Path(folder, missing[0])}; give the folder that `gapscope diagnose` wrote")
        with given(model, [], options) as arguments:
            return cls(files, _Robot.of(arguments))

    @property
    def verdict(self) -> str:
        """`no_gap`, `explained`, `partly_explained`, `unknown_effect` or `not_excited`."""
        return self._found["verdict"]

    @property
    def effects(self) -> tuple[FoundEffect, ...]:
        """Which: the effects found, strongest first."""
        return tuple(
            FoundEffect(
                kind=found["kind"],
                joints=tuple(found["joints"]),
                confidence=found["confidence"],
                parameters=found["parameters"],
                indistinguishable_from=tuple(found["indistinguishable_from"]),
                details=found,
            )
            for found in self.to_dict()["effects"]
        )

    @property
    def corrections(self) -> Effects:
        """The effects with the values found, as `generate` and corrected.json have them; not for a servo arm."""
        return Effects(json.loads(self.files["corrected.json"])["effects"])

    @property
    def gap(self) -> dict[str, Any]:
        """Where: torque (N m, N), one step, rollouts and regimes, on held-out data, for the model as described."""
        return self.to_dict()["gap"]

    @property
    def shrink(self) -> dict[str, Any]:
        """How far: before, after and their shrink with its 95 % interval, on held-out data."""
        return self.to_dict()["shrink"]

    @property
    def why(self) -> list[dict[str, Any]]:
        """The comparisons that decided: what was proposed, against what, and by how many nats it won."""
        return self.to_dict()["why"]

    @property
    def findings(self) -> list[str]:
        """What was odd about robot and logs, gravest first."""
        return self.to_dict()["data"]["findings"]

    @property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of all arrays."""
        return list(self._found["joints"])

    @property
    def summary(self) -> str:
        """The answer as the terminal shows it; empty after `load`."""
        return self._summary

    @property
    def html(self) -> Optional[str]:
        """The report, one page that needs nothing else; None for a servo arm."""
        return self.files.get("report.html")

    @property
    def plot(self) -> Plots:
        """Plots by matplotlib: `effects`, `gap`, `regimes`, `shrink`.

        Raises:
            ImportError: matplotlib is not installed.
        """
        from ._plot import Plots

        return Plots(self._found)

    def to_dict(self) -> dict[str, Any]:
        """All of it, schema `gapscope.diagnosis/1`, as plain Python values."""
        return json.loads(self.files["diagnosis.json"])

    def to_json(self) -> str:
        """The bytes of diagnosis.json."""
        return self.files["diagnosis.json"]

    def export(
        self, target: str, logs: Optional[Logs] = None, *, dt: Optional[float] = None, **options: Any
    ) -> Exported:
        """The corrected model for a target, with a ledger of what stands there and as what.

        With `logs`, best ones that the diagnosis did not see, the ledger predicts by how much the shrink falls for what the
        target cannot hold.

        Args:
            target: "urdf", "mjcf", "isaaclab", "c", "cpp", "simulink" or "fmu". "isaaclab" needs the file of "urdf" beside it,
                "cpp" and "simulink" that of "c".
            dt: length of a step in a target that has one of its own (the last four), s; .001 by default.

        Raises:
            Error: a target that the robot cannot be written for.
        """
        with self._robot.arguments([] if logs is None else logs, options) as arguments:
            corrected = self.files["corrected.json"]
            data, name, ledger = _native.export(target, arguments, self.joints, corrected, dt)
        return Exported(data, name, json.loads(ledger))

    def to_urdf(self) -> str:
        """Your own URDF with attributes edited: inertials, damping and friction, encoder zeros, a tilted base."""
        return self.export("urdf").text

    def to_mjcf(self, spec: Any = None, *, partial: bool = False) -> Any:
        """The corrected model for MuJoCo: the text of a whole MJCF file; with a `mujoco.MjSpec`, a corrected copy of it.

        A spec keeps its shapes, actuators and names. It takes what its bodies, joints and gravity can hold, which is
        checked: its mass matrix and bias are those of the corrected model.

        Args:
            spec: the robot as you simulate it, with the joints and bodies of the diagnosed model by name.
            partial: leave effects out that stand in actuators or further joints, instead of raising.

        Raises:
            Error: a spec of other bodies or joints, or an effect that it cannot hold.
        """
        exported = self.export("mjcf")
        if spec is None:
            return exported.text
        from ._mujoco import corrected

        return corrected(spec, exported, partial)

    def to_fmu(
        self, path: Union[str, "os.PathLike[str]"], *, dt: Optional[float] = None, force: bool = False
    ) -> None:
        """Writes the corrected model as a co-simulation unit (FMI 2.0): efforts in, measured positions and speeds out.

        It has a binary for this machine where there is a C compiler `cc`, and its sources in any case.

        Raises:
            Error: a file that is there already, unless `force` is given.
        """
        self.export("fmu", dt=dt).save(path, force=force)

    def save(self, folder: Union[str, "os.PathLike[str]"], *, force: bool = False) -> None:
        """Writes diagnosis.json, corrected.json, report.html and, where one is proposed, next_experiment.csv.

        Raises:
            Error: files that are there already, unless `force` is given.
        """
        save(Path(folder), self.files, force)

    def __repr__(self) -> str:
        which, where, how_far = self._sentences
        head = f"{self.verdict.upper().replace('_', ' ')}  {self._found['robot']}: "
        return "\n".join(line.replace("\n", " ") for line in (head + which, f"Where    {where}", f"How far  {how_far}"))

    def _repr_html_(self) -> str:
        if self.html is not None:
            return framed(self.html)
        import html

        return f"<pre>{html.escape(self._summary or repr(self))}</pre>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Diagnosis) and self.files == other.files

    __hash__ = None  # type: ignore[assignment]


@dataclass
class _Robot:
    """The robot that a diagnosis was made with, so that it outlives the file."""

    text: str
    path: str
    lock: list[str]
    xacro_args: list[str]

    @classmethod
    def of(cls, arguments: Mapping[str, Any]) -> _Robot:
        path = os.path.abspath(arguments["robot"])
        try:
            text = Path(path).read_text(encoding="utf-8")
        except OSError as error:
            raise _native.Error(f"cannot read the robot description {path}: {error.strerror}") from None
        return cls(text, path, list(arguments["lock"]), list(arguments["xacro_args"]))

    @contextmanager
    def arguments(self, logs: Logs, options: Mapping[str, Any]) -> Any:
        """The robot's own file as long as it is what it was, since others may lie beside it; else its text."""
        try:
            same = Path(self.path).read_text(encoding="utf-8") == self.text
        except (OSError, UnicodeDecodeError):
            same = False
        with robot_file(self.path if same else self.text) as (path, _):
            more = {"lock": self.lock, "xacro_args": self.xacro_args, **options}
            with given(path, logs, more) as arguments:
                yield arguments
