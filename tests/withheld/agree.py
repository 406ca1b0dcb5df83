"""Holds `gapscope withheld score` to a reference scorer written apart from it, figure by figure.

    python tests/withheld/agree.py target/release/gapscope [--bank ../shared/bank/sample] [--golden withheld/golden/judgements.json]

The folder above the bank holds the reference, score.py (needs numpy). Both score the binary on the bank, then a few
diagnosers that play back its answers scrambled: effects dropped, doubled, put in, put in another order, ties declared,
confidences on the edges of the bins, intervals and figures left out, no answer at all. Every case and every total must be
the same, to the last digit. --golden stores what was judged, and how, for the unit test of the same name.
"""
import argparse, contextlib, io, json, os, random, runpy, subprocess, sys, tempfile

SEEDS = (18, 9, 14)    # of forty, those whose answers meet most branches of the judging
PARROT = """#!{python}
import json, os, sys
command, robot = sys.argv[1], sys.argv[2]
played = json.load(open({answers!r}))[os.path.basename(os.path.dirname(robot))]
if command == "diagnose":
    if played["diag"] is None: sys.exit("no answer")
    out = sys.argv[sys.argv.index("--out") + 1]
    os.makedirs(out, exist_ok=True)
    json.dump(played["diag"], open(out + "/diagnosis.json", "w"))
elif played["eval"] is None: sys.exit(1)
else: print(json.dumps(played["eval"]))
"""


def reference(score, bank, exe):
    """The reference's results, truths, judgements and totals."""
    argv, sys.argv = sys.argv, [score, bank, exe, "--jobs", "2"]
    try:
        with contextlib.redirect_stdout(io.StringIO()): scope = runpy.run_path(score, run_name="__main__")
    finally: sys.argv = argv
    truths = [json.load(open(scope["sealed"](case) + "/truth.json")) for case in scope["cases"]]
    return {"cases": [os.path.basename(case) for case in scope["cases"]], "results": scope["res"], "truths": truths, "groups": [scope["group"](t) for t in truths],
            "judgements": [scope["judge"](t, r) for t, r in zip(truths, scope["res"])], "totals": json.loads(json.dumps(scope["tot"]).replace("NaN", "null"))}


def ours(gapscope, bank, exe):
    run = subprocess.run([gapscope, "withheld", "score", bank, "--exe", exe, "--jobs", "2", "--json"], capture_output=True, text=True)
    if run.returncode: sys.exit(run.stderr)
    return json.loads(run.stdout)


def figures(judgement):
    """A judgement of the reference under the names, and with the blanks, of ours."""
    j = judgement
    rows = [{"kind": k, "name": n, "error": e, "covered": c} for k, n, e, c in j.get("params", [])]
    return {"verdict": j.get("verdict"), "got": j.get("got", []), "exact": j["exact"], "class_exact": bool(j["class_exact"]), "top1": j["top1"], "f1": j.get("f1"),
            "joint_f1": j.get("joint_f1"), "conf": [list(c) for c in j["conf"]], "params": sorted(rows, key=str), "shrink": j.get("shrink"), "shrink_err": j.get("shrink_err")}


def compare(name, theirs, mine):
    wrong = []
    for case, group, judgement, own in zip(theirs["cases"], theirs["groups"], theirs["judgements"], mine["cases"], strict=True):
        own["params"] = sorted(own["params"], key=str)
        for key, value in ({"case": case, "group": group} | figures(judgement)).items():
            if own[key] != value: wrong.append(f"{case} {key}: reference {value}, ours {own[key]}")
    totals = dict(mine["totals"])
    # Rows that the reference does not have: cases without an effect of the catalogue.
    totals["confusion"] = {kind: row for kind, row in totals["confusion"].items() if kind not in ("none", "unknown")}
    for key, value in theirs["totals"].items():
        if key != "seconds_median" and totals[key] != value: wrong.append(f"{key}: reference {value}, ours {totals[key]}")
    print(f"{name}: {len(theirs['cases'])} cases, {len(theirs['totals']) - 1} totals, {len(wrong)} differences")
    for line in wrong: print("  " + line)
    return not wrong


