"""Golden figures: what MuJoCo makes of an exported model.

    python export/golden/make.py GAPSCOPE

Writes robot.xml with `gapscope export` from corrected.json here, and figures.json: random states with the torque that is left
of each joint at no command, what actuators deliver less what mj_inverse takes, N m. Needs PyPI `mujoco==4.0.0 numpy`.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).parent
JOINTS = [f"joint{i + 1}" for i in range(6)]
STATES = 24

with tempfile.TemporaryDirectory() as out:
    robot = HERE.parent.parent / "dynamics" / "robots" / "arm6.urdf"
    command = ["export", HERE / "corrected.json", "--robot", robot, "--to", "mjcf", "--out", out]
    subprocess.run([sys.argv[1], *map(str, command)], check=True, stdout=subprocess.DEVNULL)
    text = (pathlib.Path(out) / "robot.xml").read_text()
(HERE / "robot.xml").write_text(text)

model = mujoco.MjModel.from_xml_string(text)
data = mujoco.MjData(model)
random = np.random.default_rng(27)
states = []
for _ in range(STATES):
    q = random.uniform(-1.5, 1.5, 6)
    # Away from rest, where MuJoCo's dry friction is softer than a sign.
    v = random.uniform(0.3, 1.5, 6) * random.choice([-1.0, 1.0], 6)
    a = random.uniform(-3.0, 3.0, 6)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, 0.0
    mujoco.mj_forward(model, data)
    delivered = data.qfrc_actuator.copy()
    data.qacc[:] = a
    mujoco.mj_inverse(model, data)
    states.append({"q": q.tolist(), "v": v.tolist(), "a": a.tolist(), "left": (delivered - data.qfrc_inverse).tolist()})
figures = {"mujoco": mujoco.__version__, "joints": JOINTS, "states": states}
(HERE / "figures.json").write_text(json.dumps(figures) + "\n")
