//! Signatures of effects with a knob or a memory against the plant, along whole runs.

use crate::{common, support};

use common::robot;
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{
    Candidate, CoulombFriction, Effect, EncoderSide, JointCoupling, JointZeroOffset, Kind, LinkInertiaError,
    LoadDependentFriction, Motion, Payload, Plant, Range,
};
use support::motion;

const DT: f64 = 0.002;
const SAMPLES: usize = 2000;
const STILL: f64 = 0.02;

/// A smooth run under the torque that the nominal robot needs for it and a little more.
struct Run {
    q: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    a: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
    nominal: Vec<Vec<f64>>,
    still: Vec<f64>,
}

impl Run {
    fn new(model: &Model) -> Run {
        let n = model.dof();
        let wave = |j: usize, k: usize, order: i32| {
            let (omega, phase) = (1.5 + 0.7 * j as f64, 0.4 * j as f64);
            let turned = omega * k as f64 * DT + phase + f64::from(order) * std::f64::consts::FRAC_PI_2;
            0.8 * omega.powi(order) * turned.sin()
        };
        let signal =
            |order| -> Vec<Vec<f64>> { (0..n).map(|j| (0..SAMPLES).map(|k| wave(j, k, order)).collect()).collect() };
        let (q, v, a) = (signal(0), signal(1), signal(2));
        let mut data = Data::new(model);
        let (mut nominal, mut torque) = (vec![Vec::new(); n], vec![0.0; n]);
        for k in 0..SAMPLES {
            let at = |x: &[Vec<f64>]| x.iter().map(|joint| joint[k]).collect::<Vec<f64>>();
            model.inverse_dynamics(&mut data, &at(&q), &at(&v), &at(&a), &mut torque);
            nominal.iter_mut().zip(&torque).for_each(|(row, t)| row.push(*t));
        }
        let tau = nominal.iter().zip(&v).map(|(t, v)| t.iter().zip(v).map(|(t, v)| t + 0.3 * v).collect()).collect();
        Run { q, v, a, tau, nominal, still: vec![STILL; n] }
    }

    fn motion<'a>(&'a self, model: &'a Model) -> Motion<'a> {
        let Run { q, v, a, tau, nominal, still } = self;
        Motion { start: 0.5, pushed: &[[1.0, 2.0]], ..motion(model, [q, v, a, tau, nominal], DT, still) }
    }
}

/// What a candidate with coefficients adds to the residual by its columns and by the plant, and the greatest of both where
/// every joint moves, away from the ends of the run.
fn compare(model: &Model, candidate: &Candidate, theta: &[f64]) -> (f64, f64) {
    compare_on(&Run::new(model), model, candidate, theta)
}

fn compare_on(run: &Run, model: &Model, candidate: &Candidate, theta: &[f64]) -> (f64, f64) {
    let motion = run.motion(model);
    let mut effects = candidate.effects(model, theta);
    assert!(effects.iter().any(|e| e.kind() == candidate.kind), "{candidate:?} gives {effects:?}");
    for effect in &mut effects {
        if let Effect::ExternalContact(contact) = effect {
            contact.intervals = motion.pushed.to_vec();
        }
    }
    let without = Plant::nominal(model, DT).residuals(&motion);
    let mut plant = Plant::new(model, &effects, DT).unwrap();
    if candidate.side == EncoderSide::Motor {
        plant = plant.with_motor_encoders();
    }
    let with = plant.residuals(&motion);
    let columns = candidate.columns(&motion);
    assert_eq!(columns.len(), theta.len(), "{candidate:?}");
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for j in 0..model.dof() {
        for k in 150..SAMPLES - 150 {
            if run.v.iter().any(|v| v[k].abs() < STILL) {
                continue;
            }
            let sum: f64 = columns
                .iter()
                .zip(theta)
                .flat_map(|(c, t)| c.rows.iter().filter(|(row, _)| *row == j).map(move |(_, x)| t * x[k]))
                .sum();
            let added = without[j][k] - with[j][k];
            worst = worst.max((added - sum).abs());
            largest = largest.max(added.abs());
        }
    }
    (worst, largest)
}

fn with_shape(kind: Kind, joints: Vec<usize>, shape: f64) -> Candidate {
    Candidate { shape, ..Candidate::new(kind, joints) }
}

/// A contact of the hand whose point is found about some force.
fn pushed_by(force: [f64; 3]) -> Candidate {
    Candidate { force, ..Candidate::new(Kind::ExternalContact, vec![5]) }
}

