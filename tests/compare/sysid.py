"""gapscope beside mujoco.sysid, sparse regression (SINDy) and plain least squares, on the same 12 cases.

    python tests/compare/sysid.py --page docs/beside.md [--cases 12]

A case is a double pendulum with something that its URDF lacks, on two noisy logs of 8 s; a third log is held out. Each method gets the same
URDF and logs, and what its user has to know besides. All are held to one figure: the torque that the fitted model says the held-out
motion takes, against the logged one, rms over both joints in parts of the effort's spread. Motion is differentiated
by one Savitzky-Golay filter for all but gapscope's own fit.

Needs PyPI `gapscope`, `mujoco[sysid]`, `pysindy`, `scipy`, and a C compiler. A method that is not installed is said to be left out.
"""

import argparse
import contextlib
import ctypes
import io
import pathlib
import subprocess
import tempfile
import time

import gapscope
import numpy as np
from scipy.signal import savgol_filter

JOINTS = ["joint1", "joint2"]
RATE, SECONDS = 250.0, 8.0
#: Length of the rollouts that mujoco.sysid fits, s: a double pendulum forgets where it began soon after.
CHUNK = 0.2
#: One stretch in so many is fitted: all of them would take it minutes a case.
EVERY = 3
#: Samples and order of the filter that differentiates.
WINDOW, ORDER = 15, 4
#: Weight below which SINDy drops a term, in parts of the torque gap's spread.
SPARSE = 0.05

both = lambda a, b: dict(zip(JOINTS, (a, b)))
rotor = {"kind": "armature", "armature": both(0.05, 0.02)}
viscous = {"kind": "viscous_friction", "viscous": both(0.3, 0.2)}
coulomb = {"kind": "coulomb_friction", "coulomb": both(0.4, 0.25)}
payload = {"kind": "payload", "joint": "joint2", "mass": 0.3, "com": [0.02, 0.0, -0.2], "inertia": [0.002, 0, 0.002, 0, 0, 0.001]}
spring = {"kind": "parallel_spring", "stiffness": both(3.0, 1.0), "rest_position": both(0.3, -0.2)}
#: Name, effects, and the parameters that mujoco.sysid is told to fit: the right ones.
CASES = [
    ("viscous friction", [viscous], ["damping"]),
    ("Coulomb friction", [coulomb], ["frictionloss"]),
    ("both frictions", [viscous, coulomb], ["damping", "frictionloss"]),
    ("rotors", [rotor], ["armature"]),
    ("payload", [payload], ["inertia"]),
    ("torque gain", [{"kind": "torque_gain_error", "gain": both(0.85, 1.1)}], ["gain"]),
    ("torque bias", [{"kind": "torque_bias", "bias": both(0.3, -0.2)}], ["bias"]),
    ("springs", [spring], ["stiffness", "springref"]),
    ("Stribeck friction", [{"kind": "stribeck_friction", "coulomb": both(0.2, 0.1), "static": both(0.5, 0.3), "stribeck_velocity": both(0.3, 0.3)}], ["frictionloss", "damping"]),
    ("encoder zeros", [{"kind": "joint_zero_offset", "offset": both(0.06, -0.05)}], ["ref"]),
    ("payload, rotors, friction", [payload, rotor, viscous, coulomb], ["inertia", "armature", "damping", "frictionloss"]),
    ("springs and friction", [spring, viscous, coulomb], ["stiffness", "springref", "damping", "frictionloss"]),
]  # fmt: skip
#: What a user of each has to bring.
KNOWS = {
    "gapscope": "nothing",
    "mujoco.sysid": "which parameters are off, their bounds, the length of the rollouts",
    "least squares": "that bodies, rotors, biases and both frictions are all that is off; a filter",
    "SINDy": "a library of terms and its threshold; a filter",
}


def motion(log):
    """q, v, a and effort (T, 2) where all are known: the effort between two samples is the mean of those that it was held at."""
    dt = log["time"][1] - log["time"][0]
    q, v, a = (savgol_filter(log["position"], WINDOW, ORDER, deriv=d, delta=dt, axis=0) for d in range(3))
    effort = np.vstack([log["effort"][:1], (log["effort"][1:] + log["effort"][:-1]) / 2])
    inside = slice(WINDOW, -WINDOW)
    return q[inside], v[inside], a[inside], savgol_filter(effort, WINDOW, ORDER, axis=0)[inside]


def gap(predict, log):
    """Rms of logged less predicted torque over the logged torque's standard deviation, mean over the joints."""
    q, v, a, effort = motion(log)
    return float(np.mean(np.sqrt(np.mean((effort - predict(q, v, a)) ** 2, axis=0)) / effort.std(axis=0)))


