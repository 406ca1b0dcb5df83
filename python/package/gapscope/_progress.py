"""Progress of long work, where somebody looks."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Optional, Union

#: `True` for a line on standard error, a function of stage and part done (0 to 1), or `None`: a line in terminal and notebook.
Progress = Union[bool, Callable[[str, float], object], None]


class Line:
    """One line on standard error that is written over."""

    def __init__(self) -> None:
        self.width = 0

    def __call__(self, stage: str, part: float) -> None:
        text = f"{round(100 * part):3d} %  {stage}"
        sys.stderr.write("\r" + text.ljust(self.width))
        sys.stderr.flush()
        self.width = len(text)

    def clear(self) -> None:
        if self.width:
            sys.stderr.write("\r" + " " * self.width + "\r")
            sys.stderr.flush()


def teller(progress: Progress) -> Optional[Callable[[str, float], object]]:
    """What is to be told of progress."""
    if callable(progress):
        return progress
    if progress is None:
        progress = sys.stderr is not None and (sys.stderr.isatty() or "ipykernel" in sys.modules)
    return Line() if progress else None


def clear(told: Optional[Callable[[str, float], object]]) -> None:
    """Takes the line away."""
    if isinstance(told, Line):
        told.clear()
