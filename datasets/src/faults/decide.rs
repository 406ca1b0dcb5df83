//! Which account of the motion is the likeliest, and whether that is beyond doubt.

use super::change::Change;
use super::effort;
use super::motion::{self, Account, Kind, Scene};
use super::sample::Sample;
use super::weigh::{Weighed, weigh_either};
use super::words::{per_cent, phrase};
use super::{Doubt, Fault, Twin};
use crate::check::Logs;
use crate::time_stamps::LONGEST_STEP;
use gapscope_dynamics::Model;

/// Places of the first look.
const GLANCE: usize = 150;
/// Accounts that are weighed, the likeliest at the first look.
const MOST: usize = 9;
/// An account is weighed where it is better than the log as it is by this at the first look, a sum of logarithms.
const SEEN: f64 = 0.4;
/// By how much, in nats, an account must be the likelier one for no doubt to be left, ...
pub(crate) const SURE: f64 = 15.0;
/// ... and for a question. Of 324 healthy arms one reached 5.5, and none else 1.
const LIKELY: f64 = 8.0;
/// By how much it must be likelier than any other account that is not as logged.
const APART: f64 = 6.0;
/// What an account costs by itself, in nats: units, zeros, clocks and orders are tried by the hundred.
const COST: f64 = 5.0;
/// What a clock gains, in nats, by steps of time that no log has, or by velocities that are all off by its factor; and a unit by
/// each joint that it brings back from far beyond its limits.
const BESIDE: f64 = 30.0;
/// Zeros off by less than this are an effect, rad.
const ZERO: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Under its own name a joint leaves at most this part of what it left under another's, squared: a spring beside friction that
/// nobody knows makes exchanged names leave a third.
const OWN: f64 = 0.25;
/// A joint that leaves less than this of its effort, squared, under either name does not tell which is its own.
const NEXT_TO_NOTHING: f64 = 0.01;
/// A log asks next to nothing of the robot where it asks, in nats, less than this part of what it does as logged.
const AS_DESCRIBED: f64 = 0.2;
/// An account is none where it leaves more than this of the effort, as a geometric mean of squared shares.
const EXPLAINS: f64 = 0.45;
/// Of two joints under each other's names one may leave as much as before, where it leaves less than this of its effort, squared.
const NOTABLE: f64 = 0.05;

/// How much of the effort an account leaves, as a geometric mean over the joints that count.
pub(crate) fn left(weighed: &Weighed, active: &[bool]) -> f64 {
    let logs: Vec<f64> =
        weighed.unexplained.iter().zip(active).filter(|(_, active)| **active).map(|(u, _)| u.min(1.0).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp()
}

/// What a decision rests on.
pub(crate) struct Decision<'a> {
    /// The robot.
    pub model: &'a Model,
    /// Whether one log speaks for itself alone: it must be clearer then.
    pub alone: bool,
}

