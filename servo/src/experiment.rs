//! The next experiment of a servo arm: which set points would tell what these logs tell worst.
//!
//! Of a library of motions within the robot's limits the one is taken under which that number's variance is least, logs and
//! motion together, if the arm is as it was found (c-optimality; Pukelsheim, Optimal Design of Experiments, chapter 2).

use crate::choose::Chosen;
use crate::fit::{fit, normal};
use crate::follow::follow;
use crate::given::Given;
use crate::interval::{REACH, Spread};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::model::ServoModel;
use crate::prepare::{Joint, joints};
use crate::schema::NextExperiment;
use crate::weigh::weigh;
use gapscope_datasets::{Episode, Reference, ReferenceKind, Trajectory};
use gapscope_dynamics::Model;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Name of the file that holds the motion.
pub const FILE: &str = "next_experiment.csv";
/// Length of the motion, s, and rate of its samples, Hz.
const LENGTH: (f64, f64) = (20.0, 100.0);
/// Families with their paces and what they are called.
const LIBRARY: [(ReferenceKind, f64, &str); 7] = [
    (ReferenceKind::Sweep, 0.5, "slow runs to and fro at constant speed"),
    (ReferenceKind::Sweep, 1.0, "runs to and fro at constant speed"),
    (ReferenceKind::PointToPoint, 1.0, "moves between postures with pauses"),
    (ReferenceKind::PointToPoint, 2.0, "fast moves between postures with pauses"),
    (ReferenceKind::Fourier, 1.0, "sums of sines"),
    (ReferenceKind::Fourier, 2.0, "fast sums of sines"),
    (ReferenceKind::Chirp, 1.0, "sines of growing frequency"),
];
/// A number known to this part of itself needs no further experiment.
const KNOWN: f64 = 0.1;
/// A motion that narrows the interval by less than this factor is not worth a run.
const WORTH: f64 = 1.5;

/// What is often next to nothing, and then nothing to look for.
const NEAR_ZERO: [Param; 3] = [Param::Latency, Param::Offset, Param::Bias];

/// What to log next, and the set points themselves where they would help.
pub type Proposal = (NextExperiment, Option<Trajectory>);

/// What was found of one joint.
pub struct Found<'a> {
    /// The joint with its runs.
    pub joint: &'a Joint,
    /// Its account; `None` where it does not move.
    pub chosen: Option<&'a Chosen>,
    /// How well the logs determine it.
    pub spread: Option<&'a Spread>,
}

/// The number of a joint that the logs tell worst, of those that the diagnosis names.
struct Worst {
    joint: usize,
    param: Param,
    /// Half its interval over its size.
    part: f64,
}

/// The public name of a parameter, of the effect that has it or of the drive.
fn name(chosen: &Chosen, param: Param) -> Option<String> {
    let drive = match param {
        Param::Scale => Some("the drive's stiffness"),
        Param::Damping => Some("the drive's damping"),
        Param::Latency => Some("the drive's latency"),
        Param::Feedforward => Some("the drive's feed-forward"),
        _ => None,
    };
    let has = |kind: &&Kind| kind.parameters().iter().any(|(own, _, _)| *own == param);
    let kind = chosen.kinds.iter().map(|(kind, _)| kind).find(has);
    kind.map(|kind| kind.name().replace('_', " ")).or(drive.map(str::to_owned))
}

fn worst(found: &[Found]) -> Option<Worst> {
    let of = |(j, found): (usize, &Found)| {
        let (chosen, spread) = (found.chosen?, found.spread?);
        let part = |param: &Param| {
            let value = chosen.fit.law[*param].abs();
            let half = REACH * spread.deviation(*param)?;
            // A time or an angle of next to nothing is known well, however wide its interval beside it.
            let least = if NEAR_ZERO.contains(param) { found.joint.ranges.scale[*param as usize] } else { 0.0 };
            let told = value.is_finite() && value > least && half.is_finite() && name(chosen, *param).is_some();
            told.then_some(Worst { joint: j, param: *param, part: half / value })
        };
        chosen.fit.free.iter().filter_map(part).max_by(|a, b| a.part.total_cmp(&b.part))
    };
    found.iter().enumerate().filter_map(of).max_by(|a, b| a.part.total_cmp(&b.part))
}

/// What would tell the worst known number better; `None` where all are known well, or no motion would.
pub fn next_experiment(model: &Model, corrected: &ServoModel, found: &[Found]) -> Option<Proposal> {
    if found.iter().all(|found| found.chosen.is_none()) {
        return Some(to_excite(model));
    }
    let worst = worst(found).filter(|worst| worst.part > KNOWN)?;
    let Found { joint, chosen, spread } = &found[worst.joint];
    let (chosen, spread) = ((*chosen)?, (*spread)?);
    let known = Known::new(joint, chosen, spread)?;
    let at = chosen.fit.free.iter().position(|param| *param == worst.param)?;
    let tried: Vec<(f64, usize, Trajectory)> = (0..LIBRARY.len())
        .into_par_iter()
        .filter_map(|i| {
            let motion = motion(model, LIBRARY[i].0, LIBRARY[i].1)?;
            Some((known.with(&run(model, corrected, &motion)?, worst.joint, at)?, i, motion))
        })
        .collect();
    // The first of equals: the order of the library does not depend on the number of threads.
    let (variance, i, motion) = tried.into_iter().reduce(|best, other| if other.0 < best.0 { other } else { best })?;
    let there = REACH * variance.sqrt() / chosen.fit.law[worst.param].abs();
    if there * WORTH > worst.part {
        return None;
    }
    let name = format!("{} at {}", name(chosen, worst.param)?, joint.name);
    let percent =
        |part: f64| if part > 1.0 { "more than 100 %".to_owned() } else { format!("{:.0} %", (100.0 * part).max(1.0)) };
    let would = if there > 1.0 {
        format!("known {:.1} times as well", worst.part / there)
    } else {
        format!("known to about {}", percent(there))
    };
    let next = NextExperiment {
        why: format!("{name} is known to {} of itself", percent(worst.part)),
        separates: vec![],
        motion: format!(
            "send {FILE} as set points (look for collisions first): {} of all joints, {} s. {name} would then be {would}",
            LIBRARY[i].2, LENGTH.0,
        ),
        trajectory: Some(FILE.to_owned()),
        separation: None,
    };
    Some((next, Some(motion)))
}

