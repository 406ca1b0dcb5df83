"""The torque gap of a MuJoCo model on a log, in the measure of `gapscope evaluate`.

MuJoCo's own inverse dynamics (mj_inverse) says what torque a logged motion takes, its own forward step what torque its
actuators deliver under the logged effort. The difference, in the same band and at the same instants as `evaluate
--predictions`, is the gap. Only signals (smoothing) and the rule for rest are ours: what stands still holds any torque up to
its dry friction.
"""

import csv
import math

import mujoco
import numpy as np

# Half-width of the kernel that forms derivatives, s; -3 dB frequency times half-width; cut-off of the comparison, Hz:
# diagnosis/src: record/signals.rs, numbers/kernel.rs and record/band.rs.
HALF_WIDTH, CUTOFF_TIMES_HALF_WIDTH, CUTOFF = 0.010, 0.4631655, 10.0
# Time for which drives see the first effort before the log begins, s.
BEFORE = 1.0
# The same before each free run, and before play is looked at, s.
LEAD = 1.0


class Kernel:
    """cos^4 on samples every dt s, as diagnosis/src/numbers/kernel.rs has it."""

    def __init__(self, half_width, dt):
        w = max(half_width, 2.5 * dt)
        # At its very ends the kernel is zero.
        self.reach = r = int(math.floor(w / dt - 1e-9))
        t = np.arange(-r, r + 1) * dt
        shape = lambda t: np.where(np.abs(t) < w, np.cos(np.pi * t / (2 * w)) ** 4, 0.0)
        rate = np.pi / (2 * w)
        self.value = shape(t) / shape(t).sum()
        first = np.cos(rate * t) ** 3 * np.sin(rate * t)
        self.first = first / (first * t).sum()
        s, c = np.sin(rate * t), np.cos(rate * t)
        second = c * c * (3 * s * s - c * c)
        second = second - second.sum() * self.value
        self.second = second / (0.5 * second * t * t).sum()
        fine = (np.arange(16) + 0.5) / 16
        starts = (np.arange(2 * r + 2) - r - 1.0) * dt
        held = shape(starts[:, None] + fine[None, :] * dt).sum(axis=1)
        self.held = held / held.sum()


def filtered(weights, x):
    """Sum of weights[i] x[k + i] for every k, column by column."""
    return np.stack([np.correlate(column, weights, "valid") for column in x.T], axis=1)


def read(log, joints):
    """Time [T], position and effort [T, n] of a native CSV."""
    with open(log) as file:
        rows = list(csv.DictReader(file))
    column = lambda name: np.array([float(row[name]) for row in rows])
    stack = lambda channel: np.stack([column(f"{channel}.{joint}") for joint in joints], axis=1)
    return column("time"), stack("position"), stack("effort")


def along(q, v, dt, k, part):
    """Position and speed of the cubic through samples k and k + 1, `part` of the way from one to the other."""
    n, s = min(k + 1, len(q) - 1), part
    slope = (2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, -2 * s**3 + 3 * s**2, s**3 - s**2)
    rate = (6 * s**2 - 6 * s, 3 * s**2 - 4 * s + 1, -6 * s**2 + 6 * s, 3 * s**2 - 2 * s)
    at = lambda w: w[0] * q[k] + w[1] * dt * v[k] + w[2] * q[n] + w[3] * dt * v[n]
    return at(slope), at(rate) / dt


