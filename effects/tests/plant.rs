//! The plant against laws written out a second time, and the physics that any robot keeps to.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{
    Draw, Reference, assert_close, between, calm_tree, delta, heavier_link, is_dry, moving_state, on_all, one_of_each,
    payload, robot, rubbing, with_body,
};
use gapscope_dynamics::{Data, Discrete, Inertia, Integrator, Joint, JointKind, Limits, Model, Placement, StepModel};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, EffectError, GravityMisalignment, JointCoupling, Kind, LinkInertiaError,
    ParallelSpring, Payload, Plant, TorqueBias, TorqueGainError, ViscousFriction,
};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

fn coulomb(values: BTreeMap<String, f64>) -> Effect {
    Effect::CoulombFriction(CoulombFriction { coulomb: values })
}

/// State after `steps` steps under a held effort.
fn run(plant: &mut impl StepModel, q: &[f64], v: &[f64], tau: &[f64], steps: usize) -> Vec<f64> {
    let mut x = vec![0.0; plant.state_len()];
    plant.start(q, v, &mut x);
    for _ in 0..steps {
        plant.step(&mut x, tau);
    }
    x
}

/// Acceleration at which the plant's residual is zero; the residual is affine in it.
fn inverse_acceleration(plant: &mut Plant, q: &[f64], v: &[f64], tau: &[f64], still: &[f64]) -> Vec<f64> {
    let n = q.len();
    let mut at = |a: &[f64]| {
        let mut rest = vec![0.0; n];
        plant.residual(q, v, a, tau, still, &mut rest);
        DVector::from_vec(rest)
    };
    let rest = at(&vec![0.0; n]);
    let columns: Vec<DVector<f64>> = (0..n)
        .map(|j| {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            &rest - at(&unit)
        })
        .collect();
    DMatrix::from_columns(&columns).lu().solve(&rest).unwrap().as_slice().to_vec()
}

/// A mass of 2 kg that slides on a level rail.
fn slider() -> Model {
    let joint = Joint {
        name: "rail".into(),
        link: "block".into(),
        parent: None,
        kind: JointKind::Prismatic,
        placement: Placement::IDENTITY,
        axis: DVec3::X,
        inertia: Inertia::from_com(2.0, DVec3::ZERO, DMat3::IDENTITY * 0.01),
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
    };
    Model::new("slider".into(), "base".into(), vec![joint]).unwrap()
}

// Forward and inverse.

#[test]
fn forward_and_inverse_agree_for_each_effect_and_for_all_together() {
    const DT: f64 = 1e-6;
    let mut draw = Draw::new(1);
    for seed in 0..12 {
        let tree = draw.tree(1 + seed % 7);
        let model = rubbing(&mut draw, &tree);
        let n = model.dof();
        let each = one_of_each(&mut draw, &model);
        let sets: Vec<Vec<Effect>> = each.iter().map(|e| vec![e.clone()]).chain([vec![], each.clone()]).collect();
        for effects in sets {
            let mut reference = Reference::new(&model, &effects);
            let mut plant = Plant::new(&model, &effects, DT).unwrap();
            let (q, v) = moving_state(&mut draw, &reference, n, 0.1);
            let tau = draw.numbers(n, 30.0);
            let truth = reference.acceleration(&q, &v, &tau);
            let inverse = inverse_acceleration(&mut plant, &q, &v, &tau, &vec![0.05; n]);
            assert_close(&inverse, &truth, 1e-8);
            let x = run(&mut plant, &q, &v, &tau, 1);
            let forward: Vec<f64> = (0..n).map(|j| (x[n + j] - v[j]) / DT).collect();
            // The step's mean acceleration: half a step away from the state, and rounded by 1e-16 / DT.
            assert_close(&forward, &truth, 2e-3);
            let (half_q, half_v): (Vec<f64>, Vec<f64>) =
                (0..n).map(|j| (0.5 * (q[j] + x[j]), 0.5 * (v[j] + x[n + j]))).unzip();
            assert_close(&forward, &reference.acceleration(&half_q, &half_v, &tau), 1e-7);
        }
    }
}

/// Below standstill dry friction takes up what it can hold, and no more.
#[test]
fn the_residual_at_standstill_is_what_dry_friction_cannot_hold() {
    let model = slider();
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), 3.0)].into())], 1e-3).unwrap();
    for (effort, rest) in [(0.0, 0.0), (2.9, 0.0), (-2.9, 0.0), (3.5, 0.5), (-7.0, -4.0)] {
        for speed in [0.0, 0.009, -0.009] {
            let mut residual = [f64::NAN];
            plant.residual(&[0.0], &[speed], &[0.0], &[effort], &[0.01], &mut residual);
            assert!((residual[0] - rest).abs() < 1e-12, "{effort} N at {speed} m/s leaves {}", residual[0]);
        }
        let mut residual = [f64::NAN];
        plant.residual(&[0.0], &[-0.02], &[0.0], &[effort], &[0.01], &mut residual);
        assert!((residual[0] - (effort + 3.0)).abs() < 1e-12, "in motion friction has one value");
    }
}

// Order of the step.

/// Ratio of the errors at dt and dt/2 after 0.2 s, positions and velocities apart.
fn error_ratios(truth: &[f64], mut after: impl FnMut(f64) -> Vec<f64>) -> [f64; 2] {
    let n = truth.len() / 2;
    let (whole, half) = (after(1.0), after(0.5));
    let size =
        |x: &[f64], of: std::ops::Range<usize>| -> f64 { of.map(|i| (x[i] - truth[i]).powi(2)).sum::<f64>().sqrt() };
    [0..n, n..2 * n].map(|of| {
        let (whole, half) = (size(&whole, of.clone()), size(&half, of));
        assert!(whole > 1e-11, "the error {whole:e} is above rounding");
        whole / half
    })
}

