"""Robots like the one that was diagnosed: samples of the region in ranges.json, for randomisation.

    ranges = Ranges()                       # ranges.json beside this file
    sample = ranges.sample(numpy.random.default_rng(0))
    left_out = ranges.to_mujoco(model, sample)      # a mujoco.MjModel of robot.xml, loaded anew for each sample

Written by gapscope. Needs NumPy. `to_isaaclab` was not run where it was written.
"""

import json
import pathlib

import numpy as np

#: The least eigenvalue of a body's pseudo-inertia, as a part of the greatest, kg m² over kg.
LEAST = 1e-6


class Ranges:
    """The region value + F a + G b of the parameters, |a| <= radius, |b| <= radius_open: F has the directions that the logs
    determine, G those that they leave as open as they were."""

    def __init__(self, file=pathlib.Path(__file__).with_name("ranges.json")):
        told = json.loads(pathlib.Path(file).read_text())
        self.parameters = told["parameters"]
        self.determined, self.open = (np.array(told[part]).reshape(len(self.parameters), -1) for part in ("determined", "open"))
        self.radius, self.radius_open = told["radius"], told["radius_open"]
        self.value = np.array([p["value"] for p in self.parameters])

    def sample(self, rng, open=0.0):
        """A robot from the region, evenly over its volume: one number a parameter, in their order and units.

        No log tells the open directions. They stay in the middle, or go as far as `open` says: 1 is all that was plausible before
        any log. `to_mujoco` moves them where links would be no bodies."""
        ball = lambda n, radius: (lambda x: x * radius * rng.random() ** (1 / n) / np.linalg.norm(x))(rng.standard_normal(n)) if n else np.zeros(0)
        k, rest = self.determined.shape[1], self.open.shape[1]
        return self.value + self.determined @ ball(k, self.radius) + self.open @ ball(rest, open * self.radius_open)

    def holds(self, sample):
        """Whether a robot is in the region."""
        along = np.linalg.solve(np.hstack([self.determined, self.open]), sample - self.value)
        k, near = self.determined.shape[1], 1 + 1e-6
        return np.linalg.norm(along[:k]) <= self.radius * near and np.linalg.norm(along[k:]) <= self.radius_open * near

    def named(self, sample):
        """(kind, parameter, joint, component) of each number with what the exported model has of it and its sample."""
        for p, x in zip(self.parameters, sample):
            neutral = 1.0 if p["parameter"] == "gain" else 0.0
            yield (p["kind"], p["parameter"], p.get("joint"), p.get("component")), p.get("answer", neutral), x

    def to_mujoco(self, model, sample):
        """Puts a sample in the place of what the diagnosis found into a MjModel of robot.xml. Returns what the model has no place for."""
        import mujoco

        of = lambda kind, name: mujoco.mj_name2id(model, kind, name)
        left_out, bodies, tilt = [], {}, {}
        sample = self.embodied(model, sample)
        for (kind, parameter, joint, component), value, x in self.named(sample):
            change, name = x - value, kind + "." + parameter
            j = of(mujoco.mjtObj.mjOBJ_JOINT, joint) if joint else -1
            drive = of(mujoco.mjtObj.mjOBJ_ACTUATOR, joint) if joint else -1
            motor = of(mujoco.mjtObj.mjOBJ_JOINT, joint + "_motor") if joint else -1
            dof = model.jnt_dofadr[j] if j >= 0 else -1
            if name == "viscous_friction.viscous" and j >= 0:
                model.dof_damping[dof] = max(0.0, model.dof_damping[dof] + change)
            elif name == "coulomb_friction.coulomb" and j >= 0:
                model.dof_frictionloss[dof] = max(0.0, model.dof_frictionloss[dof] + change)
            elif name == "armature.armature" and j >= 0:
                turning = model.jnt_dofadr[motor] if motor >= 0 else dof
                model.dof_armature[turning] = max(0.0, model.dof_armature[turning] + change)
            elif name == "torque_gain_error.gain" and drive >= 0:
                model.actuator_gainprm[drive, 0] *= x / value
            elif name == "torque_bias.bias" and drive >= 0:
                model.actuator_biasprm[drive, 0] += change
            elif name == "torque_saturation.limit" and drive >= 0:
                model.actuator_forcerange[drive] = -x, x
            elif name == "actuator_lag.time_constant":
                model.actuator_dynprm[:, 0] = np.maximum(1e-6, model.actuator_dynprm[:, 0] + change)
            elif name == "parallel_spring.stiffness" and j >= 0:
                model.jnt_stiffness[j] = max(0.0, model.jnt_stiffness[j] + change)
            elif name == "parallel_spring.rest_position" and j >= 0:
                model.qpos_spring[model.jnt_qposadr[j]] += change
            elif kind == "gravity_misalignment":
                tilt[parameter] = x
            elif kind in ("link_inertia_error", "payload") and j >= 0:
                bodies.setdefault((kind, model.jnt_bodyid[j]), {})[parameter, component] = (value, x)
            else:
                left_out.append(name + (f".{joint}" if joint else ""))
        if tilt:
            roll, pitch = tilt.get("roll", 0.0), tilt.get("pitch", 0.0)
            size = np.linalg.norm(model.opt.gravity)
            down = np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)
            model.opt.gravity = size * np.array(down)
        for (kind, body), numbers in bodies.items():
            before, after = (_body(kind, numbers, which) for which in (0, 1))
            if not _add(model, body, after - before):
                left_out.append(f"{kind} (that of no body, left as it was)")
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return left_out

    def embodied(self, model, sample):
        """A sample with links that are bodies in a MjModel of robot.xml: open directions are moved, as no log tells of them. As near as
        one comes where no robot with what is determined has such links."""
        import mujoco

        links = {}
        for i, p in enumerate(self.parameters):
            if p["kind"] == "link_inertia_error":
                joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, p["joint"])
                links.setdefault(int(model.jnt_bodyid[joint]), []).append(i)
        links = {body: at for body, at in links.items() if len(at) == 10}
        has = np.array([p.get("answer", 0.0) for p in self.parameters])
        pseudo = lambda ten: _pseudo(ten[0], ten[1:4], _symmetric(ten[4:]))
        without = {body: _pseudo_of(model, body) - pseudo(has[at]) for body, at in links.items()}
        error = np.array([p["error"] for p in self.parameters])
        free = np.linalg.pinv(self.open / error[:, None])
        sample = np.array(sample)
        # To and fro between bodies and what the open directions reach.
        for _ in range(500):
            change = np.zeros(len(sample))
            for body, at in links.items():
                size, axes = np.linalg.eigh(without[body] + pseudo(sample[at]))
                if size[0] < LEAST * size[3]:
                    whole = axes @ np.diag(np.maximum(size, 2.0 * LEAST * size[3])) @ axes.T - without[body]
                    inertia = np.trace(whole[:3, :3]) * np.eye(3) - whole[:3, :3]
                    six = inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
                    change[at] = np.concatenate([[whole[3, 3]], whole[:3, 3], six]) - sample[at]
            if not change.any():
                break
            sample = sample + 1.5 * self.open @ (free @ (change / error))
        return sample

    def to_isaaclab(self, articulation, sample, env_ids=None):
        """Puts a sample into an Isaac Lab 2.3 `Articulation`. Returns what it has no place for. NOT RUN where it was written."""
        left_out = []
        writers = {
            "viscous_friction.viscous": "write_joint_viscous_friction_coefficient_to_sim",
            "coulomb_friction.coulomb": "write_joint_friction_coefficient_to_sim",
            "armature.armature": "write_joint_armature_to_sim",
            "torque_saturation.limit": "write_joint_effort_limit_to_sim",
        }
        for (kind, parameter, joint, component), value, x in self.named(sample):
            writer = writers.get(f"{kind}.{parameter}")
            if writer is None or joint not in articulation.joint_names:
                left_out.append(f"{kind}.{parameter}" + (f".{joint}" if joint else ""))
                continue
            getattr(articulation, writer)(max(0.0, x), joint_ids=[articulation.joint_names.index(joint)], env_ids=env_ids)
        return left_out


