"""Logs of one servo joint without torque, for the pages of the servo kinds.

    python book/servo_logs.py FOLDER

Needs PyPI `numpy`. FOLDER gets `robot.urdf`, `servo.toml` and, for each kind, `KIND_0.csv` to `KIND_2.csv`: time, position and
set point at 100 Hz. A pendulum hangs on a servo, whose law is that of `servo/src/law.rs`. The servo of KIND differs from
`servo.toml` in that one thing; the one of `as_given` does not differ.
"""

import sys
from pathlib import Path

import numpy as np

# What `servo.toml` says: N m/rad, N m s/rad, rad/s, rad.
GIVEN = {"stiffness": 6.0, "damping": 0.3, "speed_limit": 6.0, "dead_band": 0.005}
# What the servo of each kind has instead.
KINDS = {
    "servo_gain_error": {"stiffness": 4.2},
    "servo_damping_error": {"damping": 0.45},
    "speed_limit": {"speed_limit": 2.0},
    "dead_band": {"dead_band": 0.04},
}
# A rod of 0.3 kg, its centre 0.12 m below the axis, which a rotor of 0.004 kg m² turns.
MASS, CENTRE, INERTIA = 0.3, 0.12, 0.0015
GRAVITY = 9.81
# Dry friction of the gear, N m: without it a dead band would only shift where the joint swings.
FRICTION = 0.03
# Steps of the simulation and of the log, s; length of a log, s; step of a 12-bit encoder, rad.
STEP, LOG, LENGTH, TICK = 1e-4, 0.01, 20.0, 2 * np.pi / 4096

URDF = f"""<robot name="servo_pendulum">
  <link name="base"/>
  <link name="rod">
    <inertial>
      <origin xyz="0 0 {-CENTRE}"/>
      <mass value="{MASS}"/>
      <inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="0.0001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="10" velocity="20"/>
  </joint>
</robot>
"""


def set_points(number):
    """Set point at each sample: slow waves, steps, runs at constant speed with rests."""
    times = np.arange(0, LENGTH, LOG)
    rng = np.random.default_rng(number)
    if number == 0:
        waves = sum(rng.normal(0, 0.5 / k) * np.sin(2 * np.pi * 0.2 * k * times + rng.uniform(0, 6)) for k in range(1, 6))
        return times, waves
    if number == 1:
        return times, np.repeat(rng.uniform(-1.2, 1.2, 14), 150)[: len(times)]
    knots = np.arange(0, LENGTH + 1, 1.0)
    points = np.repeat(rng.uniform(-1.2, 1.2, len(knots)), 2)[: len(knots)]
    return times, np.interp(times, knots, points)


def simulate(servo, target):
    """Positions at each sample; the joint begins at rest at its set point."""
    inertia = INERTIA + MASS * CENTRE**2 + 0.004
    q, v, rows = target[0], 0.0, []
    for goal in target:
        rows.append(round(q / TICK) * TICK)
        for _ in range(round(LOG / STEP)):
            error = goal - q
            drive = 0.0 if abs(error) < servo["dead_band"] else servo["stiffness"] * error
            push = drive - MASS * GRAVITY * CENTRE * np.sin(q) + inertia * v / STEP
            factor = inertia / STEP + servo["damping"]
            # Friction is a set at rest; at the limit of speed the drive pushes no further.
            v = 0.0 if abs(push) <= FRICTION else (push - np.copysign(FRICTION, push)) / factor
            if drive * v > 0:
                v = np.clip(v, -servo["speed_limit"], servo["speed_limit"])
            q += STEP * v
    return np.array(rows)


def log(kind, number):
    """Time, set point and position of a log; kind `as_given` is the servo of `servo.toml`."""
    times, target = set_points(number)
    return times, target, simulate({**GIVEN, **KINDS.get(kind, {})}, target)


def panels(kind, panel):
    """The picture of a kind: the servo that has it in orange, the one that was given in blue."""
    degree = "position, rad"
    if kind == "servo_gain_error":
        out = panel("set-point error over position, at rest", degree, "set point − position, rad")
        for which, style in (("as_given", "one"), (kind, "law")):
            _, target, q = log(which, 1)
            rest = np.arange(149, len(q), 150)
            order = rest[np.argsort(q[rest])]
            out.line(q[order], (target - q)[order], "one" if style == "one" else "two")
        return [out]
    number, span, words = {
        "servo_damping_error": (1, slice(140, 290), "a step"),
        "speed_limit": (1, slice(140, 290), "a step"),
        "dead_band": (2, slice(0, 900), "runs and rests"),
    }[kind]
    out = panel(f"{words}: as given (blue), robot (orange)", "time, s", degree)
    for which, style in (("as_given", "one"), (kind, "two")):
        times, target, q = log(which, number)
        if style == "one":
            out.add("axis", times[span], target[span])
        out.line(times[span], q[span], style)
    return [out]


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(URDF, encoding="utf-8")
    (folder / "servo.toml").write_text("".join(f"{key} = {value}\n" for key, value in GIVEN.items()), encoding="utf-8")
    for kind in ["as_given", *KINDS]:
        for number in range(3):
            times, target, q = log(kind, number)
            rows = np.column_stack([times, q, target])
            header = "time,position.shoulder,command.shoulder"
            np.savetxt(folder / f"{kind}_{number}.csv", rows, delimiter=",", header=header, comments="", fmt="%.7g")


if __name__ == "__main__":
    main()
