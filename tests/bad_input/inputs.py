"""The inputs, each with what it must get: see walk.py."""
import gzip, json, math, os, random, re

from kit import *

DEGREES = 180 / math.pi

EMPS = lambda robots: robots.emps()
ARM = lambda robots: robots.arm()
PENDULUM = lambda robots: robots.pendulum()
ALL6 = [f"joint{j}" for j in range(1, 7)]
BOTH = ["joint1", "joint2"]


def noise(size, of):
    random.seed(1)
    return lambda name, _, x: random.gauss(0, size) if name.startswith(of) else x


def constant(value, of):
    return lambda name, _, x: value if name.startswith(of) else x


# EMPS: one slide, no gravity; only the body's mass tells a scale.
spoilt("EMPS as it is", lambda run: need(run.code == 0 and not run.answer["data"].get("faults") and not run.answer["data"].get("doubts"), "a fault or a question"), EMPS, None, real=True)
spoilt("EMPS effort 0", says("effort"), EMPS, scale(effort=0), real=True)
spoilt("EMPS effort 5 N throughout", both(fault("effort_missing"), humble), EMPS, constant(5.0, "effort"), real=True)
spoilt("EMPS effort is noise", both(fault("effort_noise"), humble), EMPS, noise(50, "effort"), real=True)
for factor in (.25, 1 / 35, .5, 2, 3, .6, 1.7): spoilt(f"EMPS effort x {factor:.3g}", asked, EMPS, scale(effort=factor), real=True)
spoilt("EMPS effort in mN", fault("effort_scale", factor=1e3, within=.06), EMPS, scale(effort=1e3), real=True)
spoilt("EMPS effort turned round", fault("effort_sign"), EMPS, scale(effort=-1), real=True)
spoilt("EMPS position in mm", fault("position_scale", factor=1e3), EMPS, scale(position=1e3), real=True)
spoilt("EMPS position in ticks", fault("position_scale", factor=65536, within=.15), EMPS, scale(position=65536), real=True)
for factor, unit in ((1e3, "ms"), (1e6, "us")):
    spoilt(f"EMPS time in {unit}", fault("time_scale", factor=factor), lambda robots: robots.emps(5000), scale(time=factor), real=True)
spoilt("EMPS row numbers as time", asked, EMPS, lambda name, k, x: float(k) if name == "time" else x, real=True)
spoilt("EMPS time in ms, 300 rows", lambda run: need("panicked" not in run.text and (run.code == 1 or not confident(run.answer) or run.answer["data"].get("faults")), "SILENT WRONG"), lambda robots: robots.emps(300), scale(time=1e3), real=True)

# An arm of six joints.
spoilt("arm as it is", lambda run: need(run.code == 0 and run.answer["verdict"] == "explained" and not run.answer["data"].get("faults") and not run.answer["data"].get("doubts"), "not right"), ARM, None)
spoilt("arm, effort of joint5 0", fault("effort_missing", ["joint5"]), ARM, scale(effort__joint5=0))
spoilt("arm, effort of joint5 3 N m throughout", fault("effort_missing", ["joint5"]), ARM, constant(3.0, "effort.joint5"))
spoilt("arm, effort in N mm", both(fault("effort_scale", ALL6, 1e3), says("n mm", "a thousandth")), ARM, scale(effort=1e3))
spoilt("arm, joint5 in degrees", fault("position_scale", ["joint5"], DEGREES), ARM, scale(position__joint5=DEGREES, velocity__joint5=DEGREES))
spoilt("arm, effort of joint3 x 1000", both(fault("effort_scale", ["joint3"], 1e3), says(never=("10²", "10³", "e+"))), ARM, scale(effort__joint3=1e3))
spoilt("arm, effort turned round", fault("effort_sign", ALL6), ARM, scale(effort=-1))
spoilt("arm, zero of joint2 by 90 degrees", fault("position_zero", ["joint2"], math.pi / 2), ARM, lambda name, _, x: x + math.pi / 2 if name == "position.joint2" else x)
spoilt("arm, time in ms", fault("time_scale", [], 1e3), ARM, scale(time=1e3))
spoilt("arm, positions in degrees", fault("position_scale", ALL6, DEGREES), ARM, scale(position=DEGREES, velocity=DEGREES))

