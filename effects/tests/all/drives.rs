//! Elasticity and play between motor and link.

use crate::support;

use gapscope_dynamics::{Data, Model, StepModel, robots};
use gapscope_effects::*;
use std::collections::BTreeMap;
use support::{DT, Run, hinge, motion, one};

fn on(joint: &str, value: f64) -> BTreeMap<String, f64> {
    [(joint.to_owned(), value)].into()
}

fn elastic(joint: &str, stiffness: f64, damping: f64, rotor: f64) -> [Effect; 2] {
    [
        Effect::JointElasticity(JointElasticity { stiffness: on(joint, stiffness), damping: on(joint, damping) }),
        Effect::Armature(Armature { armature: on(joint, rotor) }),
    ]
}

fn play(joint: &str, gap: f64, rotor: f64) -> [Effect; 2] {
    [Effect::Backlash(Backlash { gap: on(joint, gap) }), Effect::Armature(Armature { armature: on(joint, rotor) })]
}

/// Wind-up of the only drive, the last hidden state of x.
fn wind_up(x: &[f64]) -> f64 {
    x[x.len() - 2]
}

fn pendulum() -> Model {
    robots::model("double_pendulum").unwrap().unwrap().model
}

#[test]
fn elasticity_without_damping_keeps_its_energy() {
    let (model, k, rotor) = (pendulum(), 20.0, 0.02);
    let mut data = Data::new(&model);
    let mut run = Run::new(&model, &elastic("joint2", k, 0.0, rotor), DT);
    run.plant.start(&[0.8, -0.5], &[0.5, 3.0], &mut run.x);
    // The first step sets the wind-up, and its energy.
    run.step(&[0.0, 0.0]);
    let mut energy = |x: &[f64]| {
        let (delta, rate) = (x[x.len() - 2], x[x.len() - 1]);
        model.kinetic_energy(&mut data, &x[..2], &x[2..4])
            + model.potential_energy(&mut data, &x[..2])
            + 0.5 * rotor * (x[3] + rate).powi(2)
            + 0.5 * k * delta * delta
    };
    let first = energy(&run.x);
    let mut swing = 0.0_f64;
    for _ in 0..5000 {
        run.step(&[0.0, 0.0]);
        swing = swing.max((energy(&run.x) - first).abs());
    }
    assert!(swing < 2e-3 * 3.0, "{swing} J over 10 s of a motion with some 3 J");
}

#[test]
fn two_masses_on_a_spring_vibrate_at_their_frequency() {
    // 1/ω² = m/k with the reduced mass m: motor and link swing against each other.
    let (inertia, rotor, k) = (1.0, 0.5, 400.0);
    let omega = f64::sqrt(k * (1.0 / inertia + 1.0 / rotor));
    let mut run = Run::new(&hinge(inertia), &elastic("joint1", k, 0.0, rotor), DT);
    run.step(&[0.0]);
    let v = 0.1;
    let end = run.x.len();
    run.x[1] = -v * rotor;
    run.x[end - 1] = v * (inertia + rotor);
    let periods = 10.0;
    let steps = (periods * std::f64::consts::TAU / omega / DT).round() as usize;
    let mut turns = 0;
    let mut before = wind_up(&run.x);
    for _ in 0..steps + 5 {
        run.step(&[0.0]);
        turns += usize::from(before < 0.0 && wind_up(&run.x) >= 0.0);
        before = wind_up(&run.x);
        assert!(before.abs() < 1.001 * v * (inertia + rotor) / omega);
    }
    assert_eq!(turns, 10);
}

#[test]
fn the_wind_up_starts_where_the_motion_needs_it() {
    // Under a steady effort a hinge and its rotor speed up together: no ringing from the start.
    let (inertia, rotor, k) = (1.0, 0.5, 400.0);
    for effects in [elastic("joint1", k, 0.0, rotor).to_vec(), {
        let mut all = elastic("joint1", k, 0.0, rotor).to_vec();
        all.extend(play("joint1", 0.02, 0.0));
        all
    }] {
        let gap = if effects.len() > 2 { 0.01 } else { 0.0 };
        let mut run = Run::new(&hinge(inertia), &effects, DT);
        for _ in 0..200 {
            run.step(&[3.0]);
            let torque = 3.0 * inertia / (inertia + rotor);
            assert!((wind_up(&run.x) - torque / k - gap).abs() < 2e-5, "{}", wind_up(&run.x));
        }
        assert!((run.x[1] - 0.4 * 3.0 / (inertia + rotor)).abs() < 1e-4);
    }
}

