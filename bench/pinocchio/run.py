#!/usr/bin/env python3
"""Gapscope's dynamics against Pinocchio's on one URDF and the same states, in one run.

    python run.py [--urdf FILE] [--clang clang++] [--rounds 11] [--no-build]

Builds driver.cpp with clang (-O3 -march=native, against the headers of the PyPI package `pin` in this Python) and the
Rust peer (`cargo build --release`, plain target), runs them in turn, and prints the median of each over the rounds, the
ratio, the processor, versions and flags. Without --urdf: the Panda of the PyPI package `example-robot-data`, fingers
locked. Needs `pin`, `numpy`, Eigen's headers (/usr/include/eigen3 or EIGEN=...).
"""

import argparse
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
STATES = 64


def panda():
    prefix = pathlib.Path(pin.__file__).resolve()
    prefix = next(p for p in prefix.parents if p.name == "cmeel.prefix")
    text = (prefix / "share/example-robot-data/robots/panda_description/urdf/panda.urdf").read_text()
    # Fingers locked, and without the mimic that goes with them.
    text = re.sub(r'(<joint name="panda_finger_joint\d" type=")prismatic', r"\1fixed", text)
    return re.sub(r"<mimic[^>]*/>", "", text)


def write_model(model, path):
    lines = [str(model.njoints - 1)]
    for i in range(1, model.njoints):
        placement, inertia = model.jointPlacements[i], model.inertias[i]
        numbers = np.concatenate([
            placement.rotation.ravel(), placement.translation, [inertia.mass], inertia.lever, inertia.inertia.ravel()
        ])
        lines.append(f"{model.joints[i].shortname()} {model.parents[i]} " + " ".join(map(repr, map(float, numbers))))
    path.write_text("\n".join(lines) + "\n")


def write_states(model, path):
    random = np.random.default_rng(7)
    rows = [random.uniform(-3, 3, (3, model.nv)) for _ in range(STATES)]
    lines = [str(STATES)]
    for q, v, a in rows:
        # Torques of the size that a robot has.
        tau = random.uniform(-40, 40, model.nv)
        lines += [" ".join(map(repr, map(float, part))) for part in (q, v, a, tau)]
    path.write_text("\n".join(lines) + "\n")


def measure(command):
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return {name: (float(time), float(total)) for name, time, total in map(str.split, out.splitlines())}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--urdf", type=pathlib.Path)
    arguments.add_argument("--clang", default="clang++")
    arguments.add_argument("--rounds", type=int, default=11)
    arguments.add_argument("--no-build", action="store_true", help="run what an earlier call built")
    arguments = arguments.parse_args()
    xml = arguments.urdf.read_text() if arguments.urdf else panda()
    model = pin.buildModelFromXML(xml)

    prefix = next(p for p in pathlib.Path(pin.__file__).resolve().parents if p.name == "cmeel.prefix")
    eigen = os.environ.get("EIGEN", "/usr/include/eigen3")
    flags = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", "-w"]
    # The definitions with which the package itself is built.
    flags += ["-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30"]
    flags += ["-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DBOOST_FUSION_INVOKE_MAX_ARITY=12"]
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    folder = target / "pinocchio"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(xml)
    write_model(model, folder / "model.txt")
    write_states(model, folder / "states.txt")
    driver = folder / "driver"
    if not arguments.no_build:
        headers = [f"-I{prefix}/include", f"-I{eigen}"]
        subprocess.run([arguments.clang, *flags, *headers, HERE / "driver.cpp", "-o", driver], check=True)
        cargo = ["cargo", "build", "--release", "-q", "-p", "gapscope-bench", "--bin", "peer"]
        subprocess.run(cargo, check=True, cwd=ROOT)
    cpp, rust = [], []
    for _ in range(arguments.rounds):
        cpp.append(measure([driver, folder / "model.txt", folder / "states.txt"]))
        rust.append(measure([target / "release/peer", folder / "robot.urdf", folder / "states.txt"]))

    def version(command):
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[0]

    cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    print(f"processor   {cpu.group(1) if cpu else platform.processor()}")
    print(f"load        {os.getloadavg()[0]:.2f} over the last minute, {os.cpu_count()} cores")
    print(f"pinocchio   {pin.__version__}, {version([arguments.clang, '--version'])}, {' '.join(flags)}")
    print(f"gapscope    {version(['rustc', '--version'])}, release, RUSTFLAGS={os.environ.get('RUSTFLAGS', '')!r}")
    print(f"robot       {model.name}, {model.nv} joints; {STATES} states; median of {arguments.rounds} rounds, ns a call")
    print(f"{'':24}{'gapscope':>10}{'pinocchio':>11}{'ratio':>8}")
    for name in rust[0]:
        ours = statistics.median(run[name][0] for run in rust)
        line = f"{name:24}{ours:10.1f}"
        if name in cpp[0]:
            # The faster of Pinocchio's two conventions, where it has two.
            names = [key for key in cpp[0] if key in (name, name + "_world")]
            theirs = min(statistics.median(run[key][0] for run in cpp) for key in names)
            line += f"{theirs:11.1f}{ours / theirs:8.2f}"
        print(line)
    for name in ("inverse_dynamics", "forward_dynamics"):
        ours, theirs = rust[0][name][1], cpp[0][name][1]
        if abs(ours - theirs) > 1e-9 * max(1.0, abs(theirs)):
            sys.exit(f"{name}: results differ: {ours} and {theirs}")
    print("results agree")


if __name__ == "__main__":
    main()