# A double pendulum, with and without velocity.
spoilt("pendulum as it is", lambda run: need(run.code == 0 and run.answer["verdict"] == "explained" and not run.answer["data"].get("faults") and not run.answer["data"].get("doubts"), "not right"), PENDULUM, None)
for factor in (.5, 2, 10): spoilt(f"pendulum, time x {factor}, no velocity", humble, PENDULUM, scale(time=factor), bare=True)
spoilt("pendulum, positions of the motor x 100", fault("position_scale", BOTH, 100), PENDULUM, scale(position=100), bare=True)
spoilt("pendulum, joint2 in degrees", fault("position_scale", ["joint2"], DEGREES), PENDULUM, scale(position__joint2=DEGREES, velocity__joint2=DEGREES))
spoilt("pendulum, axis of joint1 turned round", humble, PENDULUM, scale(position__joint1=-1, velocity__joint1=-1, effort__joint1=-1))
spoilt("pendulum, effort of joint1 turned round", fault("effort_sign", ["joint1"]), PENDULUM, scale(effort__joint1=-1))
spoilt("pendulum, position of joint1 turned round", humble, PENDULUM, scale(position__joint1=-1, velocity__joint1=-1))
for joint in BOTH:
    for turn, of in ((math.pi / 2, "90"), (math.pi, "180")):
        spoilt(f"pendulum, zero of {joint} by {of} degrees", humble, PENDULUM, lambda name, _, x, joint=joint, turn=turn: x + turn if name == f"position.{joint}" else x)
spoilt("pendulum, effort x .5", asked, PENDULUM, scale(effort=.5))
spoilt("pendulum, effort in oz in", fault("effort_scale", BOTH, 141.612), PENDULUM, scale(effort=141.612))


@case("pendulum, 50 Hz held in a 250 Hz log", both(fault("repeated_samples", [], 5), says(never=("hardly moves",))), "log_0.csv log_1.csv")
def _(folder, robots):
    urdf, tables = robots.pendulum()
    held = [(names, [[x if name == "time" or name.startswith("effort") else rows[k - k % 5][i] for i, (name, x) in enumerate(zip(names, row))] for k, row in enumerate(rows)]) for names, rows in tables]
    put(folder, (urdf, held))


@case("pendulum, one file at 25 Hz", humble, "log_0.csv log_1.csv")
def _(folder, robots):
    urdf, [first, (names, rows)] = robots.pendulum()
    put(folder, (urdf, [first, (names, rows[::10])]))


@case("pendulum, one file of two in degrees", fault("position_scale", BOTH, DEGREES, files=["log_1.csv"]), "log_0.csv log_1.csv")
def _(folder, robots):
    urdf, [first, second] = robots.pendulum()
    put(folder, (urdf, [first, each(second, scale(position=DEGREES, velocity=DEGREES))]))


@case("arm, URDF in grams", both(fault("effort_scale", ALL6, 1e-3), says("grams")), "log_0.csv log_1.csv")
def _(folder, robots):
    urdf, tables = robots.arm()
    times = lambda match: f'{match.group(1)}="{float(match.group(2)) * 1e3!r}"'
    put(folder, (re.sub(r'\b(mass value|ixx|ixy|ixz|iyy|iyz|izz)="([^"]+)"', times, urdf), tables))


# Logs that are short, thinned or nearly still.
def decided(run):
    """What is plain in the robot is said, with nothing doubtful for sure."""
    need(run.code == 0, f"exit {run.code}")
    kinds = {e["kind"]: e for e in run.answer["effects"]}
    need("coulomb_friction" in kinds and len(kinds["coulomb_friction"]["joints"]) == 6, f"{sorted(kinds)}")


@case("TX40, 8 s at 1 kHz", decided, real=True)
def _(folder, robots):
    urdf, [(names, rows)] = robots.real("tx40", "exciting.csv.gz")
    put(folder, (urdf, [(names, rows[:40000:5])]))


def nothing_odd(run):
    need(run.code == 0, f"exit {run.code}")
    for effect in run.answer["effects"]:
        need(effect["confidence"] < .9 or effect["kind"] != "payload", "a payload for sure")


@case("double pendulum, first 20 s", nothing_odd, real=True)
def _(folder, robots):
    urdf, [(names, rows)] = robots.real("double_pendulum", "slow_74s.csv.gz")
    put(folder, (urdf, [(names, [row for row in rows if row[0] < rows[0][0] + 20])]))


@case("double pendulum, first 5 s", both(nothing_odd, says(never=("no effect that I know",))), real=True)
def _(folder, robots):
    urdf, [(names, rows)] = robots.real("double_pendulum", "slow_74s.csv.gz")
    put(folder, (urdf, [(names, [row for row in rows if row[0] < rows[0][0] + 5])]))


# Files.
@case("a binary file as a log", error("no text"))
def _(folder, robots):
    put(folder, robots.pendulum(), logs=1)
    random.seed(2)
    with open(os.path.join(folder, "log.csv"), "wb") as file: file.write(bytes([0xef, 0x62, 0xa3, 0]) + random.randbytes(4000))


@case("one row", lambda run: need(run.code in (0, 1) and "panicked" not in run.text and (run.code == 1 or run.answer["verdict"] == "not_excited"), "an answer"))
def _(folder, robots):
    put(folder, robots.pendulum(), logs=1)
    with open(os.path.join(folder, "log.csv")) as file: lines = file.readlines()[:2]
    with open(os.path.join(folder, "log.csv"), "w") as file: file.writelines(lines)


