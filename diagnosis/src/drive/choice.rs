//! Whether a drive that turns on its own takes the place of a rigid one in what was chosen.

use super::{Account, NOTHING, Through};
use crate::diagnose::{Logs, Progress};
use crate::estimate::Fit;
use crate::gap;
use crate::problem::{Problem, Term};
use crate::search::{A_KIND, Chosen, Turned, weighing};
use crate::select;
use crate::verdict::Level;
use gapscope_effects::{Candidate, EffectError, Kind};
use statrs::function::erf::erfc;

/// A drive is an account of its joint if with it this part of what the joint was left with is left, ...
pub(super) const OF_JOINT: f64 = 0.25;
/// ... or so many times the noise, ...
const OF_FLOOR: f64 = 3.0;
/// ... or what is nobody's concern, as a part of the effort's variation. A resonance of its own takes half of anything that
/// sways.
const OF_EFFORT: f64 = 0.01;
/// Where no more than noise is left of a joint, an account must be better by so many standard errors: one chance in twenty
/// over the hundred or so knobs, sides and joints that are tried.
pub(super) const IN_NOISE: f64 = 3.3;
/// A spring seen through a filter must leave this part of what its joint leaves there; one that leaves more of its joint is
/// looked for there once more.
pub(super) const HALF: f64 = 0.5;
/// Another account of a drive is better where it leaves this part of the gap.
pub(super) const BETTER: f64 = 0.95;
/// Kinds that a first look may have taken for a drive that turns on its own; the rotor is part of it.
pub(crate) const STANDS_IN: [Kind; 9] = [
    Kind::Armature,
    Kind::LinkInertiaError,
    Kind::Payload,
    Kind::TorqueGainError,
    Kind::JointZeroOffset,
    Kind::TorqueSaturation,
    Kind::TorqueBias,
    Kind::ParallelSpring,
    Kind::GravityMisalignment,
];
/// Accounts of drives that are tried beside the whole set.
const ACCOUNTS: usize = 2;

/// A choice with a drive that turns on its own in place of a rigid one.
struct Better {
    chosen: Chosen,
    /// What it leaves of all joints in a typical block, with the cost of its kinds.
    level: f64,
    /// Whether it is a spring that leaves more than half of its joint.
    loud: bool,
    /// Whether hardly more than noise is left.
    settled: bool,
}

/// What a drive must do better than what was chosen.
struct Bar<'a> {
    logs: &'a Logs<'a>,
    chosen: &'a Chosen,
    weights: Vec<f64>,
    /// What that leaves on held-out data, block by block.
    left: Vec<Vec<f64>>,
}

