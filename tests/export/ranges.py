"""How often the region of `gapscope export --ranges` holds the truth, on simulated robots.

    python tests/export/ranges.py GAPSCOPE --robots 100

Robots are those of `generate --perturb`, on two logs of noisy sensors. A robot counts as held where the truth of all parameters
of its region lies in it; of an effect that the robot has not, the truth is none. What the logs determine and what they leave
open are counted apart, and widths are those of parameters that they determine.
Needs NumPy. Not in CI: a robot takes some seconds.
"""

import argparse
import json
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
    """Parameters, determined directions, the two distances in radii, log of the mean width, and how many parameters of the truth
    the region lacks; None where there is no region."""
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
    parameters = ranges["parameters"]
    part = lambda name: np.array(ranges[name]).reshape(len(parameters), -1)
    determined, open_ = part("determined"), part("open")
    value = np.array([p["value"] for p in parameters])
    neutral = lambda p: 1.0 if p["parameter"] == "gain" else 0.0
    key = lambda p: (p["kind"], p["parameter"], p.get("joint"), p.get("component"))
    there = np.array([truth.get(key(p), neutral(p)) for p in parameters])
    along = np.linalg.solve(np.hstack([determined, open_]), there - value)
    k = determined.shape[1]
    of_open = np.linalg.norm(along[k:]) / ranges["radius_open"] if k < len(value) else 0.0
    half = np.array([p["range"][1] - p["value"] for p in parameters])
    found = np.array([p.get("answer", 0.0) for p in parameters])
    counts = np.array([p["is_determined"] for p in parameters]) & (found != 0.0) & (half > 0.0)
    widths = np.log(half[counts] / (0.2 * np.abs(found[counts])))
    missed = sum(1 for name in truth if name not in {key(p) for p in parameters})
    return len(value), k, np.linalg.norm(along[:k]) / ranges["radius"], of_open, widths.mean(), missed


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
        n, k, distance, of_open, width, missed = one
        print(f"robot {seed}: {k} of {n} directions determined, at {distance:.3f} radii; the open ones at {of_open:.3f}; "
              f"widths {np.exp(width):.2f} of ± 20 %, {missed} not in it", flush=True)  # fmt: skip
    n, k, distance, of_open, width, _ = (np.array(column) for column in zip(*told))
    print(f"\n{len(told)} robots, {n.mean():.0f} parameters each, {k.mean():.0f} directions determined")
    print(f"the region holds the truth of {np.mean((distance <= 1) & (of_open <= 1)):.2f} of them: what is determined of {np.mean(distance <= 1):.2f} "
          f"(90 % lie within {np.quantile(distance, 0.9):.2f} radii), what is open of {np.mean(of_open <= 1):.2f}")  # fmt: skip
    print(f"geometric mean of half-widths over those of ± 20 %, of parameters that are determined: {np.exp(np.mean(width)):.2f}")


if __name__ == "__main__":
    main()
