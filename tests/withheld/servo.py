"""Servo arms simulated by MuJoCo, each with hidden effects, diagnosed by gapscope from logs without torque, and scored.

    python tests/withheld/servo.py GAPSCOPE [CASES] [SEED]

Needs PyPI `mujoco` and `numpy`. Each case is a chain of 1 to 4 joints with position actuators of hidden gains. Its logs hold
`time`, `position.*` (12 bits) and `command.*` at 50 to 200 Hz. Hidden effects: dry friction, rotor inertia, a base that is
level always; or none. With gains given (`--drive`), also a wrong gain. Printed are the first cause right, kinds exact or a
declared tie, kinds that are not there a case, and how often nothing is claimed where nothing is.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

STEP = 5e-4
TICK = 2 * np.pi / 4096


def arm(rng, joints):
    """Bodies of a hobby arm: lengths, masses and axes (the first joint turns about the vertical in arms of more than one)."""
    return [
        {
            "axis": "0 0 1" if joints > 1 and j == 0 else "0 1 0",
            "length": rng.uniform(0.08, 0.16),
            "mass": rng.uniform(0.08, 0.25),
        }
        for j in range(joints)
    ]


def body(link):
    inertia = link["mass"] * link["length"] ** 2 / 12
    return inertia, 0.1 * inertia


def urdf(links):
    text = '<robot name="servo_arm"><link name="base"/>'
    for j, link in enumerate(links):
        big, small = body(link)
        text += (
            f'<link name="l{j}"><inertial><origin xyz="0 0 {link["length"] / 2}"/><mass value="{link["mass"]}"/>'
            f'<inertia ixx="{big}" iyy="{big}" izz="{small}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        parent, offset = ("base", 0) if j == 0 else (f"l{j - 1}", links[j - 1]["length"])
        text += (
            f'<joint name="j{j}" type="revolute"><parent link="{parent}"/><child link="l{j}"/><origin xyz="0 0 {offset}"/>'
            f'<axis xyz="{link["axis"]}"/><limit lower="-3" upper="3" effort="10" velocity="20"/></joint>'
        )
    return text + "</robot>"


def mjcf(links, truth):
    inner, close = "", ""
    for j, link in enumerate(links):
        big, small = body(link)
        offset = 0 if j == 0 else links[j - 1]["length"]
        inner += (
            f'<body pos="0 0 {offset}"><joint name="j{j}" axis="{link["axis"]}" frictionloss="{truth["coulomb"][j]}" '
            f'armature="{truth["armature"][j]}" damping="0"/><inertial pos="0 0 {link["length"] / 2}" mass="{link["mass"]}" '
            f'diaginertia="{big} {big} {small}"/>'
        )
        close += "</body>"
    actuators = "".join(
        f'<position joint="j{j}" kp="{truth["stiffness"][j]}" kv="{truth["damping"][j]}"/>' for j in range(len(links))
    )
    return (
        f'<mujoco><option timestep="{STEP}" integrator="implicitfast"/><worldbody>{inner}{close}</worldbody>'
        f"<actuator>{actuators}</actuator></mujoco>"
    )


def motion(rng, kind, times, joints):
    """Set points, [sample, joint], rad."""
    u = np.zeros((len(times), joints))
    for j in range(joints):
        if kind == "fourier":
            for harmonic in range(1, 5):
                u[:, j] += rng.normal(0, 0.25 / harmonic) * np.sin(2 * np.pi * 0.2 * harmonic * times + rng.uniform(0, 6))
            u[:, j] -= u[0, j]
        elif kind == "steps":
            for start in np.arange(0.5, times[-1], 1.3):
                u[times >= start, j] = rng.uniform(-0.6, 0.6)
        else:
            # From point to point at constant speed, with rests.
            knots = np.arange(0, times[-1] + 2, 1.0)
            points = rng.uniform(-0.7, 0.7, len(knots))
            points[0] = 0
            points[1::3] = points[0:-1:3]
            u[:, j] = np.interp(times, knots, points)
    return u


def simulate(links, truth, rate, seconds, u):
    model = mujoco.MjModel.from_xml_string(mjcf(links, truth))
    data = mujoco.MjData(model)
    data.ctrl[:] = u[0]
    for _ in range(int(1.0 / STEP)):
        mujoco.mj_step(model, data)
    per = round(1 / (rate * STEP))
    rows = []
    for k in range(len(u)):
        rows.append(np.round(data.qpos / TICK) * TICK)
        data.ctrl[:] = u[k]
        for _ in range(per):
            mujoco.mj_step(model, data)
    return np.array(rows)


def make(rng, folder):
    joints = int(rng.integers(1, 5))
    links = arm(rng, joints)
    carried = np.array([sum(l["mass"] for l in links[j:]) for j in range(joints)])
    stiffness = rng.uniform(4, 25, joints) * carried / carried[0]
    truth = {
        "stiffness": stiffness,
        "damping": stiffness * rng.uniform(0.03, 0.1),
        "coulomb": np.zeros(joints),
        "armature": np.zeros(joints),
    }
    kinds = []
    given = None
    draw = rng.choice(["none", "coulomb", "armature", "both", "gain"], p=[0.2, 0.3, 0.15, 0.2, 0.15])
    if draw in ("coulomb", "both"):
        truth["coulomb"] = stiffness * rng.uniform(0.01, 0.05, joints)
        kinds.append("coulomb_friction")
    if draw in ("armature", "both"):
        truth["armature"] = stiffness * rng.uniform(0.002, 0.006, joints)
        kinds.append("armature")
    if draw == "gain":
        factor = rng.choice([0.6, 0.7, 1.4, 1.6])
        given = "".join(
            f"[joint.j{j}]\nstiffness = {stiffness[j] / factor}\ndamping = {truth['damping'][j]}\n" for j in range(joints)
        )
        (folder / "servo.toml").write_text(given)
        kinds.append("servo_gain_error")
    rate = float(rng.choice([50, 100, 200]))
    seconds = 12.0
    times = np.arange(0, seconds, 1 / rate)
    (folder / "robot.urdf").write_text(urdf(links))
    for run, kind in enumerate(["fourier", "steps", "points"]):
        u = motion(rng, kind, times, joints)
        q = simulate(links, truth, rate, seconds, u)
        names = ",".join([f"position.j{j}" for j in range(joints)] + [f"command.j{j}" for j in range(joints)])
        table = np.column_stack([times, q, u])
        np.savetxt(folder / f"run_{run}.csv", table, delimiter=",", header="time," + names, comments="", fmt="%.9g")
    return kinds, given is not None


def main():
    binary = sys.argv[1]
    cases = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    first = exact = false = caused = clean = clean_total = 0
    seconds = []
    for case in range(cases):
        rng = np.random.default_rng([seed, case])
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            truth, given = make(rng, folder)
            command = [binary, "diagnose", str(folder / "robot.urdf"), *map(str, sorted(folder.glob("run_*.csv")))]
            command += ["--out", str(folder / "out")] + (["--drive", str(folder / "servo.toml")] if given else [])
            begin = time.time()
            subprocess.run(command, check=True, capture_output=True)
            seconds.append(time.time() - begin)
            answer = json.loads((folder / "out" / "diagnosis.json").read_text())
        found = [effect["kind"] for effect in answer["effects"]]
        tied = [set([e["kind"]] + e["indistinguishable_from"][:1]) for e in answer["effects"]]
        if truth:
            caused += 1
            first += bool(found) and bool(tied[0] & set(truth))
        else:
            clean_total += 1
            clean += not found
        matched = len(tied) == len(truth) and all(any(kind in tie for tie in tied) for kind in truth)
        exact += matched
        false += sum(not (tie & set(truth)) for tie in tied)
        shrink = answer["shrink"]["position"]["shrink"]
        print(f"{case:3d} {answer['verdict']:17s} truth {truth} found {found} shrink {shrink}", flush=True)
    print(f"first cause right {first}/{caused}; kinds exact or tied {exact}/{cases}; not there {false / cases:.2f} a case")
    print(f"nothing claimed where nothing is {clean}/{clean_total}; median {np.median(seconds):.1f} s")


if __name__ == "__main__":
    main()
