//! Every effect's law, seen from outside: what the plant does at constant speed, at rest and over time.

use crate::support;

use gapscope_dynamics::{StepModel, robots};
use gapscope_effects::*;
use support::{DT, Run, hinge, one};

/// Friction torque that brakes a heavy hinge at a speed, from how it slows down in one step.
fn braking(effects: &[Effect], speed: f64, effort: f64) -> f64 {
    let mut plant = Plant::new(&hinge(1e3), effects, DT).unwrap();
    let mut x = vec![0.0; plant.state_len()];
    plant.start(&[0.3], &[speed], &mut x);
    plant.step(&mut x, &[effort]);
    effort - 1e3 * (x[1] - speed) / DT
}

fn stribeck() -> Effect {
    Effect::StribeckFriction(StribeckFriction { coulomb: one(2.0), r#static: one(5.0), stribeck_velocity: one(0.1) })
}

#[test]
fn stribeck_friction_rises_towards_standstill() {
    for speed in [0.05_f64, 0.1, 0.3, -0.05] {
        let expected = (2.0 + 3.0 * (-(speed / 0.1).powi(2)).exp()) * speed.signum();
        assert!((braking(&[stribeck()], speed, 0.0) - expected).abs() < 1e-3, "{speed}");
    }
}

#[test]
fn stribeck_friction_sticks_up_to_its_static_level_and_then_breaks_away() {
    let mut run = Run::new(&hinge(1.0), &[stribeck()], DT);
    for k in 0..500 {
        run.step(&[4.99 * (0.1 * f64::from(k)).sin()]);
        assert!(run.x[1].abs() < 1e-14 && run.x[0].abs() < 1e-14);
    }
    for _ in 0..500 {
        run.step(&[5.5]);
    }
    // Once in motion only the Coulomb level is left: up to 1 s at (5.5 − 2)/1 after a slow start.
    assert!(run.x[1] > 2.0, "{}", run.x[1]);
}

#[test]
fn load_dependent_friction_is_in_proportion_to_the_delivered_effort() {
    let effect = Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: one(0.2) });
    assert!((braking(std::slice::from_ref(&effect), 1.0, 10.0) - 2.0).abs() < 1e-9);
    assert!((braking(std::slice::from_ref(&effect), -1.0, 10.0) + 2.0).abs() < 1e-9);
    assert!(braking(std::slice::from_ref(&effect), 1.0, 0.0).abs() < 1e-9);
    let gain = Effect::TorqueGainError(TorqueGainError { gain: one(0.5) });
    assert!((braking(&[effect.clone(), gain], 1.0, 10.0) - (5.0 + 1.0)).abs() < 1e-9, "half the effort, half the load");
    // At rest against a wall of gravity it holds what it can: no chatter.
    let mut run = Run::new(&hinge(1.0), &[effect, Effect::CoulombFriction(CoulombFriction { coulomb: one(1.0) })], DT);
    for _ in 0..100 {
        run.step(&[1.2]);
        assert_eq!(run.x[1], 0.0);
    }
}

#[test]
fn thermal_drift_decays_from_cold_to_warm() {
    let effect = Effect::ThermalDrift(ThermalDrift { coulomb: one(4.0), ratio: one(0.25), time_constant: one(2.0) });
    let plant = Plant::new(&hinge(1e3), &[effect], DT).unwrap();
    for time in [0.0, 1.0, 2.0, 30.0] {
        let mut x = vec![0.0; plant.state_len()];
        plant.start_at(time, &[0.0], &[1.0], &mut x);
        plant.clone().step(&mut x, &[0.0]);
        let expected = 4.0 * (0.25 + 0.75 * (-time / 2.0_f64).exp());
        assert!((1e3 * (1.0 - x[1]) / DT - expected).abs() < 4e-3, "{time}");
    }
    // The clock runs: the loss of speed over 3 s is the integral of the law.
    let mut run = Run::new(
        &hinge(1e3),
        &[Effect::ThermalDrift(ThermalDrift { coulomb: one(4.0), ratio: one(0.25), time_constant: one(2.0) })],
        DT,
    );
    run.plant.start(&[0.0], &[1.0], &mut run.x);
    for _ in 0..1500 {
        run.step(&[0.0]);
    }
    let lost = 4.0 * (0.25 * 3.0 + 0.75 * 2.0 * (1.0 - (-1.5_f64).exp()));
    assert!((1e3 * (1.0 - run.x[1]) - lost).abs() < 0.005);
}

