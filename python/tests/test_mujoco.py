"""From a diagnosis into MuJoCo itself."""

import importlib
import importlib.util
import runpy
import shutil
import sys
from pathlib import Path

import gapscope
import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs" / "python.md"
EXAMPLE = ROOT / "python" / "examples" / "mujoco_day.py"
#: One run in every container, of two links that have 0.4 N m s/rad of friction in each joint and whose URDF has none.
RUN = ROOT / "datasets" / "tests" / "formats" / "same"
TWO_LINKS = """<robot name="two_links"><link name="base"/>
<link name="upper"><inertial><mass value="1"/><inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><mass value="0.5"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="9" velocity="20"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="9" velocity="20"/></joint>
</robot>"""


def first_program(page):
    """The first block of Python of a page, ten lines at most."""
    program = page.read_text("utf-8").split("```python\n", 1)[1].split("```", 1)[0]
    assert len(program.strip().split("\n")) <= 10
    return compile(program, str(page), "exec")


@pytest.mark.parametrize("name", ["lerobot_v30", "lerobot_v21", "bag", "run.mcap"])
def test_the_ten_lines_of_the_readme_go_from_a_dataset_or_a_bag_to_a_model_that_mujoco_loads(name, tmp_path, monkeypatch):
    copy = shutil.copytree if (RUN / name).is_dir() else shutil.copy
    copy(RUN / name, tmp_path / "my_dataset")
    (tmp_path / "robot.urdf").write_text(TWO_LINKS)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(first_program(ROOT / "README.md"), names)
    assert (tmp_path / "corrected.xml").is_file()
    for joint in ("shoulder", "elbow"):
        assert names["model"].joint(joint).damping[0] == pytest.approx(0.4, rel=0.05), joint


def test_the_ten_lines_of_the_docs_end_in_a_model_that_mujoco_loads(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("robot.urdf", "episode_0.csv", "episode_1.csv"):
        (tmp_path / name).write_bytes((case.folder / name).read_bytes())
    names = {}
    exec(first_program(DOCS), names)
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


def test_samples_of_the_region_are_robots(command, tmp_path):
    """Links that logs determine in sums alone: a sample moves them as it must, and what no log tells makes bodies of them."""
    logs, out, made = tmp_path / "logs", tmp_path / "out", tmp_path / "made"
    command("generate", "double_pendulum", "--perturb", "--seed", 100, "--episodes", 2, "--seconds", 8, "--rate", 200, "--out", logs)
    command("diagnose", logs / "robot.urdf", *sorted(logs.glob("episode_*.csv")), "--out", out)
    command("export", out, "--robot", logs / "robot.urdf", "--to", "mjcf", "--ranges", "--out", made)
    spec = importlib.util.spec_from_file_location("sample_ranges", made / "sample_ranges.py")
    sampler = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sampler)
    ranges, random = sampler.Ranges(), np.random.default_rng(0)
    k = ranges.determined.shape[1]
    along = lambda sample: np.linalg.solve(np.hstack([ranges.determined, ranges.open]), sample - ranges.value)[:k]
    frictions = []
    for open_ in [0.0] * 20 + [0.1] * 20:
        sample = ranges.sample(random, open=open_)
        assert ranges.holds(sample)
        model = mujoco.MjModel.from_xml_path(str(made / "robot.xml"))
        assert ranges.to_mujoco(model, sample) == []
        frictions.append(model.dof_frictionloss.copy())
        np.testing.assert_allclose(along(ranges.embodied(model, sample)), along(sample), atol=1e-4)
    found = {p["joint"]: p for p in ranges.parameters if p["parameter"] == "coulomb"}
    for of_joint, joint in zip(np.transpose(frictions), ("joint1", "joint2")):
        assert found[joint]["range"][0] < of_joint.min() < of_joint.max() < found[joint]["range"][1]


@pytest.mark.parametrize("kind", ["viscous_friction", "backlash"])
def test_a_simulator_closes_the_gap_by_as_much_as_was_predicted(kind, command, tmp_path, monkeypatch):
    # A small part of the table in docs/export.md.
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "export"))
    prove = importlib.import_module("prove")
    monkeypatch.setattr(prove, "gapscope", lambda _, *words: command(*words))
    row = prove.prove_kind("", kind, tmp_path)
    assert row["predicted"] > 0.9
    assert not prove.is_off(row)
