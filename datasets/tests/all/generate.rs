//! Simulated logs: the servo tracks, the sensors err as they say, the same seed gives the same log.

use crate::common;

use common::{all, built_in, drives, slider};
use gapscope_datasets::{Episode, GenerateError, Perturbation, Recipe, ReferenceKind, Sensors, Servo, generate};
use gapscope_dynamics::StepModel;
use gapscope_effects::{ActuationDelay, Armature, Effect, JointElasticity, Plant, TorqueBias};

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), x| (sum + x * x, count + 1));
    (sum / f64::from(count)).sqrt()
}

/// The greatest distance of any joint from its reference.
fn worst_error(log: &Episode) -> f64 {
    let command = log.command.as_ref().unwrap();
    let error = |j: usize| log.position[j].iter().zip(&command[j]).map(|(q, c)| (q - c).abs()).fold(0.0, f64::max);
    (0..log.joint_count()).map(error).fold(0.0, f64::max)
}

#[test]
fn both_servos_track_with_the_friction_and_rotors_of_real_drives() {
    for model in all() {
        for servo in [Servo::ComputedTorque, Servo::Pd] {
            // A slow servo that does not know the robot's inertia is soft, but it holds.
            for (rate, most) in [(500.0, 0.06), (100.0, if servo == Servo::Pd { 0.3 } else { 0.06 })] {
                let recipe = Recipe { seconds: 4.0, rate, servo, ..Recipe::default() };
                let log = generate(&model, &drives(&model), 5, &recipe, "a.csv").unwrap();
                let worst = worst_error(&log);
                assert!(worst < most, "{} {servo:?} at {rate} Hz: {worst}", model.name());
            }
        }
    }
}

#[test]
fn every_motion_is_tracked_and_late_effort_does_not_shake_the_robot() {
    let model = built_in("arm7");
    let mut effects = drives(&model);
    effects.push(Effect::ActuationDelay(ActuationDelay { delay: 0.016 }));
    for motion in [ReferenceKind::PointToPoint, ReferenceKind::Chirp, ReferenceKind::Sweep] {
        let recipe = Recipe { seconds: 4.0, motion, ..Recipe::default() };
        let worst = worst_error(&generate(&model, &effects, 1, &recipe, "a.csv").unwrap());
        assert!(worst < 0.08, "{motion:?}: {worst}");
    }
}

/// A link on a spring, its resonance below the servo's bandwidth with the motor held: over the link's own position no servo
/// of this bandwidth is stable.
#[test]
fn a_servo_closes_its_loop_over_the_motor_whatever_the_log_shows() {
    let model = slider();
    let on = |value: f64| [("rail".to_owned(), value)].into();
    let stiffness: f64 = 2.0 * (2.0 * std::f64::consts::PI * 5.0_f64).powi(2);
    let effects = [
        Effect::Armature(Armature { armature: on(1.5) }),
        Effect::JointElasticity(JointElasticity {
            stiffness: on(stiffness),
            damping: on(0.1 * (2.0 * stiffness).sqrt()),
        }),
    ];
    let [link, motor] = [false, true].map(|motor_encoders| {
        let recipe = Recipe { motor_encoders, sensors: Sensors::IDEAL, ..Recipe::default() };
        generate(&model, &effects, 4, &recipe, "a.csv").unwrap()
    });
    // The spring carries the weight of 2 kg: the link hangs lower than its motor.
    let sag = 2.0 * 9.81 / stiffness;
    let mean = |log: &Episode| {
        let command = &log.command.as_ref().unwrap()[0];
        log.position[0].iter().zip(command).skip(1000).map(|(q, c)| q - c).sum::<f64>() / 4000.0
    };
    assert!(mean(&motor).abs() < 0.1 * sag, "{}", mean(&motor));
    assert!((mean(&link) + sag).abs() < 0.1 * sag, "{} {sag}", mean(&link));
    assert!(worst_error(&motor) < 0.02 && worst_error(&link) < 0.05, "{} {}", worst_error(&motor), worst_error(&link));
}

