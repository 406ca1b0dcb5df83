//! Signatures against the plant: what an effect adds to the residual is the sum of its columns.

use crate::{common, support};

use common::{Draw, between, robot, rubbing};
use gapscope_dynamics::{Data, JointKind, Model, robots};
use gapscope_effects::{
    Candidate, Column, Effect, GravityMisalignment, Kind, Motion, Plant, TorqueBias, TorqueGainError, TorqueSaturation,
};
use std::collections::BTreeSet;
use support::motion;

/// Samples of every motion.
const SAMPLES: usize = 25;
/// Speed that counts as standing; every sample lies above it.
const STILL: f64 = 0.05;
const DT: f64 = 1e-3;

/// Random samples with the torque that the nominal robot needs for them.
struct Samples {
    q: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    a: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
    nominal: Vec<Vec<f64>>,
    still: Vec<f64>,
}

impl Samples {
    /// Every joint, and every sum and difference of two joints, moves.
    fn new(draw: &mut Draw, model: &Model) -> Samples {
        let n = model.dof();
        let signal = || vec![Vec::with_capacity(SAMPLES); n];
        let mut s =
            Samples { q: signal(), v: signal(), a: signal(), tau: signal(), nominal: signal(), still: vec![STILL; n] };
        let mut data = Data::new(model);
        while s.q[0].len() < SAMPLES {
            let (q, v, a) = (draw.numbers(n, 2.5), draw.numbers(n, 2.0), draw.numbers(n, 8.0));
            let moves = |i: usize| v[i].abs() > STILL;
            let pair = |i: usize, k: usize| (v[i] + v[k]).abs().min((v[i] - v[k]).abs()) > 2.0 * STILL;
            let parents = model.joints().iter().map(|joint| joint.parent).enumerate();
            if !(0..n).all(moves) || !parents.filter_map(|(k, p)| Some((p?, k))).all(|(i, k)| pair(i, k)) {
                continue;
            }
            let mut torque = vec![0.0; n];
            model.inverse_dynamics(&mut data, &q, &v, &a, &mut torque);
            for (j, joint) in model.joints().iter().enumerate() {
                s.q[j].push(q[j]);
                s.v[j].push(v[j]);
                s.a[j].push(a[j]);
                s.tau[j].push(draw.uniform(50.0));
                s.nominal[j].push(torque[j] + joint.damping * v[j] + joint.friction * v[j].signum());
            }
        }
        s
    }

    fn motion<'a>(&'a self, model: &'a Model) -> Motion<'a> {
        motion(model, [&self.q, &self.v, &self.a, &self.tau, &self.nominal], DT, &self.still)
    }

    /// Residual of a plant at every sample, joint-major.
    fn residual(&self, plant: &mut Plant) -> Vec<Vec<f64>> {
        let n = self.q.len();
        let mut out = vec![vec![0.0; SAMPLES]; n];
        let mut rest = vec![0.0; n];
        for k in 0..SAMPLES {
            let at = |signal: &[Vec<f64>]| signal.iter().map(|joint| joint[k]).collect::<Vec<f64>>();
            plant.residual(&at(&self.q), &at(&self.v), &at(&self.a), &at(&self.tau), &self.still, &mut rest);
            for (out, rest) in out.iter_mut().zip(&rest) {
                out[k] = *rest;
            }
        }
        out
    }

    /// Nominal residual less the residual with the effects.
    fn added(&self, model: &Model, effects: &[Effect]) -> Vec<Vec<f64>> {
        let mut added = self.residual(&mut Plant::nominal(model, DT));
        let with = self.residual(&mut Plant::new(model, effects, DT).unwrap());
        added.iter_mut().zip(&with).for_each(|(a, w)| a.iter_mut().zip(w).for_each(|(a, w)| *a -= w));
        added
    }
}

