"""Walks through wrong and odd inputs, one thing wrong at a time, with a built binary, as a new user would.

    python tests/bad_input/walk.py target/release/gapscope [--data ../shared/data] [--only WORD,WORD] [--slack 1]

The list is that of a trial of 315 inputs. What tests of the crates hold already (rules of CSV files and URDFs) is left out.
Each input is held to what it must get: an error with some words, a fault of a kind with its joints and factor, a question,
or no confident answer. None may panic, take over 20 s times the slack, or more memory than 400 MB and twelve times its files.
Confident is an effect at .9 or more, `explained` or `no_gap`; confident without a fault said on a wrong log is silently wrong.
Inputs on real logs are skipped, and said to be, where their folder (--data) is missing. Needs no package.
"""
import argparse, math, os, resource, signal, subprocess, sys, tempfile, time

import inputs
from kit import CASES, Robots, Run, Wrong, need, put

SECONDS, MEMORY, TIMES = 20.0, 400e6, 12.0


def limits(seconds, size):
    def set_them():
        # Processor time, so that a busy machine makes nothing wrong.
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
        if size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return set_them


def run(binary, line, folder, slack, size=None, stdout=None):
    """Runs a command in a folder, for twice the processor time that it may take. Of a file that grows too large it hears by an
    error, as on a full disk, and by no signal."""
    with open(os.path.join(folder, "said"), "w+") as said:
        process = subprocess.Popen([binary, *line.split()], cwd=folder, stdout=stdout or said, stderr=said, stdin=subprocess.DEVNULL, preexec_fn=limits(2 * SECONDS * slack, size), restore_signals=False)
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
    parser.add_argument("--data", default=os.environ.get("GAPSCOPE_DATA", os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../shared/data")))
    parser.add_argument("--only", default="", help="inputs whose name holds one of these words, parted by commas")
    parser.add_argument("--slack", type=float, default=1.0, help="how much longer all may take, on a busy machine")
    args = parser.parse_args()
    binary, wrong, done, skipped = os.path.abspath(args.binary), [], 0, 0
    with tempfile.TemporaryDirectory() as base:
        robots = Robots(binary, args.data, base)
        special = [("Ctrl-C", interrupted), ("a full disk", full_disk), ("a full terminal", no_reader)]
        for i, (name, make, line, check, real) in enumerate(CASES + [(name, None, None, one, False) for name, one in special]):
            if not any(part in name for part in args.only.split(",")): continue
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
