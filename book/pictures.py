"""Draws the pictures of the effects: what each leaves between the logged effort and the nominal model's.

    python book/pictures.py [KIND ...]

Needs `gapscope` on the path and PyPI `numpy`. For each kind, `gapscope generate` makes a log of the six-joint arm with the
effects in `src/effects/KIND.json`. `gapscope evaluate --predictions` gives the torque that was logged and the nominal model's,
both below 10 Hz. Their difference is drawn over the quantity that tells the effect. The pictures of servo kinds come from
`servo_logs.py`. Each is written to `src/pictures/KIND.svg`.
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import servo_logs

HERE = Path(__file__).parent
EFFECTS = HERE / "src" / "effects"
PICTURES = HERE / "src" / "pictures"
# Half of the window, s, in which a parabola gives speed and acceleration: short beside 10 Hz, long beside encoder noise.
WINDOW = 0.02
# A picture in px: whole width, height, and the margins left, right, above and below the axes.
SIZE = (720, 300)
MARGIN = (66, 14, 34, 44)
# Inside margin of the axes, as a part of the range of the data.
ROOM = 0.06
JOINTS = [f"joint{i}" for i in range(1, 7)]

STYLE = """<style>
rect.page{fill:#fff}text{font:13px sans-serif;fill:#333}.grid{stroke:#ddd;fill:none}.axis{stroke:#888;fill:none}
.dots{stroke:#1f6fb4;stroke-width:3;stroke-linecap:round;fill:none}.law{stroke:#c2410c;stroke-width:2;fill:none}
.one{stroke:#1f6fb4;stroke-width:1.6;fill:none}.two{stroke:#c2410c;stroke-width:1.6;fill:none}
.head{font-weight:bold}
@media(prefers-color-scheme:dark){rect.page{fill:#1b1e23}text{fill:#ddd}.grid{stroke:#363b42}.axis{stroke:#999}
.dots,.one{stroke:#6cb6ff}.law,.two{stroke:#ffa15c}}
</style>"""


class Log:
    """A simulated log: samples of each joint, and torque logged and predicted on the rows of `evaluate`."""

    def __init__(self, folder, kind, *flags):
        run("generate", "arm6", "--effects", EFFECTS / f"{kind}.json", "--episodes", "2", *flags, "--out", folder)
        self.parts = [Part(folder, number) for number in range(2)]

    def __call__(self, name, joint):
        """A quantity of a joint on all rows: q, v, a, logged, model or left, which is logged less model."""
        return np.concatenate([getattr(part, name)(joint) for part in self.parts])

    def time(self):
        """Time of each row, s."""
        return np.concatenate([part.rows["time"] for part in self.parts])


class Part:
    """One episode."""

    def __init__(self, folder, number):
        self.log = table(folder / f"episode_{number}.csv")
        run("evaluate", folder / "robot.urdf", folder / f"episode_{number}.csv", "--as-logged", "--predictions", folder / f"p{number}.csv")
        self.rows = table(folder / f"p{number}.csv")

    def parabola(self, joint):
        """Value, slope and curvature of a joint's position about each row."""
        time, position = self.log["time"], self.log[f"position.{joint}"]
        fits = []
        for t in self.rows["time"]:
            near = np.abs(time - t) < WINDOW
            fits.append(np.polyfit(time[near] - t, position[near], 2))
        return np.array(fits)

    def q(self, joint):
        return self.parabola(joint)[:, 2]

    def v(self, joint):
        return self.parabola(joint)[:, 1]

    def a(self, joint):
        return 2 * self.parabola(joint)[:, 0]

    def logged(self, joint):
        return self.rows[f"measured.{joint}"]

    def model(self, joint):
        return self.rows[f"nominal.{joint}"]

    def left(self, joint):
        return self.logged(joint) - self.model(joint)


def run(*words):
    done = subprocess.run(["gapscope", *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr)


def table(file):
    """Columns of numbers by name; words are left out."""
    with open(file, newline="", encoding="utf-8") as source:
        rows = list(csv.DictReader(source))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name != "log"}


def ticks(low, high):
    """Some five round numbers between two others."""
    raw = (high - low) / 5
    step = min((m * 10 ** np.floor(np.log10(raw)) for m in (1, 2, 5, 10)), key=lambda s: abs(np.log(s / raw)))
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


class Panel:
    """Axes with dots and lines."""

    def __init__(self, heading, across, up):
        self.heading, self.across, self.up, self.marks = heading, across, up, []

    def dots(self, x, y):
        return self.add("dots", x, y)

    def law(self, x, y):
        return self.add("law", x, y)

    def line(self, x, y, which="one"):
        return self.add(which, x, y)

    def zero(self):
        """Has the axis upwards begin or end at zero."""
        x = self.marks[0][1]
        return self.add("axis", [x.min(), x.max()], [0, 0])

    def add(self, style, x, y):
        self.marks.append((style, np.asarray(x, float), np.asarray(y, float)))
        return self

    def draw(self, left, width):
        x0, x1 = left + MARGIN[0], left + width - MARGIN[1]
        y0, y1 = SIZE[1] - MARGIN[3], MARGIN[2]
        ranges = []
        for axis in (1, 2):
            values = np.concatenate([mark[axis] for mark in self.marks])
            low, high = values.min(), values.max()
            room = ROOM * (high - low or 1)
            ranges.append((low - room, high + room))
        across = lambda v: x0 + (v - ranges[0][0]) / (ranges[0][1] - ranges[0][0]) * (x1 - x0)
        up = lambda v: y0 + (v - ranges[1][0]) / (ranges[1][1] - ranges[1][0]) * (y1 - y0)
        out = [f'<text class="head" x="{x0}" y="20">{self.heading}</text>']
        for tick in ticks(*ranges[0]):
            out.append(f'<path class="grid" d="M{across(tick):.1f} {y0}V{y1}"/>')
            out.append(f'<text x="{across(tick):.1f}" y="{y0 + 16}" text-anchor="middle">{tick + 0:.3g}</text>')
        for tick in ticks(*ranges[1]):
            out.append(f'<path class="grid" d="M{x0} {up(tick):.1f}H{x1}"/>')
            out.append(f'<text x="{x0 - 6}" y="{up(tick) + 4:.1f}" text-anchor="end">{tick + 0:.3g}</text>')
        out.append(f'<path class="axis" d="M{x0} {y1}V{y0}H{x1}"/>')
        out.append(f'<text x="{(x0 + x1) / 2}" y="{SIZE[1] - 8}" text-anchor="middle">{self.across}</text>')
        middle = (y0 + y1) / 2
        out.append(f'<text transform="translate({left + 14},{middle}) rotate(-90)" text-anchor="middle">{self.up}</text>')
        for style, x, y in self.marks:
            places = [f"{across(a):.1f} {up(b):.1f}" for a, b in zip(x, y)]
            path = "".join(f"M{p}h0" for p in places) if style == "dots" else "M" + "L".join(places)
            out.append(f'<path class="{style}" d="{path}"/>')
        return "".join(out)


def write(kind, *panels):
    """The picture of a kind: its panels side by side."""
    width = SIZE[0] / len(panels)
    inside = "\n".join(panel.draw(i * width, width) for i, panel in enumerate(panels))
    PICTURES.mkdir(exist_ok=True)
    (PICTURES / f"{kind}.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE[0]} {SIZE[1]}" role="img">{STYLE}'
        f'<rect class="page" width="{SIZE[0]}" height="{SIZE[1]}" rx="6"/>\n{inside}\n</svg>\n',
        encoding="utf-8",
    )


def parameters(kind):
    return json.loads((EFFECTS / f"{kind}.json").read_text(encoding="utf-8"))[0]


def spread(values, n=200):
    return np.linspace(values.min(), values.max(), n)


LEFT = "left over, N m"
TIME = "time, s"
SPEED = "speed, rad/s"
alone = lambda joint: [word for other in JOINTS if other != joint for word in ("--lock", other)]


def viscous_friction(log, p):
    v = log("v", "joint2")
    return [Panel("joint 2", SPEED, LEFT).dots(v, log("left", "joint2")).law(spread(v), p["viscous"]["joint2"] * spread(v))]


def coulomb_friction(log, p):
    v, f = log("v", "joint2"), p["coulomb"]["joint2"]
    return [Panel("joint 2", SPEED, LEFT).dots(v, log("left", "joint2")).law([v.min(), 0, 0, v.max()], [-f, -f, f, f])]


def stribeck_friction(log, p):
    v = log("v", "joint2")
    f, s, fade = p["coulomb"]["joint2"], p["static"]["joint2"], p["stribeck_velocity"]["joint2"]
    grid = np.concatenate([np.linspace(v.min(), -1e-9, 100), np.linspace(1e-9, v.max(), 100)])
    return [Panel("joint 2", SPEED, LEFT).dots(v, log("left", "joint2")).law(grid, (f + (s - f) * np.exp(-((grid / fade) ** 2))) * np.sign(grid))]


def load_dependent_friction(log, p):
    v, left, load = log("v", "joint2"), log("left", "joint2"), np.abs(log("logged", "joint2"))
    moving = np.abs(v) > 0.1
    return [
        Panel("joint 2", SPEED, LEFT).dots(v, left),
        Panel("the same, along the motion", "size of the effort, N m", "left × sign of speed, N m")
        .dots(load[moving], (left * np.sign(v))[moving])
        .law([0, load.max()], [0, p["load_coefficient"]["joint2"] * load.max()]),
    ]


def presliding_friction(log, p):
    q, left, t = log("q", "joint2"), log("left", "joint2"), log.time()
    first = np.arange(len(t)) < len(t) // 2
    return [
        Panel("joint 2", TIME, LEFT).line(t[first], left[first]),
        Panel("the same", "position, rad", LEFT).line(q[first], left[first]),
    ]


def thermal_drift(log, p):
    v, left, t = log("v", "joint2"), log("left", "joint2"), log.time()
    moving = np.abs(v) > 0.1
    grid = np.linspace(0, t.max(), 100)
    f, ratio, warm = p["coulomb"]["joint2"], p["ratio"]["joint2"], p["time_constant"]["joint2"]
    return [
        Panel("joint 2", TIME, "left × sign of speed, N m")
        .dots(t[moving], (left * np.sign(v))[moving])
        .law(grid, f * (ratio + (1 - ratio) * np.exp(-grid / warm)))
    ]


def bodies(log, _):
    panels, first = [], slice(0, len(log.time()) // 2)
    for joint, words in (("joint2", "joint 2"), ("joint3", "joint 3")):
        panels.append(Panel(words, TIME, LEFT).line(log.time()[first], log("left", joint)[first]))
    return panels


def armature(log, p):
    a = log("a", "joint2")
    return [Panel("joint 2", "acceleration, rad/s²", LEFT).dots(a, log("left", "joint2")).law(spread(a), p["armature"]["joint2"] * spread(a))]


def gravity_misalignment(log, _):
    q, left = log("q", "joint1"), log("left", "joint1")
    return [Panel("joint 1, whose axis stands upright; the others locked", "position, rad", LEFT).dots(q, left)]


def torque_gain_error(log, p):
    model, gain = log("model", "joint2"), p["gain"]["joint2"]
    return [Panel("joint 2", "torque that the model asks, N m", LEFT).dots(model, log("left", "joint2")).law(spread(model), (1 / gain - 1) * spread(model))]


def torque_bias(log, p):
    v = log("v", "joint2")
    return [Panel("joint 2", SPEED, LEFT).dots(v, log("left", "joint2")).law(spread(v), np.full(200, -p["bias"]["joint2"])).zero()]


def late(log, p):
    # Where the torque changes fastest: there the shift shows.
    part, first = log.parts[0], slice(16, 28)
    t, model = part.rows["time"], part.model("joint2")
    wait = p.get("delay") or p.get("time_constant")
    rate = np.gradient(model, t)
    return [
        Panel("joint 2: logged (blue), model (orange)", TIME, "torque, N m").line(t[first], part.logged("joint2")[first]).line(t[first], model[first], "two"),
        Panel("what is left", "rate of the torque, N m/s", LEFT).dots(rate, part.left("joint2")).law(spread(rate), wait * spread(rate)),
    ]


def torque_saturation(log, p):
    logged, limit = log("logged", "joint3"), p["limit"]["joint3"]
    grid = spread(logged)
    return [Panel("joint 3", "effort logged, N m", "torque that the motion took, N m").dots(logged, log("model", "joint3")).law(grid, np.clip(grid, -limit, limit))]


def torque_ripple(log, p):
    q = log("q", "joint2")
    middle = np.abs(q - np.median(q)) < 0.8
    grid = spread(q[middle], 600)
    law = -p["amplitude"]["joint2"] * np.sin(p["cycles"]["joint2"] * grid + p["phase"]["joint2"])
    return [Panel("joint 2", "position, rad", LEFT).dots(q[middle], log("left", "joint2")[middle]).law(grid, law)]


def joint_elasticity(log, _):
    part = log.parts[0]
    rotor, a, left = 1.4, part.a("joint2"), part.left("joint2")
    return [
        Panel("joint 2", "acceleration, rad/s²", LEFT).dots(a, left).law(spread(a), rotor * spread(a)),
        Panel("less the rotor’s part", TIME, LEFT).line(part.rows["time"], left - rotor * a),
    ]


def backlash(log, p):
    part, rotor = log.parts[0], 0.5
    a, left, t = part.a("joint3"), part.left("joint3"), part.rows["time"]
    return [
        Panel("joint 3", "acceleration, rad/s²", LEFT).dots(a, left).law(spread(a), rotor * spread(a)),
        Panel("less the rotor’s part", TIME, LEFT).line(t, left - rotor * a),
    ]


def parallel_spring(log, p):
    q = log("q", "joint2")
    law = p["stiffness"]["joint2"] * (spread(q) - p["rest_position"]["joint2"])
    return [Panel("joint 2", "position, rad", LEFT).dots(q, log("left", "joint2")).law(spread(q), law)]


def joint_zero_offset(log, _):
    q, left = log("q", "joint2"), log("left", "joint2")
    return [Panel("joint 2, the others locked", "position, rad", LEFT).dots(q, left)]


def external_contact(log, _):
    part = log.parts[0]
    return [Panel("joint 2", TIME, LEFT).line(part.rows["time"], part.left("joint2"))]


def joint_coupling(log, p):
    a, b, left = log("v", "joint5"), log("v", "joint6"), log("left", "joint5")
    return [
        Panel("joint 5, over its own speed", SPEED, LEFT).dots(a, left),
        Panel("joint 5, over the sum", "speed of joint 5 + joint 6, rad/s", LEFT).dots(a + p["ratio"] * b, left),
    ]


# What is drawn, and with which flags the log is made.
DRAWN = {
    "viscous_friction": (viscous_friction, []),
    "coulomb_friction": (coulomb_friction, []),
    "stribeck_friction": (stribeck_friction, ["--motion", "point-to-point"]),
    "load_dependent_friction": (load_dependent_friction, []),
    "presliding_friction": (presliding_friction, ["--motion", "sweep", "--seconds", "20"]),
    "thermal_drift": (thermal_drift, []),
    "payload": (bodies, []),
    "link_inertia_error": (bodies, []),
    "armature": (armature, []),
    "gravity_misalignment": (gravity_misalignment, ["--motion", "sweep", *alone("joint1"), "--seconds", "20"]),
    "torque_gain_error": (torque_gain_error, []),
    "torque_bias": (torque_bias, []),
    "actuation_delay": (late, []),
    "actuator_lag": (late, []),
    "torque_saturation": (torque_saturation, []),
    "torque_ripple": (torque_ripple, ["--motion", "sweep", "--seconds", "20", "--speed", "0.5"]),
    "joint_elasticity": (joint_elasticity, ["--motion", "chirp"]),
    "backlash": (backlash, []),
    "parallel_spring": (parallel_spring, []),
    "joint_zero_offset": (joint_zero_offset, ["--motion", "sweep", *alone("joint2"), "--seconds", "20"]),
    "external_contact": (external_contact, []),
    "joint_coupling": (joint_coupling, []),
}


def main():
    asked = sys.argv[1:] or [*DRAWN, *servo_logs.KINDS]
    with tempfile.TemporaryDirectory() as root:
        for kind in asked:
            if kind in servo_logs.KINDS:
                write(kind, *servo_logs.panels(kind, Panel))
                continue
            draw, flags = DRAWN[kind]
            write(kind, *draw(Log(Path(root) / kind, kind, *flags), parameters(kind)))


if __name__ == "__main__":
    main()
