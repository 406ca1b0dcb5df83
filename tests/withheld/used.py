"""Banks of used arms: nothing about the arm is quite as its URDF says, and then there may be one thing more.

    python tests/withheld/used.py OUT --seed 1 --cases 60 [--used 2] [--robots panda,ur5,ur10] [--jobs 2] [--gz]
    python tests/withheld/used.py OUT --cases 20 --further backlash,joint_elasticity,none      these in turn as what is further

MuJoCo is the plant, through bank.py of the sealed bank (folder: GAPSCOPE_BANK). OUT and OUT.sealed are laid out as its banks are.
Each part of the calibration is there with probability .7: friction in all joints, links off, rotors, a bias in all joints.
Then there is one further effect of the catalogue (.7), a law outside it (.15), or nothing further (.15).
Logs come at 100 to 1000 Hz: encoder counts, speed from filtered differences, effort from current counts with coloured noise.
Motions are Fourier series, or moves from pose to pose with dwells. --used 2 is an arm in a worse state:
links off by up to a third, a tool missing or too many, a cable's spring, friction that differs by direction (Coulomb and bias).
Needs mujoco, numpy, scipy and, for the default of --urdf-dir, example-robot-data. A case depends on the seed and its number only.

truth.json has the fields of bank.py and more. `used`, `rate` and `further`; per effect its `part`, calibration or further.
`power` is bank.py's: the signature over the noise of the log, per joint. `beside` is what rigid bodies, rotors,
friction and bias cannot take over of the further effect. It is drawn until it is at least 8 at a joint; a payload has none.
Link errors are lists, joint by joint: mass, first moment, and inertia (xx xy yy xz yz zz) about the origin of the link's frame.
That of a payload is about its centre of mass.
"""
import argparse, contextlib, functools, json, math, multiprocessing, os, site, sys, time
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"): os.environ.setdefault(variable, "1")   # before numpy comes
import numpy as np

sys.path.insert(0, os.environ.get("GAPSCOPE_BANK", os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../shared/bank")))
import bank, mujoco
from scipy.signal import butter, lfilter, sosfiltfilt

DT = bank.PHYS_DT
RATES = (100, 125, 200, 250, 500, 1000)   # Hz, of the log
CONTROLS = (100, 125, 200, 250, 400, 500, 800, 1000)   # Hz, of the servo: a multiple of the log's
CALIBRATION = ("viscous_friction", "coulomb_friction", "link_inertia_error", "armature", "torque_bias")
FURTHER = [k for k in bank.KNOWN if k not in CALIBRATION + ("none",)]
COULOMB = ("stribeck_friction", "presliding_friction", "thermal_drift")   # take the place of Coulomb friction
WITHIN_TICK = COULOMB + ("load_dependent_friction", "torque_ripple", "joint_coupling", "joint_elasticity", "backlash", "actuation_delay", "actuator_lag", "external_contact")
UNKNOWN = bank.UNKNOWN * 2 + ["unknown_oil_drag", "unknown_stiffening_hose"]
VISIBLE = 8.0
REACHED = .02    # part of the training samples in which a limit is reached, at least: one that no log reaches cannot be told


def body(m, b):
    """Mass, centre, and inertia about the centre, in the body's frame (that of its joint)."""
    R = np.zeros(9); mujoco.mju_quat2Mat(R, m.body_iquat[b]); R = R.reshape(3, 3)
    return float(m.body_mass[b]), m.body_ipos[b].copy(), R @ np.diag(m.body_inertia[b]) @ R.T


def set_body(m, b, mass, centre, inertia):
    w, V = np.linalg.eigh(inertia); q = np.zeros(4)
    if np.linalg.det(V) < 0: V[:, 0] *= -1
    mujoco.mju_mat2Quat(q, V.flatten())
    m.body_mass[b], m.body_ipos[b], m.body_inertia[b], m.body_iquat[b] = mass, centre, w, q


def about_origin(mass, c, inertia): return inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))


def spread(inertia): return np.trace(inertia) / 2 * np.eye(3) - inertia   # second moments of mass; of a body, positive definite


SIX = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))   # order of the catalogue: xx xy yy xz yz zz


