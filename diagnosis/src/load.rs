//! Whether what looks like a torque gain is friction that grows with the load: where dry friction outweighs all else that a
//! joint does, the load has the sign of the speed, and by the first look, which takes the model's torque for the load, the
//! two are not told apart. The law itself tells.

use crate::diagnose::Logs;
use crate::refine::Data;
use crate::search::{Chosen, with_drive};
use crate::select;
use gapscope_effects::{EffectError, Kind};

impl Logs<'_> {
    /// The choice with load friction in the place of its torque gains, where other joints have such friction and it leaves
    /// no more that way: a kind less.
    pub(crate) fn load_for_gain(&self, chosen: Chosen) -> Result<Chosen, EffectError> {
        let entry = |c: usize| &chosen.all.entries[c].candidate;
        let kinds = select::kinds(&chosen.all, &chosen.choice.set);
        if !(kinds.contains(&Kind::LoadDependentFriction) && kinds.contains(&Kind::TorqueGainError)) {
            return Ok(chosen);
        }
        let instead = |c: usize| {
            let load = |i: &usize| entry(*i).kind == Kind::LoadDependentFriction && entry(*i).joints == entry(c).joints;
            if entry(c).kind == Kind::TorqueGainError { (0..chosen.all.entries.len()).find(load) } else { Some(c) }
        };
        let Some(mut set) = chosen.choice.set.iter().map(|&c| instead(c)).collect::<Option<Vec<usize>>>() else {
            return Ok(chosen);
        };
        set.sort_unstable();
        set.dedup();
        let data = Data { rubbing: true, ..self.data(&chosen.noise) };
        let (exact, fit) = data.refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
        if self.left(&exact, &fit.set)? > self.left(&chosen.exact, &chosen.fit.set)? {
            return Ok(chosen);
        }
        let choice = select::evaluate(&chosen.all, set);
        Ok(Chosen { choice, exact, fit, ..chosen })
    }
}
