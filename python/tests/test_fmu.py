"""The co-simulation unit, loaded and run by fmpy."""

import shutil

import gapscope
import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy")

# Efforts are logged without noise, so that the motion they made is the unit's.
QUIET = {"position_noise": 0.0, "effort_noise": 0.0, "episodes": 1, "seconds": 2.0, "rate": 500.0}


@pytest.fixture(scope="module")
def unit(case, tmp_path_factory):
    if not shutil.which("cc"):
        pytest.skip("no C compiler `cc` here: the unit has no binary")
    path = tmp_path_factory.mktemp("fmu") / "robot.fmu"
    case.diagnosis.to_fmu(path, dt=0.0005)
    return path


def test_it_is_as_the_standard_asks(unit):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []
    description = fmpy.read_model_description(str(unit), validate=True)
    assert description.fmiVersion == "2.0" and description.coSimulation.modelIdentifier == "robot"
    assert {v.name: v.unit for v in description.modelVariables}["effort.joint1"] == "N.m"
    assert "linux64" in fmpy.supported_platforms(str(unit)) and "c-code" in fmpy.supported_platforms(str(unit))


def test_it_moves_as_the_robot_does_and_the_nominal_model_does_not(unit, case):
    log = gapscope.generate("double_pendulum", case.diagnosis.corrections, seed=8, **QUIET).logs[0]
    names = [f"effort.{joint}" for joint in log["joints"]]
    inputs = np.zeros(len(log["time"]), dtype=[("time", float)] + [(name, float) for name in names])
    inputs["time"] = log["time"]
    for column, name in enumerate(names):
        inputs[name] = log["effort"][:, column]
    q = log["position"]
    velocity = (-3 * q[0] + 4 * q[1] - q[2]) / (2 * (log["time"][1] - log["time"][0]))
    start = {f"start.position.{joint}": q[0, j] for j, joint in enumerate(log["joints"])}
    start |= {f"start.velocity.{joint}": velocity[j] for j, joint in enumerate(log["joints"])}
    result = fmpy.simulate_fmu(
        str(unit), stop_time=0.4, step_size=0.002, output_interval=0.002, input=inputs, start_values=start,
        output=[f"position.{joint}" for joint in log["joints"]], relative_tolerance=None,
    )  # fmt: skip
    steps = len(result)
    moved = np.stack([result[f"position.{joint}"] for joint in log["joints"]], axis=1)
    off = np.abs(moved - q[:steps]).max()
    far = np.abs(q[:steps] - q[0]).max()
    assert steps == 201 and off < 0.01 * far, (steps, off, far)
    nominal = gapscope.rollout(case.robot, log, horizon=0.4)
    (model,) = nominal.models
    assert model["median"][-1] > 5 * off, (model["median"][-1], off)


def test_the_other_c_targets_are_files_of_text(case, tmp_path):
    for target, part in [("c", "gapscope_step"), ("cpp", "class Robot"), ("simulink", "mdlUpdate")]:
        exported = case.diagnosis.export(target, dt=0.002)
        exported.save(tmp_path)
        assert part in exported.text and (tmp_path / exported.name).read_text() == exported.text
    assert "#define GAPSCOPE_DT 0.002" in (tmp_path / "robot.c").read_text()
    with pytest.raises(gapscope.Error, match="exists already"):
        exported.save(tmp_path)
    with pytest.raises(gapscope.Error, match="--dt is 0"):
        case.diagnosis.export("c", dt=0.0)
