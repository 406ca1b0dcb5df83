//! Whether a drive that turns on its own takes the place of a rigid one in what was chosen.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::fit::terms::Term;
use crate::numbers::decide::FLOOR_KNOWN_TO;
use crate::record::floor::noise_floor;
use crate::record::logs::{Progress, Record};
use crate::search::chosen::{Chosen, Turned};
use crate::search::climb;
use crate::search::climb::Choice;
use crate::search::converge::weighing;
use crate::search::drive::{Account, tries};
use crate::search::needed::DOUBTFUL;
use gapscope_effects::{Candidate, EffectError, Force, Place};
use rayon::prelude::*;

/// Accounts of drives that are turned: the likeliest of those that are not far less likely than a rigid drive. Before it is turned,
/// an account beside links that are off says little. One goes on.
const ACCOUNTS: usize = 2;
/// Turns that a drive and what stands beside it take, at most, and the fall of the misfit that is worth another.
const TURNS: usize = 6;
const TURN_LEAVES: f64 = 10.0;

/// Drives that were tried, and by how many nats each is likelier than a rigid one.
type Tried = Vec<(Candidate, f64)>;

impl Record<'_> {
    /// Puts a spring or play in the drive of one joint where the logs speak for it: beside all else that was found, beside the
    /// same without laws of the joint that may stand in for its drive, and, where noise may have drowned what a
    /// spring does, through a filter. Where it is held `against` another account, drives alone that could bring it there.
    pub(crate) fn drive(
        &self,
        rigid: Chosen,
        against: Option<&Chosen>,
        progress: Progress<'_>,
    ) -> Result<Chosen, EffectError> {
        let aim = against.unwrap_or(&rigid);
        let joints = self.within_reach(&rigid, aim, self.restless(&rigid)?)?;
        let mut without = self.without_laws_of_joints(&rigid)?;
        if let Some((base, joints)) = &mut without {
            *joints = self.within_reach(base, aim, std::mem::take(joints))?;
        }
        let plain: Vec<(&Chosen, &[usize])> = [(&rigid, &joints[..])]
            .into_iter()
            .chain(without.iter().map(|(base, joints)| (base, &joints[..])))
            .collect();
        let mut best: Option<Chosen> = None;
        let mut tried = Tried::new();
        for (bases, through) in [(&plain[..], false), (&plain[..1], true)] {
            if best.is_some() {
                break;
            }
            let beside = |(base, joints): &(&Chosen, &[usize])| self.best_beside(base, joints, through, progress);
            for (next, others) in bases.par_iter().map(beside).collect::<Result<Vec<_>, _>>()? {
                tried.extend(others);
                let Some(next) = next.filter(Chosen::has_rotor) else { continue };
                let odds = next.odds_against(best.as_ref().unwrap_or(&rigid), self)?;
                tried.extend(next.turned.as_ref().map(|turned| (turned.drive.clone(), odds)));
                if odds > 0.0 {
                    best = Some(next);
                }
            }
        }
        let Some(best) = best else { return Ok(Chosen { tried, ..rigid }) };
        // What else came with it may be as good beside a rigid drive.
        let stiff = self.converge(best.all.clone(), best.choice.clone(), rigid.noise.clone(), None, progress)?;
        let rigid = if stiff.odds_against(&rigid, self)? > 0.0 { stiff } else { rigid };
        let odds = best.odds_against(&rigid, self)?;
        let odds = match odds > 0.0 && best.concerns_beside(&rigid) {
            true => odds - self.gained_by_chance(&best, &rigid)?,
            false => odds.min(0.0),
        };
        if odds <= 0.0 {
            let own = best.turned.as_ref().map(|turned| &turned.drive);
            tried.iter_mut().filter(|(drive, _)| Some(drive) == own).for_each(|(_, won)| *won = won.min(odds));
            return Ok(Chosen { tried, ..rigid });
        }
        let turned = best.turned.map(|turned| Turned { odds, ..turned });
        Ok(Chosen { turned, tried, ..best })
    }

    /// What was found with calibration in the place of laws of joints beyond it, and the joints of those laws that are restless
    /// then: a law of a joint may stand in for its drive. Nothing where no such law was found.
    fn without_laws_of_joints(&self, found: &Chosen) -> Result<Option<(Chosen, Vec<usize>)>, EffectError> {
        let candidate = |c: usize| &found.all.entries[c].candidate;
        let is_law = |c: &usize| {
            let kind = candidate(*c).kind;
            // A constant force stands in for no drive.
            let constant = kind.card().force == Some(Force::Constant);
            !kind.is_calibration() && kind.card().place == Place::Joint && !constant
        };
        let (laws, rest): (Vec<usize>, Vec<usize>) = found.choice.set.iter().partition(|c| is_law(c));
        if laws.is_empty() {
            return Ok(None);
        }
        // A friction that was there has its part of the friction that is.
        let in_its_place = |c: &usize| {
            let kind = candidate(*c).kind;
            let there = laws.iter().any(|law| candidate(*law).joints == candidate(*c).joints);
            let taken = rest.iter().any(|&own| climb::excludes(&found.all, own, *c));
            there && !taken && kind.is_calibration() && kind.card().place == Place::Joint
        };
        let mut set: Vec<usize> =
            (0..found.all.entries.len()).filter(in_its_place).chain(rest.iter().copied()).collect();
        set.sort_unstable();
        set.dedup();
        let (exact, fit) = self.data(&found.noise).exact(&found.all, &set, None)?;
        let without = found.with(Choice { set }, exact, fit);
        let mut joints = self.restless(&without)?;
        joints.retain(|joint| laws.iter().any(|&c| candidate(c).joints.contains(joint)));
        Ok(Some((without, joints)))
    }

    /// The likeliest account of a drive beside what was found, the choice made again around it, where one is likelier than a rigid
    /// drive; and the accounts that are not, with by how many nats.
    fn best_beside(
        &self,
        rigid: &Chosen,
        joints: &[usize],
        through: bool,
        progress: Progress<'_>,
    ) -> Result<(Option<Chosen>, Tried), EffectError> {
        let accounts = self.likelier(rigid, joints, through)?;
        let (near, far) = accounts.into_iter().partition::<Vec<_>, _>(|(_, odds)| *odds > -DOUBTFUL);
        let turned = |(beside, _): (Chosen, f64)| {
            let beside = self.turned(beside, through)?;
            let odds = beside.odds_against(rigid, self)?;
            Ok((beside, odds))
        };
        let near: Vec<_> = near.into_iter().take(ACCOUNTS).collect();
        let mut turned = near.into_par_iter().map(turned).collect::<Result<Vec<_>, EffectError>>()?;
        turned.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (likelier, less) = turned.into_iter().partition::<Vec<_>, _>(|(_, odds)| *odds > 0.0);
        let others = less.into_iter().chain(far);
        let others = others.filter_map(|(chosen, odds)| Some((chosen.turned?.drive, odds))).collect();
        let Some((beside, _)) = likelier.into_iter().next() else { return Ok((None, others)) };
        // Beside what was found as it is, and with the choice made again around it.
        let Chosen { all, choice, noise, turned, .. } = beside.clone();
        let next = self.converge(all, choice, noise, turned, progress)?;
        let next = if beside.odds_against(&next, self)? > 0.0 { beside } else { next };
        Ok((Some(next), others))
    }

    /// The accounts of drives beside what was found, each at its exact law, and by how many nats it is likelier than rigid
    /// drives; likeliest first.
    fn likelier(&self, rigid: &Chosen, joints: &[usize], through: bool) -> Result<Vec<(Chosen, f64)>, EffectError> {
        let entries = &rigid.exact.entries;
        let set = (0..entries.len()).filter(|&i| !entries[i].candidate.kind.card().rotor).collect();
        let others = Fit { set, ..rigid.fit.clone() };
        let at_exact_law = |account: Account| {
            let (all, place) = self.with_rotor(rigid, account.drive.joints[0]);
            let mut set = [rigid.choice.set.as_slice(), &[place]].concat();
            set.sort_unstable();
            set.dedup();
            let tries = tries(account.drive.kind);
            let turned = Turned { place, drive: account.drive, tries, odds: 0.0, beside: Vec::new() };
            let (exact, fit) = self.data(&rigid.noise).exact(&all, &set, Some(&turned))?;
            let beside = Chosen { all, turned: Some(turned), ..rigid.with(Choice { set }, exact, fit) };
            let odds = beside.odds_against(rigid, self)?;
            Ok((beside, odds))
        };
        let accounts = self.accounts(joints, &rigid.exact, &others, through)?;
        let mut found = accounts.into_par_iter().map(at_exact_law).collect::<Result<Vec<_>, EffectError>>()?;
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(found)
    }

    /// The same with its drive turned to where it leaves least beside the rest of it: what friction is beside a rigid drive hides
    /// how far a spring winds up, so that drive and friction are found by turns.
    fn turned(&self, mut best: Chosen, through: bool) -> Result<Chosen, EffectError> {
        for _ in 0..TURNS {
            let Some(turned) = best.turned.take().map(|turned| turned.beside(&best.exact, &best.fit)) else { break };
            best.turned = Some(turned.clone());
            let (exact, fit) = (&best.exact, &best.fit);
            let beside = (0..exact.entries.len()).filter(|&i| !exact.entries[i].candidate.turns()).collect();
            let others = Fit { set: beside, ..fit.clone() };
            let again = self.accounts(&turned.drive.joints, exact, &others, through)?;
            let same =
                |account: &Account| (account.drive.kind, account.drive.side) == (turned.drive.kind, turned.drive.side);
            let far = |account: &Account| (account.drive.shape / turned.drive.shape).ln().abs();
            let nearest = again.into_iter().filter(same).min_by(|a, b| far(a).total_cmp(&far(b)));
            let Some(account) = nearest else { break };
            let next = Turned { drive: account.drive, ..turned };
            let (next_exact, next_fit) = self.data(&best.noise).exact(&best.all, &best.choice.set, Some(&next))?;
            if next_exact.misfit(&next_fit, &self.band) > exact.misfit(fit, &self.band) - TURN_LEAVES {
                break;
            }
            best = Chosen { turned: Some(next), ..best.with(best.choice.clone(), next_exact, next_fit) };
        }
        Ok(best)
    }

    /// Some joints without those whose drive can hardly bring an account as far as another is. What it moves in other joints, with
    /// an encoder on the motor, is no more than all that the other leaves above the noise: what an account lacks there beyond
    /// that, something else is missing for.
    fn within_reach(&self, account: &Chosen, aim: &Chosen, mut joints: Vec<usize>) -> Result<Vec<usize>, EffectError> {
        let misfits = |of: &Chosen| of.exact.misfits(&of.fit, &self.band);
        let lacks: Vec<f64> = misfits(account).iter().zip(misfits(aim)).map(|(own, aim)| own - aim).collect();
        let (all, levels) = (lacks.iter().sum::<f64>(), self.levels_above_noise(aim)?);
        let to_noise: f64 = levels.iter().map(|level| 2.0 * self.band.rows.len() as f64 * level.ln().max(0.0)).sum();
        joints.retain(|&j| all - lacks[j] <= to_noise);
        Ok(joints)
    }

    /// What an account leaves of each joint, in parts of its noise. Play shows for moments alone: what it leaves then counts in
    /// full.
    fn levels_above_noise(&self, chosen: &Chosen) -> Result<Vec<f64>, EffectError> {
        let rest = self.rest(chosen)?;
        let floor = noise_floor(&self.signals, &self.band, &rest, self.model.dof());
        let left = chosen.exact.left(&chosen.fit);
        let calm = |j: usize| floor[j].min(chosen.exact.sigma[j]).max(f64::MIN_POSITIVE);
        Ok((0..self.model.dof()).map(|j| left[j].sqrt() / calm(j)).collect())
    }

    /// Joints of which a choice leaves more than noise, those with most of it first.
    fn restless(&self, chosen: &Chosen) -> Result<Vec<usize>, EffectError> {
        let level = self.levels_above_noise(chosen)?;
        let mut joints: Vec<usize> =
            (0..self.model.dof()).filter(|&j| self.moving[j] && level[j] > FLOOR_KNOWN_TO.get()).collect();
        joints.sort_by(|&a, &b| level[b].total_cmp(&level[a]));
        Ok(joints)
    }

    /// All candidates of a choice, and among them the place of a joint's rotor, in case the choice was made without rotors.
    fn with_rotor(&self, chosen: &Chosen, joint: usize) -> (Problem, usize) {
        let rotor = Candidate::rotor(joint);
        let entries = &chosen.all.entries;
        if let Some(place) = entries.iter().position(|e| e.candidate == rotor) {
            return (chosen.all.clone(), place);
        }
        let open = |candidate: Candidate| Term { candidate, tangent_at: None };
        let candidates = entries.iter().map(|e| e.candidate.clone()).chain([rotor]);
        let mut all = self.data(&chosen.noise).problem(candidates.map(open).collect(), &weighing());
        all.closed.clone_from(&chosen.all.closed);
        (all, entries.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{CoulombFriction, Effect, Kind};

    /// What is missing in the second joint no spring in the first makes up for.
    #[test]
    fn a_drive_makes_up_for_nothing_that_another_joint_lacks() {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let rubs = CoulombFriction { coulomb: model.joints().iter().map(|j| (j.name.clone(), 0.5)).collect() };
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let log = generate(&model, &[Effect::CoulombFriction(rubs)], 1, &recipe, "log").unwrap();
        let record = Record::new(&model, &[log], &mut Vec::new());
        let found = record.choose(&|_, _| {}).unwrap();
        let candidate = |c: &usize| &found.all.entries[*c].candidate;
        let second = |c: &usize| candidate(c).kind == Kind::CoulombFriction && candidate(c).joints == [1];
        let set: Vec<usize> = found.choice.set.iter().copied().filter(|c| !second(c)).collect();
        assert_eq!(set.len() + 1, found.choice.set.len());
        let smooth = record.instead(&found, set).unwrap();
        let reached = |account: &Chosen| record.within_reach(account, &found, vec![0, 1]).unwrap();
        assert_eq!(reached(&smooth), [1]);
        assert_eq!(reached(&found), [0, 1], "what lacks nothing may gain in any joint");
    }
}
