//! Whether effort acts after a delay or through a lag: both at their exact law, by the odds that decide everywhere.

use crate::record::logs::Record;
use crate::search::chosen::{Chosen, with_drive};
use crate::search::climb::Choice;
use gapscope_effects::EffectError;

impl Record<'_> {
    /// The choice with the likelier of delay and lag where it has one of them, and the probability that it is the other.
    pub(crate) fn delay_or_lag(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let late = |c: &usize| chosen.all.entries[*c].candidate.kind.card().is_late();
        let Some(at) = chosen.choice.set.iter().position(late) else { return Ok(chosen) };
        let law = &chosen.exact.entries[at].candidate;
        let far = |c: usize| (chosen.all.entries[c].candidate.shape - law.shape).abs();
        let other = (0..chosen.all.entries.len())
            .filter(|c| late(c) && chosen.all.entries[*c].candidate.kind != law.kind)
            .min_by(|&a, &b| far(a).total_cmp(&far(b)));
        let Some(other) = other else { return Ok(chosen) };
        let (lost, mut set) = (chosen.choice.set[at], chosen.choice.set.clone());
        set[at] = other;
        set.sort_unstable();
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
        let rival = chosen.with(Choice { set }, exact, fit);
        let odds = chosen.odds_against(&rival, self)?;
        let (mut likelier, lost) = if odds >= 0.0 { (chosen, other) } else { (rival, lost) };
        // What was decided here no climb turns round.
        likelier.all.closed.push(likelier.all.entries[lost].candidate.kind);
        likelier.late_doubt = Some(1.0 / (1.0 + odds.abs().exp()));
        Ok(likelier)
    }
}
