//! Whether a drive that turns on its own takes the place of a rigid one in what was chosen.

use crate::fit::estimate::Fit;
use crate::fit::problem::Problem;
use crate::fit::terms::Term;
use crate::numbers::decide::FLOOR_KNOWN_TO;
use crate::record::floor::noise_floor;
use crate::record::logs::{Progress, Record};
use crate::search::chosen::{Chosen, Turned};
use crate::search::climb;
use crate::search::converge::weighing;
use gapscope_effects::{Candidate, EffectError};

/// Accounts of drives that are tried in each pass.
const ACCOUNTS: usize = 2;
/// Turns that a drive and what stands beside it take, at most, and the fall of the misfit that is worth another.
const TURNS: usize = 6;
const TURN_LEAVES: f64 = 10.0;

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
        let joints = restless(&rigid.exact, &rigid.fit)?;
        let mut bases = vec![(without_rotors(&rigid), rigid.choice.clone(), joints, false)];
        if climb::kinds(&rigid.all, &rigid.choice.set).into_iter().any(|kind| !kind.is_calibration()) {
            let calibration = |c: &&Candidate| c.kind.is_calibration() && !c.kind.card().rotor;
            let bodies: Vec<Candidate> =
                rigid.exact.entries.iter().map(|e| &e.candidate).filter(calibration).cloned().collect();
            let mut choice = rigid.choice.clone();
            choice.set.retain(|&c| rigid.all.entries[c].candidate.kind.is_calibration());
            let calibrated = self.calibrated(&rigid, progress)?;
            let has_rotor = calibrated.exact.entries.iter().any(|e| e.candidate.kind.card().rotor);
            if has_rotor || calibrated.choice.set != choice.set {
                let anew = self.data(&rigid.noise).refine(&bodies)?;
                let joints = restless(&anew.0, &anew.1)?;
                bases.push((anew, choice, joints, false));
            }
            let joints = restless(&calibrated.exact, &calibrated.fit)?;
            bases.push((without_rotors(&calibrated), calibrated.choice, joints, false));
        }
        let any = |j: &usize| bases.iter().any(|(_, _, joints, _)| joints.contains(j));
        let joints: Vec<usize> = (0..self.model.dof()).filter(any).collect();
        if joints.is_empty() {
            return Ok(rigid);
        }
        bases.push((without_rotors(&rigid), rigid.choice.clone(), joints, true));
        let mut best: Option<Chosen> = None;
        let mut tried: Vec<(Candidate, f64)> = Vec::new();
        for (others, base, joints, through) in bases {
            if through && best.is_some() {
                break;
            }
            for account in self.accounts(&joints, &others.0, &others.1, through)?.into_iter().take(ACCOUNTS) {
                let (all, place) = self.with_rotor(&rigid, account.drive.joints[0]);
                let mut choice = base.clone();
                choice.set.push(place);
                choice.set.sort_unstable();
                choice.set.dedup();
                let turned = Turned { place, drive: account.drive, odds: 0.0, beside: Vec::new() };
                // Beside what was found as it is, and with the choice made again around it.
                let (turned, plain) = self.turned(&rigid.noise, &all, &choice.set, turned, through)?;
                let next = self.converge(all, choice.clone(), rigid.noise.clone(), Some(turned.clone()), progress)?;
                let plain = Chosen { turned: Some(turned.clone()), ..next.with(choice, plain.0, plain.1) };
                let next = if plain.odds_against(&next, self)? > 0.0 { plain } else { next };
                if !next.has_rotor() {
                    continue;
                }
                let odds = next.odds_against(best.as_ref().unwrap_or(&rigid), self)?;
                tried.push((turned.drive, odds));
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
        if odds <= 0.0 || !best.concerns_beside(&rigid) {
            return Ok(Chosen { tried, ..rigid });
        }
        let turned = best.turned.map(|turned| Turned { odds, ..turned });
        Ok(Chosen { turned, tried, ..best })
    }

    /// A drive turned to where it leaves least beside the other candidates of a set, and the set at its exact law: what friction is
    /// beside a rigid drive hides how far a spring winds up, so that drive and friction are found by turns.
    fn turned(
        &self,
        noise: &[f64],
        all: &Problem,
        set: &[usize],
        mut turned: Turned,
        through: bool,
    ) -> Result<(Turned, (Problem, Fit)), EffectError> {
        let mut best = self.data(noise).exact(all, set, Some(&turned))?;
        for _ in 0..TURNS {
            let (exact, fit) = &best;
            turned = turned.beside(exact, fit);
            let beside = (0..exact.entries.len()).filter(|&i| !exact.entries[i].candidate.turns()).collect();
            let others = Fit { set: beside, ..fit.clone() };
            let again = self.accounts(&turned.drive.joints, exact, &others, through)?;
            let Some(account) = again.into_iter().next() else { break };
            let next = Turned { drive: account.drive, ..turned.clone() };
            let (next_exact, next_fit) = self.data(noise).exact(all, set, Some(&next))?;
            if next_exact.misfit(&next_fit, &self.band) > exact.misfit(fit, &self.band) - TURN_LEAVES {
                break;
            }
            (turned, best) = (next, (next_exact, next_fit));
        }
        Ok((turned, best))
    }

    /// The best account of calibration alone: what was found beyond it may stand in for a drive.
    fn calibrated(&self, rigid: &Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let (mut all, mut choice) = (rigid.all.clone(), rigid.choice.clone());
        all.closed.extend(all.entries.iter().map(|e| e.candidate.kind).filter(|kind| !kind.is_calibration()));
        choice.set.retain(|&c| all.entries[c].candidate.kind.is_calibration());
        self.converge(all, choice, rigid.noise.clone(), None, progress)
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
