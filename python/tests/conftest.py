"""Logs that all tests share, and the command that they are compared with."""

import os
import shutil
import subprocess
from pathlib import Path

import gapscope
import pytest

#: What the robot of the tests has and its URDF lacks.
EFFECTS = [
    {"kind": "coulomb_friction", "coulomb": {"joint1": 0.3, "joint2": 0.2}},
    {"kind": "viscous_friction", "viscous": {"joint1": 0.15, "joint2": 0.1}},
]


class Case:
    """Logs in a folder, and the same in memory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        options = {"episodes": 2, "seconds": 8, "seed": 3}
        gapscope.generate("double_pendulum", EFFECTS, out=folder, **options)
        self.generated = gapscope.generate("double_pendulum", EFFECTS, **options)
        self.robot = folder / "robot.urdf"
        self.logs = [folder / f"episode_{i}.csv" for i in range(2)]
        self.diagnosis = gapscope.diagnose(self.robot, self.logs)


@pytest.fixture(scope="session")
def case(tmp_path_factory):
    return Case(tmp_path_factory.mktemp("case") / "logs")


@pytest.fixture(scope="session")
def command():
    """Runs the command; returns what it prints."""
    program = os.environ.get("GAPSCOPE") or shutil.which("gapscope")
    if not program:
        pytest.skip("no gapscope command: name it by GAPSCOPE")

    def run(*words, fails=False):
        done = subprocess.run([program, *map(str, words)], capture_output=True, text=True)
        assert (done.returncode != 0) == fails, done.stderr
        return done.stderr if fails else done.stdout

    return run