@case("a header alone", error("log.csv"))
@case("a header alone, evaluate", error("log.csv"), command="evaluate robot.urdf log.csv")
def _(folder, robots):
    put(folder, robots.pendulum(), logs=1)
    with open(os.path.join(folder, "log.csv")) as file: line = file.readline()
    with open(os.path.join(folder, "log.csv"), "w") as file: file.write(line)


@case("an xz file", error("xz"), "log.csv.xz")
def _(folder, robots):
    import lzma
    put(folder, robots.pendulum(), logs=1)
    with open(os.path.join(folder, "log.csv"), "rb") as file: content = file.read()
    with lzma.open(os.path.join(folder, "log.csv.xz"), "wb") as file: file.write(content)


@case("600 MB in one line of gzip", error("line"), "log.csv.gz")
def _(folder, robots):
    put(folder, robots.pendulum(), logs=1)
    with gzip.open(os.path.join(folder, "log.csv.gz"), "wb", 1) as file:
        for _ in range(600): file.write(b"1" * 1_000_000)


@case("a mimic of a joint that is not there", error("nope"), command="diagnose robot.urdf log.csv --out found")
def _(folder, robots):
    urdf, tables = robots.pendulum()
    put(folder, (urdf.replace("</joint>", '<mimic joint="Nope"/></joint>', 1), tables), logs=1)


@case("robot and log exchanged", error("the robot comes first"), command="diagnose log.csv robot.urdf --out found")
@case("a folder under a file as --out", error("afile is a file"), command="diagnose robot.urdf log.csv --out afile/below")
@case("a folder that cannot be as --out", error("/proc/none"), command="diagnose robot.urdf log.csv --out /proc/none")
@case("one column for two joints", says("joint1", "joint2", "same column"), command="inspect log.csv --model robot.urdf --map position.joint1=position.joint2")
@case("stdin by a dash", error("/dev/stdin"), command="diagnose robot.urdf - --out found")
@case("generate for -1 s", error("-1", "seconds"), command="generate double_pendulum --seconds -1 --out made")
@case("generate with a perturbation of -1", error("-1", "perturb"), command="generate double_pendulum --perturb -1 --out made")
@case("generate at 1e9 Hz", error("rate"), command="generate double_pendulum --rate 1e9 --out made")
@case("generate with a jitter of 1 s", error("jitter"), command="generate double_pendulum --clock-jitter 1 --out made")
@case("generate one log", says(never=("1 joints", "1 logs")), command="generate double_pendulum --episodes 1 --seconds 3 --out made")
@case("no word of a unit for a healthy log", says(never=("fault:", "in doubt")), command="inspect log.csv --model robot.urdf")
def _(folder, robots):
    put(folder, robots.pendulum(), logs=1)
    with open(os.path.join(folder, "afile"), "w") as file: file.write("mine")


# Commands beside diagnose have the same checks.
for command in ("evaluate robot.urdf log.csv", "rollout robot.urdf log.csv", "train residual robot.urdf log.csv --out net --epochs 1", "inspect log.csv --model robot.urdf"):
    word = command.split()[0]
    case(f"{word}, time in ms", says("ms"), command=command)(lambda folder, robots: put(folder, robots.pendulum(), scale(time=1e3), logs=1))
    case(f"{word}, effort 0", lambda run: need("panicked" not in run.text and "effort is 0 throughout" in run.text, "not said"), command=command)(lambda folder, robots: put(folder, robots.pendulum(), scale(effort=0), logs=1))
    case(f"{word}, positions in degrees", says("degrees"), command=command)(lambda folder, robots: put(folder, robots.pendulum(), scale(position=DEGREES, velocity=DEGREES), logs=1))

for wrong, words in (("diagnosis.json", ("corrected.json",)), ("broken.json", ("broken.json",))):
    @case(f"--with {wrong}", both(error(*words), lambda run: need(run.text.lower().count("expected value") < 2, "the cause is said twice")), command=f"evaluate robot.urdf log.csv --with {wrong}")
    def _(folder, robots):
        put(folder, robots.pendulum(), logs=1)
        with open(os.path.join(folder, "broken.json"), "w") as file: file.write("{nonsense")
        with open(os.path.join(folder, "diagnosis.json"), "w") as file: json.dump({"schema": "gapscope.diagnosis/1", "robot": {}, "joints": [], "effects": []}, file)


@case("a link's numbers are those of a body", lambda run: need(all(abs(x) < 1e4 for x in numbers(json.load(open(os.path.join(run.folder, "found/corrected.json"))))), "a number beyond all bodies"), "log_0.csv log_1.csv")
def _(folder, robots):
    put(folder, robots.simulated("arm7", [], "--perturb"))


def numbers(value):
    if isinstance(value, dict): return [x for one in value.values() for x in numbers(one)]
    if isinstance(value, list): return [x for one in value for x in numbers(one)]
    return [value] if isinstance(value, float) else []