class Target:
    """An exported model with its names resolved."""

    def __init__(self, xml, joints):
        self.model = m = mujoco.MjModel.from_xml_path(xml)
        self.joints = joints
        self.free = mujoco.MjModel.from_xml_path(xml)  # the same without dry friction
        self.free.dof_frictionloss[:] = 0.0
        self.free.tendon_frictionloss[:] = 0.0
        self.data, self.data_free = mujoco.MjData(m), mujoco.MjData(self.free)
        joint = lambda name: mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_JOINT, name)
        self.dof = np.array([m.jnt_dofadr[joint(name)] for name in joints])
        self.qpos = np.array([m.jnt_qposadr[joint(name)] for name in joints])
        self.motor = [joint(f"{name}_motor") for name in joints]
        self.tendon = [mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_TENDON, f"{name}_wind_up") for name in joints]
        self.drives = [m.actuator(name).id for name in joints]
        # Controls: passive elements have none.
        self.control = [m.actuator_ctrladr[drive] for drive in self.drives]
        self.gain = m.actuator_gainprm[self.drives, 0]
        # Passive elements of each joint, by whether they stand for friction that sticks.
        names = [(i, m.actuator(i).name) for i in range(len(m.actuator_trntype)) if i not in self.drives]
        of = lambda joint, sticks: [
            i for i, name in names if m.actuator_trnid[i, 0] == m.joint(joint).id and name.endswith("_stribeck") == sticks
        ]
        self.sticky = [of(name, True) for name in joints]
        self.passive = [of(name, False) for name in joints]
        # Greatest dry friction at rest; that of LuGre is the fifth number of its bias.
        at_rest = lambda mine: sum(m.actuator_biasprm[i, 4] for i in mine)
        self.hold = m.dof_frictionloss[self.dof] + np.array([at_rest(mine) for mine in self.sticky])

        self.slack = np.array([t >= 0 and bool(m.tendon_limited[t]) for t in self.tendon])
        self.couplings = [
            (t, [(m.joint(m.wrap_objid[i]).name, m.wrap_prm[i]) for i in range(adr, adr + num)], m.tendon_frictionloss[t])
            for t, (adr, num) in enumerate(zip(m.tendon_adr, m.tendon_num))
            if m.tendon_frictionloss[t] > 0
        ]

    def passed(self, q, v, effort, needed, dt):
        """What motors that turn on their own pass on to links that move as logged, in the mean of each sample's hold [T, n]. They
        begin where their contact passes on what the links need [n]: one that began in its play would hit and leave it for .5 s."""
        m, d = self.model, mujoco.MjData(self.model)
        parts = max(1, round(dt / m.opt.timestep))
        m.opt.timestep = dt / parts
        turning = [(j, motor, self.tendon[j]) for j, motor in enumerate(self.motor) if motor >= 0]
        out = np.zeros_like(effort)
        begin = np.zeros(len(self.joints))
        for j, _, tendon in turning:
            if self.slack[j]:
                impedance = m.tendon_solimp_lim[tendon, 0]
                stiffness = -m.tendon_solref_lim[tendon, 0] / (m.tendon_invweight0[tendon] * (1 - impedance))
                begin[j] = needed[j] / stiffness + math.copysign(m.tendon_range[tendon, 1], needed[j])
        self.set(d, q[0], v[0], None, [begin, 0 * begin, 0 * begin])
        for k in range(len(effort)):
            d.ctrl[self.control] = effort[k]
            for part in range(parts):
                d.qpos[self.qpos], d.qvel[self.dof] = along(q, v, dt, k, part / parts)
                mujoco.mj_step(m, d)
                for j, motor, tendon in turning:
                    spring = m.tendon_stiffness[tendon] * d.ten_length[tendon] + m.tendon_damping[tendon] * d.ten_velocity[tendon]
                    # A limit's force acts on a motor alone here, as friction of motors stands at their links.
                    out[k, j] += (spring - d.qfrc_constraint[m.jnt_dofadr[motor]]) / parts
        return out

    def set(self, data, q, v, a=None, ahead=None):
        """Links at a measured state, motors with them or ahead by a wind-up (angle, rate, acceleration)."""
        m = self.model
        data.qpos[self.qpos], data.qvel[self.dof] = q, v
        if a is not None:
            data.qacc[self.dof] = a
        for j, motor in enumerate(self.motor):
            if motor < 0:
                continue
            angle, rate, acceleration = (0, 0, 0) if ahead is None else (x[j] for x in ahead)
            data.qpos[m.jnt_qposadr[motor]] = q[j] + angle
            data.qvel[m.jnt_dofadr[motor]] = v[j] + rate
            if a is not None:
                data.qacc[m.jnt_dofadr[motor]] = a[j] + acceleration

    def inverse(self, q, v, a, ahead=None):
        """What the motion takes of links and of motors without dry friction [T, n] each, and the dry friction that MuJoCo has
        on it, of joints [T, n] and of couplings [T, their number]."""
        links, motors, friction = (np.zeros_like(q) for _ in range(3))
        coupled = np.zeros((len(q), len(self.couplings)))
        m, d, free, data = self.model, self.data, self.free, self.data_free
        of_dof = {dof: j for j, dof in enumerate(self.dof)}
        of_tendon = {tendon: i for i, (tendon, _, _) in enumerate(self.couplings)}
        for k in range(len(q)):
            where = None if ahead is None else [x[k] for x in ahead]
            self.set(data, q[k], v[k], a[k], where)
            mujoco.mj_inverse(free, data)
            links[k] = data.qfrc_inverse[self.dof]
            for j, motor in enumerate(self.motor):
                if motor >= 0:
                    motors[k, j] = data.qfrc_inverse[m.jnt_dofadr[motor]]
            self.set(d, q[k], v[k], a[k], where)
            mujoco.mj_inverse(m, d)
            for kind, number, force in zip(d.efc_type[: d.nefc], d.efc_id[: d.nefc], d.efc_force[: d.nefc]):
                if kind == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF:
                    friction[k, of_dof[number]] = force
                elif kind == mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON:
                    coupled[k, of_tendon[number]] = force
        return links, motors, friction, coupled

    def forward(self, q, v, effort, dt):
        """What drives deliver in the mean of each sample's hold; what passive elements add at each sample, first those that stand
        for friction that sticks, then all others: three arrays [T, n]."""
        m, d = self.model, mujoco.MjData(self.model)
        parts = max(1, round(dt / m.opt.timestep))
        m.opt.timestep = dt / parts
        delivered, sticky, passive = np.zeros_like(effort), np.zeros_like(effort), np.zeros_like(effort)
        for k in range(-int(BEFORE / dt), len(effort)):
            at = max(k, 0)
            d.ctrl[self.control] = effort[at]
            speed = v[at] if k >= 0 else 0.0 * v[0]
            for part in range(parts):
                self.set(d, q[at] + part / parts * dt * speed, speed)
                mujoco.mj_step(m, d)
                if k >= 0:
                    delivered[k] += d.actuator_force[self.drives] / parts
                    if part == 0:
                        sticky[k] = [sum(d.actuator_force[i] for i in mine) for mine in self.sticky]
                        passive[k] = [sum(d.actuator_force[i] for i in mine) for mine in self.passive]
        return delivered, sticky, passive


