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
use crate::search::drive::Account;
use gapscope_effects::{Candidate, EffectError};
use rayon::prelude::*;

/// Accounts of drives that are turned beside each base: of those likelier than a rigid drive, the likeliest. One goes on.
const ACCOUNTS: usize = 2;
/// Turns that a drive and what stands beside it take, at most, and the fall of the misfit that is worth another.
const TURNS: usize = 6;
const TURN_LEAVES: f64 = 10.0;

/// What accounts of drives are tried beside.
struct Base {
    /// What was found, rotors aside.
    others: (Problem, Fit),
    /// What goes into the choice with a drive.
    choice: Choice,
    /// The same with rigid drives: a drive that is not likelier is none.
    rigid: Chosen,
    /// Joints that are looked at.
    joints: Vec<usize>,
    /// Whether springs are looked for through a filter.
    through: bool,
}

impl Record<'_> {
    /// Puts a spring or play in the drive of one joint where the logs speak for it: beside all else that was found, beside the
    /// calibration alone, and where noise may have drowned what a spring does, through a filter.
    pub(crate) fn drive(&self, rigid: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        // Beside what was found, beside its calibration alone, fitted anew without rotors, and beside the best calibration.
        let without_rotors = |of: &Chosen| {
            let entries = &of.exact.entries;
            let beside = (0..entries.len()).filter(|&i| !entries[i].candidate.kind.card().rotor).collect();
            (of.exact.clone(), Fit { set: beside, ..of.fit.clone() })
        };
        let restless = |exact: &Problem, fit: &Fit| self.restless(&rigid.noise, exact, fit);
        // What was found beyond calibration may stand in for a drive: beside calibration alone more is left.
        let base = |of: &Chosen, joints: Vec<usize>, through: bool| Base {
            others: without_rotors(of),
            choice: of.choice.clone(),
            rigid: of.clone(),
            joints,
            through,
        };
        let mut bases = vec![base(&rigid, restless(&rigid.exact, &rigid.fit)?, false)];
        if climb::kinds(&rigid.all, &rigid.choice.set).into_iter().any(|kind| !kind.is_calibration()) {
            let calibration = |c: &&Candidate| c.kind.is_calibration() && !c.kind.card().rotor;
            let bodies: Vec<Candidate> =
                rigid.exact.entries.iter().map(|e| &e.candidate).filter(calibration).cloned().collect();
            let mut choice = rigid.choice.clone();
            choice.set.retain(|&c| rigid.all.entries[c].candidate.kind.is_calibration());
            let calibrated = self.calibrated(&rigid, progress)?;
            let has_rotor = calibrated.exact.entries.iter().any(|e| e.candidate.kind.card().rotor);
            if has_rotor || calibrated.choice.set != choice.set {
                let others = self.data(&rigid.noise).refine(&bodies)?;
                let joints = restless(&others.0, &others.1)?;
                bases.push(Base { others, choice, rigid: calibrated.clone(), joints, through: false });
            }
            let joints = restless(&calibrated.exact, &calibrated.fit)?;
            bases.push(base(&calibrated, joints, false));
        }
        let any = |j: &usize| bases.iter().any(|base| base.joints.contains(j));
        let joints: Vec<usize> = (0..self.model.dof()).filter(any).collect();
        if joints.is_empty() {
            return Ok(rigid);
        }
        bases.push(base(&rigid, joints, true));
        let mut best: Option<Chosen> = None;
        let mut tried: Vec<(Candidate, f64)> = Vec::new();
        let (through, plain) = bases.into_iter().partition::<Vec<_>, _>(|base| base.through);
        for bases in [plain, through] {
            if best.is_some() {
                break;
            }
            let found = bases.par_iter().map(|base| self.best_beside(base, progress)).collect::<Result<Vec<_>, _>>()?;
            for (next, others) in found {
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

    /// The likeliest account of a drive beside a base, the choice made again around it, where one is likelier than a rigid drive;
    /// and the accounts that are not, with by how many nats.
    fn best_beside(
        &self,
        base: &Base,
        progress: Progress<'_>,
    ) -> Result<(Option<Chosen>, Vec<(Candidate, f64)>), EffectError> {
        let (likelier, others) = self.likelier(base)?.into_iter().partition::<Vec<_>, _>(|(_, odds)| *odds > 0.0);
        let others = others.into_iter().filter_map(|(chosen, odds)| Some((chosen.turned?.drive, odds))).collect();
        let turned = |(beside, _): (Chosen, f64)| {
            let beside = self.turned(beside, base.through)?;
            let odds = beside.odds_against(&base.rigid, self)?;
            Ok((beside, odds))
        };
        let likelier: Vec<_> = likelier.into_iter().take(ACCOUNTS).collect();
        let mut turned = likelier.into_par_iter().map(turned).collect::<Result<Vec<_>, EffectError>>()?;
        turned.sort_by(|a, b| b.1.total_cmp(&a.1));
        let Some((beside, _)) = turned.into_iter().next() else { return Ok((None, others)) };
        // Beside what was found as it is, and with the choice made again around it.
        let Chosen { all, choice, noise, turned, .. } = beside.clone();
        let next = self.converge(all, choice, noise, turned, progress)?;
        let next = if beside.odds_against(&next, self)? > 0.0 { beside } else { next };
        Ok((Some(next), others))
    }

    /// The accounts of drives beside a base, each at its exact law, and by how many nats it is likelier than rigid drives;
    /// likeliest first.
    fn likelier(&self, base: &Base) -> Result<Vec<(Chosen, f64)>, EffectError> {
        let at_exact_law = |account: Account| {
            let (all, place) = self.with_rotor(&base.rigid, account.drive.joints[0]);
            let mut set = [base.choice.set.as_slice(), &[place]].concat();
            set.sort_unstable();
            set.dedup();
            let turned = Turned { place, drive: account.drive, odds: 0.0, beside: Vec::new() };
            let (exact, fit) = self.data(&base.rigid.noise).exact(&all, &set, Some(&turned))?;
            let beside = Chosen { all, turned: Some(turned), ..base.rigid.with(Choice { set }, exact, fit) };
            let odds = beside.odds_against(&base.rigid, self)?;
            Ok((beside, odds))
        };
        let accounts = self.accounts(&base.joints, &base.others.0, &base.others.1, base.through)?;
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

    /// The best account of calibration alone: what was found beyond it may stand in for a drive.
    fn calibrated(&self, rigid: &Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let (mut all, mut choice) = (rigid.all.clone(), rigid.choice.clone());
        all.closed.extend(all.entries.iter().map(|e| e.candidate.kind).filter(|kind| !kind.is_calibration()));
        choice.set.retain(|&c| all.entries[c].candidate.kind.is_calibration());
        let mut calibrated = self.converge(all, choice, rigid.noise.clone(), None, progress)?;
        // What comes with a drive may be any kind.
        calibrated.all.closed.clone_from(&rigid.all.closed);
        Ok(calibrated)
    }

    /// Joints of which a fit leaves more than noise, those with most of it first.
    fn restless(&self, noise: &[f64], exact: &Problem, fit: &Fit) -> Result<Vec<usize>, EffectError> {
        let rest = self.data(noise).rest(exact, fit)?;
        let floor = noise_floor(&self.signals, &self.band, &rest, self.model.dof());
        // Play shows for moments alone: what it leaves then counts in full.
        let left = exact.left(fit);
        let calm = |j: usize| floor[j].min(exact.sigma[j]).max(f64::MIN_POSITIVE);
        let level = |j: usize| left[j].sqrt() / calm(j);
        let mut joints: Vec<usize> =
            (0..self.model.dof()).filter(|&j| self.moving[j] && level(j) > FLOOR_KNOWN_TO.get()).collect();
        joints.sort_by(|&a, &b| level(b).total_cmp(&level(a)));
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
