"""A fleet's logs reduced to one diagnosis: by Ray, by processes of Python, or one after the other, with the same bits.

    python python/examples/fleet.py --with ray --episodes 2000          # needs ray
    python python/examples/fleet.py --with processes --episodes 2000
    python python/examples/fleet.py --page docs/fleet.md                # what it costs as episodes grow

On your own fleet an episode is a path: `evidence.add(path)`. Here episode i is simulated where it is needed.
"""

import argparse
import hashlib
import json
import multiprocessing
import os
import pathlib
import resource
import subprocess
import sys
import time

import gapscope

#: What all robots of the fleet have and their URDF lacks.
EFFECTS = [
    {"kind": "coulomb_friction", "coulomb": {"joint1": 0.3, "joint2": 0.2}},
    {"kind": "viscous_friction", "viscous": {"joint1": 0.15, "joint2": 0.1}},
]
ROBOT = gapscope.generate("double_pendulum", episodes=1, seconds=0.1).robot
#: Episodes that one task takes in.
BLOCK = 25


def episode(number):
    """The log of one episode: 5 s at 200 Hz."""
    (log,) = gapscope.generate(ROBOT, EFFECTS, episodes=1, seconds=5.0, rate=200.0, seed=number).logs
    return {"name": f"episode {number}", **log}


def taken(numbers):
    """The evidence of some episodes, as bytes."""
    evidence = gapscope.Evidence(ROBOT)
    for number in numbers:
        evidence.add(episode(number))
    return evidence.to_bytes()


def merged(one, other):
    """Two evidences as one."""
    return gapscope.Evidence.from_bytes(one).merge(gapscope.Evidence.from_bytes(other)).to_bytes()


def by_turns(episodes):
    evidence = gapscope.Evidence(ROBOT)
    for number in range(episodes):
        evidence.add(episode(number))
    return evidence.to_bytes()


def by_processes(episodes):
    blocks = [range(first, min(first + BLOCK, episodes)) for first in range(0, episodes, BLOCK)]
    evidence = gapscope.Evidence(ROBOT)
    with multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool:
        # In whatever order they are done.
        for part in pool.imap_unordered(taken, blocks):
            evidence.merge(gapscope.Evidence.from_bytes(part))
    return evidence.to_bytes()


def by_ray(episodes):
    import ray
    from ray.data.aggregate import AggregateFnV2
    from ray.data.block import BlockAccessor

    class Fleet(AggregateFnV2):
        """Evidence as an aggregation of Ray Data."""

        def __init__(self):
            super().__init__("fleet", zero_factory=lambda: b"", on="id", ignore_nulls=True)

        def aggregate_block(self, block):
            return taken(BlockAccessor.for_block(block).to_arrow()["id"].to_pylist())

        def combine(self, current, new):
            return merged(current, new) if current and new else current or new

    ray.init(include_dashboard=False, log_to_driver=False, configure_logging=False)
    ray.data.DataContext.get_current().enable_progress_bars = False
    logs = ray.data.range(episodes, override_num_blocks=max(1, episodes // BLOCK))
    data = logs.aggregate(Fleet())["fleet"]
    ray.shutdown()
    return data


WAYS = {"turns": by_turns, "processes": by_processes, "ray": by_ray}


def measured(way, episodes):
    """What a way costs; memory is the most that this process ever had, MB."""
    own = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    begun, before = time.perf_counter(), own()
    data = WAYS[way](episodes)
    row = {
        "way": way,
        "episodes": episodes,
        "seconds": time.perf_counter() - begun,
        "before": before,
        "memory": own(),
        "bytes": len(data),
        "digest": hashlib.sha256(data).hexdigest()[:16],
    }
    begun = time.perf_counter()
    diagnosis = gapscope.Evidence.from_bytes(data).finish(progress=False)
    return {**row, "finish": time.perf_counter() - begun, "told": repr(diagnosis).split("\n")[0]}


def apart(way, episodes):
    """The same in a process of its own, as what one way left in memory is no other's."""
    words = [sys.executable, __file__, "--with", way, "--episodes", str(episodes), "--json"]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        return {"way": way, "episodes": episodes, "failed": done.stderr.strip().split("\n")[-1]}
    return json.loads(done.stdout)


def page(sizes):
    rows = [apart("turns", size) for size in sizes]
    rows += [apart(way, sizes[-1]) for way in ("processes", "ray")]
    out = [
        "# A fleet's logs in one diagnosis",
        "",
        f"Made by `python python/examples/fleet.py --page docs/fleet.md --sizes {','.join(map(str, sizes))}`, "
        f"on {os.cpu_count()} processors.",
        "",
        "Each episode is 5 s of a double pendulum at 200 Hz. It is simulated where it is needed, which is part of the time. *Memory* is the",
        "most that the process had while it took episodes in; of Ray and processes it is that of the one that merges.",
        "",
        "| way | episodes | s | ms an episode | memory, MB | evidence, MB | digest of its bytes | `finish`, s |",
        "|---|--:|--:|--:|--:|--:|---|--:|",
    ]
    for row in rows:
        if "failed" in row:
            out.append(f"| {row['way']} | {row['episodes']} | did not run: {row['failed']} | | | | | |")
            continue
        out.append(
            f"| {row['way']} | {row['episodes']} | {row['seconds']:.1f} | {1000 * row['seconds'] / row['episodes']:.1f} "
            f"| {row['memory']:.0f} | {row['bytes'] / 1e6:.1f} | `{row['digest']}` | {row['finish']:.1f} |"
        )
    whole = [row for row in rows if row["episodes"] == sizes[-1] and "failed" not in row]
    same = len({row["digest"] for row in whole}) == 1
    out += [
        "",
        f"The {len(whole)} ways that took in all {sizes[-1]} episodes gave {'the same bits' if same else 'DIFFERENT bits'}. The answer:",
        "",
        f"> {whole[0]['told']}",
        "",
    ]
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--with", dest="way", choices=WAYS, default="turns")
    parser.add_argument("--episodes", type=int, default=2000)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--page", type=pathlib.Path)
    parser.add_argument("--sizes", type=lambda text: [int(size) for size in text.split(",")], default=[125, 250, 500, 1000, 2000])
    arguments = parser.parse_args()
    if arguments.page:
        arguments.page.write_text(page(arguments.sizes), encoding="utf-8")
        return
    row = measured(arguments.way, arguments.episodes)
    print(json.dumps(row) if arguments.json else "\n".join(f"{name:10} {value}" for name, value in row.items()))


if __name__ == "__main__":
    main()
