"""Where a robot's simulator drifts from the robot, which effect causes it, and how far the gap shrinks.

>>> import gapscope
>>> diagnosis = gapscope.diagnose("robot.urdf", ["run1.csv", "run2.csv"])
>>> print(diagnosis)                        # three lines, the answer first
>>> diagnosis.save("results")               # diagnosis.json, report.html, corrected.json
>>> mjcf = diagnosis.to_mjcf()              # the corrected model for MuJoCo

SI units throughout: s, rad, m, N m (N for a prismatic joint). Arrays have samples along their first axis and the joints of the
robot along their last.
"""

from ._commands import evaluate, generate, inspect, rollout
from ._diagnosis import Diagnosis, FoundEffect, diagnose
from ._effects import Effects
from ._evidence import Evidence
from ._native import Error, LogError, Model, RobotError, __version__
from ._residual import Pure, Residual
from ._results import Evaluation, Exported, Generated, Inspection, Rollouts

__all__ = [
    "Diagnosis",
    "Effects",
    "Error",
    "Evaluation",
    "Evidence",
    "Exported",
    "FoundEffect",
    "Generated",
    "Inspection",
    "LogError",
    "Model",
    "Pure",
    "Residual",
    "RobotError",
    "Rollouts",
    "__version__",
    "diagnose",
    "evaluate",
    "generate",
    "inspect",
    "rollout",
]
