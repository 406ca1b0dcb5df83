//! What was chosen held against the best accounts without each of its kinds, at the exact law.

use crate::fit::estimate::speeds;
use crate::record::logs::{Progress, Record};
use crate::search::chosen::Chosen;
use crate::search::climb;
use crate::search::climb::Choice;
use crate::search::rivals;
use crate::search::rivals::Rival;
use gapscope_effects::{EffectError, Kind};

/// Times that a likelier account takes the place of what was chosen.
const AGAIN: usize = 2;
/// A kind without which the logs are less likely by no more than this, nats, is looked at again: what was chosen around it may
/// have been chosen because of it. So is a drive that is less likely by no more. More of it takes more time.
pub(crate) const DOUBTFUL: f64 = 60.0;

impl Record<'_> {
    /// The likeliest account: where the best one without a kind is likelier than what was chosen, that one.
    pub(crate) fn likeliest(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        for _ in 0..AGAIN {
            let mut rivals = rivals::rivals(&chosen.all, &chosen.choice);
            rivals.sort_by(|a, b| a.odds.total_cmp(&b.odds));
            let Some(rival) = rivals.into_iter().next().filter(|rival| rival.odds < 0.0) else { break };
            let turned = chosen.turned.clone().filter(|turned| rival.choice.set.contains(&turned.place));
            let next = self.converge(chosen.all.clone(), rival.choice, chosen.noise.clone(), turned, progress)?;
            if next.odds_against(&chosen, self)? <= 0.0 {
                break;
            }
            chosen = Chosen { tried: chosen.tried, ..next };
        }
        Ok(chosen)
    }

    /// What was chosen, each kind in it held at its exact law against the best accounts without it: without replacement, and
    /// with whatever else takes its place. A kind that the logs do not speak for goes.
    pub(crate) fn needed(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let own = chosen.turned.as_ref().map(|turned| turned.place);
        let rivals = rivals::rivals(&chosen.all, &chosen.choice);
        // What is rare is asked first: beside it, something common might seem to do nothing.
        let mut kinds = climb::kinds(&chosen.all, &chosen.choice.set);
        kinds.sort_by_key(|kind| (!kind.is_outside(), kind.is_calibration()));
        for kind in kinds {
            let rival = rivals.iter().find(|rival| rival.without == kind);
            let of_kind = |c: &usize| chosen.all.entries[*c].candidate.kind == kind && Some(*c) != own;
            let set: Vec<usize> = chosen.choice.set.iter().copied().filter(|c| !of_kind(c)).collect();
            let clear = kind.is_calibration() && rival.is_some_and(|rival| rival.odds > DOUBTFUL);
            if set.len() == chosen.choice.set.len() || clear {
                continue;
            }
            let without = self.instead(&chosen, set.clone())?;
            let mut odds = chosen.odds_against(&without, self)?;
            if odds <= 0.0 || !chosen.concerns_beside(&without) {
                chosen = without;
                continue;
            }
            if let Some(next) = self.spread(&chosen, kind, progress)? {
                chosen = Chosen { tried: chosen.tried, needed: chosen.needed, ..next };
                continue;
            }
            let doubtful = |rival: &&Rival| !kind.is_calibration() && odds.min(rival.odds) < DOUBTFUL;
            let rival = rival.filter(doubtful);
            if rival.is_some() {
                let calibrated = self.calibrated_without(&chosen, set, progress)?;
                let over = chosen.odds_against(&calibrated, self)?;
                if over <= 0.0 {
                    chosen = Chosen { tried: chosen.tried, needed: chosen.needed, ..calibrated };
                    continue;
                }
                odds = odds.min(over);
            }
            if let Some(rival) = rival {
                let mut all = chosen.all.clone();
                // A delay and a lag are told apart by other means.
                all.closed.extend(climb::told_together(kind));
                let choice = rival.choice.clone();
                let next = self.converge(all, choice, chosen.noise.clone(), chosen.turned.clone(), progress)?;
                let next = if next.turned.is_none() { self.drive(next, Some(&chosen), progress)? } else { next };
                let over = chosen.odds_against(&next, self)?;
                if over < 0.0 {
                    // What lost may still stand beside what won.
                    let mut set: Vec<usize> = chosen.choice.set.iter().copied().filter(of_kind).collect();
                    set.extend(&next.choice.set);
                    set.sort_unstable();
                    set.dedup();
                    let both = self.instead(&next, set)?;
                    let beside = both.odds_against(&next, self)?;
                    let closed = std::mem::take(&mut chosen.all.closed);
                    let (tried, mut needed) = (std::mem::take(&mut chosen.tried), std::mem::take(&mut chosen.needed));
                    if beside > 0.0 {
                        needed.push((kind, beside));
                    }
                    chosen = Chosen { tried, needed, ..if beside > 0.0 { both } else { next } };
                    chosen.all.closed = closed;
                    continue;
                }
                odds = odds.min(over);
            }
            chosen.needed.push((kind, odds));
        }
        Ok(chosen)
    }

    /// The likelier of two accounts with no kind beyond calibration but those of a set: with the best calibration beside it, and,
    /// where some of what the robot's description states is off, with all of it off by as little as it may be. Of a used arm all
    /// is, most of it by less than a first look sees; another kind may stand in for the sum.
    fn calibrated_without(
        &self,
        chosen: &Chosen,
        set: Vec<usize>,
        progress: Progress<'_>,
    ) -> Result<Chosen, EffectError> {
        let mut all = chosen.all.clone();
        all.closed.extend(all.entries.iter().map(|e| e.candidate.kind).filter(|kind| !kind.is_calibration()));
        let described = |c: &usize| {
            let kind = chosen.all.entries[*c].candidate.kind;
            kind.is_calibration() && kind.card().described
        };
        let choice = Choice { set: set.clone() };
        let mut best = self.converge(all, choice, chosen.noise.clone(), chosen.turned.clone(), progress)?;
        best.all.closed.clone_from(&chosen.all.closed);
        if !set.iter().any(described) {
            return Ok(best);
        }
        let mut filled: Vec<usize> = (0..chosen.all.entries.len()).filter(described).chain(set).collect();
        filled.sort_unstable();
        filled.dedup();
        let filled = self.instead(chosen, filled)?;
        Ok(if filled.odds_against(&best, self)? > 0.0 { filled } else { best })
    }

    /// What was chosen with another of its kinds in the joints of one kind, where that is likelier: what is in some joints of a
    /// robot is likelier in one more than something else is. In a first look a law that reads the torque found stands beside
    /// the torque of another account.
    fn spread(&self, chosen: &Chosen, kind: Kind, progress: Progress<'_>) -> Result<Option<Chosen>, EffectError> {
        if kind.is_calibration() {
            return Ok(None);
        }
        let entry = |c: &usize| &chosen.all.entries[*c].candidate;
        let (own, rest): (Vec<usize>, Vec<usize>) = chosen.choice.set.iter().partition(|c| entry(c).kind == kind);
        for other in climb::kinds(&chosen.all, &rest) {
            if other.is_calibration() || other.is_outside() || !other.card().reads_found {
                continue;
            }
            let there =
                |c: &usize| entry(c).kind == other && own.iter().any(|own| entry(own).joints == entry(c).joints);
            let mut set: Vec<usize> = (0..chosen.all.entries.len()).filter(there).chain(rest.iter().copied()).collect();
            set.sort_unstable();
            set.dedup();
            if set.len() != chosen.choice.set.len() {
                continue;
            }
            let next = self.instead(chosen, set)?;
            if next.odds_against(chosen, self)? > 0.0 {
                // The first look at all candidates is to be around this account.
                let Chosen { all, choice, noise, turned, .. } = next;
                return Ok(Some(self.converge(all, choice, noise, turned, progress)?));
            }
        }
        Ok(None)
    }

    /// What was chosen without candidates of which every interval holds nothing, one by one: what blocks of time do not agree
    /// on was not shown by them. Links stay, of which the URDF says what they may be. Where nothing of a kind is left, what else
    /// there is has its turn without it.
    pub(crate) fn shown(&self, mut chosen: Chosen, progress: Progress<'_>) -> Result<Chosen, EffectError> {
        let speeds = speeds(&self.signals, &self.band, self.model.dof());
        for kind in climb::kinds(&chosen.all, &chosen.choice.set) {
            // Candidates of a choice and entries at its exact law stand in one order.
            let of_kind = |chosen: &Chosen, i: usize| {
                let candidate = &chosen.exact.entries[i].candidate;
                let is_link = kind.is_calibration() && candidate.link().is_some();
                candidate.kind == kind && !candidate.turns() && !is_link && !kind.is_outside()
            };
            // The one that shows least goes first: of two that stand for each other, each holds nothing beside the other.
            let mut needed: Vec<usize> = Vec::new();
            loop {
                let own: Vec<usize> = (0..chosen.exact.entries.len()).filter(|&i| of_kind(&chosen, i)).collect();
                let halves = chosen.fit.half_widths(&chosen.exact, &own, &speeds);
                let shows = |(&i, half): (&usize, Vec<f64>)| {
                    let (_, theta) = chosen.fit.own(&chosen.exact, i);
                    let parts = theta.iter().zip(half).map(|(theta, half)| theta.abs() / half);
                    (i, parts.fold(0.0, f64::max))
                };
                let open = |(i, _): &(usize, f64)| !needed.contains(&chosen.choice.set[*i]);
                let least = own.iter().zip(halves).map(shows).filter(open).min_by(|a, b| a.1.total_cmp(&b.1));
                let Some((gone, _)) = least.filter(|(_, shows)| *shows < 1.0) else { break };
                let mut set = chosen.choice.set.clone();
                let candidate = set.remove(gone);
                if own.len() > 1 {
                    let without = self.instead(&chosen, set)?;
                    // A rotor or a friction that links could stand for has a wide interval, though they hardly can be what they
                    // would have to be.
                    if kind.is_calibration() && chosen.odds_against(&without, self)? > 0.0 {
                        needed.push(candidate);
                    } else {
                        chosen = without;
                    }
                    continue;
                }
                let mut all = chosen.all.clone();
                all.closed.push(kind);
                let next = self.converge(all, Choice { set }, chosen.noise.clone(), chosen.turned.clone(), progress)?;
                chosen = Chosen { tried: chosen.tried, needed: chosen.needed, ..next };
                break;
            }
        }
        Ok(chosen)
    }
}
