//! Calibration that no first look asks for, as it lets links be what no link can be.
//!
//! The first look at all candidates is linear: there a link takes over what a rotor or friction does by an inertia that no
//! body has. At the exact law links stay bodies, and what they cannot take over stays in the joint.

use crate::record::logs::Record;
use crate::search::chosen::Chosen;
use crate::search::climb::{self, Choice};
use gapscope_effects::EffectError;

impl Record<'_> {
    /// What was chosen, with the calibration of each joint that links at the edge of what a body can be hold back, where the
    /// logs speak for it at the exact law.
    pub(crate) fn held_back(&self, mut chosen: Chosen) -> Result<Chosen, EffectError> {
        loop {
            let joints = climb::less_is_left(
                &chosen.exact,
                &chosen.exact.left(&chosen.fit),
                &chosen.exact.free_left(&chosen.fit),
            );
            let of = |c: usize| &chosen.all.entries[c].candidate;
            let taken = |c: usize| chosen.choice.set.iter().any(|&own| climb::excludes(&chosen.all, own, c));
            let open = |c: &usize| {
                let candidate = of(*c);
                let own = matches!(candidate.joints.as_slice(), [j] if joints.contains(j));
                own && candidate.kind.is_calibration() && !candidate.kind.card().body && !taken(*c)
            };
            let mut best: Option<(f64, Chosen)> = None;
            for c in (0..chosen.all.entries.len()).filter(open) {
                let mut set = chosen.choice.set.clone();
                set.push(c);
                set.sort_unstable();
                let (exact, fit) = self.data(&chosen.noise).exact(&chosen.all, &set, chosen.turned.as_ref())?;
                let with = chosen.with(Choice { set }, exact, fit);
                let odds = with.odds_against(&chosen, self)?;
                if odds > best.as_ref().map_or(0.0, |(least, _)| *least) {
                    best = Some((odds, with));
                }
            }
            match best {
                Some((_, with)) => chosen = with,
                None => return Ok(chosen),
            }
        }
    }
}