def six(I): return [float(I[i, j]) for i, j in SIX]


def full(six): xx, xy, yy, xz, yz, zz = six; return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class Plant(bank.Plant):
    """bank.py's plant with errors of all links, payloads by their inertia, its own rates and sensors."""

    def __init__(self, urdf, robot, effects, sensor, rng):
        mine = ("link_inertia_error", "payload")
        super().__init__(urdf, robot, [e for e in effects if e["kind"] not in mine], None, rng)
        self.effects, self.sensor, m = effects, sensor, self.m
        for e in effects:
            if e["kind"] not in mine: continue
            bodies, many = (m.jnt_bodyid[e["joints"]], True) if e["kind"] == mine[0] else ([m.nbody - 1], False)
            for i, b in enumerate(bodies):
                at = lambda x: x[i] if many else x
                M, c, I = body(m, b)
                dm = at(e["mass_delta"]) if many else e["mass"]; dh = np.array(at(e["first_moment_delta"])) if many else e["mass"] * np.array(e["com"])
                dI = full(at(e["inertia_delta"])) if many else about_origin(dm, np.array(e["com"]), full(e["inertia"]))
                mass = M + dm; centre = (M * c + dh) / mass; about = about_origin(M, c, I) + dI - about_origin(mass, centre, 0 * I)
                if mass <= 0 or np.linalg.eigvalsh(spread(about))[0] <= 0: raise ValueError("no body can have this inertia")
                set_body(m, b, mass, centre, about)
        mujoco.mj_setConst(m, mujoco.MjData(m)); self.d = mujoco.MjData(m)

    def run(self, ref, T, clean=False):
        """One episode: clean time, position, speed, effort, command, at the servo's rate; None where it does not hold.

        The law is that of bank.Plant.run. The servo reads encoder counts and was tuned on this arm: it knows the rotors and makes up for most
        of friction and bias. Wrists of little inertia would not move otherwise. Where nothing changes within a tick, MuJoCo steps alone."""
        m, d, dn, n, s = self.m, self.d, self.dn, self.n, self.sensor; rate = s["control"]; step = 0 if clean else s["step"]; effects = self.effects
        mujoco.mj_resetData(m, d); m.dof_frictionloss[:] = self.fl0
        d.qpos[:n], d.qvel[:n] = ref(0.0)[:2]; act = {e["kind"]: e for e in effects}
        off, gain, bias, limit = np.zeros(n), np.ones(n), np.zeros(n), np.full(n, np.inf); rotor, dry, wet = np.zeros(n), np.zeros(n), np.zeros(n)
        for e in effects:
            if e["kind"] == "armature": rotor[e["joints"]] += e["ia"]
            if e["kind"] in COULOMB + ("coulomb_friction",): dry[e["joints"]] += e["fc"]
            if e["kind"] == "viscous_friction": wet[e["joints"]] += e["b"]
            if e["kind"] == "joint_zero_offset": off[e["joints"]] += e["offset"]
            if e["kind"] == "torque_gain_error": gain[e["joints"]] *= e["gain"]
            if e["kind"] == "torque_bias": bias[e["joints"]] += e["bias"]
            if e["kind"] == "torque_saturation" and "limit" in e: limit[e["joints"]] = e["limit"]
        delay, lag = act.get("actuation_delay", {}).get("delay_s", 0.0), act.get("actuator_lag", {}).get("tau_s", 0.0)
        d.qpos[:n] -= off; mujoco.mj_forward(m, d); self.begin()
        el = act.get("joint_elasticity") or act.get("backlash"); contact = act.get("external_contact"); drag = act.get("unknown_tip_drag"); rub = act.get("unknown_rub_spot")
        if el: ej = el["joints"][0]; th, thd = float(d.qpos[ej] + d.qfrc_bias[ej] / el["k"]), float(d.qvel[ej])
        bursts, z, jac = [], np.zeros(n), np.zeros((3, n))
        if contact:
            bursts = [(float(b), float(b + self.rng.uniform(.3, .8))) for b in np.sort(self.rng.uniform(.5, T - 1.5, contact["bursts"]))]
            if not clean: contact.setdefault("intervals", []).append(bursts)
        if rub: spot = float(bank.POSE[self.robot][rub["joints"][0]] + .15)
        laws = [(e["kind"], np.array(e["joints"]), {k: np.array(v) if isinstance(v, list) else v for k, v in e.items()}) for e in effects]
        fine = any(k in WITHIN_TICK or k.startswith("unknown") for k in act)
        sub, N = round(1 / rate / DT), int(T * rate); out = np.zeros((N, 1 + 4 * n)); hist, state = [], None; wn = min(35.0, 20 + .05 * rate)
        for i in range(N):
            t = i / rate; qm = d.qpos[:n] + off; qdm = d.qvel[:n].copy(); ql, qdl = qm.copy(), qdm.copy()
            if el:
                qm[ej], qdm[ej] = th + off[ej], thd                 # the servo always reads the motor
                if el["motor_encoder"]: ql, qdl = qm, qdm
            qs = step * np.round(qm / step) if step else qm
            rq, rqd, rqdd = ref(t)
            acc = rqdd + wn ** 2 * (rq - qs) + 2 * bank.ZETA * wn * (rqd - qdm); dn.qpos[:n] = rq; dn.qvel[:n] = rqd; dn.qacc[:n] = acc; mujoco.mj_inverse(self.nom, dn)
            tau = dn.qfrc_inverse[:n] + rotor * acc + .8 * (dry * np.tanh(rqd / .1) + wet * rqd - bias)
            out[i, 0] = t; out[i, 1:1 + n] = ql; out[i, 1 + n:1 + 2 * n] = qdl; out[i, 1 + 2 * n:1 + 3 * n] = tau; out[i, 1 + 3 * n:] = rq
            if not fine:
                d.qfrc_applied[:n] = np.minimum(np.maximum(tau * gain + bias, -limit), limit); mujoco.mj_step(m, d, sub)
            else:
                if state is None: state = tau.copy(); hist = [(-1.0, tau)]
                if delay: hist = [h for k, h in enumerate(hist) if k + 1 == len(hist) or hist[k + 1][0] > t - delay - 1e-9] + [(t, tau)]
                for k in range(sub):
                    ts = t + k * DT; u = tau
                    if delay: u = next(v for tt, v in reversed(hist) if tt <= ts - delay + 1e-9)
                    if lag: state = state + (u - state) * (1 - math.exp(-DT / lag)); u = state
                    u = np.minimum(np.maximum(u * gain + bias, -limit), limit); qq, vv = d.qpos[:n], d.qvel[:n]; f = np.zeros(n); fl = self.fl0.copy(); F = np.zeros(3)
                    for kind, J, e in laws:
                        if kind == "stribeck_friction": fl[J] += e["fc"] * (1 + (e["fs_ratio"] - 1) * np.exp(-(vv[J] / e["vs"]) ** 2))
                        elif kind == "load_dependent_friction": fl[J] += e["mu"] * np.abs(u[J])
                        elif kind == "thermal_drift": fl[J] += e["fc"] * (e["ratio"] + (1 - e["ratio"]) * math.exp(-ts / e["tc"]))
                        elif kind == "torque_ripple": f[J] += e["amp"] * np.sin(e["cycles"] * qq[J] + e["phase"])
                        elif kind == "joint_coupling":
                            w = vv[J[0]] + e["ratio"] * vv[J[1]]; g = -(e["viscous"] * w + e["coulomb"] * math.tanh(w / .01)); f[J[0]] += g; f[J[1]] += e["ratio"] * g
                        elif kind == "presliding_friction":
                            s0, v = e["sigma0"], vv[J]; z[J] = (z[J] + DT * v) / (1 + DT * s0 * np.abs(v) / e["fc"]); f[J] -= s0 * z[J]
                        elif kind == "unknown_oil_drag": f[J] -= e["c"] * vv[J] * np.abs(vv[J])
                        elif kind == "unknown_stiffening_hose": f[J] -= e["k3"] * (qq[J] - e["rest"]) ** 3
                        elif kind == "unknown_rub_spot": f[J] -= e["amp"] * np.exp(-((qq[J] - spot) / e["width"]) ** 2) * np.tanh(vv[J] / .02)
                    m.dof_frictionloss[:] = fl
                    if drag or contact:
                        mujoco.mj_jacBodyCom(m, d, jac, None, self.tip); vt = jac @ d.qvel
                        if drag: F -= drag["c"] * math.sqrt(vt @ vt) * vt
                        if any(b0 <= ts < b1 for b0, b1 in bursts): F += contact["force"]
                        d.xfrc_applied[self.tip, :3] = F
                    d.qfrc_applied[:n] = u + f
                    if el:
                        de, dv = th - d.qpos[ej], thd - d.qvel[ej]
                        if el["kind"] == "backlash":
                            h = el["gap"] / 2; df = np.sign(de) * max(abs(de) - h, 0.0); tl = el["k"] * df + (el["d"] * dv if abs(de) > h else 0.0)
                            if tl * df < 0: tl = 0.0
                        else: tl = el["k"] * de + el["d"] * dv
                        thd += DT * (u[ej] - tl) / el["jm"]; th += DT * thd; d.qfrc_applied[ej] = tl + f[ej]
                    mujoco.mj_step(m, d)
            if not abs(d.qvel).max() < 50: return None
        return out

    def log(self, out, rms, rng):
        """What the robot's sensors make of an episode, at the rate of the log."""
        s, n = self.sensor, self.n; out = out.copy(); q = s["step"] * np.round(out[:, 1:1 + n] / s["step"])
        a = 1 - math.exp(-2 * math.pi * s["cutoff"] / s["control"]); dq = np.vstack([out[:1, 1 + n:1 + 2 * n], np.diff(q, axis=0) * s["control"]])
        out[:, 1:1 + n] = q; out[:, 1 + n:1 + 2 * n] = lfilter([a], [1, a - 1], dq, axis=0, zi=(1 - a) * dq[:1])[0]
        rho = math.exp(-1 / s["control"] / s["correlation_s"]); w = rng.normal(size=(len(out), n)) * math.sqrt(1 - rho ** 2); w[0] /= math.sqrt(1 - rho ** 2)
        u = out[:, 1 + 2 * n:1 + 3 * n] + s["effort_noise"] * rms * lfilter([1], [1, -rho], w, axis=0); count = np.array(s["effort_step"])
        out[:, 1 + 2 * n:1 + 3 * n] = count * np.round(u / count)
        return out[::s["control"] // s["rate"]]


def moves(rng, n, robot, T, speed=1.0):
    """Minimum-jerk moves between random poses, with a dwell at each."""
    pose, amp = np.array(bank.POSE[robot])[:n], np.array(bank.AMP[robot])[:n]
    start, legs, p = 0.0, [], pose + amp * rng.uniform(-1, 1, n)
    while start < T:
        to = pose + amp * rng.uniform(-1, 1, n); dwell = rng.uniform(.3, 1.0)
        legs.append((start, start + dwell, 0.0, p, p)); start += dwell
        lasts = max(.5, 1.875 * np.max(np.abs(to - p)) / (rng.uniform(.7, 1.8) * speed)); legs.append((start, start + lasts, lasts, p, to)); start += lasts; p = to

    def ref(t):
        a, _, lasts, p, to = next(l for l in legs if t < l[1] or l is legs[-1])
        if not lasts: return p, 0 * p, 0 * p
        x = min((t - a) / lasts, 1.0); D = to - p
        return p + D * x ** 3 * (10 - 15 * x + 6 * x * x), D * 30 * x * x * (1 - x) ** 2 / lasts, D * 60 * x * (1 - x) * (1 - 2 * x) / lasts ** 2
    return ref


def oil_drag(p, rng, n, robot, u, fs, j):
    """Joint torque -c v |v|."""
    joints = sorted(rng.choice(n, size=int(rng.integers(1, n + 1)), replace=False).tolist()); p |= {"joints": joints, "c": [float(1.5 * fs[k] * u()) for k in joints]}


def stiffening_hose(p, rng, n, robot, u, fs, j):
    """Joint torque -k3 (q - rest)^3."""
    p |= {"joints": [j], "k3": float(5 * fs[j] * u()), "rest": float(bank.POSE[robot][j] + rng.uniform(-.3, .3))}


bank.EXTRA |= {"unknown_oil_drag": oil_drag, "unknown_stiffening_hose": stiffening_hose}
MOTIONS = {"fourier": bank.excitation, "moves": moves}


def draw_links(rng, m, used):
    """All links off in mass, centre and inertia, as deltas in the link's frame about its origin."""
    e = {"kind": "link_inertia_error", "joints": [], "mass_delta": [], "first_moment_delta": [], "inertia_delta": []}; part, shift, shape = (.08, .01, .03) if used == 1 else (1 / 3, .03, .1)
    for j in range(m.nv):
        b = m.jnt_bodyid[j]; M, c, I = body(m, b)
        if M <= 0: continue
        size = math.sqrt(np.trace(spread(I)) / M); mass = M * (1 + rng.uniform(-part, part)); centre = c + rng.uniform(-1, 1, 3) * (shift if used == 1 else shift * min(1, size / .1))
        A = rng.uniform(-shape, shape, (3, 3)); S = np.eye(3) + (A + A.T) / 2; S = mass / M * S @ spread(I) @ S; about = np.trace(S) * np.eye(3) - S
        e["joints"].append(j); e["mass_delta"].append(mass - M); e["first_moment_delta"].append((mass * centre - M * c).tolist())
        e["inertia_delta"].append(six(about_origin(mass, centre, about) - about_origin(M, c, I)))
    return e


def draw_payload(rng, m, robot, sign):
    """A body more at the flange, or one less: then a part of what the URDF has there."""
    M, c, I = body(m, m.nbody - 1)
    if sign < 0 and M > .5:
        mass, com = -M * rng.uniform(.25, .6), c + rng.uniform(-.01, .01, 3); about = .8 * I * mass / M
    else:
        mass = rng.uniform(.8, 3.0) * (2.5 if robot == "ur10" else 1.0); com = np.array([*rng.uniform(-.06, .06, 2), rng.uniform(.08, .2)]); about = .4 * mass * .04 ** 2 * np.eye(3)
    return {"kind": "payload", "joints": [m.nv - 1], "mass": float(mass), "com": [float(x) for x in com], "inertia": six(about)}


def draw_effects(rng, m, robot, used, further):
    """Calibration, then what is further; [] for nothing."""
    n = m.nv; fs = np.array(bank.FSCALE[robot])[:n]; each = lambda size: [float(size * f * rng.uniform(.3, 2)) for f in fs]; joints = list(range(n)); effects = []
    there = lambda: rng.random() < .7
    if there():
        which = rng.choice(["both", "both", "both", "coulomb", "viscous"])
        if which != "coulomb": effects.append({"kind": "viscous_friction", "joints": joints, "b": each(1)})
        if which != "viscous": effects.append({"kind": "coulomb_friction", "joints": joints, "fc": each(1)})
    if there(): effects.append(draw_links(rng, m, used))
    if there(): effects.append({"kind": "armature", "joints": joints, "ia": each(.15)})
    bias = np.array([float(rng.choice([-1, 1])) * x for x in each(1)]) if there() else np.zeros(n)
    if used == 2:
        coulomb = next((e for e in effects if e["kind"] == "coulomb_friction"), None)
        if coulomb and not any(k in COULOMB for k in further) and rng.random() < .5: bias = bias - np.array(coulomb["fc"]) * rng.choice([-1, 1], n) * rng.uniform(.1, .35, n)   # stronger in one direction
        if rng.random() < .5: effects.append(draw_payload(rng, m, robot, rng.choice([-1, 1])))
        if "parallel_spring" not in further and rng.random() < .4: effects.append(bank.draw(rng, "parallel_spring", n, robot, "mixed"))
    for e in effects: e["part"] = "calibration"
    for kind in further:
        e = draw_payload(rng, m, robot, 1) if kind == "payload" else bank.draw(rng, kind, n, robot, "mixed")
        if kind in COULOMB:
            while len(e["joints"]) < n: e = bank.draw(rng, kind, n, robot, "mixed")
            effects = [x for x in effects if x["kind"] != "coulomb_friction"]
        e["part"] = "further"; effects.append(e)
    spring = [j for e in effects if e["kind"] == "parallel_spring" for j in e["joints"]]; soft = [j for e in effects if e["kind"] in ("joint_elasticity", "backlash") for j in e["joints"]]
    if np.any(bias): effects.append({"kind": "torque_bias", "joints": [j for j in joints if j not in spring], "bias": [float(bias[j]) for j in joints if j not in spring], "part": "calibration"})   # a bias moves a spring's rest
    for e in effects:
        if e["kind"] == "armature" and soft: e["ia"] = [v for j, v in zip(e["joints"], e["ia"]) if j not in soft]; e["joints"] = [j for j in joints if j not in soft]   # a soft joint has its own rotor
    return sorted(effects, key=lambda e: e["part"])


def residual(nom, out, rate):
    """Torque that the nominal model lacks, below 10 Hz, and the motion that it was taken at; ends cut."""
    n = nom.nv; sos = butter(4, 10, fs=rate, output="sos"); low = lambda x: sosfiltfilt(sos, x, axis=0)
    q = low((out[1:, 1:1 + n] + out[:-1, 1:1 + n]) / 2); v = np.gradient(q, 1 / rate, axis=0); a = np.gradient(v, 1 / rate, axis=0); u = out[:-1, 1 + 2 * n:1 + 3 * n]
    tau = inverse(nom, q, v, a); cut = slice(rate // 4, -rate // 4)
    return low(u - tau)[cut], q[cut], v[cut], a[cut]


def inverse(nom, q, v, a):
    d = mujoco.MjData(nom); n = nom.nv; tau = np.zeros_like(q)
    for i in range(len(q)): d.qpos[:n], d.qvel[:n], d.qacc[:n] = q[i], v[i], a[i]; mujoco.mj_inverse(nom, d); tau[i] = d.qfrc_inverse[:n]
    return tau


def columns(m, q, v, a):
    """Torques of a unit of each parameter of calibration: of bodies, then Coulomb and viscous friction, rotors, bias. Row, joint, parameter."""
    base, out, n = inverse(m, q, v, a), [], m.nv
    for j in range(n):
        b = m.jnt_bodyid[j]; M, c, I = body(m, b); O = about_origin(M, c, I)
        for k in range(10):
            mass, h, about = M, M * c, O.copy()
            if k == 0: mass = M + 1e-5
            elif k < 4: h = h + 1e-5 * np.eye(3)[k - 1]
            else: x, y = SIX[k - 4]; about[x, y] += 1e-5; about[y, x] = about[x, y]
            set_body(m, b, mass, h / mass, about - about_origin(mass, h / mass, 0 * I)); out.append((inverse(m, q, v, a) - base) / 1e-5)
        set_body(m, b, M, c, I)
    for x in (np.tanh(v / .005), v, a, np.ones_like(v)): out += [x * (np.arange(n) == j) for j in range(n)]
    return np.stack(out, 2)


class Sight:
    """How far the effects of a case stand out of the noise of its log. See `power` and `beside` above."""

    def __init__(self, urdf, robot, sensor, motion, seed, T):
        self.make = lambda effects: Plant(urdf, robot, json.loads(json.dumps(effects)), sensor, np.random.default_rng(seed)); self.urdf, self.sensor, self.T = urdf, sensor, T
        self.ref = motion(np.random.default_rng(seed + 1), self.make([]).n, robot, T)
        plant = self.make([]); out = plant.run(self.ref, T); rms = np.sqrt(np.mean(out[:, 1 + 2 * plant.n:1 + 3 * plant.n] ** 2, 0))
        self.floor = np.sqrt(np.mean(residual(plant.nom, plant.log(out, rms, np.random.default_rng(seed + 2)), sensor["rate"])[0] ** 2, 0)) + 1e-9

    def gap(self, effects):
        p = self.make(effects); out = p.run(self.ref, self.T, clean=True)
        return None if out is None else residual(p.nom, out[::self.sensor["control"] // self.sensor["rate"]], self.sensor["rate"])

    def measure(self, effects, e, gap):
        """Sets the power of one effect, and what is left beside calibration of a further one; False where the arm does not hold without it."""
        rest = [x for x in effects if x is not e]
        if e["kind"] in ("joint_elasticity", "backlash"): rest.append({"kind": "armature", "joints": e["joints"], "ia": [e["jm"]]})
        without = self.gap(rest)
        if gap is None or without is None: e["power"] = []; return False
        over = lambda x: (math.sqrt(800) * np.sqrt(np.mean(x ** 2, 0)) / self.floor).round(2).tolist()
        e["power"] = over(gap[0] - without[0])
        if e["part"] == "further":
            nom = bank.mj_model(self.urdf); some = slice(0, None, max(1, self.sensor["rate"] // 50)); y, C = gap[0][some] - without[0][some], columns(nom, *(x[some] for x in gap[1:])); w = 1 / self.floor
            C = C * w[:, None]; flat = C.reshape(-1, C.shape[2]); flat = flat / (np.linalg.norm(flat, axis=0) + 1e-12); z = (y * w).ravel()
            e["beside"] = over((z - flat @ np.linalg.lstsq(flat, z, rcond=1e-9)[0]).reshape(y.shape) * self.floor)
        return True


def make_case(a, i):
    rng = np.random.default_rng([a.seed, i]); seed = a.seed * 1000 + i; robots = a.robots.split(","); robot = robots[i % len(robots)]
    path, keep = bank.ROBOTS[robot]; urdf, joints = bank.clean_urdf(os.path.join(a.urdf_dir, path), keep); nom = bank.mj_model(urdf); n = len(joints)
    kinds = np.random.default_rng([a.seed, i // len(FURTHER), 7]).permutation(FURTHER)    # each kind in turn
    x = rng.random(); further = [str(kinds[i % len(FURTHER)])] if x < .7 else [str(rng.choice(UNKNOWN))] if x < .85 else []
    if a.further: further = [k for k in [a.further.split(",")[i % len(a.further.split(","))]] if k != "none"]
    if a.used == 2 and further == ["payload"]: further = [str(rng.choice([k for k in FURTHER if k != "payload"]))]
    rate = int(rng.choice(RATES)); control = rate if rng.random() < .5 else int(rng.choice([c for c in CONTROLS if c % rate == 0])); bits, counts = int(rng.integers(16, 21)), int(rng.integers(12, 15))
    limits = [float(l.get("effort")) for name in joints for j in bank.ET.fromstring(urdf).findall("joint") if j.get("name") == name for l in j.findall("limit")]
    sensor = {"rate": rate, "control": control, "encoder_bits": bits, "step": 2 * math.pi / 2 ** bits, "cutoff": float(rng.uniform(15, min(60, .25 * control))),
              "effort_bits": counts, "effort_step": [2 * l / 2 ** counts for l in limits], "effort_noise": float(rng.uniform(.007, .013)), "correlation_s": float(rng.uniform(.005, .05))}
    style = str(rng.choice(["fourier", "moves", "mixed"])); motions = [MOTIONS[style if style != "mixed" else ("fourier", "moves")[k % 2]] for k in range(a.ntrain + a.ntest)]
    sight = Sight(urdf, robot, sensor, motions[0], seed, a.seconds)
    for attempt in range(30):
        effects = draw_effects(rng, nom, robot, a.used, further); episodes, last = [], [e for e in effects if e["part"] == "further"]
        try: plant = Plant(urdf, robot, effects, sensor, rng)
        except ValueError: continue
        go = lambda k: plant.run(motions[k](rng, n, robot, a.seconds, speed=float(rng.choice([.6, 1.0, 1.5]))), a.seconds)
        for e in last:
            if e["kind"] != "torque_saturation": continue
            out = go(0)
            if out is None: break
            u = out[:, 1 + 2 * n:1 + 3 * n]; j = int(rng.choice(np.argsort(-np.sqrt(np.mean(u ** 2, 0)))[:3])); e.update(joints=[j], limit=float(np.quantile(np.abs(u[:, j]), e["quantile"])))
        if any(e["kind"] == "torque_saturation" and "limit" not in e for e in last): continue
        gap = sight.gap(effects) if last else None
        if last and not (sight.measure(effects, last[0], gap) and max(last[0]["power" if further == ["payload"] else "beside"]) >= VISIBLE): continue
        for k in range(a.ntrain + a.ntest):
            out = go(k)
            if out is None or np.max(np.abs(out[:, 1:1 + n] - out[:, 1 + 3 * n:])) > .6: break
            episodes.append(out)
        over = lambda e: np.mean([np.mean(np.abs(o[:, 1 + 2 * n + e["joints"][0]]) > e["limit"]) for o in episodes[:a.ntrain]])
        if len(episodes) == a.ntrain + a.ntest and all(over(e) >= REACHED for e in last if e["kind"] == "torque_saturation"): break
    else: return f"case_{i:03d} left out: {further} does not hold or show on {robot} at {rate} Hz"
    gap = gap or sight.gap(effects)
    for e in effects:
        if "power" not in e: sight.measure(effects, e, gap)
    rms = np.sqrt(np.mean([np.mean(o[:, 1 + 2 * n:1 + 3 * n] ** 2, 0) for o in episodes], 0)); logs = [plant.log(o, rms, rng) for o in episodes]
    out, sealed = f"{a.out}/case_{i:03d}", f"{a.out}.sealed/case_{i:03d}"; os.makedirs(out, exist_ok=True); os.makedirs(sealed, exist_ok=True)
    open(out + "/robot.urdf", "w").write(urdf)
    for k, log in enumerate(logs): bank.write_csv(f"{out}/episode_{k}{bank.EXT}" if k < a.ntrain else f"{sealed}/test_{k - a.ntrain}{bank.EXT}", joints, log)
    for e in effects: e["joint_names"] = [joints[j] for j in e["joints"]]
    f = 1 - math.exp(-2 * math.pi * sensor["cutoff"] / control); count = sensor["step"] / math.sqrt(12); names = [e["kind"] for e in effects] or ["none"]
    json.dump({"robot": robot, "seed": seed, "noise": [count, count * control * f * math.sqrt(2 / (2 - f)), sensor["effort_noise"]], "kinds": names, "effects": effects, "known": not any(k.startswith("unknown") for k in names),
               "used": a.used, "further": further, "rate": rate, "motion": style, "sensor": sensor}, open(sealed + "/truth.json", "w"), indent=1)
    return f"case_{i:03d} {robot} {rate} Hz, {style}, attempts {attempt + 1}: {' '.join(e['kind'] for e in effects if e['part'] == 'calibration') or 'as new'}; further {' '.join(further) or 'nothing'}"


def timed(a, i):
    if a.gz: bank.FMT, bank.EXT = "%.9g", ".csv.gz"
    t = time.time(); line = make_case(a, i); return f"{line} ({time.time() - t:.0f} s)"


def main():
    ap = argparse.ArgumentParser(description=__doc__.split("\n")[0]); ap.add_argument("out"); ap.add_argument("--seed", type=int, default=1); ap.add_argument("--cases", type=int, default=60)
    ap.add_argument("--used", type=int, default=1, choices=(1, 2)); ap.add_argument("--robots", default="panda,ur5,ur10"); ap.add_argument("--further", default="", help="these in turn, or none, instead of drawing"); ap.add_argument("--jobs", type=int, default=1)
    ap.add_argument("--seconds", type=float, default=10.0); ap.add_argument("--ntrain", type=int, default=4); ap.add_argument("--ntest", type=int, default=2); ap.add_argument("--gz", action="store_true", help="gzipped CSV")
    found = [p for p in (os.path.join(s, "cmeel.prefix/share/example-robot-data/robots") for s in site.getsitepackages()) if os.path.isdir(p)]
    ap.add_argument("--urdf-dir", default=os.environ.get("URDF_DIR") or (found[0] if found else None)); a = ap.parse_args()
    if not a.urdf_dir: sys.exit("no robots: install example-robot-data or give --urdf-dir")
    with multiprocessing.get_context("spawn").Pool(a.jobs) if a.jobs > 1 else contextlib.nullcontext() as pool:
        for line in (pool.imap if pool else map)(functools.partial(timed, a), range(a.cases)): print(line, flush=True)


if __name__ == "__main__": main()