def gap(target, log, standstill, times):
    """Torque gap of a target on a log at the rows of the comparison, [rows, n], N m (N) of effort as logged; NaN in the first
    LEAD s of joints with play."""
    joints = target.joints
    time, position, effort = read(log, joints)
    dt = float(np.median(np.diff(time)))
    kernel, band = Kernel(HALF_WIDTH, dt), Kernel(CUTOFF_TIMES_HALF_WIDTH / CUTOFF, dt)
    first = kernel.reach + 1
    length = len(time) - 2 * first
    whole = {name: filtered(w, position) for name, w in [("q", kernel.value), ("v", kernel.first), ("a", kernel.second)]}
    q, v, a = (whole[name][1 : 1 + length] for name in "qva")
    pad = lambda x: np.concatenate([x[:1].repeat(first, 0), x, x[-1:].repeat(first, 0)])
    delivered, sticky, passive = target.forward(pad(q), pad(v), effort, dt)
    delivered = filtered(kernel.held, delivered)[:length]
    sticky, passive = (x[first : first + length] for x in (sticky, passive))
    taken, _, friction, coupled = target.inverse(q, v, a)
    if any(motor >= 0 for motor in target.motor):
        # What springs pass on is what links take, their friction included.
        needed = taken - friction - sticky - passive
        links, motors, friction, coupled = target.inverse(q, v, a, wind_up(target, needed, dt))
        taken = links + motors
    rest = delivered + passive - taken
    still = (np.abs(v) < standstill) & (target.hold > 0)
    rest += np.where(still, 0.0, friction + sticky)
    of = lambda parts: np.array([dict(parts).get(name, 0.0) for name in joints])
    sums = [(of(parts), most) for _, parts, most in target.couplings]
    stands = [np.abs(v @ weights) < standstill @ np.abs(weights) for weights, _ in sums]
    for (weights, _), stand, force in zip(sums, stands, coupled.T):
        rest += np.where(stand, 0.0, force)[:, None] * weights
    # What stands holds what is left, up to its dry friction.
    rest -= np.where(still, np.clip(rest, -target.hold, target.hold), 0.0)
    for (weights, most), stand in zip(sums, stands):
        force = np.clip(rest @ weights / (weights @ weights), -most, most)
        rest -= np.where(stand, force, 0.0)[:, None] * weights
    if any(motor >= 0 for motor in target.motor) and target.slack.any():
        # Which side of the play a motor is on, inverse dynamics does not say: there it runs under the logged effort.
        passed = target.passed(q, v, effort[first : first + length], needed[0], dt)
        rest = np.where(target.slack, passed - needed, rest)
    rest = rest / target.gain
    centers = np.rint((np.asarray(times) - first * dt) / dt).astype(int)
    rows = np.stack([band.value @ rest[c - band.reach : c + band.reach + 1] for c in centers])
    # Where in its play a motor begins, no log says; for a second it hits and leaves its contact.
    rows[np.ix_(np.asarray(times) < LEAD, target.slack)] = np.nan
    return rows


