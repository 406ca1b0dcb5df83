"""Evidence of a fleet: however many logs, taken in anywhere and merged in any order."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np

from . import _native
from ._diagnosis import Diagnosis, diagnose
from ._given import Logs, Robot, given
from ._progress import Progress

#: Logs that get the exact laws, unless told otherwise.
KEEP = 64
#: What bytes of this class begin with.
MAGIC = b"GSEVID1\0"


class Evidence:
    """What logs of one robot say, or of many of one type: flat in memory, and the same bits in any order.

    The first pass keeps linear sums of every log: what bodies, viscous and Coulomb friction, rotors and biases make of its torque
    gap. It also keeps at most `keep` whole logs. Which ones is drawn by a digest of their samples; a log whose joints slide for twice
    as long is drawn with twice the odds. `finish` is the second pass: the diagnosis of those that were kept. It says
    where all logs together speak against them.

    >>> evidence = gapscope.Evidence("robot.urdf")
    >>> for log in logs:
    ...     evidence.add(log)
    >>> other = gapscope.Evidence.from_bytes(data)      # made elsewhere
    >>> diagnosis = evidence.merge(other).finish()

    Each log belongs in once: the sums cannot tell a log from its double.

    Args:
        model: the robot, as `gapscope.diagnose` takes it. All logs must have all joints that are not held by `lock`.
        keep: logs that are kept whole, 1 or more.
        options: as those of `gapscope.diagnose`; they hold for all logs.

    Raises:
        RobotError, Error: a robot that cannot be read, with its mend.
    """

    def __init__(self, model: Robot, *, keep: int = KEEP, **options: Any) -> None:
        if keep < 1:
            raise _native.Error(f"keep is {keep}; a diagnosis needs one log at least")
        self._keep = int(keep)
        with given(model, [], options) as arguments:
            self._model = _native.Model(arguments["robot"], arguments["lock"])
        self._options = {name: value for name, value in options.items() if name != "lock"}
        self._sums = _native.Sums(self._model)
        # Rank, digest, name and arrays of logs, by rank.
        self._kept: list[tuple[float, int, str, dict[str, Any]]] = []

    def add(self, episode: Logs) -> Evidence:
        """Takes in a log, or several: paths, mappings of arrays or frames, with torque. All runs of it, or none where it raises.

        Raises:
            LogError, Error: what cannot be read, lacks a joint or its effort, or is too short, with its mend.
        """
        one = isinstance(episode, (str, os.PathLike, Mapping)) or hasattr(episode, "columns")
        sums, runs = _native.Sums(self._model), []
        for log in [episode] if one else list(episode):
            with given(self._model, log, self._options) as arguments:
                if not (new := sums.add(arguments)):
                    told = "a log holds no run: parts of fewer than 20 samples between gaps of time are left out; leave it out"
                    raise _native.LogError(f"{arguments['logs'][0] if arguments['logs'] else 'log'}: {told}")
            runs += new
        self._sums.merge(sums)
        self._hold(runs)
        return self

    def merge(self, other: Evidence) -> Evidence:
        """Takes in what another has, of other logs of the same robot; returns itself.

        Raises:
            Error: evidence of another robot, with another `keep`, or this one itself.
        """
        if other is self:
            raise _native.Error("an evidence cannot be merged with itself: its logs would count twice")
        if (other._model.text, other._model.locked) != (self._model.text, self._model.locked):
            raise _native.Error("the evidence is of another robot description; merge what was made with one and the same")
        if other._keep != self._keep:
            raise _native.Error(f"one keeps {self._keep} logs, the other {other._keep}; make both with the same `keep`")
        self._sums.merge(other._sums)
        self._hold(other._kept)
        return self

    @property
    def episodes(self) -> int:
        """Number of logs taken in."""
        return self._sums.episodes

    @property
    def kept(self) -> list[str]:
        """Names of the logs that `finish` would diagnose."""
        return [name for _, _, name, _ in self._kept]

    def to_bytes(self) -> bytes:
        """All of it. The same logs give the same bytes, in whatever order they were added and merged."""
        head = {
            "robot": self._model.text,
            "path": self._model.path,
            "lock": self._model.locked,
            "keep": self._keep,
            "options": self._options,
            "kept": [
                {"rank": rank, "digest": str(digest), "name": name, "joints": list(log["joints"])}
                for rank, digest, name, log in self._kept
            ],
        }
        arrays = {"sums": np.frombuffer(self._sums.to_bytes(), dtype=np.uint8)}
        for number, (_, _, _, log) in enumerate(self._kept):
            arrays.update({f"{number}/{key}": values for key, values in log.items() if key != "joints"})
        file = io.BytesIO()
        np.savez(file, head=np.frombuffer(json.dumps(head, default=os.fspath).encode(), dtype=np.uint8), **arrays)
        return MAGIC + file.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> Evidence:
        """What `to_bytes` gave.

        Raises:
            Error: bytes that are no evidence.
        """
        if not data.startswith(MAGIC):
            raise _native.Error("these bytes are no evidence; give what `Evidence.to_bytes` returned")
        try:
            with np.load(io.BytesIO(data[len(MAGIC) :]), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            head = json.loads(arrays.pop("head").tobytes())
            evidence = cls.__new__(cls)
            evidence._keep, evidence._options = head["keep"], head["options"]
            evidence._model = _native.Model(head["robot"], head["lock"], head["path"])
            evidence._sums = _native.Sums.from_bytes(evidence._model, arrays.pop("sums").tobytes())
            evidence._kept = []
            for number, one in enumerate(head["kept"]):
                own = f"{number}/"
                log = {key[len(own) :]: values for key, values in arrays.items() if key.startswith(own)}
                evidence._kept.append((one["rank"], int(one["digest"]), one["name"], {"joints": one["joints"], **log}))
        except (KeyError, ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise _native.Error(f"these bytes are damaged or cut off ({error}); make the evidence anew") from None
        return evidence

    def finish(self, *, progress: Progress = None, **options: Any) -> Diagnosis:
        """Diagnoses the logs that were kept. `findings` begin with what all logs say of them.

        Args:
            progress, options: as those of `gapscope.diagnose`.

        Raises:
            Error: no log was added.
        """
        if not self._kept:
            raise _native.Error("the evidence holds no log; add one first")
        said = []
        if self.episodes > len(self._kept):
            chosen = _native.Sums(self._model)
            logs = [_run(name, log) for _, _, name, log in self._kept]
            with given(self._model, logs, {}) as arguments:
                chosen.add(arguments)
            said = self._sums.unlike(chosen)
            said.append(f"the logs: {self.episodes} were taken in, of which {len(self._kept)} are diagnosed")
        # In an order that no rank decides, so that the held-out parts do not follow it.
        logs = [_run(name, log) for _, _, name, log in sorted(self._kept, key=lambda one: (one[2], one[1]))]
        return diagnose(self._model, logs, progress=progress, said=said, **options)

    def _hold(self, runs: Any) -> None:
        """Keeps those of the lowest ranks. A digest decides between equals, and keeps a log from being diagnosed twice."""
        held = {(rank, digest): (rank, digest, name, log) for rank, digest, name, log in self._kept}
        for rank, digest, name, log in runs:
            known = held.setdefault((rank, digest), (rank, digest, name, log))
            if name < known[2]:
                held[rank, digest] = (rank, digest, name, log)
        self._kept = [held[place] for place in sorted(held)[: self._keep]]

    def __reduce__(self) -> tuple[Any, ...]:
        return (Evidence.from_bytes, (self.to_bytes(),))

    def __repr__(self) -> str:
        return f"Evidence of {self._model.name}: {self.episodes} logs, {len(self._kept)} of them kept"


def _run(name: str, log: dict[str, Any]) -> dict[str, Any]:
    return {"name": name, **log}
