"""What the commands give, as objects that read well."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union

from ._effects import Effects
from ._native import Error


class Record:
    """A JSON object with a text for people."""

    __slots__ = ("_json", "_text")

    def __init__(self, json_text: str, text: str) -> None:
        self._json, self._text = json_text, text

    def to_dict(self) -> dict[str, Any]:
        """The whole of it as plain Python values."""
        return json.loads(self._json)

    def to_json(self) -> str:
        """The same bytes as the command prints with `--json`."""
        return self._json

    def __repr__(self) -> str:
        return self._text.strip("\n")

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._json == other._json  # type: ignore[attr-defined]

    __hash__ = None  # type: ignore[assignment]


class Inspection(Record):
    """What logs are like, what is wrong with them, and what they determine; schema `gapscope.inspection/1`."""

    __slots__ = ()


class Evaluation(Record):
    """The gap on logs, before and after the corrections; schema `gapscope.evaluation/1`.

    `predictions` has a dict for each log: `log`, `time` (T,) in s, and `measured`, `nominal` and `corrected` torque, (T, n)
    in N m or N at the instants compared. It is empty for a servo arm.
    """

    __slots__ = ("notes", "predictions")

    def __init__(self, json_text: str, text: str, notes: list[str], predictions: list[dict[str, Any]]) -> None:
        super().__init__(json_text, text)
        #: What is wrong or odd about logs, robot and corrected model.
        self.notes = notes
        self.predictions = predictions

    @property
    def gap(self) -> dict[str, Any]:
        """Where: torque (N m), one step and rollout, by joint; for the model as described."""
        return self.to_dict()["gap"]

    @property
    def shrink(self) -> Any:
        """How far: before, after and their shrink; None without corrections."""
        return self.to_dict()["shrink"]


@dataclass(frozen=True, repr=False)
class Rollouts:
    """How the error of each model grows over the horizon.

    `models` has a dict for each: `model`, `horizons` (h,) in s; `low`, `median` and `high` (h,), the 10, 50 and 90 % quantiles
    of the norm of the position error, rad or m; `position` and `velocity` (h, n), medians by joint; `rate` in 1/s, `leaves` in s,
    `starts`; and `bound`, or None.
    """

    models: list[dict[str, Any]]
    #: The page as HTML.
    html: str
    #: What is wrong or odd about logs and robot.
    notes: list[str]
    text: str

    def __repr__(self) -> str:
        return self.text.strip("\n")

    def _repr_html_(self) -> str:
        return framed(self.html)


@dataclass(frozen=True)
class Generated:
    """Simulated logs: the robot's URDF, what `diagnose` takes as logs, and the effects that they hold."""

    robot: str
    #: Arrays by name, `time` (T,), `position` (T, n), …, with `joints`; or paths, where they were written to a folder.
    logs: list[Union[dict[str, Any], str]]
    effects: Effects

    def __repr__(self) -> str:
        kinds = ", ".join(dict.fromkeys(self.effects.kinds)) or "no effect"
        return f"Generated: {len(self.logs)} logs with {kinds}"


@dataclass(frozen=True)
class Exported:
    """A file for a simulator, and its ledger: of each effect as what it stands there and what that loses."""

    #: Content of the file.
    data: bytes
    #: What the file is to be called where others refer to it.
    name: str
    ledger: dict[str, Any]

    @property
    def text(self) -> str:
        """Content of a file of text.

        Raises:
            UnicodeDecodeError: the file of a co-simulation unit, which is none.
        """
        return self.data.decode("utf-8")

    def save(self, path: Union[str, "os.PathLike[str]"], *, force: bool = False) -> None:
        """Writes the file; into a folder under its own name.

        Raises:
            Error: a file that is there already, unless `force` is given.
        """
        file = Path(path, self.name) if Path(path).is_dir() else Path(path)
        save(file.parent, {file.name: self.data}, force)

    def __repr__(self) -> str:
        rows = [f"  {entry['kind']}: {entry['how'].replace('_', ' ')}, {entry['as']}" for entry in self.ledger["effects"]]
        return "\n".join([f"Exported for {self.ledger['target']}", *rows])


def save(folder: Path, files: Mapping[str, Union[str, bytes]], force: bool) -> None:
    """Writes files of a folder; none where one is there already."""
    there = next((folder / name for name in files if (folder / name).exists()), None)
    if there is not None and not force:
        raise Error(f"{there} exists already; choose another folder, or allow it to be replaced with force=True")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            staged = folder / f".{name}.part"
            staged.write_bytes(data)
            staged.replace(folder / name)
    except OSError as error:
        raise Error(f"cannot write to {folder}: {error.strerror}") from None


def framed(page: str, height: int = 640) -> str:
    """A page as a frame of its own, so that its style stays in it."""
    import html

    return (
        f'<iframe srcdoc="{html.escape(page, quote=True)}" width="100%" height="{height}" '
        'style="border: 0; background: white" sandbox="" title="gapscope"></iframe>'
    )