fn presliding(coulomb: f64, stiffness: f64) -> Effect {
    Effect::PreslidingFriction(PreslidingFriction { coulomb: one(coulomb), bristle_stiffness: one(stiffness) })
}

#[test]
fn presliding_friction_is_a_spring_at_small_motion_and_coulomb_when_sliding() {
    // Small: a hinge of 1 kg m² on 400 N m/rad vibrates at 20 rad/s. A quarter of a period later it stands, deflected by v/ω.
    let (fine, v) = (1e-5, 1e-4);
    let mut run = Run::new(&hinge(1.0), &[presliding(5.0, 400.0)], fine);
    run.plant.start(&[0.0], &[v], &mut run.x);
    for _ in 0..((std::f64::consts::FRAC_PI_2 / 20.0) / fine).round() as usize {
        run.step(&[0.0]);
    }
    assert!((run.x[0] - v / 20.0).abs() < 1e-3 * v / 20.0 && run.x[1].abs() < 1e-3 * v);
    // Sliding: after many lengths f/σ the braking torque is f.
    let mut run = Run::new(&hinge(1e3), &[presliding(5.0, 400.0)], DT);
    run.plant.start(&[0.0], &[1.0], &mut run.x);
    for _ in 0..100 {
        run.step(&[0.0]);
    }
    let before = run.x[1];
    run.step(&[0.0]);
    assert!((1e3 * (before - run.x[1]) / DT - 5.0).abs() < 1e-3);
}

#[test]
fn a_delay_of_samples_shifts_the_motion_by_them() {
    let model = hinge(0.5);
    let delayed = Effect::ActuationDelay(ActuationDelay { delay: 3.0 * DT });
    let (mut late, mut prompt) = (Run::new(&model, &[delayed], DT), Run::new(&model, &[], DT));
    let tau = |k: i32| if k < 0 { 0.0 } else { (0.2 * f64::from(k)).sin() };
    for k in 0..200 {
        late.step(&[tau(k)]);
        prompt.step(&[tau(k - 3)]);
        assert!((late.x[0] - prompt.x[0]).abs() < 1e-14);
    }
}

#[test]
fn a_delay_and_a_lag_are_the_same_at_any_step() {
    let effects = [
        Effect::ActuationDelay(ActuationDelay { delay: 0.0137 }),
        Effect::ActuatorLag(ActuatorLag { time_constant: 0.006 }),
    ];
    let (mut coarse, mut fine) = (Run::new(&hinge(0.5), &effects, DT), Run::new(&hinge(0.5), &effects, DT / 50.0));
    for k in 0..300 {
        let tau = [(0.3 * f64::from(k)).sin()];
        coarse.step(&tau);
        (0..50).for_each(|_| fine.step(&tau));
        assert!((coarse.x[1] - fine.x[1]).abs() < 1e-12, "speeds are integrals of the same effort");
        assert!((coarse.x[0] - fine.x[0]).abs() < 2e-6);
    }
}

#[test]
fn saturation_clips_after_gain_and_bias() {
    let effects = [
        Effect::TorqueSaturation(TorqueSaturation { limit: one(3.0) }),
        Effect::TorqueGainError(TorqueGainError { gain: one(2.0) }),
        Effect::TorqueBias(TorqueBias { bias: one(0.5) }),
        // The spring's rest position acts at the joint, not in the drive.
        Effect::ParallelSpring(ParallelSpring { stiffness: one(1e-9), rest_position: one(1e9) }),
    ];
    for (tau, expected) in [(1.0, 3.5), (2.0, 4.0), (-9.0, -2.0)] {
        let mut run = Run::new(&hinge(1.0), &effects, DT);
        run.step(&[tau]);
        assert!((run.x[1] / DT - expected).abs() < 1e-6);
    }
}

#[test]
fn ripple_is_periodic_in_position() {
    let effect = Effect::TorqueRipple(TorqueRipple { amplitude: one(2.0), cycles: one(8.0), phase: one(0.4) });
    let torque = |q: f64| {
        let mut plant = Plant::new(&hinge(1e3), std::slice::from_ref(&effect), DT).unwrap();
        let mut x = [q, 0.0];
        plant.step(&mut x, &[0.0]);
        1e3 * x[1] / DT
    };
    for q in [0.0, 0.1, 0.5, -1.0] {
        assert!((torque(q) - 2.0 * (8.0 * q + 0.4_f64).sin()).abs() < 1e-6);
        assert!((torque(q) - torque(q + std::f64::consts::TAU / 8.0)).abs() < 1e-6);
    }
}

