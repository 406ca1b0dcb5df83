"""The commands beside `diagnose`."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from ._effects import Effects
from ._given import Logs, Robot, given, robot_file
from ._results import Evaluation, Generated, Inspection, Rollouts

if TYPE_CHECKING:
    from ._diagnosis import Diagnosis
    from ._residual import Pure, Residual

    Corrections = Union[Diagnosis, str, os.PathLike[str], None]


def inspect(logs: Logs, model: Optional[Robot] = None, **options: Any) -> Inspection:
    """What logs are like: rate, gaps, jitter, steps and motion of each joint; with a robot also faults and what they determine.

    Args and options as those of `diagnose`; without a robot, files must be CSV.

    Raises:
        LogError, RobotError, Error: what cannot be read, with its mend.
    """
    with given("" if model is None else model, logs, options) as arguments:
        return Inspection(*_native.inspect(arguments))


def evaluate(
    model: Robot,
    logs: Logs,
    corrections: "Corrections" = None,
    *,
    drive: Union[str, "os.PathLike[str]", None] = None,
    **options: Any,
) -> Evaluation:
    """Measures the gap on other logs, before and after the corrections that a diagnosis found.

    Args:
        model, logs, options: as those of `diagnose`.
        corrections: a `Diagnosis`, or the path of a `corrected.json`.
        drive: path of a TOML file with what is known of the servos.

    Raises:
        LogError, RobotError, Error: what cannot be read or does not go together, with its mend.
    """
    with ExitStack() as stack:
        arguments = stack.enter_context(given(model, logs, options))
        flags = _flags(drive=drive) + _with(stack, corrections)
        return Evaluation(*_native.evaluate(arguments, flags))


def rollout(
    model: Robot,
    logs: Logs,
    corrections: "Corrections" = None,
    *,
    residual: Union[Residual, str, "os.PathLike[str]", None] = None,
    pure: Union[Pure, str, "os.PathLike[str]", None] = None,
    horizon: float = 1.0,
    tolerance: float = 0.05,
    fit_start: Optional[float] = None,
    starts: int = 240,
    **options: Any,
) -> Rollouts:
    """Shows how the models' errors grow over the horizon under the logged effort, beside what one-step errors allow.

    Args:
        model, logs, options: as those of `diagnose`.
        corrections: a `Diagnosis`, or the path of a `corrected.json`.
        residual: a `Residual`, or the folder of one, on the robot's own model.
        pure: a `Pure`, or the folder of one.
        horizon: the longest one, s.
        tolerance: position error over all joints at which a rollout has left the log, rad or m.
        fit_start: seconds of the log to which each start is fitted; for noisy logs.
        starts: rollouts over all logs.

    Raises:
        LogError, RobotError, Error: what cannot be read or does not go together, with its mend.
    """
    with ExitStack() as stack:
        arguments = stack.enter_context(given(model, logs, options))
        networks: dict[str, Any] = {"residual": residual, "pure": pure}
        for kind, network in networks.items():
            if network is not None and not isinstance(network, (str, os.PathLike)):
                networks[kind] = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="gapscope-")), kind)
                network.save(networks[kind])
        numbers = _flags(horizon=horizon, tolerance=tolerance, fit_start=fit_start, starts=starts)
        flags = _with(stack, corrections) + _flags(**networks) + numbers
        models, text, page, notes = _native.rollout(arguments, flags)
        return Rollouts(models, page, notes, text)


def generate(
    robot: Robot = "arm7",
    effects: Union[Iterable[Mapping[str, Any]], str, "os.PathLike[str]", None] = None,
    *,
    out: Union[str, "os.PathLike[str]", None] = None,
    **options: Any,
) -> Generated:
    """Simulates closed-loop logs of a robot with effects that its URDF lacks.

    Args:
        robot: a URDF, its text, or a built-in robot: arm7, arm6, double_pendulum.
        effects: `Effects`, mappings, or the path of a JSON file.
        out: folder for robot.urdf, episode_*.csv and truth.json, as the command writes them; else the logs stay in memory.
        options: those of `gapscope generate`, e.g. `episodes=4`, `seconds=10.0` (s), `rate=500.0` (Hz), `seed=0`,
            `motion="fourier"`, `servo="computed-torque"`, `perturb=1.0`, `effort_noise=1e-3`, `lock=["joint7"]`, `force=True`.

    Raises:
        RobotError, Error: a robot, an effect or a number that cannot be, with its mend.
    """
    with ExitStack() as stack:
        if effects is not None:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="gapscope-"))
            held = effects if isinstance(effects, Effects) else Effects(effects)
            file = Path(folder, "effects.json")
            file.write_text(held.to_json(), encoding="utf-8")
            options["effects"] = file
        path, locked = stack.enter_context(robot_file(robot))
        if locked:
            options["lock"] = [*locked, *options.get("lock", [])]
        flags = _flags(out=out, **options)
        urdf, held_json, logs = _native.generate(path, flags, out is not None)
        if out is None:
            return Generated(urdf, logs, Effects(json.loads(held_json)))
        count = int(options.get("episodes", 4))
        files: list[Union[dict[str, Any], str]] = [str(Path(out, f"episode_{i}.csv")) for i in range(count)]
        return Generated(Path(out, "robot.urdf").read_text(encoding="utf-8"), files, Effects(Path(out, "truth.json")))


def _with(stack: ExitStack, corrections: "Corrections") -> list[str]:
    """The flag that names a file with the corrections."""
    if corrections is None or isinstance(corrections, (str, os.PathLike)):
        return _flags(**{"with": corrections})
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="gapscope-"))
    file = Path(folder, "corrected.json")
    file.write_text(corrections.files["corrected.json"], encoding="utf-8")
    return _flags(**{"with": file})


def _flags(**options: Any) -> list[str]:
    """Options as flags of the command line, which checks them."""
    flags = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            flags.append(flag)
        elif isinstance(value, (list, tuple)):
            flags += [f"{flag}={item}" for item in value]
        else:
            flags.append(f"{flag}={os.fspath(value) if isinstance(value, os.PathLike) else value}")
    return flags