/// Where nothing moved, any motion of all joints.
fn to_excite(model: &Model) -> Proposal {
    let (kind, pace, words) = LIBRARY[4];
    let trajectory = if model.dof() > 0 { motion(model, kind, pace) } else { None };
    let motion = match &trajectory {
        Some(_) => {
            format!("send {FILE} as set points (look for collisions first): {words} of all joints, {} s", LENGTH.0)
        }
        None => {
            "send every joint through a good part of its range, at several speeds, in both directions, for 20 s or more"
                .to_owned()
        }
    };
    let next = NextExperiment {
        why: "the joints hardly move in these logs".to_owned(),
        separates: vec![],
        motion,
        trajectory: trajectory.is_some().then(|| FILE.to_owned()),
        separation: None,
    };
    (next, trajectory)
}

fn motion(model: &Model, kind: ReferenceKind, pace: f64) -> Option<Trajectory> {
    let (seconds, rate) = LENGTH;
    let reference = Reference::draw(kind, model, 0, pace, seconds).ok()?;
    let joints = model.joints().iter().map(|joint| joint.name.clone()).collect();
    Some(Trajectory::sample(&reference, joints, seconds, rate))
}

/// The arm that was found under a motion's set points: its joints with the run, and their laws in its units.
fn run(model: &Model, corrected: &ServoModel, motion: &Trajectory) -> Option<(Vec<Joint>, Vec<Law>)> {
    let log: Episode = follow(model, corrected, FILE, motion.time.clone(), motion.position.clone()).ok()?;
    let mut all = joints(model, std::slice::from_ref(&log), &Given::default());
    let laws = corrected.laws(&mut all).ok()?;
    all.iter_mut().zip(&laws).for_each(|(joint, law)| weigh(joint, law));
    Some((all, laws))
}

/// What the logs tell of a joint's free parameters.
struct Known<'a> {
    chosen: &'a Chosen,
    /// Weight of a sample, rms: the motion's count as those of the logs do.
    weight: f64,
    /// Inverse of the covariance.
    information: DMatrix<f64>,
    /// Variance of a sample's error, each worth as much as a sample of the logs: theirs are coloured.
    noise: f64,
}

impl<'a> Known<'a> {
    fn new(joint: &Joint, chosen: &'a Chosen, spread: &Spread) -> Option<Known<'a>> {
        let fit = &chosen.fit;
        let weights = joint.runs.iter().flat_map(|run| &run.weight).filter(|weight| **weight > 0.0);
        let counted = weights.clone().count();
        let weight = (weights.map(|weight| weight * weight).sum::<f64>() / counted.max(1) as f64).sqrt();
        let (plain, _) = normal(&fit.sensitivity, &fit.errors);
        let white = fit.cost / counted.max(1) as f64;
        let p = fit.free.len();
        let covariance = spread.covariance();
        let information = covariance.clone().try_inverse()?;
        // How much wider the intervals are than white errors of this size would make them.
        let inverse = plain.try_inverse()?;
        let wider =
            (0..p).map(|i| covariance[(i, i)] / (white * inverse[(i, i)])).filter(|x| x.is_finite()).sum::<f64>();
        Some(Known { chosen, weight, information, noise: white * (wider / p as f64).max(1.0) })
    }

    /// Variance of a free parameter once a run was logged too.
    fn with(&self, (all, laws): &(Vec<Joint>, Vec<Law>), joint: usize, at: usize) -> Option<f64> {
        let (own, law) = (&all[joint], &laws[joint]);
        let mut runs = own.runs.clone();
        runs.iter_mut().for_each(|run| run.weight.fill(self.weight));
        let fit = fit(law, &self.chosen.fit.free, &runs, &own.ranges, 0);
        let (mut gained, _) = normal(&fit.sensitivity, &fit.errors);
        // A drive that follows a voltage has other units of torque there than one that follows set points.
        let free = &self.chosen.fit.free;
        let unit = |i: usize| match (law[free[i]], self.chosen.fit.law[free[i]]) {
            (there, here) if here != 0.0 && (there / here).is_finite() => there / here,
            _ => 1.0,
        };
        for i in 0..free.len() {
            for j in 0..free.len() {
                gained[(i, j)] *= unit(i) * unit(j) / self.noise;
            }
        }
        let variance = (&self.information + gained).try_inverse()?[(at, at)];
        (variance.is_finite() && variance > 0.0).then_some(variance)
    }
}