#[test]
fn a_zero_offset_shifts_the_measured_position() {
    let model = robots::model("double_pendulum").unwrap().unwrap().model;
    let effect = Effect::JointZeroOffset(JointZeroOffset { offset: [("joint2".to_owned(), 0.2)].into() });
    let (mut shifted, mut plain) = (Run::new(&model, &[effect], DT), Run::new(&model, &[], DT));
    shifted.plant.start(&[0.4, 0.5], &[0.0, 1.0], &mut shifted.x);
    plain.plant.start(&[0.4, 0.3], &[0.0, 1.0], &mut plain.x);
    for _ in 0..300 {
        shifted.step(&[0.3, -0.1]);
        plain.step(&[0.3, -0.1]);
        assert!((shifted.x[0] - plain.x[0]).abs() < 1e-9 && (shifted.x[1] - plain.x[1] - 0.2).abs() < 1e-9);
        assert!((shifted.x[3] - plain.x[3]).abs() < 1e-9);
    }
}

#[test]
fn a_contact_pushes_at_its_point_inside_its_intervals_only() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let n = model.dof();
    let q = [0.3, -0.8, 1.1, 0.2, -0.4, 0.6];
    let force = [3.0, -5.0, 8.0];
    let link = 3;
    let offset = [0.03, -0.02, 0.05];
    let effect = Effect::ExternalContact(ExternalContact {
        link: model.joints()[link].link.clone(),
        intervals: vec![[1.0, 2.0], [3.0, 3.5 * DT + 3.0]],
        force,
        offset,
    });
    let change = |time: f64, tau: &[f64]| {
        let mut plant = Plant::new(&model, std::slice::from_ref(&effect), DT).unwrap();
        let mut x = vec![0.0; plant.state_len()];
        plant.start_at(time, &q, &[0.0; 6], &mut x);
        plant.step(&mut x, tau);
        x[n..2 * n].to_vec()
    };
    let center = model.joints()[link].inertia.center_of_mass().unwrap();
    let mut data = gapscope_dynamics::Data::new(&model);
    let mut jacobian = nalgebra::DMatrix::zeros(6, n);
    model.jacobian(&mut data, &q, link, center + glam::DVec3::from_array(offset), &mut jacobian);
    let push: Vec<f64> = (0..n).map(|j| (0..3).map(|i| jacobian[(i, j)] * force[i]).sum()).collect();
    let still = vec![0.0; n];
    for (time, share) in [(0.5, 0.0), (1.5, 1.0), (2.0, 0.0), (3.0 + 3.0 * DT, 0.5)] {
        let scaled: Vec<f64> = push.iter().map(|p| share * p).collect();
        for (with, without) in change(time, &still).iter().zip(change(0.0, &scaled)) {
            assert!((with - without).abs() < 1e-6, "{time}: {with} {without}");
        }
    }
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let refuse = |effect: Effect, expected: &str| {
        let error = Plant::new(&hinge(1.0), &[effect], DT).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refuse(
        Effect::StribeckFriction(StribeckFriction {
            coulomb: one(2.0),
            r#static: one(1.0),
            stribeck_velocity: one(0.1),
        }),
        "stribeck_friction: static is 1, but must be no less than `coulomb`",
    );
    refuse(
        Effect::PreslidingFriction(PreslidingFriction { coulomb: one(2.0), ..Default::default() }),
        "joint `joint1` has no `bristle_stiffness`",
    );
    refuse(Effect::ActuationDelay(ActuationDelay { delay: -0.1 }), "delay is -0.1");
    refuse(Effect::ExternalContact(ExternalContact { link: "tail".into(), ..Default::default() }), "`tail`");
}

#[test]
fn every_effect_survives_serde_under_its_public_names() {
    for effect in support::all("joint1") {
        let text = serde_json::to_string(&effect).unwrap();
        assert!(text.contains(&format!("\"kind\":\"{}\"", effect.kind())), "{text}");
        for parameter in effect.law().parameters() {
            assert!(text.contains(&format!("\"{}\"", parameter.name)), "{} in {text}", parameter.name);
        }
        assert_eq!(serde_json::from_str::<Effect>(&text).unwrap(), effect);
    }
    assert_eq!(support::all("joint1").iter().map(Effect::kind).collect::<Vec<_>>(), Kind::ALL);
}
