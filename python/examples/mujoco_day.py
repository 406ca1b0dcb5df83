"""A MuJoCo user's day: a spec in, logs of the real robot beside it, a corrected spec out.

The robot here is MuJoCo too, with damping, rotors and a heavier tool that the spec lacks. On your own robot the logs are
files, and `real` is not there.

    python python/examples/mujoco_day.py          # needs mujoco
"""

import gapscope
import mujoco
import numpy as np

MJCF = """
<mujoco model="two_links">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" mass="2"/>
      <body name="lower" pos="0 0 -0.4">
        <joint name="elbow" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.025" mass="1.2"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="shoulder" joint="shoulder"/><motor name="elbow" joint="elbow"/></actuator>
</mujoco>
"""


def recorded(model, seed, seconds=12.0):
    """A log of the robot under a PD servo: time (T,), position and effort (T, 2)."""
    random = np.random.default_rng(seed)
    frequency, phase = random.uniform(0.1, 0.8, (2, 4)), random.uniform(0, 6.28, (2, 4))
    data = mujoco.MjData(model)
    rows = []
    while data.time < seconds:
        reference = 0.35 * np.sin(6.28 * frequency * data.time + phase).sum(axis=1)
        data.ctrl[:] = [60, 25] * (reference - data.qpos) - [6, 2] * data.qvel
        rows.append((data.time, data.qpos.copy(), data.ctrl.copy()))
        mujoco.mj_step(model, data)
    time, position, effort = (np.array(column) for column in zip(*rows))
    return {"joints": ["shoulder", "elbow"], "time": time, "position": position, "effort": effort}


def torque_gap(model, log):
    """Rms of the logged effort less what the model needs for the logged motion, N m."""
    data = mujoco.MjData(model)
    dt = log["time"][1] - log["time"][0]
    velocity = np.gradient(log["position"], dt, axis=0)
    acceleration = np.gradient(velocity, dt, axis=0)
    gaps = []
    for k in range(2, len(dt * velocity) - 2):
        data.qpos[:], data.qvel[:], data.qacc[:] = log["position"][k], velocity[k], acceleration[k]
        mujoco.mj_inverse(model, data)
        # The effort is held from sample to sample: between two of them it is their mean.
        gaps.append((log["effort"][k] + log["effort"][k - 1]) / 2 - data.qfrc_inverse)
    return float(np.sqrt(np.mean(np.square(gaps))))


spec = mujoco.MjSpec.from_string(MJCF)

# The robot that nobody has a model of.
real = spec.copy()
for name, damping, rotor in (("shoulder", 0.8, 0.05), ("elbow", 0.4, 0.02)):
    joint = real.joint(name)
    joint.damping, joint.armature = np.resize([damping, 0, 0], np.shape(joint.damping)), rotor
real.body("lower").add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.03, 0, 0], pos=[0, 0, -0.3], mass=0.4)
real = real.compile()
logs = [recorded(real, seed) for seed in (1, 2, 3)]

# The day's work: three lines.
diagnosis = gapscope.diagnose(spec, logs)
print(diagnosis)
corrected = diagnosis.to_mjcf(spec)

held_out = recorded(real, seed=9)
before, after = (torque_gap(model.compile(), held_out) for model in (spec, corrected))
print(f"Torque gap in MuJoCo on another log: {before:.3f} N m before, {after:.3f} N m after")
