"""Holds what `gapscope inspect` says of a faulty bank's logs against the sealed faults.

    python tests/withheld/judge_faults.py target/release/gapscope BANK... [--beside 2]

Faults are found before any effect is looked for, so that this takes a second a case and no diagnosis. BANK is made by
`gapscope withheld make --faulty` or by `faulty.py`. Named: nothing but the fault is said, with its joints and its log,
or it is said to look the same as the one that is (a twin). Sized: within 2 %, 5 ms or .02 rad. Silent: neither a fault nor a
question. Needs no package.
"""
import argparse, collections, json, math, pathlib, subprocess
from concurrent.futures import ThreadPoolExecutor


def inspected(binary, case):
    line = [binary, "inspect", *map(str, sorted(case.glob("episode_*"))), "--model", str(case / "robot.urdf"), "--json"]
    done = subprocess.run(line, capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else {"faults": [], "doubts": [], "error": done.stderr}


def near(kind, said, true):
    if kind == "time_shift": return abs(said - true) < .005
    if kind == "position_zero": return abs(math.remainder(said - true, 2 * math.pi)) < .02
    return abs(said / true - 1) < .02


def judged(sealed, said):
    """What an answer comes to: one word."""
    faults, kind = said["faults"], sealed["kind"]
    same = lambda fault: fault["kind"] == kind or (fault["kind"], kind) == ("velocity_sign", "velocity_scale")
    joints = {joint for fault in faults for joint in fault["joints"]}
    files = [] if sealed["log"] is None else [f"episode_{sealed['log']}.csv"]
    of_log = lambda fault: not files or fault["files"] == files
    if "error" in said: return "error"
    if not faults: return "asked" if said["doubts"] else "silent"
    twins = [(twin["kind"], set(twin["joints"])) for fault in faults for twin in fault.get("indistinguishable_from", [])]
    if len(faults) == 1 and (kind, set(sealed["joints"])) in twins and all(map(of_log, faults)): return "named, as a twin"
    if not all(map(same, faults)): return "other"
    if joints != set(sealed["joints"]) or not all(map(of_log, faults)): return "part"
    sizes = [fault["factor"] for fault in faults if fault.get("factor") is not None and sealed["factor"] is not None]
    return "named" if all(near(kind, size, sealed["factor"]) for size in sizes) else "named, size off"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("binary"); parser.add_argument("banks", nargs="+", type=pathlib.Path)
    parser.add_argument("--beside", type=int, default=1, help="cases at a time")
    args = parser.parse_args()
    cases = [case for bank in args.banks for case in sorted(bank.glob("case_*"))]
    counts, healthy, kinds = collections.Counter(), collections.Counter(), {}
    with ThreadPoolExecutor(args.beside) as pool: answers = list(pool.map(lambda case: inspected(args.binary, case), cases))
    for case, said in zip(cases, answers):
        sealed = json.loads((case.parent.with_name(case.parent.name + ".sealed") / case.name / "truth.json").read_text()).get("fault")
        told = "; ".join([f"{f['kind']} of {', '.join(f['joints'])} {f.get('factor', '')} {' '.join(f['files'])}" for f in said["faults"]] + [doubt["question"][:160] for doubt in said["doubts"]])
        if sealed is None:
            healthy["all"] += 1; healthy["a fault"] += bool(said["faults"]); healthy["mended"] += any(f["mended"] for f in said["faults"]); healthy["a question"] += bool(said["doubts"])
            if told: print(f"{case}: HEALTHY: {told}")
            continue
        word = judged(sealed, said); counts[word] += 1
        of_kind = kinds.setdefault(sealed["kind"], [0, 0]); of_kind[0] += word.startswith("named"); of_kind[1] += 1
        if word != "named": print(f"{case}: {word}: {sealed['kind']} of {', '.join(sealed['joints'])} {sealed['factor']} log {sealed['log']}: said {told}")
    total, twins = sum(counts.values()), counts["named, as a twin"]
    own = counts["named"] + counts["named, size off"]; named = own + twins
    print(f"{total} faulty: named {named} ({named / max(total, 1):.2f}), {twins} as a twin, of the others sized {counts['named']} ({counts['named'] / max(own, 1):.2f}); " + ", ".join(f"{word} {counts[word]}" for word in ("part", "other", "asked", "silent", "error")))
    print(f"{healthy['all']} healthy: a fault {healthy['a fault']}, mended {healthy['mended']}, a question {healthy['a question']}")
    print(", ".join(f"{kind} {a}/{b}" for kind, (a, b) in sorted(kinds.items())))


if __name__ == "__main__":
    main()