def wind_up(target, taken, dt):
    """Wind-up of elastic drives from the torque that links take, k x + d x' = torque: angle, rate, acceleration [T, n]; 0 of play."""
    angle = np.zeros_like(taken)
    for j, tendon in enumerate(target.tendon):
        if tendon < 0 or target.slack[j]:
            continue
        k, d = target.model.tendon_stiffness[tendon], target.model.tendon_damping[tendon]
        x = taken[0, j] / k
        for i, torque in enumerate(taken[:, j]):
            x = (torque + d / dt * x) / (k + d / dt)
            angle[i, j] = x
    rate = np.gradient(angle, dt, axis=0)
    return angle, rate, np.gradient(rate, dt, axis=0)


def free_runs(xml, log, joints, horizon, every):
    """Error of position after runs of `horizon` s under the logged effort alone, one begun every `every` s, [runs, n], rad (m).
    For LEAD s before a run links are led along the log, so that drives, bristles and motors are where they would be."""
    time, position, effort = read(log, joints)
    dt = float(np.median(np.diff(time)))
    kernel = Kernel(HALF_WIDTH, dt)
    first = kernel.reach + 1
    q, v = (filtered(w, position)[1:] for w in (kernel.value, kernel.first))
    target = Target(xml, joints)
    m, d = target.model, mujoco.MjData(target.model)
    parts = max(1, math.ceil(dt / m.opt.timestep - 1e-9))
    m.opt.timestep = dt / parts
    lead, steps, errors = round(LEAD / dt), round(horizon / dt), []
    for start in range(lead, len(q) - 2 * first - steps, round(every / dt)):
        mujoco.mj_resetData(m, d)
        target.set(d, q[start - lead], v[start - lead])
        for k in range(start - lead, start + steps):
            d.ctrl[target.control] = effort[first + k]
            for part in range(parts):
                if k < start or (k == start and part == 0):
                    d.qpos[target.qpos], d.qvel[target.dof] = q[k] + part / parts * dt * v[k], v[k]
                mujoco.mj_step(m, d)
        errors.append(d.qpos[target.qpos] - q[start + steps])
    return np.array(errors)


def weighted(rows, weights):
    """sqrt of the mean over joints of (weight * rms)^2; what is not a number does not count."""
    rms = np.sqrt(np.nanmean(rows**2, axis=0))
    return math.sqrt(((weights * rms) ** 2)[weights > 0].mean())
