"""From a diagnosis into MuJoCo itself."""

import runpy
import sys
from pathlib import Path

import gapscope
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

DOCS = Path(__file__).resolve().parents[2] / "docs" / "python.md"
EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "mujoco_day.py"


def test_the_ten_lines_of_the_docs_end_in_a_model_that_mujoco_loads(case, tmp_path, monkeypatch):
    text = DOCS.read_text("utf-8")
    program = text.split("```python\n", 1)[1].split("```", 1)[0]
    assert len(program.strip().split("\n")) <= 10
    monkeypatch.chdir(tmp_path)
    for name in ("robot.urdf", "episode_0.csv", "episode_1.csv"):
        (tmp_path / name).write_bytes((case.folder / name).read_bytes())
    names = {}
    exec(compile(program, str(DOCS), "exec"), names)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "corrected.xml"))
    assert model.joint("joint1").damping[0] == pytest.approx(0.15, rel=0.1)
    assert model.joint("joint1").frictionloss[0] == pytest.approx(0.3, rel=0.1)


def test_a_spec_is_corrected_and_keeps_its_shapes(case):
    spec = mujoco.MjSpec.from_string(case.robot.read_text())
    for body in spec.bodies:
        if body.name != "world":
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], name=f"shape of {body.name}")
    before = spec.compile()
    corrected = case.diagnosis.to_mjcf(spec)
    model = corrected.compile()
    assert model.ngeom == before.ngeom and spec.compile().joint("joint1").damping[0] != model.joint("joint1").damping[0]
    assert model.joint("joint2").frictionloss[0] == pytest.approx(0.2, rel=0.1)
    assert model.body_mass == pytest.approx(mujoco.MjModel.from_xml_string(case.diagnosis.to_mjcf()).body_mass)


def test_a_spec_of_another_robot_or_with_more_to_carry_is_refused(case):
    other = gapscope.generate("arm6", episodes=1, seconds=0.1).robot
    heavy = mujoco.MjSpec.from_string(case.robot.read_text())
    heavy.compile()
    deepest = list(heavy.bodies)[-1]
    deepest.add_body(name="extra", pos=[0.1, 0, 0]).add_joint(name="further", axis=[0, 1, 0])
    list(heavy.bodies)[-1].add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], mass=1)
    with pytest.raises(gapscope.Error, match="do not move as the corrected model's"):
        case.diagnosis.to_mjcf(heavy)
    renamed = mujoco.MjSpec.from_string(other.replace('"joint1"', '"shoulder"'))
    with pytest.raises(gapscope.Error, match="the spec has no joint 'joint1'"):
        case.diagnosis.to_mjcf(renamed)
    gain = gapscope.generate("double_pendulum", [{"kind": "torque_gain_error", "gain": {"joint1": 0.8}}], episodes=2)
    found = gapscope.diagnose(gain.robot, gain.logs)
    assert found.corrections.kinds == ["torque_gain_error"]
    spec = mujoco.MjSpec.from_string(gain.robot)
    with pytest.raises(gapscope.Error, match="cannot hold torque_gain_error"):
        found.to_mjcf(spec)
    assert found.to_mjcf(spec, partial=True).compile().nv == 2


def test_urdf_and_ledger(case):
    exported = case.diagnosis.export("urdf", case.logs)
    assert exported.text == case.diagnosis.to_urdf() and "<robot" in exported.text
    assert exported.ledger["shrink"] > 0.9 and "viscous_friction: written" in repr(exported)
    assert "damping=" in exported.text
    with pytest.raises(gapscope.Error, match='there is no target "usd"'):
        case.diagnosis.export("usd")


def test_a_mujoco_users_day(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE)])
    names = runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert names["after"] < 0.2 * names["before"], capsys.readouterr().out
    assert np.isfinite(names["after"])