#[test]
fn columns_with_a_knob_are_what_the_effect_adds() {
    let model = robot("arm6");
    for (candidate, theta) in [
        (with_shape(Kind::StribeckFriction, vec![1], 0.3), vec![2.0, 1.5]),
        (with_shape(Kind::PreslidingFriction, vec![2], 40.0), vec![3.0]),
        (with_shape(Kind::ThermalDrift, vec![0], 2.5), vec![1.0, 2.0]),
        (with_shape(Kind::TorqueSaturation, vec![1], 20.0), vec![1.0]),
        (with_shape(Kind::TorqueRipple, vec![3], 12.0), vec![0.4, -0.3]),
        (with_shape(Kind::ActuationDelay, vec![], 0.0071), vec![0.0071]),
        (Candidate::new(Kind::ExternalContact, vec![5]), vec![5.0, -3.0, 8.0]),
        (pushed_by([5.0, -3.0, 8.0]), vec![5.0, -3.0, 8.0, 0.02, -0.01, 0.03]),
    ] {
        let (worst, largest) = compare(&model, &candidate, &theta);
        // A push begins inside a sample for the plant and at one for its signature.
        assert!(largest > 0.01, "{candidate:?} adds {largest:e}");
        let edge = if candidate.kind == Kind::ExternalContact { 0.6 } else { 1e-9 };
        assert!(worst < edge * largest, "{candidate:?} differs by {worst:e} of {largest:e}");
    }
}

/// Halving what is small quarters what the first order leaves out.
#[test]
fn columns_of_offset_and_load_are_exact_to_first_order() {
    let model = robot("arm6");
    for (candidate, theta) in [
        (Candidate::new(Kind::JointZeroOffset, vec![1]), vec![0.02]),
        (Candidate::new(Kind::LoadDependentFriction, vec![2]), vec![0.08]),
    ] {
        let half: Vec<f64> = theta.iter().map(|t| 0.5 * t).collect();
        let ((whole, largest), (half, _)) = (compare(&model, &candidate, &theta), compare(&model, &candidate, &half));
        assert!(whole < 0.1 * largest, "{candidate:?}: {whole:e} of {largest:e}");
        assert!(half < 0.35 * whole, "{candidate:?}: {half:e} at half of what leaves {whole:e}");
    }
}

/// What a wrong zero does hangs on what the joint carries: a tool of a tenth of the arm's mass may double it at a wrist.
#[test]
fn the_column_of_an_offset_is_that_of_the_bodies_that_were_found() {
    let model = robot("arm6");
    let tool = Payload { joint: "joint6".into(), mass: 2.0, com: [0.02, 0.03, 0.1], inertia: [0.0; 6] };
    let with = |offset: f64| {
        let zero = JointZeroOffset { offset: std::iter::once(("joint4".to_owned(), offset)).collect() };
        Plant::new(&model, &[Effect::Payload(tool.clone()), Effect::JointZeroOffset(zero)], DT).unwrap()
    };
    let run = Run::new(&model);
    let found = with(0.0).model().clone();
    let motion = run.motion(&model);
    let (offset, candidate) = (1e-3, Candidate::new(Kind::JointZeroOffset, vec![3]));
    let (more, less) = (with(offset).residuals(&motion), with(-offset).residuals(&motion));
    let column = |bodies: &Model| candidate.columns(&Motion { bodies, ..motion });
    let off = |bodies: &Model| {
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for (j, row) in &column(bodies)[0].rows {
            for k in 0..row.len() {
                let exact = (more[*j][k] - less[*j][k]) / (2.0 * offset);
                (worst, largest) = (worst.max((row[k] + exact).abs()), largest.max(exact.abs()));
            }
        }
        worst / largest
    };
    assert!(off(&found) < 1e-3, "{}", off(&found));
    assert!(off(&model) > 0.2, "{}", off(&model));
}

