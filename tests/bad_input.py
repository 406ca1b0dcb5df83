"""Walks through wrong and odd inputs, one thing wrong at a time, with a built binary, as a new user would.

    python tests/bad_input.py target/release/gapscope [--data ../shared/data] [--only WORDS] [--slack 1]

The list is that of a trial of 315 inputs. What tests of the crates hold already (rules of CSV files and URDFs) is left out.
Each input is held to what it must get: an error with some words, a fault of a kind with its joints and factor, a question,
or no confident answer. None may panic, take over 20 s times the slack, or more memory than 400 MB and twelve times its files.
Confident is an effect at .9 or more, `explained` or `no_gap`; confident without a fault said on a wrong log is silently wrong.
Inputs on real logs are skipped, and said to be, where their folder (--data) is missing. Needs no package.
"""
import argparse, gzip, json, math, os, random, resource, signal, subprocess, sys, tempfile, time

SECONDS, MEMORY, TIMES = 20.0, 400e6, 12.0
DEGREES = 180 / math.pi
CASES = []


# ---- what an input must get ----

class Wrong(Exception):
    pass


def need(condition, text):
    if not condition: raise Wrong(text)


def confident(answer):
    return answer["verdict"] in ("explained", "no_gap") or any(e["confidence"] >= .9 for e in answer["effects"])


def error(*words, code=1):
    """An error that holds these words."""
    def check(run):
        need(run.code == code, f"exit {run.code}, not {code}")
        for word in words: need(word.lower() in run.text.lower(), f"{word!r} is not said")
    return check


def says(*words, never=(), code=0):
    """Success, with these words and without those."""
    def check(run):
        need(run.code == code, f"exit {run.code}, not {code}")
        for word in words: need(word.lower() in run.text.lower(), f"{word!r} is not said")
        for word in never: need(word.lower() not in run.text.lower(), f"{word!r} is said")
    return check


def fault(kind, joints=None, factor=None, within=.02, files=None):
    """This fault and no other, in the first line."""
    def check(run):
        need(run.code == 0, f"exit {run.code}")
        faults = run.answer["data"].get("faults", [])
        told = [(f["kind"], f["joints"], f.get("factor")) for f in faults]
        need(faults and all(f["kind"] == kind for f in faults), f"faults {told}, not {kind}")
        if joints is not None: need(sorted(j for f in faults for j in f["joints"]) == sorted(joints), f"faults {told}, not of {joints}")
        if factor is not None: need(all(abs(f["factor"] / factor - 1) < within for f in faults), f"faults {told}, not of {factor}")
        if files is not None: need(faults[0]["files"] == files, f"of {faults[0]['files']}, not {files}")
        need(run.text.startswith("Fault"), f"the first line is {run.text.splitlines()[0]!r}")
    return check


def humble(run):
    """A fault, a question, or at least nothing confident."""
    need(run.code == 0, f"exit {run.code}")
    need(run.answer["data"].get("faults") or not confident(run.answer), f"SILENT WRONG: {run.answer['verdict']}")


def asked(run):
    """A fault or a question."""
    humble(run)
    need(run.answer["data"].get("faults") or run.answer["data"].get("doubts"), "neither a fault nor a question")


def both(*checks):
    def check(run):
        for one in checks: one(run)
    return check


# ---- inputs ----

class Run:
    def __init__(self, code, text, seconds, memory, folder):
        self.code, self.text, self.seconds, self.memory, self.folder = code, text, seconds, memory, folder

    @property
    def answer(self):
        with open(os.path.join(self.folder, "found/diagnosis.json")) as file: return json.load(file)


def case(name, check, logs="log.csv", command="diagnose robot.urdf {logs} --out found", real=False):
    """Registers what the decorated function makes in a folder: the files of one input."""
    def register(make):
        CASES.append((name, make, command.format(logs=logs), check, real))
        return make
    return register


def read(path):
    opened = gzip.open(path, "rt") if path.endswith(".gz") else open(path)
    with opened as file:
        names = file.readline().strip().split(",")
        return names, [[float(x) for x in line.split(",")] for line in file if line.strip()]


