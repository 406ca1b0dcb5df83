"""The torque gap of an exported URDF in the simulators that read it, in the measure of mujoco_gap.py.

Each simulator loads the file; its own inverse dynamics says what torque a logged motion takes, and what it has read of damping,
friction and effort limits counts. What a URDF has no word for (a rotor, a gain) no simulator can read, and the gap keeps it.
Drake reads damping and leaves friction out, with a warning: its gap keeps friction, too.
"""

import logging

import numpy as np


class Urdf:
    """A URDF in a simulator, as mujoco_gap.gap asks for a target: joints without drives of their own."""

    def __init__(self, simulator, joints):
        self.simulator, self.hold = simulator, simulator.friction
        self.motor, self.couplings = [-1] * len(joints), []
        self.gain, self.slack, self.joints = np.ones(len(joints)), np.zeros(len(joints), bool), joints

    def forward(self, q, v, effort, dt):
        """What drives deliver, up to the limits that were read; nothing sticks and nothing is passive beside that."""
        limit = self.simulator.limit
        return np.clip(effort, -limit, limit), np.zeros_like(q), np.zeros_like(q)

    def inverse(self, q, v, a):
        """What the motion takes without dry friction, and the dry friction, [T, n] each; friction resists, so that it is negative."""
        taken = np.stack([self.simulator.torque(*state) for state in zip(q, v, a)])
        friction = -np.sign(v) * self.simulator.friction
        return taken + self.simulator.damping * v, np.zeros_like(q), friction, np.zeros((len(q), 0))


class Mujoco:
    """MuJoCo's own reader of URDF."""

    def __init__(self, urdf, joints):
        import mujoco

        self.mujoco = mujoco
        self.model = m = mujoco.MjModel.from_xml_path(urdf)
        self.data = mujoco.MjData(m)
        dof = np.array([m.joint(joint).dofadr[0] for joint in joints])
        self.dof, self.qpos = dof, np.array([m.joint(joint).qposadr[0] for joint in joints])
        # Damping and friction as read, to be counted once.
        self.damping, self.friction = m.dof_damping[dof].copy(), m.dof_frictionloss[dof].copy()
        m.dof_damping[:], m.dof_frictionloss[:] = 0.0, 0.0
        high = np.array([m.jnt_actfrcrange[m.joint(joint).id, 1] for joint in joints])
        self.limit = np.where(high > 0, high, np.inf)

    def torque(self, q, v, a):
        d = self.data
        d.qpos[self.qpos], d.qvel[self.dof], d.qacc[self.dof] = q, v, a
        self.mujoco.mj_inverse(self.model, d)
        return d.qfrc_inverse[self.dof].copy()


class PyBullet:
    """PyBullet, with the inertias of the file and not of shapes."""

    def __init__(self, urdf, joints):
        import pybullet

        self.bullet = pybullet
        self.client = pybullet.connect(pybullet.DIRECT)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self.body = pybullet.loadURDF(urdf, useFixedBase=True, flags=flags, physicsClientId=self.client)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self.client)
        info = [pybullet.getJointInfo(self.body, i, physicsClientId=self.client) for i in range(self.count())]
        free = [row for row in info if row[2] != pybullet.JOINT_FIXED]
        self.order = [[row[1].decode() for row in free].index(joint) for joint in joints]
        column = lambda i: np.array([free[k][i] for k in self.order])
        self.damping, self.friction, limit = column(6), column(7), column(10)
        self.limit = np.where(limit > 0, limit, np.inf)

    def count(self):
        return self.bullet.getNumJoints(self.body, physicsClientId=self.client)

    def torque(self, q, v, a):
        state = np.zeros((3, len(q)))
        state[:, self.order] = q, v, a
        taken = self.bullet.calculateInverseDynamics(self.body, *map(list, state), physicsClientId=self.client)
        return np.array(taken)[self.order]


class Drake:
    """Drake's MultibodyPlant."""

    def __init__(self, urdf, joints):
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant
        from pydrake.multibody.tree import MultibodyForces

        # What it leaves out is said on the page.
        logging.getLogger("drake").setLevel(logging.ERROR)
        self.plant = plant = MultibodyPlant(0.0)
        (model,) = Parser(plant).AddModels(str(urdf))
        root = plant.GetBodyByName(next(plant.get_body(i).name() for i in plant.GetBodyIndices(model)))
        plant.WeldFrames(plant.world_frame(), root.body_frame())
        plant.Finalize()
        self.context, self.forces = plant.CreateDefaultContext(), MultibodyForces(plant)
        own = [plant.GetJointByName(joint) for joint in joints]
        self.start = np.array([joint.velocity_start() for joint in own])
        self.damping = np.array([joint.default_damping() for joint in own])
        for joint in own:
            joint.SetDampingVector(self.context, [0.0])
        self.friction = np.zeros(len(joints))
        limits = {a.joint().name(): a.effort_limit() for a in map(plant.get_joint_actuator, plant.GetJointActuatorIndices())}
        self.limit = np.array([limits.get(joint, np.inf) for joint in joints])

    def torque(self, q, v, a):
        state = np.zeros((3, len(q)))
        state[:, self.start] = q, v, a
        self.plant.SetPositions(self.context, state[0])
        self.plant.SetVelocities(self.context, state[1])
        self.forces.SetZero()
        self.plant.CalcForceElementsContribution(self.context, self.forces)
        return self.plant.CalcInverseDynamics(self.context, state[2], self.forces)[self.start]


def simulators():
    """Those that are installed here, by name; MuJoCo always is."""
    found = {}
    for name, simulator, module in [("MuJoCo", Mujoco, "mujoco"), ("PyBullet", PyBullet, "pybullet"), ("Drake", Drake, "pydrake")]:
        try:
            __import__(module)
        except ImportError:
            continue
        found[name] = simulator
    return found
