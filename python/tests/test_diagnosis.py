"""The diagnosis is that of the command, whatever the logs come as, and reads well."""

import json
import multiprocessing
import pickle
import signal
import subprocess
import sys
import time

import gapscope
import numpy as np
import pytest


def test_the_same_bytes_as_the_command_writes(case, command, tmp_path):
    command("diagnose", case.robot, *case.logs, "--out", tmp_path / "cli")
    case.diagnosis.save(tmp_path / "python")
    for name in ("diagnosis.json", "corrected.json"):
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "cli" / name).read_bytes()
    report = (tmp_path / "cli" / "report.html").read_text("utf-8")
    assert (tmp_path / "python" / "report.html").read_text("utf-8") == report.replace(f"{tmp_path / 'cli'}/", "")


def flat(log):
    """A log as columns."""
    columns = {"time": log["time"]}
    for name in ("position", "effort"):
        for at, joint in enumerate(log["joints"]):
            columns[f"{name}.{joint}"] = np.ascontiguousarray(log[name][:, at])
    return columns


def told(diagnosis):
    """The diagnosis without the names of its logs, which the findings hold."""
    found = diagnosis.to_dict()
    found["data"].pop("findings")
    return found


def test_arrays_frames_and_files_give_the_same(case):
    logs = case.generated.logs
    expected = told(case.diagnosis)
    assert told(gapscope.diagnose(case.robot, logs)) == expected
    assert told(gapscope.diagnose(gapscope.Model(case.robot), [flat(log) for log in logs])) == expected
    assert told(gapscope.diagnose(case.robot.read_text(), [dict(log, joints=log["joints"]) for log in logs])) == expected


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_frames(case, library):
    frames = [pytest.importorskip(library).DataFrame(flat(log)) for log in case.generated.logs]
    assert told(gapscope.diagnose(case.robot, frames)) == told(case.diagnosis)


def test_it_finds_what_is_there_and_says_so_in_three_lines(case):
    diagnosis = case.diagnosis
    assert {effect.kind for effect in diagnosis.effects} == {"coulomb_friction", "viscous_friction"}
    (coulomb,) = (effect for effect in diagnosis.effects if effect.kind == "coulomb_friction")
    found = coulomb.parameters["coulomb"]["joint1"]
    assert abs(found["value"] - 0.3) < 0.02 and found["unit"] == "N m"
    lines = repr(diagnosis).split("\n")
    assert len(lines) == 3 and lines[0].startswith("EXPLAINED  double_pendulum: It comes from ")
    assert lines[1].startswith("Where ") and lines[2].startswith("How far ")
    assert diagnosis.shrink["torque"]["shrink"] > 0.95 and diagnosis.gap["torque"]["rms"]["joint1"] > 0.1
    assert {"proposed", "against", "odds", "taken"} <= set(diagnosis.why[0])
    page = diagnosis._repr_html_()
    assert page.startswith("<iframe srcdoc=") and "&lt;html" in page and page.count("<") == 2
    assert diagnosis.summary.startswith("joint1 and joint2 rub") and "\ndouble_pendulum · 2 joints" in diagnosis.summary
    kinds = [effect["kind"] for effect in json.loads(diagnosis.files["corrected.json"])["effects"]]
    assert diagnosis.corrections.kinds == kinds and set(kinds) == {effect.kind for effect in diagnosis.effects}


def test_pickle_save_and_load(case, tmp_path):
    again = pickle.loads(pickle.dumps(case.diagnosis))
    assert again == case.diagnosis and repr(again) == repr(case.diagnosis)
    assert again.to_mjcf() == case.diagnosis.to_mjcf()
    case.diagnosis.save(tmp_path)
    loaded = gapscope.Diagnosis.load(tmp_path, case.robot)
    assert loaded == case.diagnosis and repr(loaded) == repr(case.diagnosis)
    with pytest.raises(gapscope.Error, match="exists already"):
        case.diagnosis.save(tmp_path)
    case.diagnosis.save(tmp_path, force=True)
    with pytest.raises(gapscope.Error, match="the folder that `gapscope diagnose` wrote"):
        gapscope.Diagnosis.load(tmp_path / "none", case.robot)


def test_progress_is_told_and_an_exception_in_it_ends_the_work(case):
    stages = []
    gapscope.diagnose(case.robot, case.logs, progress=lambda stage, part: stages.append((stage, part)))
    assert all(0 <= part <= 1 for _, part in stages)

    class Enough(Exception):
        pass

    def enough(stage, part):
        raise Enough

    logs = gapscope.generate("arm7", perturb=1.0, seconds=10.0)
    with pytest.raises(Enough):
        gapscope.diagnose(logs.robot, logs.logs, progress=enough)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_is_heard_in_long_work():
    program = (
        "import gapscope, time\n"
        "logs = gapscope.generate('arm7', perturb=1.0, seconds=10.0)\n"
        "print('working', flush=True)\n"
        "try:\n    gapscope.diagnose(logs.robot, logs.logs)\n    print('done')\n"
        "except KeyboardInterrupt:\n    print('heard')\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "working\n"
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=60)[0] == "heard\n"


def diagnosed(given):
    robot, logs = given
    return gapscope.diagnose(robot, logs, progress=False)


@pytest.mark.skipif(sys.platform != "linux", reason="fork with threads is for Linux")
def test_a_forked_child_works_and_sends_its_result(case):
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.map_async(diagnosed, [(case.robot, case.logs)]).get(timeout=120)[0] == case.diagnosis


def test_plots(case):
    pytest.importorskip("matplotlib").use("Agg")
    for name in ("effects", "gap", "regimes", "shrink"):
        assert getattr(case.diagnosis.plot, name)().has_data(), name
