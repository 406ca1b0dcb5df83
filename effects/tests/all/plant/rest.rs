//! Dry friction at rest.

use super::*;

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