#[test]
fn without_a_rotor_the_link_gets_the_effort_and_the_motor_leads_it() {
    let model = pendulum();
    let rigid = [Effect::Backlash(Backlash { gap: on("joint1", 0.02) }), elastic("joint1", 50.0, 0.1, 0.0)[0].clone()];
    let (mut soft, mut plain) = (Run::new(&model, &rigid, DT), Run::new(&model, &[], DT));
    let mut motor = Run::new(&model, &rigid, DT);
    motor.plant = motor.plant.with_motor_encoders();
    motor.plant.start(&[0.01 + 0.5 / 50.0, 0.0], &[0.0, 0.0], &mut motor.x);
    for k in 0..500 {
        let tau = [0.5 * (0.05 * f64::from(k)).cos(), 0.1];
        for run in [&mut soft, &mut plain, &mut motor] {
            run.step(&tau);
        }
        assert!(soft.x[..4].iter().zip(&plain.x).all(|(a, b)| (a - b).abs() < 1e-12));
        let lead = tau[0] / 50.0 + 0.01 * tau[0].signum();
        assert!((motor.x[0] - soft.x[0] - lead).abs() < 1e-9, "{k}");
    }
}

#[test]
fn encoders_on_the_motor_show_the_same_motion_from_the_other_side() {
    let model = pendulum();
    let effects = elastic("joint2", 30.0, 0.1, 0.02);
    let mut link = Run::new(&model, &effects, DT);
    let mut motor = Run::new(&model, &effects, DT);
    link.step(&[0.0, 0.2]);
    motor.plant = motor.plant.with_motor_encoders();
    motor.x.clone_from(&link.x);
    let end = link.x.len();
    motor.x[1] += link.x[end - 2];
    motor.x[3] += link.x[end - 1];
    for k in 0..500 {
        let tau = [0.3 * (0.04 * f64::from(k)).sin(), 0.5 * (0.1 * f64::from(k)).cos()];
        link.step(&tau);
        motor.step(&tau);
        assert!((motor.x[1] - link.x[1] - link.x[end - 2]).abs() < 1e-8);
        assert!((motor.x[3] - link.x[3] - link.x[end - 1]).abs() < 1e-6);
    }
}

#[test]
fn in_the_gap_motor_and_link_are_free_of_each_other_and_contact_loses_energy() {
    let (inertia, rotor, gap) = (1.0, 0.4, 0.04);
    let mut run = Run::new(&hinge(inertia), &play("joint1", gap, rotor), DT);
    run.step(&[0.0]);
    let end = run.x.len();
    run.x[end - 1] = 0.5;
    let omega = std::f64::consts::TAU * 20.0;
    let k = inertia * omega * omega;
    let energy = |x: &[f64]| {
        0.5 * inertia * x[1] * x[1]
            + 0.5 * rotor * (x[1] + x[end - 1]).powi(2)
            + 0.5 * k * (x[end - 2].abs() - 0.5 * gap).max(0.0).powi(2)
    };
    let (start, mut before, mut touched) = (energy(&run.x), energy(&run.x), false);
    for _ in 0..3000 {
        let (v, motor) = (run.x[1], run.x[1] + run.x[end - 1]);
        let inside = run.x[end - 2].abs() < 0.5 * gap;
        run.step(&[0.0]);
        if inside && run.x[end - 2].abs() < 0.5 * gap {
            assert!((run.x[1] - v).abs() < 1e-14 && (run.x[1] + run.x[end - 1] - motor).abs() < 1e-13);
        }
        touched |= !inside;
        // The step in which contact begins takes the spring's force at its middle: that much error, and no more.
        assert!(energy(&run.x) <= before + 0.05 * start, "{} {before}", energy(&run.x));
        before = energy(&run.x);
        let momentum = inertia * run.x[1] + rotor * (run.x[1] + run.x[end - 1]);
        assert!((momentum - rotor * 0.5).abs() < 1e-12);
    }
    assert!(touched && energy(&run.x) < 0.95 * start, "{} of {start}", energy(&run.x));
}

/// Largest distance of the link's position at 2 ms from the same plant at a fiftieth of it, over 2 s of a servo-like effort.
fn error_at_2_ms(model: &Model, effects: &[Effect]) -> f64 {
    let (mut coarse, mut fine) = (Run::new(model, effects, DT), Run::new(model, effects, DT / 50.0));
    let n = model.dof();
    let mut worst = 0.0_f64;
    for k in 0..1000 {
        let t = f64::from(k) * DT;
        let tau: Vec<f64> =
            (0..n).map(|j| 0.6 * (5.0 * t + j as f64).sin() + 0.2 * (31.0 * t).sin() - 2.0 * fine.x[j]).collect();
        coarse.step(&tau);
        (0..50).for_each(|_| fine.step(&tau));
        worst = (0..n).map(|j| (coarse.x[j] - fine.x[j]).abs()).fold(worst, f64::max);
    }
    worst
}

