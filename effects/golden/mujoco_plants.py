#!/usr/bin/env python3
"""Golden trajectories of tests/all/golden.rs from MuJoCo: one JSON file a robot, beside this script.

    python mujoco_plants.py        (needs the PyPI package `mujoco`)

Each case starts at rest under efforts amplitude · sin(frequency · t + phase) held over samples of 2 ms, and stores the
joint positions every `stride` samples. MuJoCo runs at a hundredth of a sample; friction is its constraint, a rotor is a
body of its own on the base, coupled by a tendon with stiffness and damping.
"""

import json
import math
import pathlib

import mujoco
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
ROBOTS = HERE.parent.parent / "dynamics/robots"
SAMPLE, SUBSTEPS, SAMPLES, STRIDE = 0.002, 100, 400, 20

RUNS = {
    "double_pendulum": {
        "start": [0.9, -0.6], "amplitude": [0.8, 0.5], "frequency": [6.0, 9.0], "phase": [0.3, 1.1],
        "viscous": [0.08, 0.04], "coulomb": [0.25, 0.12], "armature": [0.02, 0.01], "stiffness": 6.0, "elastic": (30.0, 0.02, 0.015),
        "always_viscous": False,
    },
    "arm6": {
        "start": [0.2, -1.3, 1.2, -1.0, 0.8, 0.3], "amplitude": [20.0, 30.0, 20.0, 4.0, 3.0, 0.4],
        "frequency": [6.0, 7.0, 5.0, 8.0, 9.0, 11.0], "phase": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        "viscous": [6.0, 6.0, 4.0, 1.0, 0.8, 0.1], "coulomb": [6.0, 6.0, 4.0, 1.0, 0.8, 0.1],
        "armature": [0.8, 0.9, 0.5, 0.1, 0.1, 0.05], "stiffness": 40.0, "elastic": (2500.0, 2.0, 0.6),
        # Without friction its light wrist spins up to where any two integrators part.
        "always_viscous": True,
    },
}
PAYLOAD = {"mass": 0.4, "com": [0.03, -0.02, 0.06], "inertia": [0.002, 0.0003, 0.0025, -0.0002, 0.0001, 0.0015]}
TILT = {"roll": 0.06, "pitch": -0.04}


def cases(run, joints):
    each = lambda name: dict(zip(joints, run[name]))
    k, d, rotor = run["elastic"]
    all_cases = {
        "nothing": [],
        "viscous": [{"kind": "viscous_friction", "viscous": each("viscous")}],
        "coulomb": [{"kind": "coulomb_friction", "coulomb": each("coulomb")}],
        "armature": [{"kind": "armature", "armature": each("armature")}],
        "spring": [{"kind": "parallel_spring", "stiffness": {joints[1]: run["stiffness"]}, "rest_position": {joints[1]: 0.3}}],
        "payload": [{"kind": "payload", "joint": joints[-1], **PAYLOAD}],
        "tilt": [{"kind": "gravity_misalignment", **TILT}],
        "elasticity": [
            {"kind": "joint_elasticity", "stiffness": {joints[1]: k}, "damping": {joints[1]: d}},
            {"kind": "armature", "armature": {joints[1]: rotor}},
        ],
    }
    if run["always_viscous"]:
        for name, effects in all_cases.items():
            if name != "viscous":
                effects.extend(all_cases["viscous"])
    return all_cases