impl Decision<'_> {
    /// The likeliest account as a fault, where it is needed and beyond doubt; a question, where it is in doubt.
    pub fn next(&self, logs: &Logs, sample: &Sample, active: &[bool]) -> Option<Result<Fault, Doubt>> {
        let glance = sample.thinned(sample.len().div_ceil(GLANCE));
        let n = logs.model.dof();
        let moves: Vec<bool> = (0..n).map(|j| logs.traits.iter().any(|traits| traits[j].moves())).collect();
        let range = (0..n).map(|j| {
            logs.traits.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), traits| {
                (low.min(traits[j].low), high.max(traits[j].high))
            })
        });
        let scene = Scene {
            model: self.model,
            sample: &glance,
            active,
            moves: &moves,
            range: range.collect(),
            slow: logs.dt.iter().any(|dt| *dt > LONGEST_STEP),
            velocity: motion::velocity_slope(logs),
        };
        let logged = self.weighed(self.model, sample, active);
        // What another scale of the efforts explains, another scale of the motion may explain better.
        let plain = logged.1 == 0.0 && logged.0.is_plain(active) && scene.far(&scene.range) == 0;
        if plain && !scene.slow && !scene.velocity_asks() {
            return None;
        }
        let best = self.contenders(&scene, sample, &logged);
        let (margin, account, weighed) = best.first()?;
        let margin = *margin;
        let small = |account: &Account| match account.kind {
            Kind::Zero => logs.is_prismatic(account.joints[0]) || account.value.abs() < ZERO,
            Kind::Scale | Kind::Clock => (effort::GAINS.0..effort::GAINS.1).contains(&account.value),
            Kind::Gravity => account.gravity.is_some_and(|gravity| {
                let own = self.model.gravity();
                (gravity - own).length() < ZERO * own.length()
            }),
            Kind::Order => !are_exchanged(&account.joints, &logged.0.unexplained, &weighed.unexplained, 2.0 * OWN),
            Kind::Sign | Kind::Axis => false,
        };
        if small(account) || margin < LIKELY {
            return None;
        }
        let (before, after) = (left(&logged.0, active), left(weighed, active));
        // Under the account the log asks next to nothing of the robot: it is the one that the description has.
        let as_described = weighed.asked < AS_DESCRIBED * logged.0.asked;
        let (sure, most) = match (self.alone, as_described) {
            (true, _) => (2.0 * SURE, 0.6 * EXPLAINS),
            (false, true) => (LIKELY, EXPLAINS),
            (false, false) => (SURE, EXPLAINS),
        };
        let other = |other: &Account| other.kind != account.kind || other.joints != account.joints;
        let as_likely = best.iter().skip(1).filter(|(of, rival, _)| margin - of <= APART && other(rival));
        // Two that leave the same of every joint are one robot: a turned base and the zero of its first joint, an axis turned
        // round and the zero of the next joint by half a turn.
        let (twins, rivals): (Vec<_>, Vec<_>) = as_likely.partition(|(_, _, by)| by.leaves_the_same(weighed, active));
        // What an unknown spring beside friction could be as well is asked.
        let known = account.kind != Kind::Order
            || are_exchanged(&account.joints, &logged.0.unexplained, &weighed.unexplained, OWN);
        if margin > sure && after < most && rivals.is_empty() && known {
            // A joint that was set otherwise is met more often than a robot that stands otherwise.
            let same: Vec<&Account> = [account].into_iter().chain(twins.into_iter().map(|(_, twin, _)| twin)).collect();
            let said = same.iter().position(|one| one.kind != Kind::Gravity).unwrap_or(0);
            // Within the border of an effect it is one, at its best size.
            let sharp = self.sharpened(logs, sample, active, same[said].clone());
            if small(&sharp) {
                return None;
            }
            let twins = same.iter().enumerate().filter(|(i, _)| *i != said).map(|(_, twin)| *twin);
            let mut fault = self.fault(logs, &sharp, before, after).with_twins(logs, twins);
            if as_described {
                fault.evidence += "; the robot is then as described, and would else be another";
            }
            return Some(Ok(fault));
        }
        let mut question = format!(
            "{}? The model would then leave {} of the effort, squared, not {}",
            phrase(logs, account),
            per_cent(after),
            per_cent(before)
        );
        if let Some((_, other, _)) = rivals.first() {
            question += &format!("; or {}", phrase(logs, other));
        }
        let joints = account.joints.iter().map(|&j| logs.model.joints()[j].name.clone()).collect();
        // Far likelier than the log as it is, whatever it explains: no healthy robot has that.
        (!self.alone || margin > sure).then_some(Err(Doubt { question, joints, effects: Vec::new() }))
    }

    /// The accounts that are best at the first look, weighed, each with the nats by which it is likelier than the log as it is;
    /// the likeliest first.
    fn contenders(&self, scene: &Scene, sample: &Sample, logged: &(Weighed, f64)) -> Vec<(f64, Account, Weighed)> {
        let base = scene.as_logged();
        let counts = |account: &Account| account.look < base - SEEN || (scene.slow && account.kind == Kind::Clock);
        let weighed = |account: Account| {
            let mut changed = sample.clone();
            account.changes.iter().for_each(|change| motion::apply(change, &mut changed));
            let model = match account.gravity {
                Some(gravity) => self.model.clone().with_gravity(gravity),
                None => self.model.clone(),
            };
            let (weighed, scales) = self.weighed(&model, &changed, scene.active);
            let margin = weighed.likelier_than(&logged.0) + logged.1;
            (margin - scales + beforehand(scene, &account), account, weighed)
        };
        let mut best: Vec<_> = scene.accounts().into_iter().filter(counts).take(MOST).map(weighed).collect();
        best.sort_by(|a, b| b.0.total_cmp(&a.0));
        best
    }

    /// An account with whatever scale of the efforts suits it, and what those scales cost.
    pub fn weighed(&self, model: &Model, sample: &Sample, active: &[bool]) -> (Weighed, f64) {
        let scales = effort::first_scales(model, sample, active);
        let cost = effort::scales_cost(&scales, active);
        let plain = weigh_either(model, sample, &vec![1.0; scales.len()], active);
        if cost == 0.0 {
            return (plain, 0.0);
        }
        let (scales, _) = effort::fine_scales(model, sample, scales, active);
        let scaled = weigh_either(model, sample, &scales, active);
        if scaled.score - cost > plain.score { (scaled, cost) } else { (plain, 0.0) }
    }

    fn fault(&self, logs: &Logs, account: &Account, before: f64, after: f64) -> Fault {
        let evidence = format!(
            "{}: the model then leaves {} of the effort, squared, not {}",
            phrase(logs, account),
            per_cent(after),
            per_cent(before)
        );
        let all: Vec<usize> = (0..logs.episodes.len()).collect();
        let factor = (account.kind != Kind::Order).then_some(account.value);
        let mut fault = Fault::new(
            logs,
            account.kind.of_fault(),
            &account.joints,
            &all,
            factor,
            evidence,
            with_velocities(logs, &account.changes),
        );
        fault.gravity = account.gravity.map(|gravity| gravity.to_array());
        fault
    }
}

