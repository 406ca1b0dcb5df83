"""Robot and logs as users hold them, as the Rust side takes them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from ._native import Error, Model

#: A path of a robot description, its XML text, a Model, or an object with `to_xml()` such as `mujoco.MjSpec`.
Robot = Union[str, "os.PathLike[str]", Model, Any]
#: A path, a mapping of names to arrays, or a frame with `columns` (pandas, polars); or several of a kind.
Logs = Union[str, "os.PathLike[str]", Mapping[str, Any], Any, Sequence[Any]]


@contextmanager
def given(robot: Robot, logs: Logs, options: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The arguments of the Rust side. A robot that is no file stands in one while this is open."""
    arguments = _options(options)
    paths, arguments["runs"] = _split(logs)
    arguments["logs"] = [os.fspath(path) for path in paths]
    with robot_file(robot) as (path, locked):
        arguments["robot"] = path
        arguments["lock"] = [*locked, *arguments["lock"]]
        yield arguments


@contextmanager
def robot_file(robot: Robot) -> Iterator[tuple[str, list[str]]]:
    """A file with the robot description, and the joints of it that are held still."""
    locked: list[str] = []
    if isinstance(robot, Model):
        robot, locked = robot.path or robot.text, list(robot.locked)
    elif hasattr(robot, "to_xml"):
        robot = robot.to_xml()
    if not (isinstance(robot, str) and robot.lstrip("\ufeff \t\r\n").startswith("<")):
        yield os.fspath(robot), locked
        return
    with tempfile.TemporaryDirectory(prefix="gapscope-") as folder:
        file = Path(folder, "robot.xml")
        file.write_text(robot, encoding="utf-8")
        yield str(file), locked


def _options(options: Mapping[str, Any]) -> dict[str, Any]:
    def texts(name: str) -> list[str]:
        value = options.get(name) or []
        return [value] if isinstance(value, str) else [str(item) for item in value]

    def path(name: str) -> Optional[str]:
        value = options.get(name)
        return None if value is None else os.fspath(value)

    known = {
        "map", "map_file", "topic", "episodes", "calibration", "xacro_args", "lock", "allow_truncated", "skip_bad_logs",
        "as_logged", "said",
    }  # fmt: skip
    if unknown := sorted(set(options) - known):
        raise TypeError(f"unknown option {unknown[0]!r}; there are {', '.join(sorted(known - {'said'}))}")
    columns = options.get("map") or {}
    pairs = [f"{name}={column}" for name, column in columns.items()] if isinstance(columns, Mapping) else list(columns)
    episodes = options.get("episodes")
    if episodes is not None and not isinstance(episodes, str):
        episodes = ",".join(str(int(number)) for number in ([episodes] if isinstance(episodes, int) else episodes))
    return {
        "map": pairs,
        "map_file": path("map_file"),
        "topic": texts("topic"),
        "episodes": episodes,
        "calibration": path("calibration"),
        "xacro_args": texts("xacro_args"),
        "lock": texts("lock"),
        "allow_truncated": bool(options.get("allow_truncated", False)),
        "skip_bad_logs": bool(options.get("skip_bad_logs", False)),
        "as_logged": bool(options.get("as_logged", False)),
        "said": texts("said"),
    }


def _split(logs: Logs) -> tuple[list[Any], list[dict[str, Any]]]:
    if isinstance(logs, (str, os.PathLike)):
        return [logs], []
    if isinstance(logs, Mapping) or hasattr(logs, "columns"):
        return [], [_run(logs, "log")]
    several = list(logs)
    paths = [log for log in several if isinstance(log, (str, os.PathLike))]
    if paths and len(paths) < len(several):
        raise Error("logs are either all paths or all in memory; read the files first, or save the arrays")
    if paths or not several:
        return paths, []
    return [], [_run(log, f"log {number}") for number, log in enumerate(several)]


def _run(log: Any, name: str) -> dict[str, Any]:
    """A mapping or frame as named arrays. A float64 array that lies contiguous is passed on as it is."""
    if not isinstance(log, Mapping) and not hasattr(log, "columns"):
        raise Error(f"{name} is a {type(log).__name__}; expected a path, a mapping of arrays, or a frame with columns")
    names: Iterable[Any] = log.keys() if isinstance(log, Mapping) else log.columns
    joints: list[str] = []
    arrays = []
    for key in names:
        values = log[key]
        if str(key) in ("joints", "joint_names"):
            joints = [str(joint) for joint in values]
            continue
        if str(key) == "name" and isinstance(values, str):
            name = values
            continue
        try:
            array = np.ascontiguousarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            # A column of texts, say, which no quantity is.
            continue
        arrays.append((str(key), array))
    return {"name": name, "joints": joints, "arrays": arrays}
