//! Rotors that no first look asks for, as it lets links be what no link can be.
//!
//! The first look at all candidates is linear: there a link takes over what a rotor does by an inertia that no body has. At
//! the exact law links stay bodies, and what they cannot take over stays in the joint.

use crate::record::logs::Record;
use crate::search::chosen::Chosen;
use crate::search::climb;
use gapscope_effects::EffectError;

impl Record<'_> {
    /// What was chosen, with rotors in the joints that links at the edge of what a body can be hold back, where the logs speak
    /// for them at the exact law.
    pub(crate) fn held_back(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let (left, free) = (chosen.exact.left(&chosen.fit), chosen.exact.free_left(&chosen.fit));
        let joints = climb::less_is_left(&chosen.exact, &left, &free);
        let missing = |c: &usize| {
            let candidate = &chosen.all.entries[*c].candidate;
            let there = chosen.choice.set.iter().any(|&own| climb::excludes(&chosen.all, own, *c));
            candidate.kind.card().rotor && candidate.joints.iter().all(|j| joints.contains(j)) && !there
        };
        let rotors: Vec<usize> = (0..chosen.all.entries.len()).filter(missing).collect();
        if rotors.is_empty() {
            return Ok(chosen);
        }
        let mut set = [chosen.choice.set.as_slice(), &rotors].concat();
        set.sort_unstable();
        let with = self.instead(&chosen, set)?;
        if with.odds_against(&chosen, self)? <= 0.0 {
            return Ok(chosen);
        }
        // What a law was refined by beside them it may be without them.
        let mut all = chosen.all.clone();
        for (&c, refined) in with.choice.set.iter().zip(&with.exact.entries) {
            all.entries[c].candidate = refined.candidate.clone();
        }
        let (exact, fit) = self.data(&chosen.noise).exact(&all, &chosen.choice.set, chosen.turned.as_ref())?;
        let without = chosen.with(chosen.choice.clone(), exact, fit);
        Ok(if with.odds_against(&without, self)? > 0.0 { with } else { without })
    }
}
