//! Whether what looks like a torque gain is friction that grows with the load: where dry friction outweighs all else that a
//! joint does, the load has the sign of the speed, and by the first look, which takes the model's torque for the load, the
//! two are not told apart. The law itself tells.

use crate::diagnose::Logs;
use crate::estimate::Fit;
use crate::gap;
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
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&chosen.all, &set, &chosen.turned))?;
        let weights = gap::weights_of_concern(self.model, &self.signals, &self.moving);
        let left = |exact, fit: &Fit| -> Result<f64, EffectError> {
            let rows = self.held_out(exact, &fit.set, false)?.rows;
            let rows = self.beside_outside(exact, &fit.set, &rows);
            Ok(gap::weighted_rms(&gap::total(&gap::squares(&self.band, &rows, |_| true)), &weights))
        };
        if left(&exact, &fit)? > left(&chosen.exact, &chosen.fit)? {
            return Ok(chosen);
        }
        let choice = select::evaluate(&chosen.all, set);
        Ok(Chosen { choice, exact, fit, ..chosen })
    }
}