#[test]
fn the_step_is_of_second_order_against_runge_kutta_of_the_rigid_robot() {
    const DT: f64 = 1e-3;
    for name in ["double_pendulum", "arm6", "arm7"] {
        let mut draw = Draw::new(4);
        let model = robot(name);
        let n = model.dof();
        let (q, v) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0));
        // Against gravity, so that the arm does not fall too fast.
        let mut tau = vec![0.0; n];
        model.gravity_torque(&mut Data::new(&model), &q, &mut tau);
        let truth = run(&mut Discrete::new(model.clone(), 1e-4, Integrator::Rk4), &q, &v, &tau, 2000);
        let ratios = error_ratios(&truth, |part| {
            let steps = (0.2 / (DT * part)).round() as usize;
            run(&mut Plant::nominal(&model, DT * part), &q, &v, &tau, steps)
        });
        for ratio in ratios {
            assert!((3.7..4.3).contains(&ratio), "{name}: halving dt divides the error by {ratio}");
        }
    }
}

#[test]
fn the_step_is_of_second_order_with_every_smooth_effect() {
    const DT: f64 = 1e-3;
    for seed in 0..8 {
        let (tree, mut draw) = calm_tree(seed, 2 + seed as usize % 5);
        let n = tree.dof();
        let mut effects = one_of_each(&mut draw, &tree);
        effects.retain(|e| !matches!(e, Effect::CoulombFriction(_)));
        for effect in &mut effects {
            if let Effect::JointCoupling(coupling) = effect {
                coupling.coulomb = 0.0;
            }
        }
        let sets: Vec<Vec<Effect>> = effects.iter().map(|e| vec![e.clone()]).chain([effects.clone()]).collect();
        for effects in sets {
            let (q, v, tau) = (draw.numbers(n, 1.0), draw.numbers(n, 0.5), draw.numbers(n, 3.0));
            let truth = Reference::new(&tree, &effects).runge_kutta(&q, &v, &tau, 2e-4, 1000);
            let ratios = error_ratios(&truth, |part| {
                let steps = (0.2 / (DT * part)).round() as usize;
                run(&mut Plant::new(&tree, &effects, DT * part).unwrap(), &q, &v, &tau, steps)
            });
            for ratio in ratios {
                assert!((3.6..4.4).contains(&ratio), "seed {seed}, {effects:?}: {ratio}");
            }
        }
    }
}

/// While nothing reverses, dry friction is a constant and the step keeps its order.
#[test]
fn dry_friction_in_one_direction_keeps_second_order() {
    let model = robot("double_pendulum");
    let effects = [coulomb(on_all(&model, || 0.05))];
    let (q, v, tau) = ([0.4, 0.6], [1.0, 8.0], [0.0, 0.0]);
    let steps = 500;
    let truth = Reference::new(&model, &effects).runge_kutta(&q, &v, &tau, 0.1 / steps as f64, steps);
    assert!(truth[2] > 0.1 && truth[3] > 0.1, "both joints still turn the way they did: {truth:?}");
    let ratios = error_ratios(&truth, |part| {
        let dt = 1e-3 * part;
        run(&mut Plant::new(&model, &effects, dt).unwrap(), &q, &v, &tau, (0.1 / dt).round() as usize)
    });
    assert!(ratios.iter().all(|r| (3.7..4.3).contains(r)), "{ratios:?}");
}

// Dry friction at rest.

/// Speed of a joint that stands, up to what the friction solver leaves, rad/s.
const STANDING: f64 = 1e-6;

/// Coulomb friction half as strong again as what gravity asks of each joint.
fn holding_friction(model: &Model, q: &[f64]) -> BTreeMap<String, f64> {
    let mut gravity = vec![0.0; model.dof()];
    model.gravity_torque(&mut Data::new(model), q, &mut gravity);
    model.joints().iter().zip(&gravity).map(|(j, g)| (j.name.clone(), 1.5 * g.abs() + 0.1)).collect()
}

/// A held joint, with the largest speed and the largest creep in 10 s.
fn hold(model: &Model, effects: &[Effect], q: &[f64], tau: &[f64]) -> (f64, f64) {
    let n = model.dof();
    let mut plant = Plant::new(model, effects, 2e-3).unwrap();
    let mut x = vec![0.0; plant.state_len()];
    plant.start(q, &vec![0.0; n], &mut x);
    let (mut speed, mut creep) = (0.0f64, 0.0f64);
    for _ in 0..5000 {
        plant.step(&mut x, tau);
        for j in 0..n {
            speed = speed.max(x[n + j].abs());
            creep = creep.max((x[j] - q[j]).abs());
        }
    }
    (speed, creep)
}

#[test]
fn a_joint_below_the_coulomb_bound_stands_exactly_still() {
    for (seed, name) in ["double_pendulum", "arm6", "arm7"].into_iter().enumerate() {
        let mut draw = Draw::new(seed as u64);
        let model = robot(name);
        for _ in 0..2 {
            let q = draw.numbers(model.dof(), 1.5);
            let friction = coulomb(holding_friction(&model, &q));
            let (speed, creep) = hold(&model, &[friction], &q, &vec![0.0; model.dof()]);
            assert_eq!((speed, creep), (0.0, 0.0), "{name} at {q:?}: largest speed and creep");
        }
    }
}

