"""Does MuJoCo shrink the gap by as much as was promised? Kind by kind, on simulated logs.

    python tests/export/prove.py GAPSCOPE [KIND ...] [--used 20] [--page docs/export.md]

For each kind of effect: `gapscope generate` makes logs of the six-joint arm with it, `evaluate` says what the corrected model
promises on them, `export` writes the MJCF and predicts what is lost; MuJoCo then runs along the logs (mujoco_gap.py). The URDF
goes into MuJoCo, too, and where they are installed into PyBullet and Drake (urdf_gap.py). `--used`
does the same on arms that are off in most things at once. The
corrected model is the truth: what is measured is the way into the target, not the diagnosis. Exits with 1 where a simulator's
shrink is further than TOLERANCE from the one promised less the loss predicted; Drake does not count, as it reads no friction.
Needs PyPI `mujoco==4.0.0 numpy`; `pybullet==3.2.7 drake==1.51.1` as well for the whole page.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import cases
import mujoco_gap
import urdf_gap

# How far shrinks may lie apart: issue 27's bound.
TOLERANCE = 0.02
ROBOT = "arm6"
# Logs of a case, and the length of each, s.
LOGS, SECONDS = 2, 10
# Length of free runs, s, one of the horizons of `evaluate`, and the time from the start of one to the next, s.
HORIZON, EVERY = 0.25, 0.25
# What a used arm is off by in any case.
CALIBRATION = {"viscous_friction", "coulomb_friction", "torque_bias", "link_inertia_error", "armature"}


def gapscope(binary, *words):
    """Standard output of a command."""
    done = subprocess.run([binary, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr}")
    return done.stdout


def corrected(effects, logs, joints):
    """A corrected.json that knows the truth; weights and standstill as a diagnosis would set them."""
    efforts, speeds = [], []
    for log in logs:
        time, position, effort = mujoco_gap.read(log, joints)
        efforts.append(effort)
        speeds.append(np.gradient(position, time, axis=0))
    by_joint = lambda values: dict(zip(joints, map(float, values)))
    return {
        "schema": "gapscope.model/1",
        "robot": ROBOT,
        "weights": by_joint(1.0 / np.concatenate(efforts).std(axis=0)),
        "standstill": by_joint(0.03 * np.sqrt((np.concatenate(speeds) ** 2).mean(axis=0))),
        "band": mujoco_gap.CUTOFF,
        "encoder_side": "link",
        "alignment": 0.0,
        "effects": effects,
    }


def figure(x):
    """Three digits, or that it is not known."""
    return "unknown" if x is None else f"{x:.3f}".replace("-0.000", "0.000")


def of_kind(binary, kind, folder):
    """Logs of the robot with one kind of effect: URDF, logs, effects."""
    effects = folder / "effects.json"
    effects.write_text(json.dumps(cases.effects(kind)))
    logs = folder / "logs"
    gapscope(binary, "generate", ROBOT, "--effects", effects, "--episodes", LOGS, "--seconds", SECONDS, "--out", logs)
    return logs / "robot.urdf", sorted(logs.glob("episode_*.csv")), cases.effects(kind)


def prove(binary, robot, logs, effects, folder):
    """What was promised, predicted and found; the ledger's entries of MJCF and URDF."""
    joints = cases.JOINTS
    model = corrected(effects, logs, joints)
    (folder / "corrected.json").write_text(json.dumps(model))
    rows = folder / "rows.csv"
    words = ["--with", folder / "corrected.json", "--json", "--predictions", rows]
    shrink = json.loads(gapscope(binary, "evaluate", robot, *logs, *words))["shrink"]
    torque, rollout = shrink["torque"], next(row for row in shrink["rollout"] if row["horizon"] == HORIZON)
    gapscope(binary, "export", folder, "--robot", robot, "--to", "mjcf,urdf", "--logs", *logs, "--out", folder / "out")
    mjcf, urdf = json.loads((folder / "out" / "ledger.json").read_text())["targets"]
    with open(rows) as file:
        times = {}
        for row in csv.DictReader(file):
            times.setdefault(pathlib.Path(row["log"]).name, []).append(float(row["time"]))
    standstill = np.array([model["standstill"][joint] for joint in joints])
    weights = np.array([model["weights"][joint] for joint in joints])
    xml = str(folder / "out" / "robot.xml")
    def shrink_in(target):
        gaps = [mujoco_gap.gap(target(), log, standstill, times[log.name]) for log in logs]
        return 1.0 - mujoco_gap.weighted(np.concatenate(gaps), weights) / torque["before"]

    exported = str(folder / "out" / "robot.urdf")
    urdf_in = {
        name: shrink_in(lambda simulator=simulator: urdf_gap.Urdf(simulator(exported, joints), joints))
        for name, simulator in urdf_gap.simulators().items()
    }
    runs = np.concatenate([mujoco_gap.free_runs(xml, log, joints, HORIZON, EVERY) for log in logs])
    found, here = shrink_in(lambda: mujoco_gap.Target(xml, joints)), mjcf["shrink_here"]
    return {
        "promised": torque["shrink"],
        "predicted": here,
        "mujoco": found,
        "off": None if here is None else found - here,
        "urdf": urdf["shrink_here"],
        "urdf_in": urdf_in,
        "position": [rollout["before"], rollout["after"], float(np.sqrt((runs**2).mean()))],
        "entries": [mjcf["effects"], urdf["effects"]],
    }