#[test]
fn four_steps_a_sample_are_enough() {
    // The same efforts through a plant with steps a sixteenth as long: the states differ by little over a tenth of a second.
    let model = built_in("arm7");
    let effects = drives(&model);
    let recipe = Recipe { seconds: 2.0, sensors: Sensors::IDEAL, ..Recipe::default() };
    let log = generate(&model, &effects, 3, &recipe, "a.csv").unwrap();
    let mut worst: f64 = 0.0;
    for from in (0..900).step_by(50) {
        let ends: Vec<Vec<f64>> = [4, 64]
            .map(|substeps| {
                let mut plant = Plant::new(&model, &effects, 0.002 / f64::from(substeps)).unwrap();
                let mut x = vec![0.0; plant.state_len()];
                let speed: Vec<f64> = log.position.iter().map(|q| (q[from + 1] - q[from.max(1) - 1]) / 0.004).collect();
                plant.start(&log.position.iter().map(|q| q[from]).collect::<Vec<_>>(), &speed, &mut x);
                for k in from..from + 50 {
                    let effort: Vec<f64> = log.effort.iter().map(|e| e[k]).collect();
                    (0..substeps).for_each(|_| plant.step(&mut x, &effort));
                }
                x[..7].to_vec()
            })
            .into();
        worst = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
    }
    assert!(worst < 5e-6, "{worst:e}");
}

#[test]
fn the_same_seed_gives_the_same_log() {
    let model = built_in("arm6");
    let sensors = Sensors {
        encoder_step: 1e-4,
        velocity_cutoff: Some(50.0),
        clock_jitter: 1e-4,
        dropped: 0.1,
        ..Sensors::default()
    };
    let recipe = Recipe { seconds: 1.0, sensors, ..Recipe::default() };
    let log = |seed| generate(&model, &drives(&model), seed, &recipe, "a.csv").unwrap();
    assert_eq!(log(7), log(7));
    assert_ne!(log(7).position, log(8).position);
}

#[test]
fn sensors_err_as_they_say() {
    let model = slider();
    let log = |sensors| {
        let recipe = Recipe { seconds: 20.0, sensors, ..Recipe::default() };
        generate(&model, &[], 2, &recipe, "a.csv").unwrap()
    };
    let ideal = log(Sensors::IDEAL);
    assert!(ideal.velocity.is_none());
    let dt = 0.002;

    let step = 1e-4;
    let coarse = log(Sensors { encoder_step: step, ..Sensors::IDEAL });
    assert!(coarse.position[0].iter().all(|q| (q / step - (q / step).round()).abs() < 1e-6));

    // Second differences of white noise have six times its variance; those of the motion are far smaller.
    let noisy = log(Sensors { position_noise: 2e-5, ..Sensors::IDEAL });
    let noise = rms(noisy.position[0].windows(3).map(|q| q[0] - 2.0 * q[1] + q[2])) / 6f64.sqrt();
    assert!((noise / 2e-5 - 1.0).abs() < 0.05, "{noise}");

    let size = rms(ideal.effort[0].iter().copied());
    let differs = |sensors| {
        let other = log(sensors);
        assert_eq!(other.position, ideal.position, "the robot does not feel what its sensors add");
        rms(other.effort[0].iter().zip(&ideal.effort[0]).map(|(a, b)| a - b)) / size
    };
    let noise = differs(Sensors { effort_noise: 0.02, ..Sensors::IDEAL });
    assert!((noise / 0.02 - 1.0).abs() < 0.03, "{noise}");
    // What is left of one sample's noise at the next: e^{−dt/time}.
    let slow = log(Sensors { effort_noise: 0.02, effort_noise_time: 0.01, ..Sensors::IDEAL });
    let noise: Vec<f64> = slow.effort[0].iter().zip(&ideal.effort[0]).map(|(a, b)| a - b).collect();
    assert!((rms(noise.iter().copied()) / size / 0.02 - 1.0).abs() < 0.08);
    let kept = noise.windows(2).map(|n| n[0] * n[1]).sum::<f64>() / noise.iter().map(|n| n * n).sum::<f64>();
    assert!((kept - (-0.2f64).exp()).abs() < 0.03, "{kept}");
    let current = log(Sensors { effort_step: 0.05, ..Sensors::IDEAL });
    let off = |e: &f64| (e / (0.05 * size) - (e / (0.05 * size)).round()).abs();
    assert!(current.effort[0].iter().all(|e| off(e) < 1e-6));
    // The servo does not feel how the log rounds.
    let counts = log(Sensors { log_step: step, velocity_cutoff: Some(50.0), ..Sensors::IDEAL });
    assert_eq!(counts.effort, ideal.effort);
    for (counted, q) in counts.position[0].iter().zip(&ideal.position[0]) {
        assert!((counted - q).abs() <= 0.5 * step * (1.0 + 1e-9));
    }
    let ripple = differs(Sensors { effort_ripple: 0.02, ..Sensors::IDEAL });
    assert!((ripple * 2f64.sqrt() / 0.02 - 1.0).abs() < 0.1, "{ripple}");

    let late = log(Sensors { clock_jitter: 1e-4, ..Sensors::IDEAL });
    let jitter = rms(late.time.iter().zip(&ideal.time).map(|(a, b)| a - b));
    assert!((jitter / 1e-4 - 1.0).abs() < 0.03, "{jitter}");
    let wild = log(Sensors { clock_jitter: 1e-2, ..Sensors::IDEAL });
    assert!(wild.time.windows(2).all(|t| t[1] > t[0]));

    let gappy = log(Sensors { dropped: 0.05, ..Sensors::IDEAL });
    let lost = 1.0 - gappy.len() as f64 / ideal.len() as f64;
    assert!((lost - 0.05).abs() < 0.01, "{lost}");
    for (time, q) in gappy.time.iter().zip(&gappy.position[0]) {
        assert_eq!(ideal.position[0][(time / dt).round() as usize], *q);
    }
    assert_eq!((gappy.time[0], gappy.time.last()), (0.0, ideal.time.last()));

    // A first-order filter of 5 Hz lags by 1/(2π·5) s behind a motion of far lower frequency.
    let filtered = log(Sensors { velocity_cutoff: Some(5.0), ..Sensors::IDEAL });
    let velocity = &filtered.velocity.as_ref().unwrap()[0];
    let lag = (1.0 / (2.0 * std::f64::consts::PI * 5.0) / dt).round() as usize;
    let slope = |k: usize| (ideal.position[0][k + 1] - ideal.position[0][k - 1]) / (2.0 * dt);
    let late = rms((1000..9000).map(|k| velocity[k] - slope(k - lag)));
    let prompt = rms((1000..9000).map(|k| velocity[k] - slope(k)));
    assert!(late < 0.2 * prompt, "{late} {prompt}");
}