/// Whatever the solver leaves, less than 1e-4 rad in 10 s.
#[test]
fn a_joint_below_the_coulomb_bound_hardly_creeps() {
    for (seed, name) in ["double_pendulum", "arm6", "arm7"].into_iter().enumerate() {
        let mut draw = Draw::new(seed as u64);
        let model = robot(name);
        for _ in 0..2 {
            let q = draw.numbers(model.dof(), 1.5);
            let friction = coulomb(holding_friction(&model, &q));
            let (speed, creep) = hold(&model, &[friction], &q, &vec![0.0; model.dof()]);
            assert!(speed < 1e-5 && creep < 1e-4, "{name} at {q:?}: speed {speed:e}, creep {creep:e}");
        }
    }
}

#[test]
fn a_joint_holds_with_other_effects_beside_its_friction() {
    let mut draw = Draw::new(9);
    let model = robot("arm6");
    let q = draw.numbers(6, 1.0);
    let mut effects = one_of_each(&mut draw, &model);
    effects.retain(|e| !is_dry(e));
    // Springs and biases ask for more; the friction of all joints is above that.
    effects.push(coulomb(on_all(&model, || 200.0)));
    let tau = draw.numbers(6, 20.0);
    let (speed, creep) = hold(&model, &effects, &q, &tau);
    assert!(speed < 1e-5 && creep < 1e-4, "speed {speed:e}, creep {creep:e}");
}

#[test]
fn a_coupling_holds_the_sum_of_its_joints() {
    let model = robot("arm6");
    let coupling = JointCoupling {
        joints: ["joint5".into(), "joint6".into()],
        ratio: 1.0,
        coulomb: 5.0,
        viscous: 0.0,
        armature: 0.0,
    };
    // Other joints stand; equal and opposite speeds of joints 5 and 6 are free, their sum is not.
    let mut standing = on_all(&model, || 500.0);
    standing.remove("joint5");
    standing.remove("joint6");
    let effects = [coulomb(standing), Effect::JointCoupling(coupling)];
    let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
    let mut x = vec![0.0; 12];
    plant.start(&[0.1, -1.0, 1.0, 0.2, 0.3, 0.4], &[0.0; 6], &mut x);
    let mut tau = [0.0; 6];
    model.gravity_torque(&mut Data::new(&model), &[0.1, -1.0, 1.0, 0.2, 0.3, 0.4], &mut tau);
    (tau[4], tau[5]) = (tau[4] + 0.5, tau[5] - 0.5);
    for _ in 0..300 {
        plant.step(&mut x, &tau);
        assert!((x[10] + x[11]).abs() < 1e-10, "the sum of speeds creeps: {:e}", x[10] + x[11]);
    }
    assert!(x[10] > 0.05, "the free combination moves: {}", x[10]);
}

/// A robot let go with some speed comes to rest; from then on no velocity changes its sign at every step.
#[test]
fn once_stuck_there_is_no_chatter() {
    for (seed, name) in ["double_pendulum", "arm6", "arm7"].into_iter().enumerate() {
        let mut draw = Draw::new(40 + seed as u64);
        let model = robot(name);
        let n = model.dof();
        let q = draw.numbers(n, 1.0);
        let mut friction = holding_friction(&model, &q);
        friction.values_mut().for_each(|f| *f *= 3.0);
        let mut plant = Plant::new(&model, &[coulomb(friction)], 1e-3).unwrap();
        let mut x = vec![0.0; 2 * n];
        plant.start(&q, &draw.numbers(n, 0.5), &mut x);
        let tau = vec![0.0; n];
        for _ in 0..20_000 {
            plant.step(&mut x, &tau);
        }
        assert!(x[n..].iter().all(|v| v.abs() < STANDING), "{name} has come to rest: {:?}", &x[n..]);
        let mut alternations = 0;
        for _ in 0..500 {
            let before = x.clone();
            plant.step(&mut x, &tau);
            alternations += (n..2 * n).filter(|&j| before[j] * x[j] < 0.0).count();
        }
        assert_eq!(alternations, 0, "{name}: sign changes of a velocity after it stuck");
    }
}

/// The rail stands between two motions, and its speed has the sign of the motion on the way.
#[test]
fn a_joint_reverses_once_where_the_effort_reverses_once() {
    let model = slider();
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), 4.0)].into())], 2e-3).unwrap();
    let mut x = vec![0.0, 0.0];
    let mut signs = Vec::new();
    for k in 0..5000 {
        let t = f64::from(k) * 2e-3;
        plant.step(&mut x, &[10.0 * (0.5 * std::f64::consts::PI * t).sin()]);
        let sign = if x[1] == 0.0 { 0 } else { x[1].signum() as i32 };
        if signs.last() != Some(&sign) {
            signs.push(sign);
        }
    }
    // Period of 4 s: rest, forth, rest, back, rest, forth, rest, back, rest, forth in 10 s.
    let expected = [0, 1, 0, -1, 0, 1, 0, -1, 0, 1, 0];
    assert!(expected.starts_with(&signs) && signs.len() >= 9, "{signs:?}");
}

#[test]
fn a_block_breaks_away_where_the_force_exceeds_the_bound() {
    let model = slider();
    let bound = 10.0;
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), bound)].into())], 1e-3).unwrap();
    let mut x = vec![0.0, 0.0];
    for k in 0..2000 {
        let force = 0.01 * f64::from(k);
        plant.step(&mut x, &[force]);
        if force <= bound - 1e-9 {
            assert_eq!(x, [0.0, 0.0], "at {force} N");
        } else if force > bound + 0.005 {
            assert!(x[1] > 0.0, "at {force} N");
        }
    }
    // From rest under a constant force above the bound: (12 − 10) N / 2 kg for 1 s.
    let x = run(&mut plant, &[0.0], &[0.0], &[12.0], 1000);
    assert!((x[1] - 1.0).abs() < 1e-9 && (x[0] - 0.5).abs() < 1e-9, "{x:?}");
    // And down from speed: (−10) N / 2 kg stops 1 m/s in 0.2 s and 0.1 m, then stands.
    let x = run(&mut plant, &[0.0], &[1.0], &[0.0], 500);
    assert_eq!(x[1], 0.0);
    assert!((x[0] - 0.1).abs() < 1e-6, "{x:?}");
}

