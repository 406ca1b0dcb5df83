"""One case for each kind of effect on the built-in six-joint arm, sized as on arms in use."""

# Joint by joint, shoulder to wrist: what an arm of 20 kg has.
SIZE = [1.0, 1.0, 0.6, 0.2, 0.2, 0.1]
JOINTS = [f"joint{i + 1}" for i in range(6)]
each = lambda value: {joint: round(value * size, 6) for joint, size in zip(JOINTS, SIZE)}
same = lambda value: {joint: value for joint in JOINTS}
rotors = {"kind": "armature", "armature": {"joint1": 1.2, "joint2": 1.4, "joint3": 0.5, "joint4": 0.05, "joint5": 0.04, "joint6": 0.005}}

CASES = {
    "viscous_friction": [{"viscous": each(8.0)}],
    "coulomb_friction": [{"coulomb": each(6.0)}],
    "stribeck_friction": [{"coulomb": each(4.0), "static": each(8.0), "stribeck_velocity": same(0.15)}],
    "load_dependent_friction": [{"load_coefficient": same(0.12)}],
    "presliding_friction": [{"coulomb": each(6.0), "bristle_stiffness": each(600.0)}],
    "thermal_drift": [{"coulomb": each(8.0), "ratio": same(0.5), "time_constant": same(6.0)}],
    "payload": [{"joint": "joint6", "mass": 1.5, "com": [0.02, -0.01, 0.08], "inertia": [0.004, 0, 0.004, 0, 0, 0.003]}],
    "link_inertia_error": [
        {
            "joint": "joint3",
            "mass_delta": 0.6,
            "first_moment_delta": [-0.1, 0.02, 0.05],
            "inertia_delta": [0.01, 0.002, 0.04, 0.004, -0.001, 0.04],
        }
    ],
    "armature": [{"armature": rotors["armature"]}],
    "gravity_misalignment": [{"roll": 0.05, "pitch": -0.04}],
    "torque_gain_error": [{"gain": {"joint1": 1.1, "joint2": 0.9, "joint3": 1.08, "joint4": 0.93}}],
    "torque_bias": [{"bias": each(3.0)}],
    "actuation_delay": [{"delay": 0.013}],
    "actuator_lag": [{"time_constant": 0.02}],
    "torque_saturation": [{"limit": {"joint2": 70.0, "joint3": 22.0}}],
    "torque_ripple": [{"amplitude": each(3.0), "cycles": same(17.0), "phase": same(0.4)}],
    "joint_elasticity": [
        {"stiffness": {"joint1": 4000.0, "joint2": 4000.0, "joint3": 2000.0}, "damping": {"joint1": 8.0, "joint2": 8.0, "joint3": 4.0}},
        rotors,
    ],
    "backlash": [{"gap": {"joint1": 0.006, "joint3": 0.006}}, rotors],
    "parallel_spring": [{"stiffness": {"joint2": 25.0, "joint3": 10.0}, "rest_position": {"joint2": -0.6, "joint3": 0.4}}],
    "joint_zero_offset": [{"offset": {"joint2": 0.03, "joint3": -0.04, "joint5": 0.05}}],
    "joint_coupling": [{"joints": ["joint5", "joint6"], "coulomb": 0.6, "viscous": 0.5, "armature": 0.03, "ratio": 1.0}],
}


def effects(kind):
    """The list of effects of a case, as `gapscope generate --effects` reads it."""
    return [{"kind": kind, **effect} if "kind" not in effect else effect for effect in CASES[kind]]
