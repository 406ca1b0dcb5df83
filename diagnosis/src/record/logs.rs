//! What was measured: the signals of all logs, and what of them is compared.

use crate::record::band::Band;
use crate::record::data::Data;
use crate::record::known::Known;
use crate::record::signals::{Signals, standstill};
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use gapscope_effects::Candidate;
use rayon::prelude::*;

/// Part of its noise that a second run has once more: so little that play hits its stops as it did.
pub(crate) const PART_OF_NOISE: f64 = 0.3;

/// A joint moves if this part of its samples is in motion, ...
const MOVING_PART: f64 = 0.05;
/// ... and its top speed is this many times the speed that counts as standing.
const MOVING_SPEED: f64 = 8.0;

/// A stage of the work with the part of the whole that is done when it begins, 0 to 1.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// What is being compared.
pub struct Record<'a> {
    /// The nominal robot.
    pub model: &'a Model,
    /// Signals of every episode that is long enough.
    pub signals: Vec<Signals>,
    /// The same logs with a part of the noise of their positions once more.
    pub noisier: Vec<Signals>,
    /// The rows that are compared.
    pub band: Band,
    /// Speed per joint below which it stands.
    pub still: Vec<f64>,
    /// Joints that tell anything.
    pub moving: Vec<bool>,
    /// Columns that are the same in every problem of these logs.
    pub known: Known,
    /// What may have pushed from outside, with its force as far as it is known.
    pub contacts: Vec<Candidate>,
}

impl<'a> Record<'a> {
    /// The logs of a robot. What cannot be used, and why, goes to the findings.
    pub fn new(model: &'a Model, episodes: &[Episode], findings: &mut Vec<String>) -> Record<'a> {
        let used = with_episodes(model, episodes, findings);
        let noisier = noisier(model, &used);
        let signals: Vec<Signals> = used.into_iter().map(|(signals, _)| signals).collect();
        let still = standstill(&signals, model.dof());
        let mut moving = moving(&signals, &still, model, findings);
        // A joint whose effort is not known keeps its place in the dynamics of the others, without rows of its own.
        for &j in episodes.iter().flat_map(|episode| &episode.effort_unknown) {
            moving[j] = false;
        }
        let band = Band::new(&signals);
        let contacts = Candidate::contacts(model);
        Record { model, signals, noisier, band, still, moving, known: Known::default(), contacts }
    }

    /// What a problem is made from; `noise` is the noise floor of each joint.
    pub fn data<'b>(&'b self, noise: &'b [f64]) -> Data<'b> {
        Data {
            model: self.model,
            signals: &self.signals,
            band: &self.band,
            standstill: &self.still,
            moving: &self.moving,
            noise,
            known: &self.known,
        }
    }
}

/// Signals of every episode that is long enough.
pub fn signals(model: &Model, episodes: &[Episode], findings: &mut Vec<String>) -> Vec<Signals> {
    with_episodes(model, episodes, findings).into_iter().map(|(signals, _)| signals).collect()
}

/// The same, each with its episode: names need not tell them apart.
fn with_episodes<'a>(
    model: &Model,
    episodes: &'a [Episode],
    findings: &mut Vec<String>,
) -> Vec<(Signals, &'a Episode)> {
    let all: Vec<Option<Signals>> = episodes.par_iter().map(|episode| Signals::new(model, episode)).collect();
    for (episode, signals) in episodes.iter().zip(&all) {
        if signals.is_none() {
            findings.push(format!("{}: too short to use ({:.2} s)", episode.name, episode.duration()));
        }
    }
    all.into_iter().zip(episodes).filter_map(|(signals, episode)| Some((signals?, episode))).collect()
}

/// The logs behind some signals with a part of their noise once more, see [`Signals::noisier`].
fn noisier(model: &Model, used: &[(Signals, &Episode)]) -> Vec<Signals> {
    let noisier = |(seed, (signals, episode)): (usize, &(Signals, &Episode))| {
        signals.noisier(model, episode, PART_OF_NOISE, seed as u64)
    };
    used.par_iter().enumerate().filter_map(noisier).collect()
}

/// Which joints tell anything: those that move enough, under an effort that was logged.
fn moving(signals: &[Signals], still: &[f64], model: &Model, findings: &mut Vec<String>) -> Vec<bool> {
    model
        .joints()
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let constant = |effort: &[f64]| effort.windows(2).all(|pair| pair[0] == pair[1]);
            if !signals.is_empty() && signals.iter().all(|s| constant(&s.effort[j])) {
                findings.push(format!(
                    "{}: no effort of it was logged: nothing is said about it, and its motion counts for the others alone",
                    joint.name
                ));
                return false;
            }
            let speeds = || signals.iter().flat_map(|s| s.v[j].iter()).map(|v| v.abs());
            let in_motion = speeds().filter(|v| *v >= still[j]).count() as f64;
            let moves = in_motion >= MOVING_PART * speeds().count() as f64
                && in_motion > 0.0
                && speeds().fold(0.0, f64::max) > MOVING_SPEED * still[j];
            if !moves && !signals.is_empty() {
                findings.push(format!("{}: hardly moves in these logs, so nothing is said about it", joint.name));
            }
            moves
        })
        .collect()
}