#[test]
fn a_joint_breaks_away_on_an_arm() {
    let model = robot("arm6");
    let q = [0.3, -1.1, 0.9, 0.2, -0.4, 0.5];
    let mut gravity = [0.0; 6];
    model.gravity_torque(&mut Data::new(&model), &q, &mut gravity);
    let effects = [coulomb(on_all(&model, || 8.0))];
    for j in 0..6 {
        for (beyond, moves) in [(7.9, false), (8.1, true), (-7.9, false), (-8.1, true)] {
            let mut tau = gravity;
            tau[j] += beyond;
            let x = run(&mut Plant::new(&model, &effects, 1e-3).unwrap(), &q, &[0.0; 6], &tau, 20);
            for i in 0..6 {
                let speed = x[6 + i];
                if i == j && moves {
                    assert!(speed * beyond > 0.0 && speed.abs() > 1e-5, "joint {j} under {beyond}: {speed}");
                } else {
                    assert!(speed.abs() < STANDING, "joint {i} while joint {j} has {beyond}: {speed:e}");
                }
            }
        }
    }
}

/// A little above its bound a joint moves as if the others were welded: v = h (τ − f) / M_jj after one step.
#[test]
fn the_joint_that_breaks_away_moves_as_if_the_others_were_welded() {
    const DT: f64 = 1e-3;
    const BOUND: f64 = 8.0;
    for (seed, name) in ["double_pendulum", "arm6", "arm7"].into_iter().enumerate() {
        let mut draw = Draw::new(60 + seed as u64);
        let model = robot(name);
        let n = model.dof();
        let q = draw.numbers(n, 1.2);
        let mut gravity = vec![0.0; n];
        let mut mass = DMatrix::zeros(n, n);
        let mut data = Data::new(&model);
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.mass_matrix(&mut data, &q, &mut mass);
        let effects = [coulomb(on_all(&model, || BOUND))];
        for j in 0..n {
            for beyond in [1e-3, -1e-3] {
                let mut tau = gravity.clone();
                tau[j] += BOUND.copysign(beyond) + beyond;
                let x = run(&mut Plant::new(&model, &effects, DT).unwrap(), &q, &vec![0.0; n], &tau, 1);
                let expected = DT * beyond / mass[(j, j)];
                assert!((x[n + j] / expected - 1.0).abs() < 0.02, "{name} joint {j}: {} for {expected}", x[n + j]);
                for i in (0..n).filter(|&i| i != j) {
                    assert!(
                        x[n + i].abs() < 1e-3 * expected.abs(),
                        "{name}: joint {i} moves with joint {j}: {}",
                        x[n + i]
                    );
                }
            }
        }
    }
}

// Energy.

/// Most that the energy rises above its lowest value so far, as part of the kinetic energy at the start.
fn greatest_rise(model: &Model, effects: &[Effect], q: &[f64], v: &[f64], dt: f64, seconds: f64) -> f64 {
    let n = model.dof();
    let mut reference = Reference::new(model, effects);
    let mut plant = Plant::new(model, effects, dt).unwrap();
    let mut x = vec![0.0; 2 * n];
    plant.start(q, v, &mut x);
    let start = reference.energy(q, v);
    let scale = model.kinetic_energy(&mut Data::new(model), q, v).max(1.0);
    let (mut lowest, mut rise) = (start, 0.0f64);
    for _ in 0..(seconds / dt).round() as usize {
        plant.step(&mut x, &vec![0.0; n]);
        let energy = reference.energy(&x[..n], &x[n..]);
        assert!(energy.is_finite());
        rise = rise.max(energy - lowest);
        lowest = lowest.min(energy);
    }
    rise / scale
}

/// Without effort, friction of all sorts only takes energy away: no rise beyond 1e-4 of the kinetic energy at the start,
/// which is what the midpoint rule leaves at dt = 0.5 ms on these trees.
#[test]
fn friction_never_creates_energy() {
    const TOLERANCE: f64 = 1e-4;
    for seed in 0..16 {
        let n = 1 + seed as usize % 6;
        let (tree, mut draw) = calm_tree(seed, n);
        let mut effects = one_of_each(&mut draw, &tree);
        effects.retain(|e| {
            matches!(
                e,
                Effect::ViscousFriction(_)
                    | Effect::CoulombFriction(_)
                    | Effect::JointCoupling(_)
                    | Effect::ParallelSpring(_)
                    | Effect::Armature(_)
            )
        });
        let (q, v) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0));
        let sets: Vec<Vec<Effect>> = effects.iter().map(|e| vec![e.clone()]).chain([effects.clone()]).collect();
        for effects in sets.iter().filter(|set| set.iter().any(|e| is_dry(e) || e.kind() == Kind::ViscousFriction)) {
            let rise = greatest_rise(&tree, effects, &q, &v, 5e-4, 1.0);
            let kinds: Vec<Kind> = effects.iter().map(Effect::kind).collect();
            assert!(rise < TOLERANCE, "seed {seed}, {n} joints, {kinds:?}: rises by {rise:e}");
        }
    }
}