/// Σ θ_i · column_i, joint-major.
fn predicted(columns: &[Column], theta: &[f64], joints: usize) -> Vec<Vec<f64>> {
    assert_eq!(columns.len(), theta.len());
    let mut sum = vec![vec![0.0; SAMPLES]; joints];
    for (column, theta) in columns.iter().zip(theta) {
        for (joint, torque) in &column.rows {
            sum[*joint].iter_mut().zip(torque).for_each(|(sum, x)| *sum += theta * x);
        }
    }
    sum
}

fn largest_difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn largest(a: &[Vec<f64>]) -> f64 {
    a.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// Coefficients within their bounds; those of a payload belong to a real body, present or missing.
fn coefficients(draw: &mut Draw, model: &Model, candidate: &Candidate, columns: &[Column]) -> Vec<f64> {
    if [Kind::Payload, Kind::LinkInertiaError].contains(&candidate.kind) {
        let link = model.joints()[candidate.joints[0]].inertia;
        let body = draw.inertia();
        let part = between(draw, 0.1, 0.9);
        return match draw.below(2) {
            0 => body.parameters().to_vec(),
            _ => link.parameters().iter().map(|p| -part * p).collect(),
        };
    }
    let mut theta: Vec<f64> = columns
        .iter()
        .map(|c| {
            let low = c.at_least.max(-3.0);
            between(draw, low, c.at_most.min(low + 6.0))
        })
        .collect();
    if candidate.kind == Kind::ParallelSpring {
        theta[0] = between(draw, 0.5, 30.0);
    }
    theta
}

/// Kinds whose columns are exact to first order only, or that one sample does not show.
const INEXACT: [Kind; 3] = [Kind::LoadDependentFriction, Kind::GravityMisalignment, Kind::JointZeroOffset];

/// Every candidate whose columns are exact, sample by sample.
fn columns_are_what_the_effect_adds(model: &Model, draw: &mut Draw) {
    let samples = Samples::new(draw, model);
    let motion = samples.motion(model);
    let scale = 1.0 + largest(&samples.nominal);
    for candidate in Candidate::all(model).iter().filter(|c| !INEXACT.contains(&c.kind)) {
        let columns = candidate.columns(&motion);
        for _ in 0..3 {
            let theta = coefficients(draw, model, candidate, &columns);
            for (column, theta) in columns.iter().zip(&theta) {
                assert!((column.at_least..=column.at_most).contains(theta), "{candidate:?}: the test draws {theta}");
                assert!(column.rows.iter().all(|(j, x)| *j < model.dof() && x.len() == SAMPLES));
            }
            let effect = candidate.effects(model, &theta).pop().unwrap();
            assert_eq!(effect.kind(), candidate.kind);
            let added = samples.added(model, std::slice::from_ref(&effect));
            let error = largest_difference(&added, &predicted(&columns, &theta, model.dof()));
            assert!(error < 1e-11 * scale, "{}: {candidate:?} with {theta:?} differs by {error:e}", model.name());
            assert!(largest(&added) > 1e-9, "{candidate:?} adds nothing");
        }
    }
}

#[test]
fn columns_are_what_the_effect_adds_on_built_in_robots() {
    for (seed, name) in robots::NAMES.into_iter().enumerate() {
        let mut draw = Draw::new(seed as u64);
        let model = robot(name);
        columns_are_what_the_effect_adds(&model, &mut draw);
    }
}

/// Damping and friction declared in the URDF stand on both sides; sliding joints and branches too.
#[test]
fn columns_are_what_the_effect_adds_on_random_trees_that_rub() {
    for seed in 0..30 {
        let mut draw = Draw::new(seed);
        let tree = draw.tree(1 + seed as usize % 8);
        let model = rubbing(&mut draw, &tree);
        columns_are_what_the_effect_adds(&model, &mut draw);
    }
}

/// Linear effects stand side by side without touching each other.
#[test]
fn columns_of_several_effects_add_up() {
    let mut draw = Draw::new(11);
    let model = robot("arm7");
    let samples = Samples::new(&mut draw, &model);
    let motion = samples.motion(&model);
    let mut sum = vec![vec![0.0; SAMPLES]; 7];
    let mut effects = Vec::new();
    // Gain multiplies what the others add, and tilt meets the payload.
    let bends = |c: &&Candidate| c.kind == Kind::TorqueGainError || INEXACT.contains(&c.kind);
    for candidate in Candidate::all(&model).iter().filter(|c| !bends(c)) {
        let columns = candidate.columns(&motion);
        let theta = coefficients(&mut draw, &model, candidate, &columns);
        let part = predicted(&columns, &theta, 7);
        sum.iter_mut().zip(&part).for_each(|(s, p)| s.iter_mut().zip(p).for_each(|(s, p)| *s += p));
        effects.push(candidate.effects(&model, &theta).pop().unwrap());
    }
    let error = largest_difference(&samples.added(&model, &effects), &sum);
    assert!(error < 1e-10 * (1.0 + largest(&sum)), "{error:e}");
}

#[test]
fn tilt_is_exact_to_second_order_in_the_angle() {
    for (seed, name) in robots::NAMES.into_iter().enumerate() {
        let mut draw = Draw::new(100 + seed as u64);
        let model = robot(name);
        let samples = Samples::new(&mut draw, &model);
        let candidate = Candidate::new(Kind::GravityMisalignment, vec![]);
        let columns = candidate.columns(&samples.motion(&model));
        let error = |angle: f64| {
            let tilt = GravityMisalignment { roll: 0.8 * angle, pitch: -0.6 * angle };
            let g = tilt.gravity();
            let back = candidate.effects(&model, &[g.x, g.y]).pop().unwrap();
            let Effect::GravityMisalignment(back) = back else { panic!("{back:?}") };
            assert!((back.roll - tilt.roll).abs() < 1e-12 && (back.pitch - tilt.pitch).abs() < 1e-12);
            let added = samples.added(&model, &[Effect::GravityMisalignment(tilt)]);
            largest_difference(&added, &predicted(&columns, &[g.x, g.y], model.dof()))
        };
        let (whole, half) = (error(0.04), error(0.02));
        assert!(whole > 1e-6, "{name}: the second-order part is there: {whole:e}");
        assert!((3.95..4.05).contains(&(whole / half)), "{name}: {whole:e} at the angle, {half:e} at half of it");
    }
}

#[test]
fn no_tilt_beyond_a_right_angle() {
    let model = robot("arm6");
    let candidate = Candidate::new(Kind::GravityMisalignment, vec![]);
    for (x, y) in [(9.9, 0.0), (0.0, -9.9), (8.0, 8.0), (f64::NAN, 0.0), (f64::INFINITY, 0.0)] {
        assert!(candidate.effects(&model, &[x, y]).is_empty(), "({x}, {y})");
    }
}

#[test]
fn coefficients_that_no_effect_has_give_none() {
    let model = robot("arm6");
    let make = |kind, joints: &[usize], theta: &[f64]| {
        Candidate { shape: 1.0, ..Candidate::new(kind, joints.to_vec()) }.effects(&model, theta).pop()
    };
    assert_eq!(make(Kind::ParallelSpring, &[1], &[0.0, 2.0]), None, "a spring without stiffness has no rest position");
    assert_eq!(make(Kind::ParallelSpring, &[1], &[-3.0, 2.0]), None);
    assert_eq!(make(Kind::Payload, &[5], &[0.0; 10]), None);
    assert_eq!(make(Kind::Payload, &[5], &[1.0; 3]), None);
    assert_eq!(make(Kind::LinkInertiaError, &[2], &[1.0; 3]), None);
    assert_eq!(make(Kind::ViscousFriction, &[1], &[]), None);
    assert_eq!(make(Kind::JointCoupling, &[1], &[1.0, 1.0, 1.0]), None);
}

/// At and just inside every bound the plant takes the effect.
#[test]
fn coefficients_at_their_bounds_are_effects_that_the_plant_takes() {
    let mut draw = Draw::new(5);
    for model in [robot("arm7"), {
        let tree = draw.tree(6);
        rubbing(&mut draw, &tree)
    }] {
        let samples = Samples::new(&mut draw, &model);
        for candidate in Candidate::all(&model) {
            let columns = candidate.columns(&samples.motion(&model));
            let least: Vec<f64> =
                columns.iter().map(|c| if c.at_least.is_finite() { c.at_least } else { 0.0 }).collect();
            {
                let effects = candidate.effects(&model, &least);
                Plant::new(&model, &effects, DT).unwrap_or_else(|e| panic!("{candidate:?} {least:?}: {e}"));
            }
        }
    }
}

#[test]
fn a_robot_offers_every_kind_where_it_can_be() {
    for (name, joints) in robots::NAMES.into_iter().zip([7, 6, 2]) {
        let all = Candidate::all(&robot(name));
        // Eight laws a joint and one of its link, two sizes of a load, one base, and two signs of a coupling for each pair of
        // neighbours.
        assert_eq!(all.len(), (8 + 1) * joints + 2 + 1 + 2 * (joints - 1), "{name}");
        assert_eq!(
            all.iter().filter(|c| c.kind == Kind::Payload).map(|c| c.joints[0]).collect::<Vec<_>>(),
            [joints - 1; 2]
        );
        let kinds: BTreeSet<Kind> = all.iter().map(|c| c.kind).collect();
        let not_alone = |kind: &Kind| kind.card().turned_by_tangent().is_none() && !kind.card().is_late();
        let anywhere = |kind: &Kind| kind.card().turning.is_none() && !kind.card().of_its_log();
        assert_eq!(kinds, Kind::ALL.into_iter().filter(not_alone).filter(anywhere).collect(), "{name}");
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].contains(a), "{name}: {a:?} twice");
        }
    }
}