/// Where logs show next to no mass of a link, what was found has its centre of mass anywhere: the push stays where it was.
#[test]
fn a_push_acts_where_the_described_link_has_its_centre_whatever_was_found_of_the_link() {
    let model = robot("arm6");
    let joint = &model.joints()[5];
    let light = Effect::LinkInertiaError(LinkInertiaError {
        joint: joint.name.clone(),
        mass_delta: -0.99 * joint.inertia.mass,
        first_moment_delta: [0.0; 3],
        inertia_delta: [0.0; 6],
    });
    let run = Run::new(&model);
    let motion = run.motion(&model);
    let (candidate, force) = (Candidate::new(Kind::ExternalContact, vec![5]), [5.0, -3.0, 8.0]);
    let Some(Effect::ExternalContact(mut push)) = candidate.effects(&model, &force).pop() else { unreachable!() };
    push.intervals = motion.pushed.to_vec();
    let push = Effect::ExternalContact(push);
    let columns = candidate.columns(&motion);
    let residuals = |effects: &[Effect]| Plant::new(&model, effects, DT).unwrap().residuals(&motion);
    let without = residuals(std::slice::from_ref(&light));
    for effects in [[light.clone(), push.clone()], [push, light]] {
        let with = residuals(&effects);
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for j in 0..model.dof() {
            // Away from where the push begins and ends.
            for k in (0..SAMPLES).filter(|k| [250, 750].iter().all(|edge: &usize| k.abs_diff(*edge) > 2)) {
                let of = |(c, t): (&gapscope_effects::Column, &f64)| {
                    c.rows.iter().filter(|(row, _)| *row == j).map(|(_, x)| t * x[k]).sum::<f64>()
                };
                let told: f64 = columns.iter().zip(&force).map(of).sum();
                worst = worst.max((without[j][k] - with[j][k] - told).abs());
                largest = largest.max(told.abs());
            }
        }
        assert!(largest > 1.0 && worst < 1e-9 * largest, "{worst:e} of {largest:e}");
    }
}

/// Its column is of the torque that the motion takes, its residual where the effort acts: they differ by what the run leaves.
#[test]
fn the_column_of_a_lag_is_nearly_what_it_adds() {
    let (worst, largest) = compare(&robot("arm6"), &Candidate::new(Kind::ActuatorLag, vec![]), &[0.012]);
    assert!(largest > 0.1 && worst < 0.1 * largest, "{worst:e} of {largest:e}");
}

/// With a rotor as heavy as its link, which a signature takes for granted, an elastic drive adds what its columns say, on
/// either side of the encoder.
#[test]
fn knobs_lie_in_the_range_of_the_joint() {
    let range = Range { speed: 2.0, least: -0.7, span: 1.5, torque: 30.0, duration: 10.0 };
    for candidate in Candidate::knobs(std::slice::from_ref(&range)).into_iter().chain(Candidate::scanned(
        Kind::TorqueRipple,
        0,
        &range,
    )) {
        assert!(candidate.shape.is_finite() && candidate.shape > 0.0, "{candidate:?}");
    }
    let idle = Range { speed: 0.0, least: 0.0, span: 0.0, torque: 0.0, duration: 0.0 };
    let kinds: Vec<Kind> = Candidate::knobs(std::slice::from_ref(&idle)).iter().map(|c| c.kind).collect();
    assert!(kinds.iter().all(|k| matches!(k, Kind::ActuationDelay | Kind::ActuatorLag)), "{kinds:?}");
    assert!(Candidate::scanned(Kind::TorqueRipple, 0, &idle).is_empty());
}

/// A joint looked at alone, all else along its measured motion, leaves what the whole plant leaves of it.
#[test]
fn one_joint_alone_is_the_plant_to_first_order() {
    let model = robot("arm6");
    let run = Run::new(&model);
    let motion = run.motion(&model);
    let (joint, rotor) = (1, 0.8);
    let runs = Plant::nominal(&model, DT).joint_runs(&motion);
    let inertia = runs[joint].inertia.iter().sum::<f64>() / SAMPLES as f64;
    for side in [EncoderSide::Link, EncoderSide::Motor] {
        for (kind, shape) in [(Kind::Armature, 0.0), (Kind::JointElasticity, 9.0), (Kind::Backlash, 0.004)] {
            let drive = Candidate { shape, side, inertia, ..Candidate::new(kind, vec![joint]) };
            let mut plant = Plant::new(&model, &drive.effects(&model, &[rotor]), DT).unwrap();
            if side == EncoderSide::Motor {
                plant = plant.with_motor_encoders();
            }
            let whole = &plant.residuals(&motion)[joint];
            let alone = runs[joint].left_by(&drive, rotor);
            let rigid = runs[joint].left_by(&Candidate::new(Kind::Armature, vec![joint]), rotor);
            let rms = |x: &[f64], y: &[f64]| {
                (x.iter().zip(y).skip(400).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / (SAMPLES - 400) as f64).sqrt()
            };
            let (differs, adds) = (rms(whole, &alone), rms(whole, &rigid));
            let bends = if kind == Kind::Armature || drive.side == EncoderSide::Link { 0.05 } else { 0.1 };
            assert!(differs < 1e-12 + bends * adds, "{kind:?} {side:?}: differ by {differs:e} of {adds:e}");
            assert!(kind == Kind::Armature || adds > 5e-3, "{kind:?} {side:?} adds {adds:e}");
        }
    }
}