/// Dry friction alone, on a level rail: the energy is ½ m v², and it falls at every step until the block stands.
#[test]
fn dry_friction_takes_energy_at_every_step() {
    let model = slider();
    let mut plant = Plant::new(&model, &[coulomb([("rail".into(), 3.0)].into())], 1e-2).unwrap();
    let mut x = vec![0.0, -2.0];
    while x[1] != 0.0 {
        let before = x[1];
        plant.step(&mut x, &[0.0]);
        assert!(x[1].abs() < before.abs(), "{before} to {}", x[1]);
        assert!(x[1] <= 0.0, "friction does not reverse a motion");
    }
}

/// Springs and gravity alone: over 10 s at dt = 1 ms the energy stays within 1e-3 of its span.
#[test]
fn springs_conserve_energy() {
    let model = robot("double_pendulum");
    let spring = ParallelSpring {
        stiffness: [("joint1".into(), 3.0), ("joint2".into(), 1.0)].into(),
        rest_position: [("joint1".into(), 0.3), ("joint2".into(), -0.2)].into(),
    };
    let effects = [Effect::ParallelSpring(spring)];
    let mut reference = Reference::new(&model, &effects);
    let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
    let mut x = vec![0.0; 4];
    plant.start(&[0.8, -0.5], &[0.0, 0.0], &mut x);
    let start = reference.energy(&x[..2], &x[2..]);
    let (mut worst, mut kinetic) = (0.0f64, 0.0f64);
    let mut data = Data::new(&model);
    for _ in 0..10_000 {
        plant.step(&mut x, &[0.0, 0.0]);
        worst = worst.max((reference.energy(&x[..2], &x[2..]) - start).abs());
        kinetic = kinetic.max(model.kinetic_energy(&mut data, &x[..2], &x[2..]));
    }
    assert!(kinetic > 0.1, "it swings: {kinetic} J");
    assert!(worst < 1e-3 * kinetic, "energy strays by {worst:e} J of {kinetic} J");
}

/// A slider on a spring: half a period later it is on the other side.
#[test]
fn a_spring_swings_at_its_own_frequency() {
    let model = slider();
    let spring =
        ParallelSpring { stiffness: [("rail".into(), 50.0)].into(), rest_position: [("rail".into(), 0.2)].into() };
    let half_period = std::f64::consts::PI * (2.0f64 / 50.0).sqrt();
    let steps = 1000;
    let mut plant = Plant::new(&model, &[Effect::ParallelSpring(spring)], half_period / f64::from(steps)).unwrap();
    let x = run(&mut plant, &[0.5], &[0.0], &[0.0], steps as usize);
    assert!((x[0] - (-0.1)).abs() < 1e-5 && x[1].abs() < 1e-4, "{x:?}");
}

/// The midpoint rule keeps the energy of a linear oscillator to rounding, however stiff the spring is against the step.
#[test]
fn a_stiff_spring_keeps_its_energy_to_rounding() {
    let model = slider();
    for (stiffness, dt) in [(50.0, 5e-3), (1e4, 1e-2), (1e9, 1e-2)] {
        let spring = ParallelSpring {
            stiffness: [("rail".into(), stiffness)].into(),
            rest_position: [("rail".into(), 0.0)].into(),
        };
        let mut plant = Plant::new(&model, &[Effect::ParallelSpring(spring)], dt).unwrap();
        let energy = |x: &[f64]| 0.5 * (stiffness * x[0] * x[0] + 2.0 * x[1] * x[1]);
        let mut x = vec![0.3, 0.0];
        let start = energy(&x);
        for _ in 0..2000 {
            plant.step(&mut x, &[0.0]);
            assert!((energy(&x) / start - 1.0).abs() < 1e-9, "{stiffness} N/m at {dt} s: {}", energy(&x) / start);
        }
    }
}

// Effects that are another model or another effort.

/// Same residual and same step.
fn assert_same(a: &mut Plant, b: &mut Plant, draw: &mut Draw, n: usize, tolerance: f64) {
    for _ in 0..10 {
        let (q, v, acceleration) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 5.0));
        let tau = draw.numbers(n, 20.0);
        let mut rest = [vec![0.0; n], vec![0.0; n]];
        a.residual(&q, &v, &acceleration, &tau, &vec![0.1; n], &mut rest[0]);
        b.residual(&q, &v, &acceleration, &tau, &vec![0.1; n], &mut rest[1]);
        assert_close(&rest[0], &rest[1], tolerance);
        assert_close(&run(a, &q, &v, &tau, 5), &run(b, &q, &v, &tau, 5), tolerance);
    }
}

fn trees() -> impl Iterator<Item = (Model, Draw)> {
    (0..10).map(|seed| {
        let mut draw = Draw::new(seed);
        let tree = draw.tree(1 + seed as usize % 6);
        (rubbing(&mut draw, &tree), draw)
    })
}

#[test]
fn armature_is_the_models_rotor_inertia() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let extra: Vec<f64> = (0..n).map(|_| between(&mut draw, 0.0, 1.0)).collect();
        let armature = model.joints().iter().zip(&extra).map(|(j, i)| (j.name.clone(), *i)).collect();
        let sum: Vec<f64> = model.armature().iter().zip(&extra).map(|(a, b)| a + b).collect();
        let mut effect = Plant::new(&model, &[Effect::Armature(Armature { armature })], 1e-3).unwrap();
        assert_same(&mut effect, &mut Plant::nominal(&model.clone().with_armature(&sum), 1e-3), &mut draw, n, 1e-9);
    }
}

#[test]
fn payload_is_more_inertia_of_its_link() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let body = payload(&mut draw, &model);
        let j = model.joint_index(&body.joint).unwrap();
        let heavier = model.clone().with_inertia(j, with_body(&model, &body));
        let mut effect = Plant::new(&model, &[Effect::Payload(body)], 1e-3).unwrap();
        assert_eq!(effect.model().joints()[j].inertia, heavier.joints()[j].inertia);
        assert_same(&mut effect, &mut Plant::nominal(&heavier, 1e-3), &mut draw, n, 1e-14);
    }
}