def prove_kind(binary, kind, folder):
    """A row of the table of kinds."""
    row = prove(binary, *of_kind(binary, kind, folder), folder)
    mjcf, urdf = (next(entry for entry in entries if entry["kind"] == kind) for entries in row["entries"])
    return {**row, "kind": kind, "how": mjcf["how"], "as": mjcf["as"], "urdf_how": urdf["how"]}


def prove_used(binary, count, folder):
    """Rows of used arms: every link and every joint's friction off, a rotor in each joint, and one further kind in turn."""
    further = [kind for kind in cases.CASES if kind not in CALIBRATION]
    for number in range(count):
        kind = further[number % len(further)]
        into = folder / f"arm_{number}"
        into.mkdir()
        wanted = cases.effects(kind)
        if not any(effect["kind"] == "armature" for effect in wanted):
            wanted += cases.effects("armature")
        (into / "effects.json").write_text(json.dumps(wanted))
        words = ["--perturb", "--seed", number, "--effects", into / "effects.json", "--episodes", LOGS, "--seconds", SECONDS]
        gapscope(binary, "generate", ROBOT, *words, "--out", into / "logs")
        effects = json.loads((into / "logs" / "truth.json").read_text())["effects"]
        logs = sorted((into / "logs").glob("episode_*.csv"))
        row = prove(binary, into / "logs" / "robot.urdf", logs, effects, into)
        yield {**row, "kind": f"arm {number}", "how": kind}


def told(row):
    """A row on the terminal."""
    return (
        f"{row['kind']:25} {row['how']:12} promised {figure(row['promised'])} predicted {figure(row['predicted'])} "
        f"mujoco {row['mujoco']:.3f} off {figure(row['off'])}   urdf {figure(row['urdf'])} "
        f"{' '.join(f'{name} {x:.3f}' for name, x in row['urdf_in'].items())}   "
        f"position {' '.join(f'{x:.1e}' for x in row['position'])}"
    )


def cells(row):
    """What a URDF shrinks the gap by: as predicted, and in each simulator."""
    return " | ".join([figure(row["urdf"]), *map(figure, row["urdf_in"].values())])


def is_off(row):
    """Whether a simulator is further from the prediction than it may be."""
    read = [x for name, x in row["urdf_in"].items() if name != "Drake"]
    of_urdf = [] if row["urdf"] is None else [x - row["urdf"] for x in read]
    return any(abs(off) > TOLERANCE for off in [row["off"] or 0.0, *of_urdf])