/// A servo's answer to its encoder's noise loads the gear as well: on average the drive delivers more than the smooth effort
/// loses, and a plant that knows the noise leaves nothing.
#[test]
fn friction_under_the_load_of_a_noisy_effort_goes_by_its_mean_size() {
    let model = support::hinge(0.2);
    let (coefficient, effort, noise, samples) = (0.2, 0.5, 1.0, 50);
    let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let mean_size: f64 =
        (-800..=800).map(|i| f64::from(i) * 1e-2).map(|z| (effort + noise * z).abs() * density(z) * 1e-2).sum();
    let needed = effort - coefficient * mean_size;
    let of = |x: f64| vec![vec![x; samples]];
    let (q, v, a, tau, nominal) = (of(0.0), of(1.0), of(needed / 0.2), of(effort), of(needed));
    let still = [STILL];
    let friction =
        LoadDependentFriction { load_coefficient: std::iter::once(("joint1".to_owned(), coefficient)).collect() };
    let left = |noise: &[f64]| {
        let motion = Motion { effort_noise: noise, ..motion(&model, [&q, &v, &a, &tau, &nominal], DT, &still) };
        let mut plant = Plant::new(&model, &[Effect::LoadDependentFriction(friction.clone())], DT).unwrap();
        plant.residuals(&motion)[0][samples / 2]
    };
    assert!(left(&[noise]).abs() < 1e-4, "{}", left(&[noise]));
    assert!(left(&[]).abs() > 0.05, "{}", left(&[]));
}

/// Each newton metre more that a joint takes needs more of a loaded gear, or less where the load drives the joint.
#[test]
fn what_a_gear_needs_is_the_slope_of_the_plant() {
    let inertia = 0.2;
    let model = support::hinge(inertia);
    let friction = LoadDependentFriction { load_coefficient: std::iter::once(("joint1".to_owned(), 0.2)).collect() };
    let mut plant = Plant::new(&model, &[Effect::LoadDependentFriction(friction)], DT).unwrap();
    let of = |x: f64| vec![vec![x; 50]];
    let (q, tau, still) = (of(0.0), of(0.0), [STILL]);
    for (noise, needed, speed) in [(&[][..], 0.5, 1.0), (&[], 0.5, -1.0), (&[], -0.5, 1.0), (&[0.7], 0.5, 1.0)] {
        let v = of(speed);
        let effort = |plant: &mut Plant, needed: f64| {
            let a = of(needed / inertia);
            let motion = motion(&model, [&q, &v, &a, &tau, &tau], DT, &still);
            -plant.residuals(&Motion { effort_noise: noise, ..motion })[0][25]
        };
        let load = of(effort(&mut plant, needed));
        let step = 1e-5;
        let slope = (effort(&mut plant, needed + step) - effort(&mut plant, needed - step)) / (2.0 * step);
        let a = of(needed / inertia);
        let motion = motion(&model, [&q, &v, &a, &tau, &load], DT, &still);
        let gear = plant.gears(&Motion { effort_noise: noise, load: &load, ..motion })[0][25];
        assert!((gear - slope).abs() < 1e-5 && (gear - 1.0).abs() > 0.1, "{gear} and {slope}");
    }
    let v = of(0.5 * STILL);
    let motion = motion(&model, [&q, &v, &tau, &tau, &tau], DT, &still);
    assert_eq!(plant.gears(&motion)[0], [1.0; 50], "a joint that stands");
}