#[test]
fn a_link_error_is_another_inertia_of_that_link() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let error = heavier_link(&mut draw, &model);
        let j = model.joint_index(&error.joint).unwrap();
        let heavier = model.clone().with_inertia(j, model.joints()[j].inertia.add(&delta(&error)));
        let mut effect = Plant::new(&model, &[Effect::LinkInertiaError(error)], 1e-3).unwrap();
        assert_eq!(effect.model().joints()[j].inertia, heavier.joints()[j].inertia);
        assert_same(&mut effect, &mut Plant::nominal(&heavier, 1e-3), &mut draw, n, 1e-14);
    }
}

#[test]
fn tilt_is_another_gravity() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let tilt = GravityMisalignment { roll: draw.uniform(0.5), pitch: draw.uniform(0.5) };
        let ((sr, cr), (sp, cp)) = (tilt.roll.sin_cos(), tilt.pitch.sin_cos());
        let tilted = model.clone().with_gravity(9.81 * DVec3::new(sp, -sr * cp, -cr * cp));
        let mut effect = Plant::new(&model, &[Effect::GravityMisalignment(tilt)], 1e-3).unwrap();
        assert_same(&mut effect, &mut Plant::nominal(&tilted, 1e-3), &mut draw, n, 1e-14);
    }
}

/// Roll about x, then pitch about y, both fixed in the world: the world's gravity seen from the turned base.
#[test]
fn tilt_is_gravity_seen_from_a_turned_base() {
    let mut draw = Draw::new(3);
    for _ in 0..20 {
        let (roll, pitch) = (draw.uniform(1.5), draw.uniform(1.5));
        let world_from_base = DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
        let seen = world_from_base.transpose() * DVec3::new(0.0, 0.0, -9.81);
        let gravity = GravityMisalignment { roll, pitch }.gravity();
        assert!((seen - gravity).length() < 1e-12, "roll {roll}, pitch {pitch}: {gravity}, expected {seen}");
    }
}

#[test]
fn bias_and_gain_are_another_effort() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let gain: Vec<f64> = (0..n).map(|_| between(&mut draw, 0.5, 1.5)).collect();
        let bias = draw.numbers(n, 5.0);
        let named = |x: &[f64]| model.joints().iter().zip(x).map(|(j, x)| (j.name.clone(), *x)).collect();
        let effects = [
            Effect::TorqueGainError(TorqueGainError { gain: named(&gain) }),
            Effect::TorqueBias(TorqueBias { bias: named(&bias) }),
        ];
        let mut with = Plant::new(&model, &effects, 1e-3).unwrap();
        let mut nominal = Plant::nominal(&model, 1e-3);
        let (q, v, tau) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 20.0));
        let delivered: Vec<f64> = (0..n).map(|j| gain[j] * tau[j] + bias[j]).collect();
        assert_eq!(run(&mut with, &q, &v, &tau, 5), run(&mut nominal, &q, &v, &delivered, 5));
        // The residual is in the units of the log: less by the gain.
        let mut rest = [vec![0.0; n], vec![0.0; n]];
        let a = draw.numbers(n, 5.0);
        with.residual(&q, &v, &a, &tau, &vec![0.0; n], &mut rest[0]);
        nominal.residual(&q, &v, &a, &delivered, &vec![0.0; n], &mut rest[1]);
        let scaled: Vec<f64> = rest[0].iter().zip(&gain).map(|(r, g)| r * g).collect();
        assert_close(&scaled, &rest[1], 1e-13);
    }
}

/// Two effects of a kind add up, and the order in which effects are given does not matter.
#[test]
fn effects_add_up_in_any_order() {
    for (model, mut draw) in trees().skip(1) {
        let n = model.dof();
        let mut effects = one_of_each(&mut draw, &model);
        // A bias acts on top of a gain wherever it stands.
        let mut forth = Plant::new(&model, &effects, 1e-3).unwrap();
        effects.reverse();
        assert_same(&mut forth, &mut Plant::new(&model, &effects, 1e-3).unwrap(), &mut draw, n, 1e-8);
        let viscous = |b: f64| Effect::ViscousFriction(ViscousFriction { viscous: on_all(&model, || b) });
        let mut two = Plant::new(&model, &[viscous(0.4), viscous(0.6)], 1e-3).unwrap();
        assert_same(&mut two, &mut Plant::new(&model, &[viscous(1.0)], 1e-3).unwrap(), &mut draw, n, 1e-13);
    }
}

/// What the URDF declares is in the nominal plant, and an effect counts beyond it.
#[test]
fn damping_and_friction_of_the_urdf_are_in_the_nominal_plant() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let mut joints = model.joints().to_vec();
        joints.iter_mut().for_each(|j| (j.damping, j.friction) = (0.0, 0.0));
        let bare = Model::new("tree".into(), "base".into(), joints)
            .unwrap()
            .with_armature(model.armature())
            .with_gravity(model.gravity());
        let of = |value: fn(&Joint) -> f64| model.joints().iter().map(|j| (j.name.clone(), value(j))).collect();
        let effects =
            [Effect::ViscousFriction(ViscousFriction { viscous: of(|j| j.damping) }), coulomb(of(|j| j.friction))];
        let mut declared = Plant::nominal(&model, 1e-3);
        assert_same(&mut declared, &mut Plant::new(&bare, &effects, 1e-3).unwrap(), &mut draw, n, 1e-13);
    }
}

// Errors.

