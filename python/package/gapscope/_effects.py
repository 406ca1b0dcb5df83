"""Effects that a robot has and its model lacks."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Optional, Union, overload

from . import _native


class Effects(Sequence[Mapping[str, Any]]):
    """Unmodelled effects with their parameters, by their public names: a sequence that does not change.

    Args:
        effects: effects as mappings, e.g. `{"kind": "coulomb_friction", "coulomb": {"joint2": 1.3}}`; or the path of a JSON
            file with such a list, or with one under `effects`, as `corrected.json` and `truth.json` have.
        model: where given, the robot is asked whether it can have them.

    Raises:
        Error: a kind or parameter that does not exist, a joint that the robot lacks, or a value out of bounds.
    """

    __slots__ = ("_effects",)

    def __init__(
        self,
        effects: Union[Iterable[Mapping[str, Any]], str, "os.PathLike[str]"] = (),
        model: Optional[_native.Model] = None,
    ) -> None:
        if isinstance(effects, (str, os.PathLike)):
            try:
                held = json.loads(Path(effects).read_text(encoding="utf-8"))
            except OSError as error:
                raise _native.Error(f"cannot read the effects {os.fspath(effects)}: {error.strerror}") from None
            except ValueError as error:
                raise _native.Error(f"{os.fspath(effects)} is not JSON: {error}") from None
            effects = held.get("effects", []) if isinstance(held, dict) else held
        text = json.dumps([dict(effect) for effect in effects])
        self._effects: list[dict[str, Any]] = json.loads(_native.effects(text, model))

    @overload
    def __getitem__(self, index: int) -> Mapping[str, Any]: ...
    @overload
    def __getitem__(self, index: slice) -> Effects: ...
    def __getitem__(self, index: Union[int, slice]) -> Any:
        if isinstance(index, slice):
            return Effects(self._effects[index])
        return copy.deepcopy(self._effects[index])

    def __len__(self) -> int:
        return len(self._effects)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        return iter(copy.deepcopy(self._effects))

    def __add__(self, other: Iterable[Mapping[str, Any]]) -> Effects:
        return Effects([*self._effects, *other])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Effects) and self._effects == other._effects

    def __hash__(self) -> int:
        return hash(self.to_json())

    def __repr__(self) -> str:
        return f"Effects({self._effects!r})"

    @property
    def kinds(self) -> list[str]:
        """Kinds in their order."""
        return [effect["kind"] for effect in self._effects]

    def of(self, kind: str) -> Effects:
        """Those of one kind."""
        return Effects([effect for effect in self._effects if effect["kind"] == kind])

    def to_json(self) -> str:
        """A JSON list that `gapscope generate --effects` reads."""
        return json.dumps(self._effects)