/// What an account gains before the efforts are looked at, nats: by limits and velocities, less by how many others like it
/// there are.
fn beforehand(scene: &Scene, account: &Account) -> f64 {
    // What limits and velocity say counts as in the first look.
    let beside = match account.kind {
        Kind::Clock if scene.slow || scene.velocity_says(account.value) => BESIDE,
        // Positions that no robot reaches, and would with it.
        _ => BESIDE * f64::from(account.inside),
    };
    let unlikely = match account.kind {
        // Another size of gravity is another planet: a clock is the likelier account.
        Kind::Gravity if (account.value - 1.0).abs() > 0.1 => 3.0 * COST,
        // There are as many more orders of more joints.
        Kind::Order => COST * account.joints.len().saturating_sub(2) as f64,
        // A robot that stands otherwise has them all turned round.
        Kind::Axis | Kind::Sign if account.joints.len() > 1 => 3.0 * COST,
        _ => 0.0,
    };
    beside - unlikely - COST
}

impl Fault {
    /// The same with what would look the same.
    fn with_twins<'a>(mut self, logs: &Logs, twins: impl Iterator<Item = &'a Account>) -> Fault {
        for twin in twins {
            let joints = twin.joints.iter().map(|&j| logs.model.joints()[j].name.clone()).collect();
            self.indistinguishable_from.push(Twin { kind: twin.kind.of_fault(), joints });
            self.evidence += &format!("; it would look the same if {}", phrase(logs, twin));
        }
        self
    }
}

/// Whether joints stand under each other's names: each leaves at most a part of its effort, squared, under its own. One that
/// leaves next to nothing either way tells nothing. Or, in the mean (geometric) they leave half of that part, and each of them
/// twice that part or next to nothing; or all a quarter of it in the mean, whatever one of them leaves.
fn are_exchanged(joints: &[usize], logged: &[f64], own: &[f64], part: f64) -> bool {
    let times = |j: usize| own[j] / logged[j];
    let telling = || joints.iter().copied().filter(|&j| logged[j].max(own[j]) > NEXT_TO_NOTHING);
    let mean = (joints.iter().map(|&j| times(j).ln()).sum::<f64>() / joints.len().max(1) as f64).exp();
    let most = |part: f64| joints.iter().all(|&j| times(j) <= part || own[j] < NOTABLE);
    let each = telling().next().is_some() && telling().all(|j| times(j) <= part);
    each || mean <= 0.5 * part && most(2.0 * part) || mean <= 0.25 * part
}

/// What an account undoes, and with it the velocities that were logged in the same terms: they are the derivative of the
/// position as logged.
fn with_velocities(logs: &Logs, changes: &[Change]) -> Vec<Change> {
    let follows = |j: usize| {
        let mut slopes =
            logs.relations.iter().filter_map(|relations| relations[j]).map(|relation| relation.slope).peekable();
        slopes.peek().is_some() && slopes.all(|slope| (slope - 1.0).abs() < 0.1)
    };
    let beside = |change: &Change| match *change {
        Change::Position(j, factor, _) if factor != 1.0 && follows(j) => vec![Change::Velocity(j, factor)],
        Change::Clock(factor) => {
            (0..logs.model.dof()).filter(|&j| follows(j)).map(|j| Change::Velocity(j, 1.0 / factor)).collect()
        }
        _ => Vec::new(),
    };
    changes.iter().cloned().chain(changes.iter().flat_map(beside)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_exchanged_only_where_each_joint_leaves_much_less_under_its_own() {
        // Two joints of a simulated arm whose names were exchanged.
        assert!(are_exchanged(&[1, 3], &[0.156, 0.072, 0.781, 2.292], &[0.002, 0.001, 0.005, 0.002], OWN));
        // A healthy used arm with a cable beside its elbow: the second pair is none better, nor is the elbow by much.
        let (logged, own) = ([0.153, 0.060, 0.611, 0.093, 0.045, 0.028], [0.159, 0.008, 0.209, 0.087, 0.027, 0.035]);
        assert!(!are_exchanged(&[1, 2, 4, 5], &logged, &own, 2.0 * OWN) && !are_exchanged(&[1, 2], &logged, &own, OWN));
        // One of two leaves little either way, and one of two leaves much in both; the other tells.
        assert!(are_exchanged(&[0, 1], &[0.034, 1.12], &[0.014, 0.023], OWN));
        assert!(are_exchanged(&[0, 1], &[0.93, 0.94], &[0.043, 0.296], OWN));
        // One leaves next to nothing under either name, or one leaves as much, by its limit, where the other leaves a thousandth.
        assert!(are_exchanged(&[0, 1], &[0.0005, 0.149], &[0.0003, 0.0142], OWN));
        assert!(are_exchanged(&[0, 1], &[0.227, 0.141], &[0.0003, 0.226], OWN));
        assert!(!are_exchanged(&[0, 1], &[0.0005, 0.006], &[0.0003, 0.0003], OWN), "nobody tells");
    }
}