#[test]
fn couplings_join_neighbours_of_one_unit() {
    for seed in 0..20 {
        let mut draw = Draw::new(seed);
        let model = draw.tree(7);
        let slides = |j: usize| model.joints()[j].kind == JointKind::Prismatic;
        for c in Candidate::all(&model).iter().filter(|c| c.kind == Kind::JointCoupling) {
            assert_eq!(model.joints()[c.joints[1]].parent, Some(c.joints[0]));
            assert_eq!(slides(c.joints[0]), slides(c.joints[1]));
            assert_eq!(c.shape.abs(), 1.0);
        }
    }
}

#[test]
fn a_limit_acts_behind_the_gain_and_the_bias_of_its_drive() {
    let model = robots::model("arm6").unwrap().unwrap().model;
    let samples = Samples::new(&mut Draw::new(5), &model);
    let on = |value: f64| [(model.joints()[1].name.clone(), value)].into();
    let drive =
        [Effect::TorqueGainError(TorqueGainError { gain: on(1.2) }), Effect::TorqueBias(TorqueBias { bias: on(-6.0) })];
    let limited = [drive.to_vec(), vec![Effect::TorqueSaturation(TorqueSaturation { limit: on(30.0) })]].concat();
    let residual = |effects: &[Effect]| samples.residual(&mut Plant::new(&model, effects, DT).unwrap())[1].clone();
    let (free, cut) = (residual(&drive), residual(&limited));

    let drives = Plant::new(&model, &drive, DT).unwrap().drives();
    let motion = Motion { drives: &drives, ..samples.motion(&model) };
    let candidate = Candidate { shape: 30.0, ..Candidate::new(Kind::TorqueSaturation, vec![1]) };
    let column = &candidate.columns(&motion)[0].rows[0].1;
    assert!(column.iter().any(|x| *x > 1.0) && column.iter().any(|x| *x < -1.0), "{column:?}");
    for ((free, cut), beyond) in free.iter().zip(&cut).zip(column) {
        assert!((free - cut - beyond).abs() < 1e-9, "{free} {cut} {beyond}");
    }
}