/// What friction holds at rest is told from the mean of what is needed: the noise of an encoder's acceleration exceeds it by far.
#[test]
fn a_joint_that_slips_at_its_greatest_friction_leaves_the_noise_of_its_acceleration_and_not_its_mean_size() {
    let (inertia, friction, samples) = (0.2, 1.0, 400);
    let model = support::hinge(inertia);
    let of = |x: f64| vec![vec![x; samples]];
    let noise = vec![(0..samples).map(|k| if k % 2 == 0 { 20.0 } else { -20.0 }).collect::<Vec<f64>>()];
    let mean_left = |effort: f64| {
        let (q, v, tau) = (of(0.0), of(0.5 * STILL), of(effort));
        let still = [STILL];
        let motion = motion(&model, [&q, &v, &noise, &tau, &tau], DT, &still);
        let coulomb = std::iter::once(("joint1".to_owned(), friction)).collect();
        let effects = [Effect::CoulombFriction(CoulombFriction { coulomb })];
        let left = &Plant::new(&model, &effects, DT).unwrap().residuals(&motion)[0];
        // Away from the ends, where the mean is of fewer samples.
        let inner = &left[100..samples - 100];
        inner.iter().sum::<f64>() / inner.len() as f64
    };
    assert!((mean_left(1.25) - 0.25).abs() < 1e-9, "{}", mean_left(1.25));
    assert!((mean_left(-1.25) + 0.25).abs() < 1e-9, "{}", mean_left(-1.25));
    assert_eq!(mean_left(0.8), 0.0, "it holds");
}

/// A coupling holds 0.6 N m, each joint 0.1 N m by itself: torques that pull the joints apart are shared, sample by sample and
/// beside noise that exceeds all of it.
#[test]
fn joints_that_a_coupling_joins_hold_together_what_their_frictions_can() {
    let model = robot("double_pendulum").with_gravity(glam::DVec3::ZERO);
    let names: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let coupling = JointCoupling {
        joints: [names[0].clone(), names[1].clone()],
        ratio: -1.0,
        coulomb: 0.6,
        viscous: 0.0,
        armature: 0.0,
    };
    let own = CoulombFriction { coulomb: names.iter().map(|name| (name.clone(), 0.1)).collect() };
    let effects = [Effect::JointCoupling(coupling), Effect::CoulombFriction(own)];
    let mut plant = Plant::new(&model, &effects, DT).unwrap();
    let samples = 400;
    let still = [STILL; 2];
    for (effort, left) in [
        ([0.65, -0.65], [0.0, 0.0]),
        ([0.8, -0.8], [0.1, -0.1]),
        ([0.15, 0.02], [0.0, 0.0]),
        ([0.4, 0.05], [0.125, 0.125]),
    ] {
        let mut rest = [f64::NAN; 2];
        plant.residual(&[0.3, -0.4], &[0.0; 2], &[0.0; 2], &effort, &still, &mut rest);
        assert!((0..2).all(|j| (rest[j] - left[j]).abs() < 1e-6), "{rest:?} of {effort:?}");
        let of = |x: [f64; 2]| x.map(|x| vec![x; samples]).to_vec();
        let noise = (0..2).map(|_| (0..samples).map(|k| if k % 2 == 0 { 20.0 } else { -20.0 }).collect());
        let noise: Vec<Vec<f64>> = noise.collect();
        let (q, v, tau) = (of([0.3, -0.4]), of([0.5 * STILL; 2]), of(effort));
        let along = plant.residuals(&motion(&model, [&q, &v, &noise, &tau, &tau], DT, &still));
        for j in 0..2 {
            let inner = &along[j][100..samples - 100];
            let mean = inner.iter().sum::<f64>() / inner.len() as f64;
            assert!((mean - left[j]).abs() < 1e-3, "{mean} of {effort:?}");
        }
    }
    // The first rests while the second turns: the coupling slides, and the first holds by itself what that leaves.
    let of = |x: [f64; 2]| x.map(|x| vec![x; samples]).to_vec();
    let noise: Vec<f64> = (0..samples).map(|k| if k % 2 == 0 { 20.0 } else { -20.0 }).collect();
    for (effort, left) in [([-0.55, 0.7], 0.0), ([-0.9, 0.7], -0.2)] {
        let (q, v, tau) = (of([0.3, -0.4]), of([0.0, 20.0 * STILL]), of(effort));
        let along = plant.residuals(&motion(&model, [&q, &v, &[noise.clone(), noise.clone()], &tau, &tau], DT, &still));
        let inner = &along[0][100..samples - 100];
        let mean = inner.iter().sum::<f64>() / inner.len() as f64;
        assert!((mean - left).abs() < 1e-2, "{mean} of {effort:?}");
    }
}
