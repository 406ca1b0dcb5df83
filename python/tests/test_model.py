"""Identities of rigid-body dynamics on random states, and the same figures as MuJoCo."""

import pickle
import threading
import time

import gapscope
import numpy as np
import pytest


@pytest.fixture(scope="module", params=["arm7", "arm6", "double_pendulum"])
def model(request):
    return gapscope.Model(gapscope.generate(request.param, episodes=1, seconds=0.1).robot)


@pytest.fixture
def states(model):
    return np.random.default_rng(1).uniform(-1, 1, (3, 40, model.dof))


def test_identities(model, states):
    q, v, a = states
    mass, tau = model.mass_matrix(q), model.inverse_dynamics(q, v, a)
    assert mass.shape == (40, model.dof, model.dof)
    np.testing.assert_array_equal(mass, mass.swapaxes(1, 2))
    assert (np.linalg.eigvalsh(mass) > 0).all()
    np.testing.assert_allclose(tau, np.einsum("bij,bj->bi", mass, a) + model.bias(q, v), atol=1e-10)
    np.testing.assert_allclose(model.forward_dynamics(q, v, tau), a, atol=1e-8)
    np.testing.assert_allclose(model.regressor(q, v, a) @ model.parameters, tau, atol=1e-10)
    np.testing.assert_array_equal(model.gravity(q), model.bias(q, np.zeros_like(v)))


def test_power_is_the_rate_of_kinetic_energy(model, states):
    # d/dt (v' M v / 2) = v' (tau - gravity) along any motion: central differences over 2e-6 s.
    q, v, a = states
    step = 1e-6

    def energy(sign):
        speed = v + sign * step * a
        mass = model.mass_matrix(q + sign * step * v + 0.5 * step**2 * a)
        return 0.5 * np.einsum("bi,bij,bj->b", speed, mass, speed)

    rate = (energy(1) - energy(-1)) / (2 * step)
    power = ((model.inverse_dynamics(q, v, a) - model.gravity(q)) * v).sum(axis=1)
    np.testing.assert_allclose(rate, power, rtol=1e-6, atol=1e-7)


def test_batches_equal_loops(model):
    # More rows than one thread takes at a time.
    q, v, a = np.random.default_rng(2).uniform(-1, 1, (3, 1300, model.dof))
    for name, inputs in [
        ("inverse_dynamics", (q, v, a)),
        ("forward_dynamics", (q, v, a)),
        ("mass_matrix", (q,)),
        ("gravity", (q,)),
        ("bias", (q, v)),
        ("regressor", (q, v, a)),
    ]:
        method = getattr(model, name)
        whole = method(*inputs)
        np.testing.assert_array_equal(whole, np.stack([method(*row) for row in zip(*inputs)]), name)
        cube = method(*(x.reshape(13, 100, -1) for x in inputs))
        np.testing.assert_array_equal(cube.reshape(whole.shape), whole, name)


def test_any_array_is_taken_and_none_is_changed(model, states):
    q, v, a = states
    tau = model.inverse_dynamics(q, v, a)
    np.testing.assert_array_equal(model.inverse_dynamics(np.asfortranarray(q), v[::1].tolist(), a), tau)
    assert model.inverse_dynamics(q.astype(np.float32), v, a).dtype == np.float64
    q.flags.writeable = False
    np.testing.assert_array_equal(model.inverse_dynamics(q, v, a), tau)
    assert model.mass_matrix(np.zeros((0, model.dof))).shape == (0, model.dof, model.dof)
    with pytest.raises(gapscope.Error, match=r"`q` has shape \[3\], expected"):
        model.gravity(np.zeros(3) if model.dof != 3 else np.zeros(4))
    with pytest.raises(gapscope.Error, match=r"`v` has shape .* as `q`"):
        model.bias(q, v[:3])
    with pytest.raises((TypeError, ValueError)):
        model.gravity(["a"] * model.dof)


def test_others_run_meanwhile():
    model = gapscope.Model(gapscope.generate("arm7", episodes=1, seconds=0.1).robot)
    q = np.random.default_rng(3).uniform(-1, 1, (300_000, 7))
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    model.regressor(q[:20_000], q[:20_000], q[:20_000])
    model.inverse_dynamics(q, q, q)
    after = counted[0]
    done.set()
    thread.join()
    assert after > before


def test_pickle_and_lock(model, states):
    q = states[0]
    again = pickle.loads(pickle.dumps(model))
    assert again.joints == model.joints and repr(again) == repr(model)
    np.testing.assert_array_equal(again.mass_matrix(q), model.mass_matrix(q))
    held = pickle.loads(pickle.dumps(gapscope.Model(model.text, lock=[model.joints[-1]])))
    assert held.joints == model.joints[:-1] and held.locked == [model.joints[-1]]
    part = q.copy()
    part[:, -1] = 0
    np.testing.assert_allclose(held.mass_matrix(part[:, :-1]), model.mass_matrix(part)[:, :-1, :-1], atol=1e-12)
    assert set(model.limits) == {"lower", "upper", "velocity", "effort"}


def test_mujoco_agrees(model, states):
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(model.text)
    compiled = spec.compile()
    # A URDF's damping and friction are no part of these figures.
    compiled.dof_damping[:], compiled.dof_frictionloss[:] = 0, 0
    # Nor do random states keep to its limits.
    compiled.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(compiled)
    places = [int(compiled.joint(name).qposadr[0]) for name in model.joints]
    q, v, a = states
    tau = model.inverse_dynamics(q, v, a)
    for row in range(5):
        data.qpos[places], data.qvel[places], data.qacc[places] = q[row], v[row], a[row]
        mujoco.mj_inverse(compiled, data)
        np.testing.assert_allclose(data.qfrc_inverse[places], tau[row], rtol=1e-5, atol=1e-5)
