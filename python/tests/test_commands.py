"""The other commands are those of the command line, and errors have its sentences."""

import json
import pickle

import gapscope
import numpy as np
import pytest


def test_generate_writes_what_the_command_does(case, command, tmp_path):
    effects = tmp_path / "effects.json"
    effects.write_text(case.generated.effects.to_json())
    words = ["double_pendulum", "--effects", effects, "--episodes", 2, "--seconds", 8, "--seed", 3, "--out", tmp_path / "cli"]
    command("generate", *words)
    for name in ("robot.urdf", "episode_0.csv", "episode_1.csv"):
        assert (tmp_path / "cli" / name).read_bytes() == (case.folder / name).read_bytes(), name
    log = case.generated.logs[1]
    table = np.genfromtxt(case.logs[1], delimiter=",", names=True)
    assert log["position"].shape == (len(table), 2)
    np.testing.assert_array_equal(log["effort"][:, 1], table["effortjoint2"])


def test_evaluate(case, command, tmp_path):
    other = tmp_path / "other"
    gapscope.generate("double_pendulum", case.generated.effects, out=other, episodes=1, seconds=5, seed=9)
    log = other / "episode_0.csv"
    case.diagnosis.save(tmp_path / "results")
    corrected = tmp_path / "results" / "corrected.json"
    text = command("evaluate", case.robot, log, "--with", corrected, "--json").strip()
    evaluation = gapscope.evaluate(case.robot, log, case.diagnosis)
    assert evaluation.to_json() == text == gapscope.evaluate(case.robot, [log], corrected).to_json()
    assert evaluation.shrink["torque"]["shrink"] > 0.9 and "How far" in repr(evaluation)
    torque = evaluation.predictions[0]
    assert torque["measured"].shape == torque["nominal"].shape == (len(torque["time"]), 2)
    assert np.std(torque["measured"] - torque["corrected"]) < 0.2 * np.std(torque["measured"] - torque["nominal"])
    assert gapscope.evaluate(case.robot, log).shrink is None
    seen = gapscope.evaluate(case.robot, case.logs[0], case.diagnosis)
    assert any("fitted on this very log" in note for note in seen.notes)


def test_inspect(case, command):
    assert gapscope.inspect(case.logs[0]).to_json() == command("inspect", case.logs[0], "--json").strip()
    words = ["inspect", *case.logs, "--model", case.robot, "--json"]
    inspection = gapscope.inspect(case.logs, case.robot)
    assert inspection.to_json() == command(*words).strip()
    assert repr(inspection) == command(*words[:-1]).strip()
    in_memory = gapscope.inspect(case.generated.logs)
    assert in_memory.to_dict()["logs"][1]["samples"] == inspection.to_dict()["logs"][1]["samples"]


def test_rollout(case):
    rollouts = gapscope.rollout(case.robot, case.logs, case.diagnosis, horizon=0.5, starts=20)
    nominal, corrected = rollouts.models
    assert (nominal["model"], corrected["model"]) == ("nominal", "corrected")
    assert nominal["median"].shape == nominal["horizons"].shape and nominal["position"].shape[1] == 2
    assert corrected["median"][-1] < 0.1 * nominal["median"][-1]
    assert "leaves 0.05 rad" in repr(rollouts) and "<html" in rollouts.html and "<iframe" in rollouts._repr_html_()


def test_effects(case):
    effects = gapscope.Effects([{"kind": "torque_bias", "bias": {"joint1": 0.5}}], gapscope.Model(case.robot))
    assert len(effects + case.generated.effects) == 1 + len(case.generated.effects)
    assert effects.kinds == ["torque_bias"] and effects[0]["bias"] == {"joint1": 0.5}
    assert pickle.loads(pickle.dumps(effects)) == effects == gapscope.Effects(json.loads(effects.to_json()))
    assert gapscope.Effects(case.folder / "truth.json") == case.generated.effects
    effects[0]["bias"]["joint1"] = 9
    assert effects[0]["bias"] == {"joint1": 0.5}, "they do not change"
    with pytest.raises(gapscope.Error, match="tork_bias"):
        gapscope.Effects([{"kind": "tork_bias"}])
    with pytest.raises(gapscope.Error, match="`elbow`"):
        gapscope.Effects([{"kind": "torque_bias", "bias": {"elbow": 1.0}}], gapscope.Model(case.robot))


