"""How often the region of `gapscope export --ranges` holds the truth, on simulated robots.

    python tests/export/ranges.py GAPSCOPE --robots 100

Robots are those of `generate --perturb`, on two logs of noisy sensors. A robot counts as held
where the truth of all parameters of its region lies in it; of an effect that the robot has not, the truth is none.
Needs NumPy. Not in CI: a robot takes some seconds.
"""

import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import numpy as np

RATE = 200  # Hz
SENSORS = ["--encoder-step", "2e-5", "--effort-noise", "0.01", "--position-noise", "5e-6"]


def numbers(effects):
    """(kind, parameter, joint, component) -> value of a list of effects."""
    out = {}
    for effect in effects:
        of_link = effect.get("joint")
        for name, told in effect.items():
            if name in ("kind", "joint", "joints", "link"):
                continue
            for joint, value in told.items() if isinstance(told, dict) else [(of_link, told)]:
                for i, x in enumerate(value) if isinstance(value, list) else [(None, value)]:
                    out[effect["kind"], name, joint, i] = x
    return out


def robot(gapscope, model, seed, seconds, folder):
    """Parameters, distance in radii, and the two mean widths of one robot; None where it has no region."""
    run = lambda *words: subprocess.run([gapscope, *map(str, words)], check=True, capture_output=True, text=True).stdout
    logs = folder / "logs"
    run("generate", model, "--perturb", "--seed", seed, "--episodes", 2, "--seconds", seconds, "--rate", RATE, *SENSORS, "--out", logs)
    files = sorted(logs.glob("episode_*.csv"))
    run("diagnose", logs / "robot.urdf", *files, "--out", folder / "out")
    try:
        run("export", folder / "out", "--robot", logs / "robot.urdf", "--ranges", "--out", folder / "ranges")
    except subprocess.CalledProcessError:
        return None
    ranges = json.loads((folder / "ranges" / "ranges.json").read_text())
    truth = numbers(json.loads((logs / "truth.json").read_text())["effects"])
    parameters, factor = ranges["parameters"], np.array(ranges["factor"])
    value = np.array([p["value"] for p in parameters])
    error = np.array([p["error"] for p in parameters])
    neutral = lambda p: 1.0 if p["parameter"] == "gain" else 0.0
    key = lambda p: (p["kind"], p["parameter"], p.get("joint"), p.get("component"))
    there = np.array([truth.get(key(p), neutral(p)) for p in parameters])
    distance = np.linalg.norm(np.linalg.solve(factor, there - value)) / ranges["radius"]
    sized = np.abs(value) > 0
    part = lambda half: np.log(half[sized] / (0.2 * np.abs(value[sized]))).mean()
    n = len(value)
    # The box of the region's volume, as half-widths.
    ball = 0.5 * n * math.log(math.pi) - math.lgamma(0.5 * n + 1) - n * math.log(2)
    log_volume = ball + n * math.log(ranges["radius"]) + np.linalg.slogdet(factor)[1]
    same = log_volume / n - np.log(0.2 * np.abs(value[sized])).mean()
    missed = sum(1 for k in truth if k not in {key(p) for p in parameters})
    return n, distance, part(ranges["radius"] * error), same, missed


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("gapscope")
    parse.add_argument("--robots", type=int, default=100)
    parse.add_argument("--first", type=int, default=0, help="seed of the first robot")
    parse.add_argument("--model", default="double_pendulum", help="name of a built-in robot, or a URDF")
    parse.add_argument("--seconds", type=float, default=8.0, help="length of each of two logs, s")
    args = parse.parse_args()
    told = []
    for seed in range(args.first, args.first + args.robots):
        with tempfile.TemporaryDirectory() as folder:
            one = robot(args.gapscope, args.model, seed, args.seconds, pathlib.Path(folder))
        if one is None:
            print(f"robot {seed}: no region", flush=True)
            continue
        told.append(one)
        n, distance, box, volume, missed = one
        print(f"robot {seed}: {n} parameters, at {distance:.3f} radii, {missed} not named", flush=True)
    distance = np.array([one[1] for one in told])
    print(f"\n{len(told)} robots, {np.mean([one[0] for one in told]):.0f} parameters each")
    print(f"the region holds the truth of {np.mean(distance <= 1):.2f} of them; 90 % lie within {np.quantile(distance, 0.9):.2f} radii")
    print(f"geometric mean of half-widths over those of ± 20 %: {np.exp(np.mean([one[2] for one in told])):.2f} (box about the region), "
          f"{np.exp(np.mean([one[3] for one in told])):.3f} (box of its volume)")  # fmt: skip


if __name__ == "__main__":
    main()
