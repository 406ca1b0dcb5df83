#!/usr/bin/env python3
"""A training step of a tanh network with Adam: gapscope against JAX (jit) and PyTorch, in one run, on one thread.

    python run.py [--sizes 21,128,128,14] [--batch 64] [--precision f32] [--rounds 7] [--no-build]

Needs the PyPI packages `jax`, `torch`, `numpy`. Runs the peers in turn, each in a process of its own pinned to one core,
and prints the median over the rounds of each one's median time, the ratios, processor and versions. The same data and
loss everywhere: mean over the rows of the squared error. PyTorch is timed with its default Adam and with the fused one;
the faster counts.
"""

import argparse
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "RAYON_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
    "CUDA_VISIBLE_DEVICES": "",
}


def data(sizes, batch, precision):
    import numpy as np

    kind = {"f32": np.float32, "f64": np.float64}[precision]
    x = np.sin(1.7 * np.arange(batch * sizes[0])).astype(kind).reshape(batch, sizes[0])
    t = np.sin(0.9 * np.arange(batch * sizes[-1])).astype(kind).reshape(batch, sizes[-1])
    random = np.random.default_rng(1)
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        bound = (6.0 / (inputs + outputs)) ** 0.5
        layers.append((random.uniform(-bound, bound, (outputs, inputs)).astype(kind), np.zeros(outputs, kind)))
    return x, t, layers


def median_us(call, repeats=21, rounds=200):
    import time

    for _ in range(rounds):
        call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(rounds):
            call()
        times.append((time.perf_counter() - start) / rounds * 1e6)
    return statistics.median(times)


def run_jax(sizes, batch, precision):
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", precision == "f64")
    x, t, layers = data(sizes, batch, precision)
    x, t = jnp.asarray(x), jnp.asarray(t)
    parameters = [(jnp.asarray(w.T), jnp.asarray(b)) for w, b in layers]

    def loss(parameters, x, t):
        for w, b in parameters[:-1]:
            x = jnp.tanh(x @ w + b)
        w, b = parameters[-1]
        return jnp.mean(jnp.sum((x @ w + b - t) ** 2, axis=1))

    def step(state, x, t):
        parameters, mean, square, count = state
        value, gradient = jax.value_and_grad(loss)(parameters, x, t)
        count = count + 1
        mean = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, mean, gradient)
        square = jax.tree.map(lambda s, g: 0.999 * s + 0.001 * g * g, square, gradient)
        rate = 1e-3 / (1 - 0.9**count)
        scale = 1 / jnp.sqrt(1 - 0.999**count)
        update = lambda p, m, s: p - rate * m / (jnp.sqrt(s) * scale + 1e-8)
        return (jax.tree.map(update, parameters, mean, square), mean, square, count), value

    step = jax.jit(step, donate_argnums=0)
    zeros = lambda: jax.tree.map(jnp.zeros_like, parameters)
    state = (parameters, zeros(), zeros(), jnp.asarray(0.0, x.dtype))

    def call():
        nonlocal state
        state, value = step(state, x, t)
        value.block_until_ready()

    print(f"step {median_us(call)} jax {jax.__version__}")


def run_torch(sizes, batch, precision):
    import torch

    torch.set_num_threads(1)
    torch.set_default_dtype({"f32": torch.float32, "f64": torch.float64}[precision])
    x, t, layers = data(sizes, batch, precision)
    x, t = torch.from_numpy(x), torch.from_numpy(t)
    times = []
    for fused in (False, True):
        modules = []
        for w, b in layers:
            linear = torch.nn.Linear(w.shape[1], w.shape[0])
            with torch.no_grad():
                linear.weight.copy_(torch.from_numpy(w))
                linear.bias.copy_(torch.from_numpy(b))
            modules += [linear, torch.nn.Tanh()]
        network = torch.nn.Sequential(*modules[:-1])
        adam = torch.optim.Adam(network.parameters(), lr=1e-3, fused=fused)

        def call():
            adam.zero_grad()
            loss = ((network(x) - t) ** 2).sum(1).mean()
            loss.backward()
            adam.step()

        times.append(median_us(call))
    print(f"step {min(times)} torch {torch.__version__} (default Adam {times[0]:.0f}, fused {times[1]:.0f})")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--sizes", default="21,128,128,14")
    arguments.add_argument("--batch", type=int, default=64)
    arguments.add_argument("--precision", choices=["f32", "f64"], default="f32")
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--no-build", action="store_true", help="run what an earlier call built")
    arguments.add_argument("--peer", choices=["jax", "torch"], help=argparse.SUPPRESS)
    arguments = arguments.parse_args()
    if arguments.peer:
        sizes = [int(s) for s in arguments.sizes.split(",")]
        return {"jax": run_jax, "torch": run_torch}[arguments.peer](sizes, arguments.batch, arguments.precision)

    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    if not arguments.no_build:
        cargo = ["cargo", "build", "--release", "-q", "-p", "gapscope-bench", "--bin", "train_step"]
        subprocess.run(cargo, check=True, cwd=ROOT)
    settings = [arguments.sizes, str(arguments.batch), arguments.precision]
    flags = ["--sizes", settings[0], "--batch", settings[1], "--precision", settings[2]]
    commands = {
        "gapscope": [target / "release/train_step", *settings],
        "JAX jit": [sys.executable, __file__, "--peer", "jax", *flags],
        "PyTorch": [sys.executable, __file__, "--peer", "torch", *flags],
    }
    environment = {**os.environ, **ONE_THREAD}
    core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
    pin = (lambda: os.sched_setaffinity(0, {core})) if core is not None else None
    times, notes = {name: [] for name in commands}, {}
    for _ in range(arguments.rounds):
        for name, command in commands.items():
            out = subprocess.run(command, check=True, capture_output=True, text=True, env=environment, preexec_fn=pin)
            first = out.stdout.splitlines()[0].split(maxsplit=2)
            times[name].append(float(first[1]))
            notes[name] = first[2]
    rust = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout.strip()
    notes["gapscope"] = f"{rust}, release, RUSTFLAGS={os.environ.get('RUSTFLAGS', '')!r}"
    cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    print(f"processor   {cpu.group(1) if cpu else platform.processor()}")
    print(f"load        {os.getloadavg()[0]:.2f} over the last minute, {os.cpu_count()} cores")
    print(f"network     {arguments.sizes}, tanh, {arguments.precision}, batch {arguments.batch}; Adam; one thread")
    print(f"            median of {arguments.rounds} rounds, µs a step")
    ours = statistics.median(times["gapscope"])
    for name, values in times.items():
        theirs = statistics.median(values)
        print(f"{name:10} {theirs:8.1f}   ours / theirs {ours / theirs:5.2f}   {notes[name]}")


if __name__ == "__main__":
    main()