def build(path, effects):
    text = path.read_text().replace("</robot>", '<mujoco><compiler balanceinertia="false" fusestatic="true" boundmass="0" boundinertia="0"/></mujoco></robot>')
    spec = mujoco.MjSpec.from_string(text)
    by_kind = {e["kind"]: e for e in effects}
    joint = {j.name: j for j in spec.joints}
    if "payload" in by_kind:
        e = by_kind["payload"]
        xx, xy, yy, xz, yz, zz = e["inertia"]
        body = joint[e["joint"]].parent.add_body(name="payload")
        body.mass, body.ipos, body.explicitinertial = e["mass"], e["com"], True
        body.fullinertia = [xx, yy, zz, xy, xz, yz]
    if "joint_elasticity" in by_kind:
        e = by_kind["joint_elasticity"]
        (name, k), = e["stiffness"].items()
        rotor = by_kind.pop("armature")["armature"][name]
        body = spec.worldbody.add_body(name="rotor")
        body.mass, body.inertia, body.explicitinertial = 1e-3, [rotor] * 3, True
        body.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        tendon = spec.add_tendon(name="gear", stiffness=k, damping=e["damping"][name], springlength=[0, 0])
        tendon.wrap_joint("rotor", 1.0)
        tendon.wrap_joint(name, -1.0)
    m = spec.compile()
    m.opt.timestep = SAMPLE / SUBSTEPS
    # Friction is a constraint and wants Euler steps; all else takes the more exact rule.
    m.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST if "coulomb_friction" in by_kind else mujoco.mjtIntegrator.mjINT_RK4
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    dof = lambda name: m.jnt_dofadr[m.joint(name).id]
    for e in by_kind.values():
        match e["kind"]:
            case "viscous_friction":
                for name, b in e["viscous"].items(): m.dof_damping[dof(name)] = b
            case "coulomb_friction":
                for name, f in e["coulomb"].items(): m.dof_frictionloss[dof(name)] = f
                m.dof_solref[:, 0], m.dof_solimp[:, :2] = 5 * m.opt.timestep, 0.9999
            case "armature":
                for name, i in e["armature"].items(): m.dof_armature[dof(name)] = i
            case "parallel_spring":
                for name, k in e["stiffness"].items():
                    m.jnt_stiffness[m.joint(name).id], m.qpos_spring[dof(name)] = k, e["rest_position"][name]
            case "gravity_misalignment":
                r, p = e["roll"], e["pitch"]
                m.opt.gravity[:] = 9.81 * np.array([math.sin(p), -math.sin(r) * math.cos(p), -math.cos(r) * math.cos(p)])
    return m, dof


def simulate(path, joints, run, effects):
    m, dof = build(path, effects)
    d = mujoco.MjData(m)
    index = [dof(name) for name in joints]
    drive = list(index)
    d.qpos[index] = run["start"]
    elastic = next((e for e in effects if e["kind"] == "joint_elasticity"), None)
    first = np.array(run["amplitude"]) * np.sin(run["phase"])
    if elastic:
        # The rotor starts where it has the link's acceleration: wound up by what the link takes.
        (name, k), = elastic["stiffness"].items()
        j, rotor = joints.index(name), dof("rotor")
        drive[j] = rotor
        mass = np.zeros((m.nv, m.nv))
        mujoco.mj_forward(m, d)
        mujoco.mj_fullM(m, d, mass)
        rigid = mass[np.ix_(index, index)]
        rigid[j, j] += mass[rotor, rotor]
        a = np.linalg.solve(rigid, first - d.qfrc_bias[index])
        d.qpos[rotor] = run["start"][j] + (first[j] - mass[rotor, rotor] * a[j]) / k
    rows = []
    for sample in range(SAMPLES):
        t = sample * SAMPLE
        d.qfrc_applied[drive] = np.array(run["amplitude"]) * np.sin(np.array(run["frequency"]) * t + run["phase"])
        for _ in range(SUBSTEPS):
            mujoco.mj_step(m, d)
        if (sample + 1) % STRIDE == 0:
            rows.append([round(float(q), 9) for q in d.qpos[index]])
    return rows


for robot, run in RUNS.items():
    path = ROBOTS / f"{robot}.urdf"
    joints = [f"joint{i + 1}" for i in range(len(run["start"]))]
    out = {key: run[key] for key in ("start", "amplitude", "frequency", "phase")}
    out |= {"mujoco": mujoco.__version__, "sample": SAMPLE, "stride": STRIDE}
    out["cases"] = {
        name: {"effects": effects, "position": simulate(path, joints, run, effects)}
        for name, effects in cases(run, joints).items()
    }
    (HERE / f"{robot}.json").write_text(json.dumps(out) + "\n")
    print(robot, "written")