def write(path, names, rows):
    with open(path, "w") as file:
        file.write(",".join(names) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows)


def each(table, change):
    """The table with `change(column, row, value)` in every cell."""
    names, rows = table
    return names, [[change(name, k, x) for name, x in zip(names, row)] for k, row in enumerate(rows)]


def scale(**factors):
    """Channels times factors, as `effort=1e3`, or of one joint, as `effort__joint2=0`."""
    def change(name, _, x):
        return x * factors.get(name.replace(".", "__"), factors.get(name.split(".")[0], 1.0))
    return change


def without(table, channel):
    names, rows = table
    kept = [i for i, name in enumerate(names) if name.split(".")[0] != channel]
    return [names[i] for i in kept], [[row[i] for i in kept] for row in rows]


class Robots:
    """Healthy logs: made or read once."""
    def __init__(self, binary, data, folder):
        self.binary, self.data, self.folder, self.made = binary, data, folder, {}

    def simulated(self, robot, effects, *more):
        key = (robot, more)
        if key not in self.made:
            out = os.path.join(self.folder, f"base_{len(self.made)}")
            with open(os.path.join(self.folder, "effects.json"), "w") as file: json.dump(effects, file)
            line = [self.binary, "generate", robot, "--effects", "effects.json", "--episodes", "2", "--seconds", "10", "--rate", "250", "--seed", "7", "--out", out, *more]
            subprocess.run(line, cwd=self.folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            with open(os.path.join(out, "robot.urdf")) as file: urdf = file.read()
            self.made[key] = urdf, [read(os.path.join(out, f"episode_{i}.csv")) for i in range(2)]
        return self.made[key]

    def arm(self):
        return self.simulated("arm6", [{"kind": "coulomb_friction", "coulomb": {"joint2": 1.3, "joint3": .8}}, {"kind": "viscous_friction", "viscous": {"joint1": .9, "joint2": .6}}])

    def pendulum(self, *more):
        return self.simulated("double_pendulum", [{"kind": "coulomb_friction", "coulomb": {"joint1": .2, "joint2": .12}}, {"kind": "viscous_friction", "viscous": {"joint1": .05}}], *more)

    def real(self, name, log, rows=None):
        key = (name, log)
        if key not in self.made:
            folder = os.path.join(self.data, name)
            with open(os.path.join(folder, "robot.urdf")) as file: urdf = file.read()
            self.made[key] = urdf, [read(os.path.join(folder, log))]
        urdf, [(names, all_rows)] = self.made[key]
        return urdf, [(names, all_rows[:rows] if rows else all_rows)]

    def emps(self, rows=None):
        return self.real("emps", "record_1.csv.gz", rows)


def put(folder, robot, change=None, logs=None):
    """Writes robot.urdf and its logs, log.csv or log_0.csv and on, with a change in every cell."""
    urdf, tables = robot
    with open(os.path.join(folder, "robot.urdf"), "w") as file: file.write(urdf)
    tables = tables[:logs]
    for i, table in enumerate(tables):
        name = "log.csv" if len(tables) == 1 else f"log_{i}.csv"
        write(os.path.join(folder, name), *(each(table, change) if change else table))


def spoilt(name, check, robot, change, bare=False, real=False, logs=None):
    """An input whose cells are changed, and that is diagnosed."""
    @case(name, check, real=real, logs="log.csv" if real or logs == 1 else "log_0.csv log_1.csv")
    def _(folder, robots):
        urdf, tables = robot(robots)
        put(folder, (urdf, [without(t, "velocity") for t in tables] if bare else tables), change, logs)


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
spoilt("arm, effort in N mm", both(fault("effort_scale", ALL6, 1e3), says("n mm", "grams")), ARM, scale(effort=1e3))
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
    import re
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


# ---- running them ----

def limits(seconds, size):
    def set_them():
        # Processor time, so that a busy machine makes nothing wrong.
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
        if size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return set_them


def run(binary, line, folder, slack, size=None, stdout=None):
    """Runs a command in a folder, for twice the processor time that it may take."""
    with open(os.path.join(folder, "said"), "w+") as said:
        process = subprocess.Popen([binary, *line.split()], cwd=folder, stdout=stdout or said, stderr=said, stdin=subprocess.DEVNULL, preexec_fn=limits(2 * SECONDS * slack, size))
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    return Run(process.returncode, text, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, folder)


def interrupted(binary, folder, robots, slack):
    """Ctrl-C half way: gone within a second, and nothing is left behind."""
    put(folder, robots.arm())
    before = set(os.listdir(folder))
    process = subprocess.Popen([binary, "diagnose", "robot.urdf", "log_0.csv", "log_1.csv", "--out", "found"], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(.7)
    process.send_signal(signal.SIGINT)
    start = time.time()
    process.wait(30)
    need(time.time() - start < 1 * slack, f"{time.time() - start:.1f} s after Ctrl-C")
    need(set(os.listdir(folder)) == before, f"left behind: {set(os.listdir(folder)) - before}")


def full_disk(binary, folder, robots, slack):
    """No file may grow over 20 kB: an error, and nothing partial."""
    put(folder, robots.pendulum())
    before = set(os.listdir(folder)) | {"said"}
    ended = run(binary, "diagnose robot.urdf log_0.csv log_1.csv --out found", folder, slack, size=20_000)
    need(ended.code != 0, "exit 0")
    need(set(os.listdir(folder)) <= before, f"left behind: {set(os.listdir(folder)) - before}")


def no_reader(binary, folder, robots, slack):
    """What is printed goes nowhere: that is an error."""
    put(folder, robots.pendulum())
    with open("/dev/full", "w") as full: ended = run(binary, "inspect log_0.csv --model robot.urdf", folder, slack, stdout=full)
    need(ended.code == 1, f"exit {ended.code}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("binary")
    parser.add_argument("--data", default=os.environ.get("GAPSCOPE_DATA", os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../shared/data")))
    parser.add_argument("--only", default="", help="inputs whose name holds this")
    parser.add_argument("--slack", type=float, default=1.0, help="how much longer all may take, on a busy machine")
    args = parser.parse_args()
    binary, wrong, done, skipped = os.path.abspath(args.binary), [], 0, 0
    with tempfile.TemporaryDirectory() as base:
        robots = Robots(binary, args.data, base)
        special = [("Ctrl-C", interrupted), ("a full disk", full_disk), ("a full terminal", no_reader)]
        for i, (name, make, line, check, real) in enumerate(CASES + [(name, None, None, one, False) for name, one in special]):
            if args.only not in name: continue
            if real and not os.path.isdir(args.data):
                skipped += 1
                continue
            folder = os.path.join(base, f"case_{i}")
            os.mkdir(folder)
            ended = None
            try:
                if make is None:
                    check(binary, folder, robots, args.slack)
                else:
                    make(folder, robots)
                    size = sum(os.path.getsize(os.path.join(folder, file)) for file in os.listdir(folder))
                    ended = run(binary, line, folder, args.slack)
                    need("panicked" not in ended.text, "PANIC")
                    need(ended.seconds < SECONDS * args.slack, f"takes {ended.seconds:.0f} s of processor time")
                    need(ended.memory < MEMORY + TIMES * size, f"takes {ended.memory / 1e6:.0f} MB")
                    check(ended)
            except (Wrong, OSError, ValueError, KeyError) as cause:
                wrong.append(name)
                print(f"WRONG  {name}: {cause}")
                if ended: print("       " + "\n       ".join(ended.text.splitlines()[:6]))
            else:
                print(f"right  {name}" + (f"  {ended.seconds:.1f} s, {ended.memory / 1e6:.0f} MB" if ended else ""))
            done += 1
            sys.stdout.flush()
    print(f"{done - len(wrong)} of {done} right" + (f", {skipped} skipped: no folder {args.data}" if skipped else ""))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
