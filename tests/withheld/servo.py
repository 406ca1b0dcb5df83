"""A bank of servo arms simulated by MuJoCo, in the folders of `gapscope withheld make --servo`, without torque.

    python tests/withheld/servo.py BANK [CASES] [SEED]
    gapscope withheld score BANK

Needs PyPI `mujoco` and `numpy`. Each case is a chain of 1 to 7 joints with position actuators of gains that only the sealed
folder knows. Its logs hold `time`, `position.*` (12 bits) and `command.*` at 20 to 200 Hz. Hidden are one to four effects, a
law outside the catalogue, or nothing; a third of the cases and those whose effect asks for it give the servo (`servo.toml`).
An effect is drawn anew until what an unknown drive does not take over of it is half a step of the encoder, rms.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

STEP = 5e-4
TICK = 2 * np.pi / 4096
NOISE = TICK / np.sqrt(12)
SECONDS = 10.0
# Signature over noise as `gapscope withheld` tells it, that an effect must have.
VISIBLE = 40.0
AXES = ["0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1", "0 1 0"]
FREE = [
    "coulomb_friction", "armature", "torque_bias", "joint_zero_offset", "actuation_delay", "torque_saturation",
    "joint_elasticity", "backlash", "payload", "gravity_misalignment",
]
AGAINST = ["servo_gain_error", "servo_damping_error", "speed_limit", "dead_band", "viscous_friction"]
CLASH = [
    {"torque_bias", "joint_zero_offset", "gravity_misalignment"},
    {"armature", "joint_elasticity", "backlash"},
    {"servo_damping_error", "viscous_friction"},
    {"speed_limit", "torque_saturation"},
]
UNKNOWN = ["unknown_hum", "unknown_rub_spot", "unknown_tip_drag"]


class Redraw(Exception):
    pass


def draw_links(rng):
    joints = int(rng.integers(1, 8))
    length, mass = rng.uniform(0.10, 0.18), rng.uniform(0.12, 0.30)
    links = []
    for j in range(joints):
        links.append(
            {
                "axis": AXES[1] if joints == 1 else AXES[j],
                "length": length * rng.uniform(0.7, 1.2),
                "mass": mass * rng.uniform(0.7, 1.3),
                "com": rng.uniform(-0.015, 0.015, 2),
            }
        )
        length, mass = 0.85 * length, 0.85 * mass
    return links


def inertia(link):
    small = link["mass"] * 0.03**2 / 6
    return link["mass"] * link["length"] ** 2 / 12 + small, small


def urdf(links):
    text = '<robot name="servo_arm">\n<link name="base"/>\n'
    for j, link in enumerate(links):
        big, small = inertia(link)
        x, y = link["com"]
        text += (
            f'<link name="l{j}"><inertial><origin xyz="{x} {y} {link["length"] / 2}"/><mass value="{link["mass"]}"/>'
            f'<inertia ixx="{big}" iyy="{big}" izz="{small}" ixy="0" ixz="0" iyz="0"/></inertial></link>\n'
        )
        parent, offset = ("base", 0) if j == 0 else (f"l{j - 1}", links[j - 1]["length"])
        text += (
            f'<joint name="j{j}" type="revolute"><parent link="{parent}"/><child link="l{j}"/><origin xyz="0 0 {offset}"/>'
            f'<axis xyz="{link["axis"]}"/><limit lower="-2.6" upper="2.6" effort="10" velocity="12"/></joint>\n'
        )
    return text + "</robot>\n"


def mjcf(links, drive, hidden):
    """The real arm. Behind a joint that bends or has play, the motor is a small body of its own, and its angle is logged."""
    roll, pitch = hidden.get("tilt", (0.0, 0.0))
    g = 9.81 * np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)])
    inner, close, actuators = "", "", ""
    for j, link in enumerate(links):
        big, small = inertia(link)
        offset = 0 if j == 0 else links[j - 1]["length"]
        x, y = link["com"]
        joint = (
            f'<joint name="j{j}" axis="{link["axis"]}" frictionloss="{hidden["coulomb"][j]}" '
            f'armature="{hidden["armature"][j]}" damping="{hidden["viscous"][j]}"/>'
        )
        behind = hidden.get("behind")
        if behind and behind["joint"] == j:
            # The joint's own rotor carries all of the motor's inertia.
            spring = (
                f'<joint name="flex" axis="{link["axis"]}" stiffness="{behind["stiffness"]}" damping="{behind["damping"]}"/>'
                if behind["gap"] == 0
                else f'<joint name="flex" axis="{link["axis"]}" limited="true" range="{-behind["gap"] / 2} {behind["gap"] / 2}" '
                f'solreflimit="0.004 1" damping="{behind["damping"]}"/>'
            )
            joint = (
                f'<joint name="j{j}" axis="{link["axis"]}" frictionloss="{hidden["coulomb"][j]}" '
                f'armature="{behind["rotor"]}" damping="{hidden["viscous"][j]}"/>'
                f'<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-8 1e-8 1e-8"/></BODY><body>{spring}'
            )
            head, tail = joint.split("</BODY>")
            inner += f'<body pos="0 0 {offset}">{head}{tail}'
            close += "</body>"
        else:
            inner += f'<body pos="0 0 {offset}">{joint}'
        inner += (
            f'<inertial pos="{x} {y} {link["length"] / 2}" mass="{link["mass"]}" diaginertia="{big} {big} {small}"/>'
        )
        if j == len(links) - 1 and "payload" in hidden:
            mass, com = hidden["payload"]
            ball = 0.4 * mass * 0.04**2
            inner += f'<body pos="{com[0]} {com[1]} {com[2]}"><inertial pos="0 0 0" mass="{mass}" diaginertia="{ball} {ball} {ball}"/></body>'
        close += "</body>"
        limit = drive["torque_limit"][j]
        actuators += f'<motor name="p{j}" joint="j{j}" gear="1"'
        actuators += f' ctrllimited="true" ctrlrange="{-limit} {limit}"/>' if np.isfinite(limit) else "/>"
        # Back-EMF and derivative gain: implicit, so that light wrists stay stable.
        actuators += f'<damper joint="j{j}" kv="{drive["damping"][j]}" ctrlrange="0 1"/>'
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{STEP}" integrator="implicitfast" gravity="{g[0]} {g[1]} {g[2]}"/>'
        f"<worldbody>{inner}{close}</worldbody><actuator>{actuators}</actuator></mujoco>"
    )


class Motion:
    """Set points of all joints over time, [joint] of (knots, values, held)."""

    def __init__(self, rng, family, middle, reach):
        self.tables = [self.table(rng, family, m, r) for m, r in zip(middle, reach)]
        self.held = family == "steps"

    @staticmethod
    def table(rng, family, middle, reach):
        if family == "fourier":
            t = np.arange(0, SECONDS + 0.02, 0.01)
            u = np.zeros_like(t)
            for k in range(1, 5):
                size, phase = 0.6 * reach * rng.normal() / k, rng.uniform(0, 2 * np.pi)
                u += size * (np.sin(2 * np.pi * 0.2 * k * t + phase) - np.sin(phase))
            return t, middle + u
        if family == "steps":
            t, u = [0.0], [middle]
            while t[-1] < SECONDS:
                t.append(t[-1] + rng.uniform(0.7, 2.0))
                u.append(middle + rng.uniform(-reach, reach))
            return np.array(t), np.array(u)
        if family == "points":
            t, u = [0.0], [middle]
            while t[-1] < SECONDS:
                t.append(t[-1] + rng.uniform(0.2, 0.8))
                u.append(u[-1])
                to, takes, start, at = middle + rng.uniform(-reach, reach), rng.uniform(0.6, 1.5), u[-1], t[-1]
                s = np.arange(1, 41) / 40
                t.extend(at + takes * s)
                u.extend(start + (to - start) * s**3 * (10 - 15 * s + 6 * s * s))
            return np.array(t), np.array(u)
        t = np.arange(0, SECONDS + 0.02, 0.01)
        u, speed, rest, out = 0.0, 0.0, 0.0, []
        kept = np.exp(-0.01 / 0.35)
        for _ in t:
            out.append(middle + np.round(u / TICK) * TICK)
            speed = kept * speed + np.sqrt(1 - kept**2) * 1.6 * reach * rng.normal()
            if rest <= 0 and rng.random() < 0.004:
                rest = rng.uniform(0.3, 1.2)
            rest -= 0.01
            if rest <= 0:
                u += 0.01 * (speed - 0.8 * u)
        return t, np.array(out)

    def at(self, times):
        """[sample, joint]"""
        times = np.atleast_1d(times)
        columns = []
        for t, u in self.tables:
            if self.held:
                columns.append(u[np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(u) - 1)])
            else:
                columns.append(np.interp(times, t, u))
        return np.array(columns).T


def most_at_speed(model, data, dof, v, gained, last_force, drive, j):
    """Greatest torque with which a drive comes up to its speed limit and not beyond it; its own damping at the least.

    Judged by whole steps, a drive would be half its limit beyond it where it drives hard: what else accelerates the joint is
    taken to be what it was in the step before.
    """
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    yields = np.linalg.inv(full)[dof, dof]
    sign, limit, damping = np.sign(v), drive["speed_limit"][j], drive["damping"][j]
    rest = sign * (gained / STEP - yields * (last_force - damping * v))
    most = damping * limit + ((limit - abs(v)) / STEP - rest) / yields
    return max(most, damping * abs(v))


def simulate(links, drive, hidden, clock, motion, times, torques=False):
    """Positions at the samples as the encoders show them before rounding, [sample, joint]."""
    n = len(links)
    model = mujoco.MjModel.from_xml_string(mjcf(links, drive, hidden))
    data = mujoco.MjData(model)
    at_q = [model.joint(f"j{j}").qposadr[0] for j in range(n)]
    at_v = [model.joint(f"j{j}").dofadr[0] for j in range(n)]
    push = [model.actuator(f"p{j}").id for j in range(n)]
    offset = hidden["offset"]
    u = motion.at(times)
    late = times + clock["arrives"] / clock["rate"] + drive["latency"]
    first = u[0]
    data.qpos[at_q] = first - offset
    model.actuator_ctrllimited[[i for i in range(model.nu) if i not in push]] = 0
    samples, out, pushes = 0, [], []
    law = hidden.get("unknown")
    tip = model.nbody - 1
    step = -int(1.5 / STEP)
    arrived = 0
    last_v, last_force = np.zeros(n), np.zeros(n)
    before = data.qpos[at_q] + offset
    while samples < len(times):
        t = step * STEP
        while arrived < len(times) and late[arrived] <= t:
            arrived += 1
        target = first if step < 0 else u[max(arrived, 1) - 1]
        q, v = data.qpos[at_q] + offset, data.qvel[at_v]
        error = target - q
        error = np.where(np.abs(error) < drive["dead_band"], 0.0, error)
        force = np.clip(drive["stiffness"] * error, -drive["torque_limit"], drive["torque_limit"])
        if step >= 0 and torques:
            pushes.append(force)
        for j in np.flatnonzero((force * v > 0) & (np.abs(v) > 0.5 * drive["speed_limit"])):
            most = most_at_speed(model, data, at_v[j], v[j], v[j] - last_v[j], last_force[j], drive, j)
            force[j] = np.sign(v[j]) * min(abs(force[j]), most)
        last_v, last_force = v.copy(), force.copy()
        data.ctrl[push] = force
        data.qfrc_applied[:] = 0
        data.qfrc_applied[at_v] += hidden["bias"]
        if law:
            if law["kind"] == "unknown_hum":
                data.qfrc_applied[at_v[law["joint"]]] += law["size"] * np.sin(2 * np.pi * law["f"] * t + law["phase"])
            elif law["kind"] == "unknown_rub_spot":
                j = law["joint"]
                near = np.exp(-(((q[j] - law["center"]) / 0.08) ** 2))
                data.qfrc_applied[at_v[j]] -= 3 * law["size"] * near * np.tanh(v[j] / 0.02)
            else:
                velocity = np.zeros(6)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, tip, velocity, 0)
                drag = -law["size"] * np.linalg.norm(velocity[3:]) * velocity[3:]
                data.xfrc_applied[tip, :3] = drag
        # The dampers of the actuators have a control of one: force = −kv · speed.
        for i in range(model.nu):
            if i not in push:
                data.ctrl[i] = 1.0
        mujoco.mj_step(model, data)
        after = data.qpos[at_q] + offset
        while samples < len(times) and times[samples] <= t + STEP:
            along = np.clip((times[samples] - t) / STEP, 0, 1)
            out.append(before + along * (after - before))
            samples += 1
        before = after
        step += 1
    return (np.array(out), np.array(pushes)) if torques else np.array(out)


def beside(signature, columns):
    """Signature over noise of what columns do not take over, for each joint."""
    power = []
    for j in range(signature.shape[1]):
        a = np.array([c[:, j] for c in columns]).T
        rest = signature[:, j] - a @ np.linalg.lstsq(a, signature[:, j], rcond=1e-9)[0]
        power.append(float(round(np.sqrt(800) * np.sqrt(np.mean(rest**2)) / NOISE, 2)))
    return power


def copied(hidden):
    return {k: (v.copy() if isinstance(v, np.ndarray) else v) for k, v in hidden.items()}


def attempt(rng, kinds):
    links = draw_links(rng)
    n = len(links)
    plain = {key: np.zeros(n) for key in ("coulomb", "armature", "viscous", "bias", "offset")}
    none = {
        "stiffness": np.zeros(n), "damping": np.zeros(n), "latency": 0.0, "dead_band": np.zeros(n),
        "speed_limit": np.full(n, np.inf), "torque_limit": np.full(n, np.inf),
    }
    model = mujoco.MjModel.from_xml_string(mjcf(links, none, plain))
    data, full = mujoco.MjData(model), np.zeros((n, n))
    weight, mass = np.zeros(n), np.zeros(n)
    for _ in range(24):
        data.qpos[:] = rng.uniform(-1.5, 1.5, n)
        data.qvel[:] = 0
        mujoco.mj_forward(model, data)
        weight = np.maximum(weight, np.abs(data.qfrc_bias))
        mujoco.mj_fullM(model, data, full)
        mass += np.diag(full) / 24
    stiffness = np.maximum(weight / rng.uniform(0.03, 0.12, n), mass * rng.uniform(15, 40, n) ** 2)
    real = {**none, "stiffness": stiffness, "damping": stiffness * rng.uniform(0.03, 0.1, n)}
    given = {key: (value.copy() if isinstance(value, np.ndarray) else value) for key, value in real.items()}
    hidden = copied(plain)
    friction = 0.02 * stiffness
    total = sum(link["mass"] for link in links)
    clock = {
        "rate": float(rng.choice([20, 30, 50, 100, 200])),
        "jitter": float(rng.uniform(0.01, 0.15)) if rng.random() < 0.5 else 0.0,
        "nominal": bool(rng.random() < 0.25),
        "repeated": float(rng.uniform(0.005, 0.03)) if rng.random() < 0.3 else 0.0,
        "arrives": float(rng.uniform(-0.5, 0.8)),
    }
    middle, reach = rng.uniform(-0.6, 0.6, n), rng.uniform(0.3, 0.8, n)
    families = list(rng.permutation(["fourier", "steps", "points", "teleoperated"]))
    count = int(SECONDS * clock["rate"])
    runs = []
    for episode in range(6):
        stray = np.clip(clock["jitter"] * rng.normal(size=count), -0.4, 0.4)
        times = np.maximum((np.arange(count) + stray) / clock["rate"], 0)
        runs.append((Motion(rng, families[episode % 4], middle, reach), times))
    is_given = bool(set(kinds) & set(AGAINST)) or rng.random() < 0.3
    effects, lacking = [], []

    def seal(kind, joints, parameters):
        names = [f"j{j}" for j in joints]
        effects.append({"kind": kind, "joints": [int(j) for j in joints], "joint_names": names, **parameters})

    for kind in kinds:
        some = np.sort(rng.choice(n, int(rng.integers(1, n + 1)), replace=False))
        joint = int(some[0])
        size = rng.uniform(0.3, 2.0, n)
        sign = rng.choice([-1.0, 1.0])
        undo_hidden, undo_drive = {}, {}
        if kind in ("coulomb_friction", "viscous_friction"):
            key, short = ("coulomb", "fc") if kind == "coulomb_friction" else ("viscous", "b")
            hidden[key][some] = friction[some] * size[some]
            seal(kind, some, {short: hidden[key][some].tolist()})
            undo_hidden[key] = np.zeros(n)
        elif kind == "armature":
            hidden["armature"][some] = 0.15 * friction[some] * size[some]
            seal(kind, some, {"ia": hidden["armature"][some].tolist()})
            undo_hidden["armature"] = np.zeros(n)
        elif kind == "torque_bias":
            hidden["bias"][some] = friction[some] * size[some] * rng.choice([-1.0, 1.0], len(some))
            seal(kind, some, {"bias": hidden["bias"][some].tolist()})
            undo_hidden["bias"] = np.zeros(n)
        elif kind == "joint_zero_offset":
            hidden["offset"][joint] = sign * rng.uniform(0.05, 0.2)
            seal(kind, [joint], {"offset": hidden["offset"][joint]})
            undo_hidden["offset"] = np.zeros(n)
        elif kind == "actuation_delay":
            real["latency"] = max(rng.uniform(2.5, 4.5) / clock["rate"], 0.025)
            seal(kind, range(n), {"delay_s": real["latency"] + clock["arrives"] / clock["rate"]})
            undo_drive["latency"] = 0.0
        elif kind == "gravity_misalignment":
            tilt = rng.choice([-1.0, 1.0], 2) * rng.uniform(0.05, 0.15, 2)
            hidden["tilt"] = (float(tilt[0]), float(tilt[1]))
            seal(kind, range(n), {"roll": tilt[0], "pitch": tilt[1]})
            undo_hidden["tilt"] = (0.0, 0.0)
        elif kind == "payload":
            load = 0.15 * total * rng.uniform(0.3, 2.0)
            com = [*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.08, 0.2)]
            hidden["payload"] = (load, com)
            seal(kind, [n - 1], {"mass": load, "com": com})
            undo_hidden["payload"] = (1e-9, com)
        elif kind in ("joint_elasticity", "backlash"):
            joint = int(rng.integers(n))
            f = rng.uniform(3, 7)
            k = mass[joint] * (2 * np.pi * f) ** 2
            gap = rng.uniform(0.01, 0.04) if kind == "backlash" else 0.0
            rotor = rng.uniform(0.5, 1.2) * mass[joint]
            d = 0.1 * np.sqrt(k * mass[joint]) if gap == 0 else 1e-5
            hidden["behind"] = {"joint": joint, "stiffness": k, "damping": d, "rotor": rotor, "gap": gap}
            seal(kind, [joint], {"k": k, "d": d, "jm": rotor} if gap == 0 else {"gap": gap, "jm": rotor})
            without = {**hidden["behind"]}
            undo_hidden["behind"] = None
            undo_hidden["armature_at"] = (joint, without["rotor"])
        elif kind == "servo_gain_error":
            gain = rng.uniform(0.6, 0.85) if rng.random() < 0.5 else rng.uniform(1.2, 1.6)
            given["stiffness"][some] = stiffness[some] / gain
            seal(kind, some, {"gain": gain})
            undo_drive["stiffness"] = given["stiffness"]
        elif kind == "servo_damping_error":
            given["damping"][some] = real["damping"][some] * rng.uniform(0.4, 0.7)
            seal(kind, some, {"damping": (real["damping"] - given["damping"])[some].tolist()})
            undo_drive["damping"] = given["damping"]
        elif kind == "dead_band":
            real["dead_band"] = np.zeros(n)
            real["dead_band"][some] = rng.uniform(0.006, 0.02)
            seal(kind, some, {"width": float(real["dead_band"][joint])})
            undo_drive["dead_band"] = np.zeros(n)
        elif kind in ("speed_limit", "torque_saturation"):
            joint, part, seen = int(rng.integers(n)), rng.uniform(0.2, 0.6), []
            for motion, times in runs[:4]:
                q, push = simulate(links, real, hidden, clock, motion, times, torques=True)
                seen.append(np.abs(push[:, joint]) if kind != "speed_limit" else np.abs(np.diff(q[:, joint]) / np.diff(times)))
            seen = np.concatenate(seen)
            at = part * seen.max() if kind == "speed_limit" else max(part * seen.max(), 1.4 * (weight + friction)[joint])
            if not 0.004 <= np.mean(seen > at) <= 0.4:
                raise Redraw
            key = "speed_limit" if kind == "speed_limit" else "torque_limit"
            real[key] = real[key].copy()
            real[key][joint] = at
            seal(kind, [joint], {"limit": float(at)})
            undo_drive[key] = np.full(n, np.inf)
        else:
            law = {"kind": kind, "joint": joint, "size": friction[joint] * size[joint], "center": middle[joint] + 0.15}
            law |= {"f": rng.uniform(0.7, 4.0), "phase": rng.uniform(0, 6)}
            if kind == "unknown_tip_drag":
                law["size"] = 0.3 * total * 9.81 * size[0]
            hidden["unknown"] = law
            seal(kind, [joint] if kind != "unknown_tip_drag" else range(n), {})
            undo_hidden["unknown"] = None
        lacking.append((undo_hidden, undo_drive))

    if "speed_limit" in kinds:
        given["speed_limit"] = np.where(np.isfinite(real["speed_limit"]), 2 * real["speed_limit"], 20.0)
    for effect in effects:
        effect["power"] = [0.0] * n
    for motion, times in runs[:2]:
        def run(drive, h):
            return simulate(links, drive, h, clock, motion, times)

        whole = run(real, hidden)
        columns = [run({**real, "latency": real["latency"] + 2e-3}, hidden) - whole]
        if not is_given:
            columns += [run({**real, key: 1.05 * real[key]}, hidden) - whole for key in ("stiffness", "damping")]
        for effect, (undo_hidden, undo_drive) in zip(effects, lacking):
            rest = copied(hidden) | undo_hidden
            if rest.get("armature_at"):
                at, rotor = rest["armature_at"]
                rest["armature"] = rest["armature"].copy()
                rest["armature"][at] = rotor
            power = beside(whole - run({**real, **undo_drive}, rest), columns)
            effect["power"] = [max(a, b) for a, b in zip(effect["power"], power)]
    if any(not max(effect["power"]) >= VISIBLE for effect in effects):
        raise Redraw
    logs = []
    for motion, times in runs:
        q, u = simulate(links, real, hidden, clock, motion, times), motion.at(times)
        if not np.sqrt(np.mean((q - u) ** 2, axis=0)).max() < 0.5:
            raise Redraw
        q = np.round(q / TICK) * TICK
        for k in np.nonzero(rng.random(count) < clock["repeated"])[0]:
            q[k] = q[max(k - 1, 0)]
        stamps = np.arange(count) / clock["rate"] if clock["nominal"] else times
        logs.append(np.column_stack([stamps, q, u]))
    toml = ""
    for j in range(n):
        toml += f"[joint.j{j}]\nstiffness = {given['stiffness'][j]}\ndamping = {given['damping'][j]}\ndead_band = 0\n"
        if "speed_limit" in kinds:
            toml += f"speed_limit = {given['speed_limit'][j]}\n"
    names = {f"j{j}": None for j in range(n)}
    truth = {
        "robot": f"mujoco_arm{n}", "noise": [NOISE, np.sqrt(2) * NOISE * clock["rate"], 0.0],
        "kinds": list(kinds) or ["none"], "effects": effects,
        "known": not any(kind.startswith("unknown") for kind in kinds), "rate": clock["rate"],
        "motion": ", ".join(families),
        "servo": {
            "given": is_given, "stiffness": dict(zip(names, stiffness.tolist())),
            "damping": dict(zip(names, real["damping"].tolist())), "latency": clock["arrives"] / clock["rate"],
            "jitter": clock["jitter"], "nominal_stamps": clock["nominal"], "repeated": clock["repeated"],
        },
    }
    return urdf(links), logs, toml if is_given else None, truth


def draw_kinds(rng, case):
    """A third one effect, each kind in turn; a third two to four; the rest an unknown law or none."""
    turn = case % 20
    if turn < 7:
        return [(FREE + AGAINST)[(case // 20 * 7 + turn) % 15]]
    if turn < 14:
        while True:
            kinds = list(rng.choice(FREE + AGAINST, int(rng.integers(2, 5)), replace=False))
            if all(len(clash & set(kinds)) < 2 for clash in CLASH):
                return [str(kind) for kind in kinds]
    return [UNKNOWN[(case // 20 * 3 + turn) % 3]] if turn < 17 else []


def make(bank, sealed, seed, case):
    rng = np.random.default_rng([seed, case])
    kinds = draw_kinds(rng, case)
    for _ in range(80):
        try:
            description, logs, toml, truth = attempt(rng, kinds)
            break
        except Redraw:
            continue
    else:
        return print(f"case {case}: {kinds} do not show in 80 draws")
    folder, hidden = bank / f"case_{case:03d}", sealed / f"case_{case:03d}"
    folder.mkdir(parents=True), hidden.mkdir(parents=True)
    (folder / "robot.urdf").write_text(description)
    if toml:
        (folder / "servo.toml").write_text(toml)
    n = len(truth["servo"]["stiffness"])
    head = ",".join(["time"] + [f"{kind}.j{j}" for kind in ("position", "command") for j in range(n)])
    for episode, table in enumerate(logs):
        file = folder / f"episode_{episode}.csv" if episode < 4 else hidden / f"test_{episode - 4}.csv"
        np.savetxt(file, table, delimiter=",", header=head, comments="", fmt="%.9g")
    (hidden / "truth.json").write_text(json.dumps({"seed": seed, **truth}, indent=1, default=float))
    print(f"case {case}: {kinds}", flush=True)


def main():
    bank = Path(sys.argv[1])
    cases = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    sealed = bank.with_name(bank.name + ".sealed")
    for folder in (bank, sealed):
        if folder.exists():
            sys.exit(f"{folder} exists already; name another folder")
    for case in range(cases):
        make(bank, sealed, seed, case)


if __name__ == "__main__":
    main()
