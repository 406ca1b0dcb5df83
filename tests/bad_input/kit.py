"""What an input must get, and what inputs are made of: see walk.py."""
import gzip, json, math, os, random, subprocess

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
