//! Reference motions: within the limits, smooth, the same for the same seed, and informative.

use crate::common;

use common::{all, built_in, slider, tree};
use gapscope_datasets::{Reference, ReferenceError, ReferenceKind, excitation};
use gapscope_dynamics::{Data, Inertia, JointKind, Model};
use glam::{DMat3, DVec3};

const PLAIN: [ReferenceKind; 4] =
    [ReferenceKind::Fourier, ReferenceKind::PointToPoint, ReferenceKind::Chirp, ReferenceKind::Sweep];
const SECONDS: f64 = 12.0;

fn assert_within_limits(model: &Model, motion: &Reference, what: &str) {
    let mut data = Data::new(model);
    let mut effort = vec![0.0; model.dof()];
    let mut travel = vec![(f64::INFINITY, f64::NEG_INFINITY); model.dof()];
    for i in 0..=5000 {
        let (q, v, a) = motion.at(SECONDS * f64::from(i) / 5000.0);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut effort);
        for (j, joint) in model.joints().iter().enumerate() {
            let limits = joint.limits;
            let what = format!("{what}: joint {j} of {}", model.name());
            if joint.kind != JointKind::Continuous {
                assert!(limits.lower.is_none_or(|low| q[j] >= low), "{what} at {}", q[j]);
                assert!(limits.upper.is_none_or(|high| q[j] <= high), "{what} at {}", q[j]);
            }
            assert!(limits.velocity.is_none_or(|most| v[j].abs() <= most), "{what} moves at {}", v[j]);
            let needed = effort[j].abs() + joint.damping * v[j].abs() + joint.friction;
            assert!(limits.effort.is_none_or(|most| needed <= most), "{what} takes {needed}");
            travel[j] = (travel[j].0.min(q[j]), travel[j].1.max(q[j]));
        }
    }
    for (j, (low, high)) in travel.into_iter().enumerate() {
        assert!(high - low > 0.005, "{what}: joint {j} of {} moves by {}", model.name(), high - low);
    }
}

#[test]
fn every_motion_keeps_to_the_limits_of_every_robot() {
    for model in all() {
        for kind in PLAIN {
            for seed in 0..8 {
                let speed = [0.5, 1.0, 2.5][seed as usize % 3];
                let motion = Reference::draw(kind, &model, seed, speed, SECONDS).unwrap();
                assert_within_limits(&model, &motion, &format!("{kind:?}, seed {seed}"));
            }
        }
        let motion = Reference::draw(ReferenceKind::Optimised, &model, 1, 1.0, SECONDS).unwrap();
        assert_within_limits(&model, &motion, "optimised");
    }
}

#[test]
fn velocity_and_acceleration_are_the_derivatives() {
    for model in [built_in("arm6"), slider(), tree()] {
        for kind in PLAIN {
            let motion = Reference::draw(kind, &model, 3, 1.3, SECONDS).unwrap();
            let h = 1e-5;
            for t in (1..60).map(|i| 0.19 * f64::from(i)) {
                let ((before, v0, _), (_, v, a), (after, v1, _)) = (motion.at(t - h), motion.at(t), motion.at(t + h));
                for j in 0..model.dof() {
                    let slope = [(after[j] - before[j]) / (2.0 * h), (v1[j] - v0[j]) / (2.0 * h)];
                    // Accelerations of sweeps and moves have kinks.
                    assert!(
                        (slope[0] - v[j]).abs() < 1e-6 * (1.0 + v[j].abs()),
                        "{kind:?} at {t}: {} {}",
                        slope[0],
                        v[j]
                    );
                    assert!(
                        (slope[1] - a[j]).abs() < 1e-3 * (1.0 + a[j].abs()),
                        "{kind:?} at {t}: {} {}",
                        slope[1],
                        a[j]
                    );
                }
            }
        }
    }
}

#[test]
fn a_seed_is_a_motion() {
    let model = built_in("arm7");
    for kind in PLAIN {
        let draw = |seed| Reference::draw(kind, &model, seed, 1.0, SECONDS).unwrap();
        assert_eq!(draw(5), draw(5));
        assert_ne!(draw(5), draw(6), "{kind:?}");
    }
    let double = built_in("double_pendulum");
    let draw = |seed| Reference::draw(ReferenceKind::Optimised, &double, seed, 1.0, SECONDS).unwrap();
    assert_eq!(draw(5), draw(5));
}

#[test]
fn the_optimised_motion_tells_parameters_better_than_random_ones() {
    for name in ["arm7", "arm6", "double_pendulum"] {
        let model = built_in(name);
        let judge = |kind, seed| excitation(&model, &Reference::draw(kind, &model, seed, 1.0, 10.0).unwrap(), 10.0);
        let best = judge(ReferenceKind::Optimised, 0);
        let mut random: Vec<_> = (0..15).map(|seed| judge(ReferenceKind::Fourier, 100 + seed)).collect();
        assert!(random.iter().all(|one| best.information > one.information), "{name}");
        random.sort_by(|a, b| a.condition.total_cmp(&b.condition));
        // With few parameters almost any motion separates them; what is left to gain is their size.
        let (typical, best) = (random[7].condition, best.condition);
        assert!(name == "double_pendulum" || best < typical, "{name}: {best} against {typical}");
    }
}

#[test]
fn moves_pause_and_sweeps_go_both_ways_at_one_speed() {
    let model = built_in("arm7");
    let still = |kind| {
        let motion = Reference::draw(kind, &model, 2, 1.0, SECONDS).unwrap();
        (0..1200).filter(|i| motion.at(0.01 * f64::from(*i)).1.iter().all(|&v| v == 0.0)).count()
    };
    assert!(still(ReferenceKind::PointToPoint) > 300);
    let sweep = Reference::draw(ReferenceKind::Sweep, &model, 2, 1.0, SECONDS).unwrap();
    for j in 0..7 {
        let speeds: Vec<f64> = (0..1200).map(|i| sweep.at(0.01 * f64::from(i)).1[j]).collect();
        let top = speeds.iter().fold(0.0, |top: f64, v| top.max(v.abs()));
        let share = |sign: f64| speeds.iter().filter(|&&v| sign * v > 0.999 * top).count() as f64 / 1200.0;
        assert!(share(1.0) > 0.25 && share(-1.0) > 0.25, "joint {j}: {} {}", share(1.0), share(-1.0));
    }
}

#[test]
fn what_leaves_no_motion_is_an_error() {
    let model = slider();
    let draw = |model: &Model, speed, seconds| Reference::draw(ReferenceKind::Fourier, model, 0, speed, seconds);
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(draw(&model, wrong, 1.0), Err(ReferenceError::NotPositive { name: "speed", .. })));
        assert!(matches!(draw(&model, 1.0, wrong), Err(ReferenceError::NotPositive { name: "seconds", .. })));
    }
    // 50 kg on a drive of 40 N.
    let heavy = slider().with_inertia(0, Inertia::from_com(50.0, DVec3::ZERO, DMat3::IDENTITY));
    let error = draw(&heavy, 1.0, 5.0).unwrap_err();
    assert!(error.to_string().contains("rail") && error.to_string().contains("490.7"), "{error}");
}