#[test]
fn two_milliseconds_are_short_enough() {
    let model = pendulum();
    let rigid = error_at_2_ms(&model, &[]);
    let soft = error_at_2_ms(&model, &elastic("joint2", 40.0, 0.05, 0.03));
    let loose = error_at_2_ms(&hinge(0.3), &play("joint1", 0.02, 0.2));
    let both = error_at_2_ms(
        &hinge(0.3),
        &[play("joint1", 0.02, 0.2).to_vec(), elastic("joint1", 200.0, 0.5, 0.0)[..1].to_vec()].concat(),
    );
    let bristles = error_at_2_ms(
        &hinge(0.3),
        &[Effect::PreslidingFriction(PreslidingFriction { coulomb: one(0.4), bristle_stiffness: one(40.0) })],
    );
    assert!(rigid < 2e-5 && soft < 5e-5 && loose < 1e-3 && both < 1e-5 && bristles < 2e-3);
}

/// What plants leave of the log of a pendulum, root mean square over the second joint's torque: the rigid one, and the one
/// that has the effects. Jolts aside: the half of the samples on which least is left.
fn left_of_a_log(effects: &[Effect], motor: bool) -> (f64, f64) {
    let model = pendulum();
    let plant = |effects: &[Effect]| {
        let plant = Plant::new(&model, effects, DT).unwrap();
        if motor { plant.with_motor_encoders() } else { plant }
    };
    let mut run = Run::new(&model, effects, DT);
    if motor {
        run.plant = run.plant.with_motor_encoders();
    }
    let samples = 6000;
    let (mut q, mut tau) = (vec![vec![]; 2], vec![vec![]; 2]);
    for k in 0..samples {
        let t = f64::from(k) * DT;
        let effort = [0.4 * (1.3 * t).cos(), 0.6 * (2.1 * t).sin() + 0.2 * (7.0 * t).cos()];
        (0..2).for_each(|j| {
            q[j].push(run.x[j]);
            tau[j].push(effort[j]);
        });
        run.step(&effort);
    }
    // Positions stand at the beginning of the interval over which an effort is held: the mean over two is the effort there.
    let middle = |x: &Vec<f64>| (1..x.len() - 1).map(|k| x[k]).collect::<Vec<f64>>();
    let v: Vec<Vec<f64>> = q.iter().map(|q| q.windows(3).map(|w| (w[2] - w[0]) / (2.0 * DT)).collect()).collect();
    let a: Vec<Vec<f64>> =
        q.iter().map(|q| q.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]) / (DT * DT)).collect()).collect();
    let tau: Vec<Vec<f64>> = tau.iter().map(|x| x.windows(3).map(|w| 0.5 * (w[0] + w[1])).collect()).collect();
    let q: Vec<Vec<f64>> = q.iter().map(middle).collect();
    let motion = motion(&model, [&q, &v, &a, &tau, &q], DT, &[1e-6, 1e-6]);
    let rms = |mut plant: Plant| {
        let mut size: Vec<f64> = plant.residuals(&motion)[1].iter().map(|x| x * x).collect();
        size.sort_by(f64::total_cmp);
        size.truncate(size.len() / 2);
        (size.iter().sum::<f64>() / size.len() as f64).sqrt()
    };
    (rms(plant(&[])), rms(plant(effects)))
}

#[test]
fn a_log_of_an_elastic_drive_leaves_nothing_to_its_own_plant() {
    for motor in [false, true] {
        let (rigid, elastic) = left_of_a_log(&elastic("joint2", 30.0, 0.1, 0.05), motor);
        assert!(elastic < 0.03 * rigid, "motor {motor}: {elastic} of {rigid}");
    }
}

#[test]
fn a_log_of_play_leaves_little_to_its_own_plant() {
    for motor in [false, true] {
        let mut effects = elastic("joint2", 300.0, 0.3, 0.05).to_vec();
        effects.extend(play("joint2", 0.02, 0.0).into_iter().take(1));
        let (rigid, play) = left_of_a_log(&effects, motor);
        assert!(play < 0.1 * rigid, "motor {motor}: {play} of {rigid}");
    }
}