def scramble(results, truths, seed):
    """The answers of a diagnoser, every other one given the truth first, made worse at random."""
    rng = random.Random(seed)
    kinds = sorted({e["kind"] for r in results for e in r["diag"]["effects"]} | {"stribeck_friction", "joint_elasticity", "backlash", "armature", "actuation_delay"})
    pool = [e for r in results for e in r["diag"]["effects"]]
    answers = []
    for r, truth in zip(results, truths):
        diag, evaluation = json.loads(json.dumps(r["diag"])), json.loads(json.dumps(r.get("eval")))
        if rng.random() < .5:
            sealed = [e for e in truth["effects"] if not e["kind"].startswith("unknown")]
            diag["effects"] = [next((d for d in diag["effects"] if d["kind"] == e["kind"]), {"kind": e["kind"], "joints": e["joint_names"], "confidence": .9, "parameters": {}}) for e in sealed]
            diag["verdict"] = ("explained" if truth["known"] else "partly_explained") if sealed else rng.choice(["no_gap", "unknown_effect"])
        effects = [e for e in diag["effects"] if rng.random() < .85]
        if pool and rng.random() < .3: effects.append(json.loads(json.dumps(rng.choice(pool))))
        if rng.random() < .3: rng.shuffle(effects)
        for e in effects:
            if rng.random() < .1: e["kind"] = rng.choice(kinds)
            if rng.random() < .6: e["confidence"] = rng.choice([0, .1, .2, .3, .5, .6, .7, .9, 1.0, rng.random()])
            elif rng.random() < .2: del e["confidence"]
            if rng.random() < .5: e["indistinguishable_from"] = rng.sample(kinds, rng.randint(1, 3))
            if e["joints"] and rng.random() < .3: e["joints"] = rng.sample(diag["joints"], rng.randint(0, len(diag["joints"])))
            for name in list(e["parameters"]):
                if rng.random() < .1: del e["parameters"][name]; continue
                values = e["parameters"][name]
                for value in [values] if "value" in values else values.values():
                    if isinstance(value["value"], list): continue
                    if rng.random() < .3: value["value"] *= rng.uniform(.5, 1.5)
                    if rng.random() < .2: del value["ci95"]
        diag["effects"] = effects
        if rng.random() < .15: diag["verdict"] = rng.choice(["no_gap", "explained", "partly_explained", "unknown_effect", "not_excited"])
        if rng.random() < .1: diag["shrink"]["torque"]["shrink"] = None
        if rng.random() < .1: evaluation = None
        answers.append({"diag": None if rng.random() < .07 else diag, "eval": evaluation})
    return answers


def short(result):
    """What the judging reads of a result."""
    diag, evaluation = result.get("diag"), result.get("eval")
    if diag: diag = {"verdict": diag["verdict"], "effects": diag["effects"], "shrink": {"torque": diag["shrink"]["torque"]}}
    if evaluation: evaluation = {"shrink": {"torque": evaluation["shrink"]["torque"]}}
    return {"diagnosis": diag, "evaluation": evaluation}


def main():
    ap = argparse.ArgumentParser(); ap.add_argument("gapscope"); ap.add_argument("--exe"); ap.add_argument("--golden"); 
    ap.add_argument("--bank", default=os.path.join(os.environ.get("GAPSCOPE_BANK", os.path.join(os.path.dirname(__file__), "../../../shared/bank")), "sample"))
    a = ap.parse_args(); bank = os.path.realpath(a.bank); score = os.path.join(os.path.dirname(bank), "score.py"); exe = os.path.realpath(a.exe or a.gapscope)
    theirs = reference(score, bank, exe); right = compare("the binary", theirs, ours(a.gapscope, bank, exe)); golden = []
    for seed in SEEDS:
        with tempfile.TemporaryDirectory() as folder:
            answers, parrot = folder + "/answers.json", folder + "/parrot"
            json.dump(dict(zip(theirs["cases"], scramble(theirs["results"], theirs["truths"], seed))), open(answers, "w"))
            open(parrot, "w").write(PARROT.format(python=sys.executable, answers=answers)); os.chmod(parrot, 0o755)
            played = reference(score, bank, parrot); right &= compare(f"scrambled {seed}", played, ours(a.gapscope, bank, parrot))
        if seed == SEEDS[0]:
            golden = [{"case": c, "truth": t, "group": g, "judgement": figures(j)} | short(r) for c, t, g, j, r in zip(played["cases"], played["truths"], played["groups"], played["judgements"], played["results"])]
            totals = {k: v for k, v in played["totals"].items() if k != "seconds_median"}
    if a.golden: json.dump({"cases": golden, "totals": totals}, open(a.golden, "w"), separators=(",", ":"))
    sys.exit(0 if right else 1)


if __name__ == "__main__": main()