def _symmetric(six):
    """(xx, xy, yy, xz, yz, zz) as a matrix."""
    xx, xy, yy, xz, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _pseudo(mass, moment, inertia):
    """Mass, first moment and inertia about the origin as one matrix, in which bodies add up."""
    out = np.empty((4, 4))
    out[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    out[:3, 3] = out[3, :3] = moment
    out[3, 3] = mass
    return out


def _body(kind, numbers, which):
    get = lambda name, count: np.array([numbers.get((name, i), (0.0, 0.0))[which] for i in range(count)])
    scalar = lambda name: numbers.get((name, None), (0.0, 0.0))[which]
    if kind == "link_inertia_error":
        return _pseudo(scalar("mass_delta"), get("first_moment_delta", 3), _symmetric(get("inertia_delta", 6)))
    # The inertia of a payload is about its centre of mass.
    mass, com = scalar("mass"), get("com", 3)
    about = _symmetric(get("inertia", 6)) + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return _pseudo(mass, mass * com, about)


def _pseudo_of(model, body):
    """The pseudo-inertia of a body of a model."""
    import mujoco

    turned = np.empty(9)
    mujoco.mju_quat2Mat(turned, model.body_iquat[body])
    turned = turned.reshape(3, 3)
    mass, com = model.body_mass[body], model.body_ipos[body]
    about = turned @ np.diag(model.body_inertia[body]) @ turned.T + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return _pseudo(mass, mass * com, about)


def _add(model, body, change):
    """Adds to a body; False, and nothing done, where no body would be left."""
    import mujoco

    whole = _pseudo_of(model, body) + change
    if np.linalg.eigvalsh(whole)[0] <= 0.0:
        return False
    mass, com = whole[3, 3], whole[:3, 3] / whole[3, 3]
    spread = whole[:3, :3] - mass * np.outer(com, com)
    size, axes = np.linalg.eigh(np.trace(spread) * np.eye(3) - spread)
    axes[:, 2] *= np.linalg.det(axes)
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    model.body_mass[body], model.body_ipos[body] = mass, com
    model.body_iquat[body], model.body_inertia[body] = quaternion, size
    return True
