"""Puts one fault on the logs of each case of a bank, or none: a second view of what `withheld make --faulty` does.

    python tests/withheld/faulty.py BANK... --out FAULTY --seed 1 [--healthy .33]

Each case is copied with one fault drawn at random; its truth goes to FAULTY.sealed. Besides the faults that the crate draws,
angles are wrapped to a turn, efforts are in per cent of the limit, and URDFs are in grams or belong to another robot. Sizes
and joints are drawn independently of the crate. Needs numpy. `judge_faults.py` holds `gapscope inspect` against it.
"""
import argparse, gzip, json, math, pathlib, re
import numpy as np

DEGREES = 180 / math.pi
KINDS = ["time_scale", "time_shift", "repeated_samples", "position_scale", "position_sign", "axis_sign", "position_zero",
         "position_wrapped", "position_is_command", "velocity_scale", "effort_scale", "effort_scale", "effort_sign",
         "effort_missing", "effort_noise", "effort_absolute", "effort_clipped", "joint_order", "gravity", "urdf_grams",
         "other_robot"]


class Log:
    def __init__(self, path):
        with (gzip.open(path, "rt") if path.name.endswith(".gz") else open(path)) as file:
            self.names = file.readline().strip().split(",")
            self.rows = np.loadtxt(file, delimiter=",")

    def column(self, channel, joint):
        name = f"{channel}.{joint}"
        return self.names.index(name) if name in self.names else None

    def change(self, channel, joint, f):
        at = self.column(channel, joint)
        if at is not None: self.rows[:, at] = f(self.rows[:, at])

    def write(self, path):
        np.savetxt(path, self.rows, delimiter=",", header=",".join(self.names), comments="", fmt="%.10g")


def far(rng):
    """A factor outside of 0.67 to 1.5 by a fifth at least."""
    size = math.exp(rng.uniform(.6, 4))
    return size if rng.random() < .5 else 1 / size