/// Each kind of effect on a joint of this name.
fn on_joint(joint: &str) -> Vec<Effect> {
    let one = |x: f64| -> BTreeMap<String, f64> { [(joint.to_owned(), x)].into() };
    let coupling = |joints: [&str; 2]| {
        let joints = joints.map(str::to_owned);
        Effect::JointCoupling(JointCoupling { joints, ratio: 1.0, coulomb: 1.0, viscous: 1.0, armature: 0.1 })
    };
    vec![
        Effect::ViscousFriction(ViscousFriction { viscous: one(1.0) }),
        coulomb(one(1.0)),
        Effect::Armature(Armature { armature: one(0.1) }),
        Effect::TorqueGainError(TorqueGainError { gain: one(1.1) }),
        Effect::TorqueBias(TorqueBias { bias: one(1.0) }),
        Effect::ParallelSpring(ParallelSpring { stiffness: one(1.0), rest_position: one(0.0) }),
        Effect::Payload(Payload { joint: joint.into(), mass: 1.0, com: [0.0; 3], inertia: [0.0; 6] }),
        Effect::LinkInertiaError(LinkInertiaError {
            joint: joint.into(),
            mass_delta: 1.0,
            first_moment_delta: [0.0; 3],
            inertia_delta: [0.0; 6],
        }),
        coupling([joint, "joint1"]),
        coupling(["joint1", joint]),
    ]
}

#[test]
fn an_unknown_joint_is_named_with_those_there_are() {
    let model = robot("arm6");
    for effect in on_joint("joint2") {
        Plant::new(&model, &[effect], 1e-3).unwrap();
    }
    for effect in on_joint("elbow") {
        let error = Plant::new(&model, std::slice::from_ref(&effect), 1e-3).unwrap_err();
        match &error {
            EffectError::UnknownJoint { kind, joint, known } => {
                assert_eq!((*kind, joint.as_str()), (effect.kind(), "elbow"));
                assert_eq!(known, "joint1, joint2, joint3, joint4, joint5, joint6");
            }
            other => panic!("{effect:?}: {other}"),
        }
        let text = error.to_string();
        assert!(text.contains(effect.kind().name()) && text.contains("elbow") && text.contains("joint6"), "{text}");
    }
}

#[track_caller]
fn assert_out_of_bounds(effect: Effect, name: &str) {
    let error = Plant::new(&robot("arm6"), std::slice::from_ref(&effect), 1e-3);
    match &error {
        Err(e @ EffectError::OutOfBounds { kind, parameter, .. }) => {
            assert_eq!((*kind, *parameter), (effect.kind(), name), "{effect:?}");
            let text = e.to_string();
            assert!(text.contains(effect.kind().name()) && text.contains(name) && text.contains("must be"), "{text}");
        }
        other => panic!("{effect:?} with a bad {name} gives {:?}", other.as_ref().err()),
    }
}

#[test]
fn parameters_outside_their_bounds_are_named() {
    let one = |x: f64| -> BTreeMap<String, f64> { [("joint2".to_owned(), x)].into() };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_out_of_bounds(Effect::ViscousFriction(ViscousFriction { viscous: one(bad) }), "viscous");
        assert_out_of_bounds(coulomb(one(bad)), "coulomb");
        assert_out_of_bounds(Effect::TorqueBias(TorqueBias { bias: one(bad) }), "bias");
        let spring = ParallelSpring { stiffness: one(1.0), rest_position: one(bad) };
        assert_out_of_bounds(Effect::ParallelSpring(spring), "rest_position");
        let body = Payload { joint: "joint6".into(), mass: 1.0, com: [0.0; 3], inertia: [0.0; 6] };
        assert_out_of_bounds(Effect::Payload(Payload { mass: bad, ..body.clone() }), "mass");
        assert_out_of_bounds(Effect::Payload(Payload { com: [0.0, bad, 0.0], ..body.clone() }), "com");
        let inertia = [0.0, 0.0, 0.0, 0.0, 0.0, bad];
        assert_out_of_bounds(Effect::Payload(Payload { inertia, ..body }), "inertia");
        let error = LinkInertiaError {
            joint: "joint3".into(),
            mass_delta: 0.1,
            first_moment_delta: [0.0; 3],
            inertia_delta: [0.0; 6],
        };
        assert_out_of_bounds(
            Effect::LinkInertiaError(LinkInertiaError { mass_delta: bad, ..error.clone() }),
            "mass_delta",
        );
        let moved = LinkInertiaError { first_moment_delta: [bad, 0.0, 0.0], ..error.clone() };
        assert_out_of_bounds(Effect::LinkInertiaError(moved), "first_moment_delta");
        let turned = LinkInertiaError { inertia_delta: [0.0, 0.0, bad, 0.0, 0.0, 0.0], ..error };
        assert_out_of_bounds(Effect::LinkInertiaError(turned), "inertia_delta");
    }
    for bad in [f64::NAN, f64::INFINITY, -1e-9] {
        assert_out_of_bounds(Effect::Armature(Armature { armature: one(bad) }), "armature");
        let spring = ParallelSpring { stiffness: one(bad), rest_position: one(0.0) };
        assert_out_of_bounds(Effect::ParallelSpring(spring), "stiffness");
        let coupling = JointCoupling {
            joints: ["joint1".into(), "joint2".into()],
            ratio: 1.0,
            coulomb: 1.0,
            viscous: 1.0,
            armature: 1.0,
        };
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { coulomb: bad, ..coupling.clone() }), "coulomb");
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { viscous: bad, ..coupling.clone() }), "viscous");
        assert_out_of_bounds(Effect::JointCoupling(JointCoupling { armature: bad, ..coupling.clone() }), "armature");
    }
    for bad in [f64::NAN, f64::INFINITY, 0.0, -0.5] {
        assert_out_of_bounds(Effect::TorqueGainError(TorqueGainError { gain: one(bad) }), "gain");
    }
    for bad in [f64::NAN, f64::INFINITY, 3.2, -3.2] {
        assert_out_of_bounds(Effect::GravityMisalignment(GravityMisalignment { roll: bad, pitch: 0.0 }), "roll");
        assert_out_of_bounds(Effect::GravityMisalignment(GravityMisalignment { roll: 0.0, pitch: bad }), "pitch");
    }
    for bad in [f64::NAN, f64::INFINITY, 0.0] {
        let joints = ["joint1".into(), "joint2".into()];
        let coupling = JointCoupling { joints, ratio: bad, coulomb: 1.0, viscous: 1.0, armature: 1.0 };
        assert_out_of_bounds(Effect::JointCoupling(coupling), "ratio");
    }
}

