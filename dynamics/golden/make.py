#!/usr/bin/env python3
"""Golden figures of tests/all/golden.rs from Pinocchio: one JSON file a robot, beside this script.

    python make.py        (needs the PyPI package `pin`)

Joints are in Pinocchio's order, which the JSON names; matrices are lists of rows. Frames are the URDF's link frames.
"""

import json
import pathlib

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
ROBOTS = {
    "arm7": HERE.parent / "robots/arm7.urdf",
    "arm6": HERE.parent / "robots/arm6.urdf",
    "double_pendulum": HERE.parent / "robots/double_pendulum.urdf",
    "branched": HERE / "branched.urdf",
}
STATES = 3


def full_positions(model, q):
    """Pinocchio keeps cosine and sine of a continuous joint."""
    full = np.zeros(model.nq)
    for i, joint in enumerate(model.joints[1:]):
        if joint.nq == 2:
            full[joint.idx_q : joint.idx_q + 2] = np.cos(q[i]), np.sin(q[i])
        else:
            full[joint.idx_q] = q[i]
    return full


def state(model, random, first):
    data = model.createData()
    n = model.nv
    q, v, a = random.uniform(-3, 3, n), random.uniform(-3, 3, n), random.uniform(-10, 10, n)
    tau, point = random.uniform(-20, 20, n), random.uniform(-0.3, 0.3, 3)
    positions = full_positions(model, q)
    out = {"q": q, "v": v, "a": a, "tau": tau, "point": point}
    out["inverse_dynamics"] = pin.rnea(model, data, positions, v, a)
    out["forward_dynamics"] = pin.aba(model, data, positions, v, tau)
    out["gravity_torque"] = pin.computeGeneralizedGravity(model, data, positions)
    out["bias"] = pin.nonLinearEffects(model, data, positions, v)
    mass = pin.crba(model, data, positions)
    out["mass_matrix"] = np.triu(mass) + np.triu(mass, 1).T
    out["coriolis_matrix"] = pin.computeCoriolisMatrix(model, data, positions, v)
    out["kinetic_energy"] = pin.computeKineticEnergy(model, data, positions, v)
    out["potential_energy"] = pin.computePotentialEnergy(model, data, positions)
    by_position, by_velocity, _ = pin.computeRNEADerivatives(model, data, positions, v, a)
    out["torque_by_position"], out["torque_by_velocity"] = by_position.copy(), by_velocity.copy()
    by_position, by_velocity, by_torque = pin.computeABADerivatives(model, data, positions, v, tau)
    out["acceleration_by_position"], out["acceleration_by_velocity"] = by_position.copy(), by_velocity.copy()
    out["acceleration_by_torque"] = np.triu(by_torque) + np.triu(by_torque, 1).T
    pin.forwardKinematics(model, data, positions)
    out["rotations"] = [place.rotation for place in data.oMi[1:]]
    out["translations"] = [place.translation for place in data.oMi[1:]]
    pin.computeJointJacobians(model, data, positions)
    jacobians = []
    for i in range(1, model.njoints):
        jacobian = pin.getJointJacobian(model, data, i, pin.LOCAL_WORLD_ALIGNED)
        jacobian[:3] -= pin.skew(data.oMi[i].rotation @ point) @ jacobian[3:]
        jacobians.append(jacobian)
    out["jacobians"] = jacobians
    if first:
        out["regressor"] = pin.computeJointTorqueRegressor(model, data, positions, v, a)
    return out


def plain(value):
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, np.ndarray)):
        return [plain(entry) for entry in value]
    # Zero has one sign here.
    return float(value) + 0.0


def main():
    for name, urdf in ROBOTS.items():
        if not urdf.exists():
            print(f"{urdf} is missing")
            continue
        model = pin.buildModelFromXML(urdf.read_text())
        random = np.random.default_rng(11)
        golden = {
            "made_by": f"golden/make.py, pinocchio {pin.__version__}",
            "joints": list(model.names)[1:],
            "states": plain([state(model, random, k == 0) for k in range(STATES)]),
        }
        (HERE / f"{name}.json").write_text(json.dumps(golden) + "\n")


if __name__ == "__main__":
    main()
