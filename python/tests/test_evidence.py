"""A fleet's logs, taken in anywhere: the same bits in any order, flat memory, and a diagnosis of what was kept."""

import itertools
import multiprocessing
import pickle
import sys

import gapscope
import numpy as np
import pytest

JOINTS = ["joint1", "joint2"]


def logs(viscous, seeds, seconds=4.0):
    effects = [
        {"kind": "coulomb_friction", "coulomb": {"joint1": 0.3, "joint2": 0.2}},
        {"kind": "viscous_friction", "viscous": {"joint1": viscous, "joint2": 0.1}},
    ]
    options = {"episodes": 1, "seconds": seconds, "rate": 200.0}
    made = [gapscope.generate("double_pendulum", effects, seed=seed, **options).logs[0] for seed in seeds]
    return [{"name": f"run {seed}", **log} for seed, log in zip(seeds, made)]


@pytest.fixture(scope="module")
def robot():
    return gapscope.generate("double_pendulum", episodes=1, seconds=0.1).robot


@pytest.fixture(scope="module")
def fleet():
    return logs(0.15, range(9))


def evidence(robot, runs, keep=4):
    made = gapscope.Evidence(robot, keep=keep)
    for run in runs:
        made.add(run)
    return made


def test_any_order_of_adding_and_merging_gives_the_same_bytes(robot, fleet):
    whole = evidence(robot, fleet)
    assert whole.episodes == 9 and len(whole.kept) == 4
    assert evidence(robot, fleet[::-1]).to_bytes() == whole.to_bytes()
    parts = [fleet[:2], fleet[2:3], fleet[3:]]
    for order in itertools.permutations(parts):
        merged = evidence(robot, [])
        for part in order:
            merged.merge(gapscope.Evidence.from_bytes(evidence(robot, part).to_bytes()))
        assert merged.to_bytes() == whole.to_bytes()
    # All at once is the same as one by one, and so is a pickle.
    assert gapscope.Evidence(robot, keep=4).add(fleet).to_bytes() == whole.to_bytes()
    assert pickle.loads(pickle.dumps(whole)).to_bytes() == whole.to_bytes()


def test_its_diagnosis_is_that_of_the_logs_it_kept(robot, fleet):
    few = evidence(robot, fleet, keep=16)
    assert few.kept and len(few.kept) == 9
    found, expected = few.finish(progress=False), gapscope.diagnose(robot, fleet)
    assert found.to_dict()["effects"] == expected.to_dict()["effects"] and found.findings == expected.findings
    some = evidence(robot, fleet)
    found = some.finish(progress=False)
    kept = [log for log in fleet if log["name"] in some.kept]
    assert found.to_dict()["effects"] == gapscope.diagnose(robot, kept).to_dict()["effects"]
    assert found.findings[0] == "the logs: 9 were taken in, of which 4 are diagnosed"
    assert {effect.kind for effect in found.effects} == {"coulomb_friction", "viscous_friction"}


def test_logs_that_are_unlike_the_kept_are_said(robot, fleet):
    # By chance few of the others are kept among nine of one kind; here none can be.
    one = evidence(robot, fleet[:4])
    other = gapscope.Evidence(robot, keep=4)
    other._sums = evidence(robot, logs(0.6, range(20, 28)))._sums
    found = one.merge(other).finish(progress=False)
    assert found.findings[0].startswith("joint `joint1`: bodies and friction as in the logs that were diagnosed"), found.findings
    assert not any("`joint2`: bodies" in finding for finding in found.findings)


def test_a_log_counts_once_among_the_kept(robot, fleet):
    made = evidence(robot, [fleet[0], {**fleet[0], "name": "another name"}])
    assert made.kept == ["another name"]


def test_memory_is_flat(robot, fleet):
    few, many = evidence(robot, fleet[:4], keep=2), evidence(robot, fleet, keep=2)
    # But for the digits of two ranks and digests.
    assert abs(len(many.to_bytes()) - len(few.to_bytes())) < 64


def test_what_cannot_be_is_said(robot, fleet):
    made = evidence(robot, fleet[:1])
    before = made.to_bytes()
    with pytest.raises(gapscope.Error, match="holds no log"):
        gapscope.Evidence(robot).finish()
    with pytest.raises(gapscope.Error, match="needs one log at least"):
        gapscope.Evidence(robot, keep=0)
    with pytest.raises(gapscope.LogError, match="effort"):
        made.add({name: values for name, values in fleet[1].items() if name != "effort"})
    rest = {"joints": JOINTS, "time": np.arange(12) / 100, "position": np.zeros((12, 2)), "effort": np.zeros((12, 2))}
    with pytest.raises(gapscope.LogError, match="holds no run"):
        made.add([fleet[1], rest])
    assert made.to_bytes() == before, "an error takes nothing in"
    with pytest.raises(gapscope.Error, match="another robot description"):
        made.merge(gapscope.Evidence(gapscope.generate("arm6", episodes=1, seconds=0.1).robot, keep=4))
    with pytest.raises(gapscope.Error, match="the other 64"):
        made.merge(gapscope.Evidence(robot))
    with pytest.raises(gapscope.Error, match="with itself"):
        made.merge(made)
    with pytest.raises(gapscope.Error, match="are no evidence"):
        gapscope.Evidence.from_bytes(b"PK")
    with pytest.raises(gapscope.Error, match="damaged or cut off"):
        gapscope.Evidence.from_bytes(before[: len(before) // 2])


def worked(part):
    robot, runs = part
    return evidence(robot, runs).to_bytes()


@pytest.mark.skipif(sys.platform != "linux", reason="fork with threads is for Linux")
def test_multiprocessing_gives_the_same_bytes(robot, fleet):
    with multiprocessing.get_context("fork").Pool(2) as pool:
        parts = pool.map_async(worked, [(robot, fleet[0::2]), (robot, fleet[1::2])]).get(timeout=120)
    merged = gapscope.Evidence.from_bytes(parts[1]).merge(gapscope.Evidence.from_bytes(parts[0]))
    assert merged.to_bytes() == evidence(robot, fleet).to_bytes()
