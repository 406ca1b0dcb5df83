"""Corrections in a user's own `mujoco.MjSpec`. mujoco is imported here and nowhere else."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from ._native import Error
from ._results import Exported

#: Effects that stand in bodies, joints and gravity alone; the others need actuators or further joints.
HELD = {
    "viscous_friction", "coulomb_friction", "load_dependent_friction", "thermal_drift", "payload", "link_inertia_error",
    "armature", "gravity_misalignment", "parallel_spring",
}  # fmt: skip
#: Attributes of a joint that hold them.
JOINT = ("damping", "frictionloss", "armature", "stiffness", "springref")
#: Largest difference of mass matrix and bias, as a part of their size: rounding of the file's decimals and no more.
SAME = 1e-6


def corrected(spec: Any, exported: Exported, partial: bool) -> Any:
    """A copy of `spec` with the corrections of `exported`."""
    entries = exported.ledger["effects"]
    lost = sorted({entry["kind"] for entry in entries if entry["kind"] not in HELD and entry["how"] != "left_out"})
    if lost and not partial:
        raise Error(
            f"bodies and joints of a spec cannot hold {', '.join(lost)}; use the whole file, to_mjcf() without a spec, or leave "
            "them out with partial=True"
        )
    source = mujoco.MjSpec.from_string(exported.text)
    model = source.compile()
    joints = [joint for joint in source.joints if _named(spec.joints, joint.name)]
    if not lost and len(joints) < len(source.joints):
        missing = next(joint.name for joint in source.joints if not _named(spec.joints, joint.name))
        raise Error(f"the spec has no joint {missing!r}; give the robot that the diagnosis was made with")
    copy = spec.copy()
    for joint in joints:
        target = copy.joint(joint.name)
        for attribute in JOINT:
            setattr(target, attribute, getattr(joint, attribute))
    bodies = [body for body in source.bodies if body.name != "world" and _named(copy.bodies, body.name)]
    for body in bodies:
        held, target = model.body(body.name), copy.body(body.name)
        _weigh(target, float(held.mass[0]), held.ipos, held.iquat, held.inertia)
        for child in target.bodies:
            _lighten(child, {body.name for body in bodies})
    copy.option.gravity = source.option.gravity
    _check(copy.compile(), model, [joint.name for joint in joints], bool(lost))
    return copy


def _named(elements: Any, name: str) -> bool:
    return any(element.name == name for element in elements)


def _weigh(body: Any, mass: float, ipos: Any, iquat: Any, inertia: Any) -> None:
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = mass, ipos, iquat, inertia
    body.fullinertia = [np.nan] * 6


def _lighten(body: Any, known: set[str]) -> None:
    """Takes the weight of what is fixed to a body: the corrected model counts it with that body."""
    if body.name in known or len(body.joints) > 0:
        return
    _weigh(body, 0.0, [0, 0, 0], [1, 0, 0, 0], [0, 0, 0])
    for child in body.bodies:
        _lighten(child, known)


def _check(copy: Any, model: Any, joints: list[str], partial: bool) -> None:
    """Holds mass matrix and bias against the corrected model's, at random states of the joints."""
    if partial or model.nv != len(joints):
        return
    random = np.random.default_rng(0)
    for _ in range(4):
        q, v = random.uniform(-1, 1, (2, len(joints)))
        (mass, bias), (expected, expected_bias) = (_dynamics(of, joints, q, v) for of in (copy, model))
        size = np.abs(expected).max(), max(np.abs(expected_bias).max(), 1e-9)
        if np.abs(mass - expected).max() > SAME * size[0] or np.abs(bias - expected_bias).max() > SAME * size[1]:
            raise Error(
                "the spec's bodies do not move as the corrected model's: it has further bodies that weigh or other frames; use "
                "the whole file, to_mjcf() without a spec"
            )


def _dynamics(model: Any, joints: list[str], q: Any, v: Any) -> tuple[Any, Any]:
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    places = [int(model.joint(name).qposadr[0]) for name in joints]
    speeds = [int(model.joint(name).dofadr[0]) for name in joints]
    data.qpos[places], data.qvel[speeds] = q, v
    mujoco.mj_forward(model, data)
    columns = np.zeros((len(speeds), model.nv))
    for column, unit in zip(columns, np.eye(model.nv)[speeds]):
        mujoco.mj_mulM(model, data, column, unit)
    return columns[:, speeds], data.qfrc_bias[speeds]