def spoil(kind, logs, urdf, joints, rng):
    """The fault that was put on, or None where the logs could not show it, and the URDF."""
    n, one = len(joints), [joints[rng.integers(len(joints))]]
    some = joints if rng.random() < .5 else one
    pick = lambda *of: of[rng.integers(len(of))]
    fault = lambda joints, factor=None, **more: ({"kind": kind, "joints": sorted(joints), "log": None, "factor": factor, **more}, urdf)
    every = lambda channels, joints, f: [log.change(c, j, f) for log in logs for c in channels for j in joints]
    motion = ["position", "velocity", "command"]
    if kind == "time_scale":
        factor = pick(1e3, 1e6, far(rng))
        for log in logs: log.rows[:, 0] *= factor
        return fault([], factor)
    if kind == "time_shift":
        shift = rng.uniform(.04, .25) * pick(1, -1)
        for log in logs:
            by = round(shift / np.median(np.diff(log.rows[:, 0])))
            move = lambda x: x[np.clip(np.arange(len(x)) - by, 0, len(x) - 1)]
            for j in joints: log.change("effort", j, move)
        return fault(joints, shift)
    if kind == "repeated_samples":
        held = int(rng.integers(3, 11))
        every(["position", "velocity"], joints, lambda x: x[np.arange(len(x)) // held * held])
        return fault([], held)
    if kind == "position_scale":
        factor = pick(DEGREES, DEGREES, 200 / math.pi, .5 / math.pi, 2 ** int(rng.integers(12, 21)) / 2 / math.pi, rng.uniform(30, 160))
        every(motion, some, lambda x: x * factor)
        return fault(some, factor)
    if kind in ("position_sign", "axis_sign"):
        if kind == "axis_sign" and n < 3: return None
        every(motion + ["effort"] * (kind == "axis_sign"), one, lambda x: -x)
        return fault(one, -1.0)
    if kind == "position_zero":
        # About a vertical first axis any zero does, and of a last link little shows.
        j = joints[int(rng.integers(1, max(n - 1, 2)))]
        zero = pick(math.pi / 2, -math.pi / 2, math.pi, rng.uniform(.5, 2), -rng.uniform(.5, 2))
        every(["position", "command"], [j], lambda x: x + zero)
        return fault([j], zero)
    if kind == "position_wrapped":
        crosses = [j for j in joints if any(np.min(log.rows[:, log.column("position", j)]) < -.05 and np.max(log.rows[:, log.column("position", j)]) > .05 for log in logs)]
        if not crosses: return None
        every(["position"], crosses, lambda x: np.mod(x, 2 * math.pi))
        return fault(crosses)
    if kind == "position_is_command":
        if logs[0].column("command", joints[0]) is None: return None
        for log in logs:
            for j in joints: log.rows[:, log.column("position", j)] = log.rows[:, log.column("command", j)]
        return fault(joints)
    if kind == "velocity_scale":
        if logs[0].column("velocity", joints[0]) is None: return None
        factor = pick(DEGREES, 30 / math.pi, 100.0, -1.0)
        every(["velocity"], some, lambda x: x * factor)
        return fault(some, factor)
    if kind == "effort_scale":
        limits = dict(re.findall(r'<joint name="([^"]+)".*?effort="([^"]+)"', urdf, re.S))
        limit = float(limits.get(one[0], 0) or 0)
        if rng.random() < .2 and limit > 0:
            every(["effort"], one, lambda x: x * 100 / limit)
            return fault(one, 100 / limit) if abs(math.log(100 / limit)) > .5 else None
        factor = pick(1e3, 141.612, 100.0, 1 / 35, far(rng), far(rng))
        every(["effort"], some, lambda x: x * factor)
        return fault(some, factor)
    if kind == "effort_sign":
        every(["effort"], some, lambda x: -x)
        return fault(some, -1.0)
    if kind == "effort_missing":
        value = pick(0.0, 0.0, rng.uniform(-5, 5))
        every(["effort"], some, lambda x: 0 * x + value)
        return fault(some)
    if kind == "effort_noise":
        every(["effort"], some, lambda x: np.max(np.abs(x)) * rng.normal(size=len(x)))
        return fault(some)
    if kind == "effort_absolute":
        both = [j for j in some if all(min(np.mean(x > .05 * np.max(np.abs(x))), np.mean(x < -.05 * np.max(np.abs(x)))) > .05 for log in logs for x in [log.rows[:, log.column("effort", j)]])]
        if not both: return None
        every(["effort"], both, np.abs)
        return fault(both)
    if kind == "effort_clipped":
        shows = [j for j in some if all(.05 < np.mean(np.abs(x) > .5 * np.max(np.abs(x))) < .95 for log in logs for x in [log.rows[:, log.column("effort", j)]])]
        if not shows: return None
        for log in logs:
            for j in shows: log.change("effort", j, lambda x: np.clip(x, -.5 * np.max(np.abs(x)), .5 * np.max(np.abs(x))))
        return fault(shows)
    if kind == "joint_order":
        if n < 2: return None
        a, b = sorted(rng.choice(n, 2, replace=False)); channels = pick(["effort"], motion + ["effort"])
        for log in logs:
            for c in channels:
                i, k = log.column(c, joints[a]), log.column(c, joints[b])
                if i is not None: log.rows[:, [i, k]] = log.rows[:, [k, i]]
        return fault([joints[a], joints[b]])
    if kind == "gravity":
        base = next(l for l in re.findall(r'<link\s+name="([^"]+)"', urdf) if f'<child link="{l}"' not in urdf)
        rpy = pick(f"{math.pi} 0 0", f"{math.pi / 2} 0 0", f"0 {-math.pi / 2} 0")
        turned = f'<link name="stand_"/><joint name="stand_joint_" type="fixed"><parent link="stand_"/><child link="{base}"/><origin xyz="0 0 0" rpy="{rpy}"/></joint></robot>'
        urdf = urdf.replace("</robot>", turned)
        return ({"kind": kind, "joints": [], "log": None, "factor": None}, urdf)
    if kind == "urdf_grams":
        times = lambda m: f'{m.group(1)}="{float(m.group(2)) * 1e3!r}"'
        urdf = re.sub(r'\b(mass value|ixx|ixy|ixz|iyy|iyz|izz)="([^"]+)"', times, urdf)
        return ({"kind": "effort_scale", "joints": joints, "log": None, "factor": 1e-3}, urdf)
    return None


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    p.add_argument("banks", nargs="+", type=pathlib.Path); p.add_argument("--out", required=True, type=pathlib.Path)
    p.add_argument("--seed", type=int, default=1); p.add_argument("--healthy", type=float, default=1 / 3)
    a = p.parse_args()
    cases = [c for bank in a.banks for c in sorted(bank.glob("case_*"))]
    for i, case in enumerate(cases):
        rng = np.random.default_rng([a.seed, i])
        truth = json.loads((case.parent.with_name(case.parent.name + ".sealed") / case.name / "truth.json").read_text())
        urdf = next(case.glob("robot.urdf"), None) or next(case.glob("*.urdf"))
        urdf = urdf.read_text(); paths = sorted({path.name.removesuffix(".gz"): path for path in case.glob("episode_*")}.values()); logs = [Log(path) for path in paths]
        joints = [name[9:] for name in logs[0].names if name.startswith("position.")]
        fault = None
        while rng.random() >= a.healthy and fault is None:
            kind = KINDS[rng.integers(len(KINDS))]
            if kind == "other_robot":
                others = [(c, u) for c in cases for u in [next(c.glob("*.urdf")).read_text()] if u != urdf]
                names = lambda text: {name: kind for name, kind in re.findall(r'<joint name="([^"]+)" type="([^"]+)"', text)}
                others = [u for c, u in others if [j for j, t in names(u).items() if t != "fixed"] != joints and sum(t != "fixed" for t in names(u).values()) == len(joints)]
                if not others: continue
                text = others[rng.integers(len(others))]
                for old, new in zip([j for j, t in names(text).items() if t != "fixed"], joints): text = text.replace(f'"{old}"', f'"{new}"')
                fault, urdf = {"kind": "other_robot", "joints": [], "log": None, "factor": None}, text
            else:
                drawn = spoil(kind, logs, urdf, joints, rng)
                if drawn: fault, urdf = drawn
            if fault and rng.random() < .3 and fault["kind"] != "velocity_scale":
                for log in logs:
                    keep = [k for k, name in enumerate(log.names) if not name.startswith("velocity.")]
                    log.names, log.rows = [log.names[k] for k in keep], log.rows[:, keep]
        name = f"case_{i:03}"; out, sealed = a.out / name, a.out.with_name(a.out.name + ".sealed") / name
        out.mkdir(parents=True); sealed.mkdir(parents=True)
        (out / "robot.urdf").write_text(urdf)
        for k, log in enumerate(logs): log.write(out / f"episode_{k}.csv")
        (sealed / "truth.json").write_text(json.dumps({"robot": truth["robot"], "kinds": truth["kinds"], "from": str(case), "faulty": True, "fault": fault}))


if __name__ == "__main__":
    main()