def test_residual(case, tmp_path):
    trained = gapscope.Residual.train(case.robot, case.logs, epochs=60, hidden=[24], seed=1)
    held = trained.training["held_out"]
    assert held["learned"] < 0.7 * held["physics"] and "Residual on next-state" in repr(trained)
    log = case.generated.logs[0]
    rows = slice(100, 150)
    q, tau = log["position"][rows], log["effort"][rows]
    v = np.zeros_like(q)
    q_next, v_next = trained.predict(q, v, tau)
    assert q_next.shape == v_next.shape == q.shape
    one = [np.stack(part) for part in zip(*(trained.predict(*row) for row in zip(q, v, tau)))]
    np.testing.assert_array_equal(np.stack([q_next, v_next]), np.stack(one))
    a = trained.model.forward_dynamics(q, v, tau)
    np.testing.assert_allclose(trained.physics(q, v, tau)[1], v + trained.dt * a, rtol=0.05, atol=0.05)
    trained.save(tmp_path / "residual")
    for again in (pickle.loads(pickle.dumps(trained)), gapscope.Residual.load(tmp_path / "residual", case.robot)):
        np.testing.assert_array_equal(again.predict(q, v, tau)[1], v_next)
    with pytest.raises(gapscope.Error, match="exists already"):
        trained.save(tmp_path / "residual")
    with pytest.raises(gapscope.Error, match="was trained for the joints"):
        gapscope.Residual.load(tmp_path / "residual", gapscope.generate("arm6", episodes=1, seconds=0.1).robot)
    rollouts = gapscope.rollout(case.robot, case.logs, residual=trained, horizon=0.1, starts=10)
    assert rollouts.models[1]["model"] == "hybrid"


def test_a_residual_on_the_corrected_model_has_little_left_to_learn(case):
    settings = dict(epochs=5, hidden=[8], seed=1)
    bare = gapscope.Residual.train(case.robot, case.logs, **settings)
    on_top = gapscope.Residual.train(case.robot, case.logs, corrections=case.diagnosis, **settings)
    assert on_top.training["held_out"]["physics"] < 0.2 * bare.training["held_out"]["physics"]
    # What it stands on goes with it.
    log = case.generated.logs[0]
    state = log["position"][50], np.zeros(2), log["effort"][50]
    assert np.abs(pickle.loads(pickle.dumps(on_top)).physics(*state)[1] - bare.physics(*state)[1]).max() > 1e-4


def test_a_network_alone(case, tmp_path):
    trained = gapscope.Pure.train(case.robot, case.logs, epochs=20, hidden=[24], seed=1)
    assert repr(trained).startswith("Pure of double_pendulum, steps of") and not hasattr(trained, "physics")
    log = case.generated.logs[0]
    state = log["position"][50:60], np.zeros((10, 2)), log["effort"][50:60]
    expected = trained.predict(*state)[1]
    trained.save(tmp_path / "pure")
    for again in (pickle.loads(pickle.dumps(trained)), gapscope.Pure.load(tmp_path / "pure", case.robot)):
        np.testing.assert_array_equal(again.predict(*state)[1], expected)
    with pytest.raises(gapscope.Error, match="holds a pure network, expected a residual"):
        gapscope.Residual.load(tmp_path / "pure", case.robot)
    for pure in (trained, tmp_path / "pure"):
        rollouts = gapscope.rollout(case.robot, case.logs, pure=pure, horizon=0.1, starts=10)
        assert [model["model"] for model in rollouts.models] == ["nominal", "pure"]


def test_errors_have_the_sentences_of_the_command(case, command, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text(case.logs[0].read_text().replace("effort.joint2", "effort.elbow"))
    broken = tmp_path / "broken.urdf"
    broken.write_text(case.robot.read_text().replace('type="revolute"', 'type="hinge"').replace('type="continuous"', 'type="hinge"'))
    cases = [
        (gapscope.LogError, case.robot, bad),
        (gapscope.LogError, case.robot, tmp_path / "none.csv"),
        (gapscope.RobotError, broken, case.logs[0]),
        (gapscope.Error, tmp_path / "none.urdf", case.logs[0]),
        (gapscope.Error, bad, case.logs[0]),
    ]
    for kind, robot, log in cases:
        said = command("diagnose", robot, log, "--out", tmp_path / "out", fails=True)
        with pytest.raises(kind) as raised:
            gapscope.diagnose(robot, log)
        assert f"error: {raised.value}" == said.strip().split("\n")[-1]
    assert issubclass(gapscope.LogError, gapscope.Error) and issubclass(gapscope.Error, ValueError)


def test_what_is_wrong_with_arrays_names_run_and_column(case):
    log = dict(case.generated.logs[0])
    log["effort"] = log["effort"].copy()
    log["effort"][7, 1] = np.nan
    with pytest.raises(gapscope.LogError, match="log 1.*effort.joint2.*sample 8"):
        gapscope.diagnose(case.robot, [case.generated.logs[1], log])
    with pytest.raises(gapscope.LogError, match="has 5 numbers|no array holds the effort|effort"):
        gapscope.diagnose(case.robot, dict(log, effort=log["effort"][:5]))
    with pytest.raises(gapscope.Error, match="either all paths or all in memory"):
        gapscope.diagnose(case.robot, [case.logs[0], log])
    with pytest.raises(gapscope.Error, match="expected a path, a mapping of arrays, or a frame"):
        gapscope.diagnose(case.robot, [3.0])
    with pytest.raises(gapscope.LogError, match="no log is given"):
        gapscope.diagnose(case.robot, [])
    with pytest.raises(TypeError, match="unknown option 'maps'"):
        gapscope.diagnose(case.robot, log, maps={})
    with pytest.raises(gapscope.Error, match="--episodes"):
        gapscope.generate(episodes=0)
