#!/usr/bin/env python3
"""Golden figures of tests/all/mjcf.rs from MuJoCo, one JSON file a model, beside this script.

    python make.py        (needs the PyPI package `mujoco`)

The bias holds gravity, Coriolis and centrifugal torque; the mass matrix holds the armature.
"""

import json
import pathlib

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
JOINTS = {name: ["first", "second", "third"] for name in ["geoms", "frames"]}
JOINTS["arm"] = ["pan", "lift", "elbow", "wrist"]


def figures(name, joints):
    model = mujoco.MjModel.from_xml_path(str(HERE / f"{name}.xml"))
    data = mujoco.MjData(model)
    places = [model.joint(joint) for joint in joints]
    q_at, v_at = [int(joint.qposadr[0]) for joint in places], [int(joint.dofadr[0]) for joint in places]
    random = np.random.default_rng(1)
    states = []
    for _ in range(3):
        q, v = random.uniform(-2, 2, len(joints)), random.uniform(-3, 3, len(joints))
        mujoco.mj_resetData(model, data)
        data.qpos[q_at], data.qvel[v_at] = q, v
        mujoco.mj_forward(model, data)
        full = np.array([[mass(model, data, i, j) for j in v_at] for i in v_at])
        states.append({"q": q, "v": v, "bias": data.qfrc_bias[v_at], "mass_matrix": full})
    fixed = {"damping": model.dof_damping, "friction": model.dof_frictionloss, "armature": model.dof_armature}
    out = {"mujoco": mujoco.__version__, "joints": joints, "states": states}
    out |= {key: np.reshape(values, (model.nv, -1))[v_at, 0] for key, values in fixed.items()}
    out["range"] = np.array([model.jnt_range[joint.id] if model.jnt_limited[joint.id] else [0, 0] for joint in places])
    (HERE / f"{name}.json").write_text(json.dumps(out, default=lambda x: x.tolist()) + "\n")


def mass(model, data, i, j):
    """An entry of the mass matrix: what acceleration of one joint takes of another, from inverse dynamics at rest."""
    out = np.zeros(model.nv)
    unit = np.zeros(model.nv)
    unit[j] = 1
    mujoco.mj_mulM(model, data, out, unit)
    return out[i]


if __name__ == "__main__":
    for name, joints in JOINTS.items():
        figures(name, joints)