def page(rows, used, command):
    """The table as a page of the documents."""
    words = {"written": "written", "approximated": "approximated", "left_out": "left out"}
    known = [row for row in rows if row["off"] is not None]
    near = sum(abs(row["off"]) <= TOLERANCE for row in known)
    lost = sum(row["promised"] - row["mujoco"] <= TOLERANCE for row in rows)
    names = list(rows[0]["urdf_in"]) if rows else []
    within = lambda name: sum(abs(row["urdf_in"][name] - row["urdf"]) <= TOLERANCE for row in rows)
    of_urdf = ", ".join(f"{name} on {within(name)}" for name in names)
    head, line = (" | ".join(cells) for cells in (["predicted", *names], ["---"] * (1 + len(names))))
    lines = [
        "# The corrected model in MuJoCo, PyBullet and Drake",
        "",
        f"Made by `{command}` (mujoco {mujoco_gap.mujoco.__version__}; URDF in {', '.join(names)}).",
        "",
        f"Each kind of effect once on the {ROBOT}, {LOGS} logs of {SECONDS} s. The corrected model is the truth, so that the",
        "table measures the way into the target and not the diagnosis. *Promised* is the shrink of the torque gap that",
        "`evaluate` finds. *Predicted* is that of our own plant with what the target holds, from `ledger.json`. *MuJoCo* is",
        "measured in MuJoCo: its inverse dynamics along the logs, against what its actuators deliver under the logged effort.",
        f"A joint with play counts from {mujoco_gap.LEAD:g} s on: where in its play a motor begins, no log says.",
        "",
        f"MuJoCo is within {TOLERANCE} of the prediction on {near} of {len(known)} kinds that have one, and loses at most {TOLERANCE} of what",
        f"was promised on {lost} of {len(rows)}. `external_contact` is not carried over.",
        "",
        "| effect | MJCF | as | promised | predicted | MuJoCo |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        mark = "" if row["off"] is None or abs(row["off"]) <= TOLERANCE else " (off)"
        what = row["as"].replace("<", "`<").replace(">", ">`")
        lines.append(
            f"| `{row['kind']}` | {words[row['how']]} | {what} | {row['promised']:.3f} | {figure(row['predicted'])} "
            f"| {row['mujoco']:.3f}{mark} |"
        )
    lines += [
        "",
        "The same effects in a URDF, which has no word for most of what a drive does. Each simulator loads the file, and its own",
        "inverse dynamics, damping, friction and limits count.",
        f"Within {TOLERANCE} of the prediction, of {len(rows)} kinds: {of_urdf}. Drake reads no `friction`, and no effort limit",
        "of a joint without a transmission.",
        "",
        f"| effect | URDF | promised | {head} |",
        f"|---|---|---|{line.replace(' ', '')}|",
    ]
    for row in rows:
        lines.append(f"| `{row['kind']}` | {words[row['urdf_how']]} | {row['promised']:.3f} | {cells(row)} |")
    lines += [
        "",
        f"The same models running free: rms error of position over all joints after {HORIZON} s under the logged effort alone, rad.",
        "MuJoCo's state begins as the log's, after a second in which it was led along the log.",
        "",
        "| effect | nominal | corrected, our plant | MuJoCo | of the nominal error removed |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        before, after, here = row["position"]
        lines.append(f"| `{row['kind']}` | {before:.2e} | {after:.2e} | {here:.2e} | {1 - here / before:.3f} |")
    known = [row for row in used if row["off"] is not None]
    if used:
        near = sum(abs(row["off"]) <= TOLERANCE for row in known)
        lines += [
            "",
            "## Used arms",
            "",
            f"{len(used)} arms of `generate --perturb`: every link and every joint's friction is off, each joint has a rotor, and one",
            f"further kind is beside that. {len(known)} have a prediction, and MuJoCo is within {TOLERANCE} of it on {near} of them.",
            "The last columns are of the URDF.",
            "",
            f"| arm | further effect | promised | predicted | MuJoCo | {head} |",
            f"|---|---|---|---|---|{line.replace(' ', '')}|",
        ]
        for row in used:
            mark = "" if row["off"] is None or abs(row["off"]) <= TOLERANCE else " (off)"
            lines.append(
                f"| {row['kind']} | `{row['how']}` | {figure(row['promised'])} | {figure(row['predicted'])} "
                f"| {row['mujoco']:.3f}{mark} | {cells(row)} |"
            )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gapscope")
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--page", help="Markdown page to write")
    parser.add_argument("--used", type=int, default=0, help="number of used arms")
    parser.add_argument("--keep", help="folder for logs and files, which otherwise vanish")
    args = parser.parse_args()
    rows, used = [], []
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(args.keep or temporary)
        for kind in args.kinds or ([] if args.used and not args.page else cases.CASES):
            (root / kind).mkdir(parents=True, exist_ok=True)
            rows.append(prove_kind(args.gapscope, kind, root / kind))
            print(told(rows[-1]), flush=True)
        for row in prove_used(args.gapscope, args.used, root) if args.used else []:
            used.append(row)
            print(told(row), flush=True)
    if args.page:
        command = "python tests/export/prove.py GAPSCOPE" + (f" --used {args.used}" if args.used else "")
        pathlib.Path(args.page).write_text(page(rows, used, f"{command} --page docs/export.md"))
    sys.exit(any(map(is_off, rows + used)))


if __name__ == "__main__":
    main()