impl<'a> Bar<'a> {
    fn new(logs: &'a Logs<'a>, chosen: &'a Chosen) -> Result<Bar<'a>, EffectError> {
        let weights = gap::weights_of_concern(logs.model, &logs.signals, &logs.moving);
        let left = left_by(logs, chosen, None)?;
        Ok(Bar { logs, chosen, weights, left })
    }

    /// Whether what is left of a joint is more than noise.
    fn more_than_noise(&self, joint: usize) -> bool {
        let own = gap::of_joint(&self.weights, joint);
        let rest = gap::weighted_rms(&gap::total(&self.left), &own);
        let floor = gap::weighted_floor(&self.chosen.noise, &own);
        Level { before: rest, after: rest, floor }.leaves_any()
    }

    /// The choice with an account of a drive, if it clears the bar; seen through a filter it must leave less there than
    /// another such choice, too.
    fn cleared(&self, next: Chosen, account: &Account, other: Option<&Better>) -> Result<Option<Better>, EffectError> {
        let joint = account.drive.joints[0];
        let own = gap::of_joint(&self.weights, joint);
        let (through, logs) = (account.through, self.logs);
        let before = if through.is_some() { &left_by(logs, self.chosen, through)? } else { &self.left };
        let after = left_by(logs, &next, through)?;
        let plain = if through.is_some() { &left_by(logs, &next, None)? } else { &after };
        let rms = |blocks: &[Vec<f64>]| gap::weighted_rms(&gap::total(blocks), &own);
        let typical = |blocks: &[Vec<f64>], weights: &[f64]| gap::mean_level(blocks, weights, NOTHING);
        let loud = account.drive.kind == Kind::JointElasticity && rms(plain) > HALF * rms(&self.left);
        let (own_before, own_after) = (typical(before, &own), typical(&after, &own));
        let most = OF_JOINT * own_before;
        let explains = if through.is_some() {
            let least = other.map(|other| left_by(logs, &other.chosen, through)).transpose()?;
            least.is_none_or(|least| rms(&after) < rms(&least)) && (rms(&after) < HALF * rms(before) || !loud)
        } else if self.more_than_noise(joint) {
            let floor = gap::weighted_floor(&next.noise, &own);
            own_after < (BETTER * own_before).min(most.max(OF_FLOOR * floor).max(OF_EFFORT))
        } else {
            // An account that takes a part of what may all be noise follows noise.
            own_after < most
        };
        let there = next.exact.entries.iter().any(|e| e.candidate.turns());
        let left = typical(&after, &self.weights);
        if !there || !explains || left > typical(before, &self.weights) {
            return Ok(None);
        }
        let level = left * (1.0 + A_KIND * select::kinds(&next.exact, &next.fit.set).len() as f64);
        // Impacts that are not yet followed pass for noise: much of the joint's gap must be gone as well.
        let settled = level < OF_FLOOR * gap::weighted_floor(&next.noise, &self.weights) && own_after < most;
        Ok(Some(Better { chosen: next, level, loud, settled }))
    }
}

/// What a choice leaves on held-out data, block by block.
fn left_by(logs: &Logs<'_>, chosen: &Chosen, through: Option<Through>) -> Result<Vec<Vec<f64>>, EffectError> {
    logs.left_by_block(&chosen.exact, &chosen.fit.set, through)
}

impl Logs<'_> {
    /// Puts a spring or play in the drive of one of some joints where an account with it leaves less of that joint than the
    /// set does, at its exact law: once beside all else that was found; unless hardly more than noise is left by that, once
    /// without what may have stood in for it; and where noise may have drowned what a spring does, once through a filter.
    pub(crate) fn drive(&self, best: Chosen, joints: &[usize], progress: Progress<'_>) -> Result<Chosen, EffectError> {
        if joints.is_empty() {
            return Ok(best);
        }
        let bar = Bar::new(self, &best)?;
        let mut better: Option<Better> = None;
        let of = |kinds: &[Kind]| -> Vec<usize> {
            let is = |&i: &usize| kinds.contains(&best.exact.entries[i].candidate.kind);
            (0..best.exact.entries.len()).filter(is).collect()
        };
        let (rotors, stand_ins) = (of(&[Kind::Armature]), of(&STANDS_IN));
        for (gone, through) in [(&[Kind::Armature][..], false), (&STANDS_IN, false), (&[Kind::Armature], true)] {
            if better.as_ref().is_some_and(|better| better.settled || (through && !better.loud)) {
                break;
            }
            let all_but =
                |out: &[usize]| (0..best.exact.entries.len()).filter(|i| !out.contains(i)).collect::<Vec<_>>();
            let others = if gone == STANDS_IN {
                if stand_ins == rotors {
                    continue;
                }
                let rest: Vec<Candidate> =
                    all_but(&stand_ins).into_iter().map(|i| best.exact.entries[i].candidate.clone()).collect();
                self.data(&best.noise).refine(&rest)?
            } else {
                (best.exact.clone(), Fit { set: all_but(&rotors), ..best.fit.clone() })
            };
            let joints: Vec<usize> = joints.iter().copied().filter(|&j| !through || bar.more_than_noise(j)).collect();
            for account in self.accounts(&joints, &others.0, &others.1, through)?.into_iter().take(ACCOUNTS) {
                let joint = account.drive.joints[0];
                if !bar.more_than_noise(joint) && account.beyond < IN_NOISE {
                    continue;
                }
                let (all, place) = self.with_rotor(&best, joint);
                let leaves = |c: usize| {
                    let candidate = &all.entries[c].candidate;
                    gone.contains(&candidate.kind) && (gone == STANDS_IN || candidate.joints.contains(&joint))
                };
                let mut set: Vec<usize> = best.choice.set.iter().copied().filter(|&c| !leaves(c)).collect();
                set.push(place);
                set.sort_unstable();
                set.dedup();
                let turned = Turned {
                    place,
                    drive: account.drive.clone(),
                    doubt: 0.5 * erfc(account.beyond / std::f64::consts::SQRT_2),
                };
                let next = self.converge(all, set, best.noise.clone(), Some(turned), progress)?;
                if let Some(found) = bar.cleared(next, &account, better.as_ref())? {
                    if through || better.as_ref().is_none_or(|better| found.level < better.level) {
                        better = Some(found);
                    }
                    break;
                }
            }
        }
        Ok(better.map_or(best, |better| better.chosen))
    }

    /// All candidates of a choice, and among them the place of a joint's rotor, in case the choice was made without rotors.
    fn with_rotor(&self, chosen: &Chosen, joint: usize) -> (Problem, usize) {
        let rotor = Candidate::new(Kind::Armature, vec![joint]);
        let entries = &chosen.all.entries;
        if let Some(place) = entries.iter().position(|e| e.candidate == rotor) {
            return (chosen.all.clone(), place);
        }
        let open = |candidate: Candidate| Term { candidate, tangent_at: None };
        let candidates = entries.iter().map(|e| e.candidate.clone()).chain([rotor]);
        (self.data(&chosen.noise).problem(candidates.map(open).collect(), &weighing()), entries.len())
    }

    /// A choice with a drive made anew among all laws, those outside the catalogue included, as they stand in `laws`; nothing
    /// where they lack one of its set.
    pub(crate) fn beside(
        &self,
        chosen: &Chosen,
        turned: &Turned,
        mut laws: Problem,
        progress: Progress<'_>,
    ) -> Result<Option<Chosen>, EffectError> {
        let same = |a: &Candidate, b: &Candidate| a.kind == b.kind && a.joints == b.joints;
        let place = |c: usize| {
            let candidate = &chosen.all.entries[c].candidate;
            let at = laws.entries.iter().position(|e| same(&e.candidate, candidate))?;
            Some((at, candidate.clone()))
        };
        let places: Option<Vec<(usize, Candidate)>> = chosen.choice.set.iter().map(|&c| place(c)).collect();
        let (Some(changes), Some((rotor, _))) = (places, place(turned.place)) else { return Ok(None) };
        laws.replace(self.model, &self.signals, &self.band, &self.still, &changes);
        let mut set: Vec<usize> = changes.iter().map(|(at, _)| *at).collect();
        set.sort_unstable();
        set.dedup();
        let turned = Some(Turned { place: rotor, ..turned.clone() });
        self.converge(laws, set, chosen.noise.clone(), turned, progress).map(Some)
    }
}