#[test]
fn numbers_that_cannot_be_are_errors() {
    let model = slider();
    let fails = |recipe: Recipe, named: &str| match generate(&model, &[], 0, &recipe, "a") {
        Err(GenerateError::Recipe { name, .. }) => assert_eq!(name, named),
        other => panic!("{named}: {other:?}"),
    };
    let recipe = Recipe::default();
    fails(Recipe { rate: 0.0, ..recipe }, "rate");
    fails(Recipe { rate: f64::NAN, ..recipe }, "rate");
    fails(Recipe { substeps: 0, ..recipe }, "substeps");
    fails(Recipe { seconds: 1e9, ..recipe }, "seconds");
    fails(Recipe { seconds: -1.0, ..recipe }, "seconds");
    fails(Recipe { sensors: Sensors { dropped: 1.0, ..Sensors::IDEAL }, ..recipe }, "dropped");
    fails(Recipe { sensors: Sensors { position_noise: -1.0, ..Sensors::IDEAL }, ..recipe }, "position_noise");
    fails(Recipe { sensors: Sensors { velocity_cutoff: Some(0.0), ..Sensors::IDEAL }, ..recipe }, "velocity_cutoff");
    let elsewhere = Effect::TorqueBias(TorqueBias { bias: [("elbow".to_owned(), 1.0)].into() });
    assert!(matches!(generate(&model, &[elsewhere], 0, &recipe, "a"), Err(GenerateError::Effect(_))));
}

#[test]
fn perturbed_bodies_are_physical_and_spread_as_stated() {
    let size = Perturbation { mass: 0.1, center_of_mass: 0.1, stretch: 0.1, coulomb: 0.02, viscous: 0.03 };
    let mut logs = Vec::new();
    for model in all() {
        for seed in 0..100 {
            let effects = size.draw(&model, seed);
            assert_eq!(effects, size.draw(&model, seed));
            let plant = Plant::new(&model, &effects, 0.001).unwrap();
            for (before, after) in model.joints().iter().zip(plant.model().joints()) {
                let (before, after) = (before.inertia, after.inertia);
                assert!(!before.is_physical() || after.is_physical(), "{after:?}");
                assert_ne!(before, after);
                logs.push((after.mass / before.mass).ln());
            }
            let coulomb = effects.iter().find_map(|e| if let Effect::CoulombFriction(e) = e { Some(e) } else { None });
            assert_eq!(coulomb.unwrap().coulomb.len(), model.dof());
        }
    }
    let spread = rms(logs.iter().copied());
    assert!((spread - 0.1).abs() < 0.005, "{spread}");
    assert!(Perturbation::scaled(0.0).draw(&built_in("arm7"), 3).is_empty());
}