/// Friction below what the URDF declares is an effect; friction below zero drives the joint.
#[test]
fn friction_that_would_drive_a_joint_is_out_of_bounds() {
    let declared = {
        let mut joints = slider().joints().to_vec();
        (joints[0].damping, joints[0].friction) = (2.0, 3.0);
        Model::new("slider".into(), "base".into(), joints).unwrap()
    };
    let one = |x: f64| -> BTreeMap<String, f64> { [("rail".to_owned(), x)].into() };
    let viscous = |x| Effect::ViscousFriction(ViscousFriction { viscous: one(x) });
    for allowed in [coulomb(one(-3.0)), viscous(-2.0)] {
        Plant::new(&declared, &[allowed], 1e-3).unwrap();
    }
    for (effect, name) in [(coulomb(one(-3.1)), "coulomb"), (viscous(-2.1), "viscous")] {
        match Plant::new(&declared, std::slice::from_ref(&effect), 1e-3) {
            Err(EffectError::OutOfBounds { parameter, .. }) => assert_eq!(parameter, name),
            other => panic!("{effect:?}: {:?}", other.err()),
        }
    }
}

/// A body may be missing from the link, but not more than the link has.
#[test]
fn a_payload_that_leaves_less_than_nothing_is_out_of_bounds() {
    let model = robot("arm6");
    let mass = model.joints()[5].inertia.mass;
    let missing = Payload { joint: "joint6".into(), mass: -1.5 * mass, com: [0.0; 3], inertia: [0.0; 6] };
    assert_out_of_bounds(Effect::Payload(missing), "mass");
    let error = LinkInertiaError {
        joint: "joint3".into(),
        mass_delta: -1.5 * model.joints()[2].inertia.mass,
        first_moment_delta: [0.0; 3],
        inertia_delta: [0.0; 6],
    };
    assert_out_of_bounds(Effect::LinkInertiaError(error), "mass_delta");
}

#[test]
fn a_rest_position_of_an_unknown_joint_is_an_error() {
    let spring = ParallelSpring {
        stiffness: [("joint1".into(), 1.0)].into(),
        rest_position: [("joint1".into(), 0.1), ("elbow".into(), 0.2)].into(),
    };
    let error = Plant::new(&robot("arm6"), &[Effect::ParallelSpring(spring)], 1e-3).err();
    assert!(matches!(&error, Some(EffectError::UnknownJoint { joint, .. }) if joint == "elbow"), "{error:?}");
}

#[test]
fn a_coupling_needs_two_joints() {
    let joints = ["joint3".into(), "joint3".into()];
    let coupling = JointCoupling { joints, ratio: -1.0, coulomb: 1.0, viscous: 1.0, armature: 0.1 };
    assert!(Plant::new(&robot("arm6"), &[Effect::JointCoupling(coupling)], 1e-3).is_err());
}

// Repeatability.

#[test]
fn the_same_input_gives_the_same_bits() {
    for (model, mut draw) in trees().skip(1) {
        let n = model.dof();
        let effects = one_of_each(&mut draw, &model);
        let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
        let (q, v, tau) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 20.0));
        let first = run(&mut plant, &q, &v, &tau, 20);
        // Scratch that other states have been through must not show, nor a plant made anew.
        run(&mut plant, &v, &q, &draw.numbers(n, 9.0), 3);
        assert_eq!(first, run(&mut plant, &q, &v, &tau, 20));
        assert_eq!(first, run(&mut plant.clone(), &q, &v, &tau, 20));
        assert_eq!(first, run(&mut Plant::new(&model, &effects, 1e-3).unwrap(), &q, &v, &tau, 20));
        let mut rest = [vec![0.0; n], vec![f64::NAN; n]];
        let a = draw.numbers(n, 5.0);
        for rest in &mut rest {
            plant.residual(&q, &v, &a, &tau, &vec![0.1; n], rest);
            run(&mut plant, &v, &q, &tau, 3);
        }
        assert_eq!(rest[0], rest[1]);
    }
}

/// One state at a time or a long run in pieces: the plant carries nothing from step to step but the state.
#[test]
fn a_run_in_pieces_is_the_run() {
    let mut draw = Draw::new(21);
    let model = robot("arm7");
    let effects = one_of_each(&mut draw, &model);
    let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
    assert_eq!((plant.joints(), plant.dt(), plant.state_len()), (7, 1e-3, 14));
    let (q, v, tau) = (draw.numbers(7, 1.0), draw.numbers(7, 1.0), draw.numbers(7, 5.0));
    let whole = run(&mut plant, &q, &v, &tau, 40);
    let half = run(&mut plant, &q, &v, &tau, 20);
    assert_eq!(whole, run(&mut plant, &half[..7], &half[7..], &tau, 20));
}