def by_gapscope(robot, logs, _):
    """Torque by the C file of the corrected model, sample by sample."""
    diagnosis = gapscope.diagnose(robot, logs, progress=False)
    code = diagnosis.export("c").text
    spent = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        source, library = pathlib.Path(folder, "robot.c"), pathlib.Path(folder, "robot.so")
        source.write_text(code)
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-o", library, "-lm"], check=True)
        inverse = ctypes.CDLL(str(library)).gapscope_inverse_dynamics
    pointer = ctypes.POINTER(ctypes.c_double)
    at = lambda row: row.ctypes.data_as(pointer)

    def predict(q, v, a):
        q, v, a = (np.ascontiguousarray(x) for x in (q, v, a))
        tau = np.zeros_like(q)
        for k in range(len(q)):
            inverse(at(q[k]), at(v[k]), at(a[k]), at(tau[k]))
        return tau

    return predict, time.process_time() - spent


def by_least_squares(robot, logs, _):
    model = gapscope.Model(robot)

    def columns(q, v, a):
        own = np.zeros((len(q), 2, 2, 4))
        for j in range(2):
            own[:, j, j] = np.stack([v[:, j], np.sign(v[:, j]), a[:, j], np.ones(len(q))], axis=-1)
        return np.concatenate([model.regressor(q, v, a), own.reshape(len(q), 2, 8)], axis=-1)

    rows = [motion(log) for log in logs]
    design = np.concatenate([columns(*row[:3]).reshape(-1, 28) for row in rows])
    target = np.concatenate([row[3].reshape(-1) for row in rows])
    weight = np.tile(1 / np.concatenate([row[3] for row in rows]).std(axis=0), len(target) // 2)
    fit = np.linalg.lstsq(design * weight[:, None], target * weight, rcond=1e-9)[0]
    return lambda q, v, a: columns(q, v, a) @ fit, 0.0


def by_sindy(robot, logs, _):
    import pysindy

    model = gapscope.Model(robot)

    def library(q, v, a):
        nominal = model.inverse_dynamics(q, v, a)
        terms = [q, v, a, np.sin(q), np.cos(q), np.sign(v), v * np.abs(v), nominal, np.sin(q.sum(axis=1, keepdims=True)), np.ones((len(q), 1))]
        return np.concatenate(terms, axis=1), nominal

    rows = [motion(log) for log in logs]
    terms, nominal = (np.concatenate(parts) for parts in zip(*(library(*row[:3]) for row in rows)))
    target = np.concatenate([row[3] for row in rows]) - nominal
    size, spread = terms.std(axis=0), target.std(axis=0)
    size[size == 0] = 1.0
    fit = pysindy.STLSQ(threshold=SPARSE, alpha=1e-6).fit(terms / size, target / spread)
    weights = (np.asarray(fit.coef_).T / size[:, None]) * spread

    def predict(q, v, a):
        terms, nominal = library(q, v, a)
        return nominal + terms @ weights

    return predict, 0.0


def parameters(sysid, spec, names):
    """What mujoco.sysid is told: a parameter for each joint, with bounds some five times wider than the truth."""
    bounds = {
        "damping": (0.0, 1.5), "frictionloss": (0.0, 1.5), "armature": (0.0, 0.3), "stiffness": (0.0, 15.0),
        "springref": (-1.0, 1.0), "ref": (-0.3, 0.3), "gain": (0.5, 1.5), "bias": (-1.0, 1.0),
    }  # fmt: skip
    held = sysid.ParameterDict()

    def set_first(element, attribute, value):
        shape = np.shape(getattr(element, attribute))
        setattr(element, attribute, value if not shape else np.resize([value, *np.zeros(shape[0] - 1)], shape))

    for name in names:
        if name == "inertia":
            body = next(body for body in spec.bodies if any(joint.name == "joint2" for joint in body.joints))
            # Mass and place, inertia in proportion: the pseudo-inertia leads to bodies that MuJoCo does not compile.
            kind = sysid.InertiaType.MassIpos
            held.add(sysid.body_inertia_param(spec, spec.compile(), body.name, inertia_type=kind, scale_rot_inertia=True))
            continue
        for joint in JOINTS:
            def change(spec, parameter, name=name, joint=joint):
                value = float(parameter.value[0])
                if name == "gain":
                    spec.actuator(joint).gainprm[0] = value
                elif name == "bias":
                    spec.actuator(joint).biasprm[0] = value
                else:
                    set_first(spec.joint(joint), name, value)

            low, high = bounds[name]
            start = 1.0 if name == "gain" else 0.0 if low < 0 else 0.02 * high
            held.add(sysid.Parameter(f"{name} {joint}", [start], min_value=[low], max_value=[high], modifier=change))
    return held


def by_mujoco(robot, logs, names):
    import mujoco
    from mujoco import sysid

    spec = mujoco.MjSpec.from_string(robot)
    spec.option.timestep = 1 / RATE
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for joint in spec.joints:
        joint.limited = False
        spec.add_sensor(name=f"{joint.name} position", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name)
        spec.add_sensor(name=f"{joint.name} speed", type=mujoco.mjtSensor.mjSENS_JOINTVEL, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name)
    for name in JOINTS:
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = 1.0
    model = spec.compile()
    starts, controls, sensors = [], [], []
    length = round(CHUNK * RATE)
    for log in logs:
        dt = log["time"][1] - log["time"][0]
        q, v = (savgol_filter(log["position"], WINDOW, ORDER, deriv=d, delta=dt, axis=0) for d in range(2))
        for first in range(WINDOW, len(q) - length - WINDOW, EVERY * length):
            part = slice(first, first + length)
            times = np.arange(length) / RATE
            starts.append(sysid.create_initial_state(model, q[first], v[first], np.zeros(0)))
            controls.append(sysid.TimeSeries.from_control_names(times, log["effort"][part], model))
            read = np.stack([q[part, 0], v[part, 0], q[part, 1], v[part, 1]], axis=1)
            sensors.append(sysid.TimeSeries.from_names(times, read, model))
    sequences = sysid.ModelSequences("robot", spec, [f"part {i}" for i in range(len(starts))], starts, controls, sensors)
    held = parameters(sysid, spec, names)
    residual = sysid.build_residual_fn(models_sequences=[sequences])
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = sysid.optimize(initial_params=held, residual_fn=residual, optimizer="mujoco", verbose=False)
    fitted = spec.copy()
    for parameter in found.values():
        parameter.modifier(fitted, parameter)
    predict = inverse_in_mujoco(mujoco, fitted.compile())
    # A fit that ends at a bound has gone astray: the bounds are far from the truth.
    ends = lambda p: np.isclose(p.value, p.min_value, rtol=1e-3, atol=0) | np.isclose(p.value, p.max_value, rtol=1e-3, atol=0)
    predict.astray = [name for name, parameter in found.items() if np.any(ends(parameter))]
    return predict, 0.0


def inverse_in_mujoco(mujoco, model):
    """The effort that MuJoCo's inverse dynamics asks of the actuators."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    loss = model.dof_frictionloss.copy()
    # Its soft constraint would take a step to build up: dry friction is put in by its law.
    model.dof_frictionloss[:] = 0

    def predict(q, v, a):
        tau = np.zeros_like(q)
        for k in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
            mujoco.mj_inverse(model, data)
            force = data.qfrc_inverse + loss * np.sign(v[k])
            tau[k] = (force - model.actuator_biasprm[:, 0]) / model.actuator_gainprm[:, 0]
        return tau

    return predict


METHODS = {"gapscope": by_gapscope, "mujoco.sysid": by_mujoco, "least squares": by_least_squares, "SINDy": by_sindy}


def case(number, effects, told):
    """Nominal gap, and of each method gap and processor time in s."""
    noise = {"rate": RATE, "seconds": SECONDS, "effort_noise": 0.01, "position_noise": 5e-6}
    made = gapscope.generate("double_pendulum", effects, episodes=3, seed=number, **noise)
    *logs, held_out = made.logs
    model = gapscope.Model(made.robot)
    rows = {"nominal": (gap(model.inverse_dynamics, held_out), 0.0)}
    for name, method in METHODS.items():
        begun = time.process_time()
        try:
            predict, spent = method(made.robot, logs, told)
        except ImportError:
            rows[name] = (None, "left out")
            continue
        except ValueError as error:
            print(f"{name}: {error}", flush=True)
            rows[name] = (None, "failed")
            continue
        rows[name] = (gap(predict, held_out), time.process_time() - begun - spent, getattr(predict, "astray", []))
    return rows


def page(table):
    names = ["nominal", *METHODS]
    out = [
        "# Beside mujoco.sysid, SINDy and least squares",
        "",
        "Made by `python tests/compare/sysid.py --page docs/beside.md`; its head says how the cases are made.",
        "",
        "Each number is the torque gap on a held-out log, in parts of the effort's spread. Behind it stands processor time in s.",
        "mujoco.sysid is told which parameters are off, and they are the right ones. The others are told what the last table says.",
        "",
        "| case | " + " | ".join(names) + " |",
        "|---|" + "--:|" * len(names),
    ]
    cell = lambda told: told[1] if told[0] is None else f"{told[0]:.4f}" + (f" ({told[1]:.1f} s)" if told[1] else "")
    for name, rows in table:
        out.append(f"| {name} | " + " | ".join(cell(rows[method]) for method in names) + " |")
    middle = lambda method: [rows[method][0] for _, rows in table if rows[method][0] is not None]
    median = [f"**{np.median(middle(method)):.4f}**" if middle(method) else "left out" for method in names]
    out.append("| **median** | " + " | ".join(median) + " |")
    for name, rows in table:
        if astray := rows["mujoco.sysid"][2:] and rows["mujoco.sysid"][2]:
            out += ["", f"In the case *{name}* mujoco.sysid ended at its bounds in {', '.join(astray)}."]
    out += ["", "| method | what its user has to know |", "|---|---|"]
    out += [f"| {name} | {text} |" for name, text in KNOWS.items()]
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=len(CASES))
    arguments = parser.parse_args()
    table = []
    for number, (name, effects, told) in enumerate(CASES[: arguments.cases]):
        rows = case(number, effects, told)
        print(name, {method: value for method, value in rows.items()}, flush=True)
        table.append((name, rows))
    if arguments.page:
        arguments.page.write_text(page(table), encoding="utf-8")


if __name__ == "__main__":
    main()
