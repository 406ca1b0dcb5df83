//! Friction at rest: no fit of motion tells it where a joint leaves rest too fast to be seen, but rests do, by what they bear.

use crate::diagnose::Logs;
use crate::estimate::Fit;
use crate::problem::Problem;
use crate::refine::Data;
use crate::regimes::quantile;
use crate::search::{Chosen, with_drive};
use crate::select;
use gapscope_effects::{Candidate, EffectError, Kind};

/// Part of a fold that a joint must rest for its rests to tell: the blows of other joints would outweigh few of them.
const RESTS: f64 = 0.1;
/// Part of the rests of a fold that end well below the break-away torque: by so many times what the others differ, it may
/// lie higher, as a rest that ends in a moment is averaged with what comes before.
const WELL_BELOW: f64 = 0.98;
const SPREADS: f64 = 3.0;

/// What friction held at rest in the rows of a fold, N m or N.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Break-away torque.
    pub torque: f64,
    /// What it may be off by.
    pub doubt: f64,
}

impl Held {
    /// From the torques in the rows at rest, and the noise on them.
    fn at_rest(rows: &[Option<f64>], noise: f64) -> Option<Held> {
        let mut held: Vec<f64> = rows.iter().filter_map(|x| x.map(f64::abs)).collect();
        held.sort_by(f64::total_cmp);
        // One row alone may be a glitch.
        let &[.., second, greatest] = held.as_slice() else { return None };
        let spread = greatest - quantile(&held, WELL_BELOW);
        (held.len() as f64 >= RESTS * rows.len() as f64 && second > noise)
            .then_some(Held { torque: second - noise, doubt: SPREADS * spread + 2.0 * noise })
    }
}

impl Data<'_> {
    /// Tells each Stribeck friction of a fit what its joint held at rest, fold by fold: the break-away torque.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn break_away(&self, problem: &mut Problem, fit: &Fit) -> Result<(), EffectError> {
        let sticks = |&c: &usize| problem.entries[c].candidate.kind == Kind::StribeckFriction;
        let (set, others): (Vec<usize>, Vec<usize>) = fit.set.iter().partition(|c| sticks(c));
        if set.is_empty() {
            return Ok(());
        }
        // What friction holds is what all else leaves.
        let rest = self.rest(problem, &Fit { set: others, ..fit.clone() })?;
        let held: Vec<(usize, Vec<Option<Held>>)> = set
            .into_iter()
            .filter_map(|c| {
                let &[j] = problem.entries[c].candidate.joints.as_slice() else { return None };
                let mut folds = vec![Vec::new(); self.band.folds];
                for (e, s) in self.signals.iter().enumerate() {
                    let still: Vec<bool> = s.v[j].iter().map(|v| v.abs() < self.standstill[j]).collect();
                    let rows = self.band.of_episode[e].clone().zip(self.band.filter_where(e, &still, &rest[e][j]));
                    for (row, x) in rows {
                        folds[self.band.rows[row].fold].push(x);
                    }
                }
                Some((c, folds.iter().map(|rows| Held::at_rest(rows, self.noise[j])).collect()))
            })
            .collect();
        for (c, held) in held {
            problem.entries[c].held = held;
        }
        Ok(())
    }
}

impl Logs<'_> {
    /// A choice of rigid drives with Stribeck friction in the place of its Coulomb friction, among `all` candidates; nothing
    /// where it has none.
    /// The rise towards rest of a joint that leaves rest too fast shows in what it holds there, and in no row of its motion.
    pub(crate) fn sticking(&self, chosen: &Chosen, all: Problem) -> Result<Option<Chosen>, EffectError> {
        let of = |c: usize| &all.entries[c].candidate;
        let place = |chosen: &Candidate| (0..all.entries.len()).find(|&c| of(c) == chosen);
        let entries = chosen.choice.set.iter().map(|&c| place(&chosen.all.entries[c].candidate));
        let Some(slides) = entries.collect::<Option<Vec<usize>>>() else { return Ok(None) };
        let mut set = slides.clone();
        for (i, &c) in slides.iter().enumerate().filter(|(_, c)| of(**c).kind == Kind::CoulombFriction) {
            let sticks = |other: &usize| of(*other).kind == Kind::StribeckFriction && of(*other).joints == of(c).joints;
            let objective = |other: usize| {
                let set = set.iter().enumerate().map(|(k, &c)| if k == i { other } else { c }).collect();
                (select::evaluate(&all, set).objective, other)
            };
            let best = (0..all.entries.len()).filter(sticks).map(objective).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, best)) = best {
                set[i] = best;
            }
        }
        if set == slides {
            return Ok(None);
        }
        set.sort_unstable();
        let (exact, fit) = self.data(&chosen.noise).refine(&with_drive(&all, &set, &None))?;
        let choice = select::evaluate(&all, set);
        Ok(Some(Chosen { choice, exact, fit, all, noise: chosen.noise.clone(), turned: None, late_doubt: None }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_tell_friction_where_they_are_not_few() {
        // Torques grow to 1.5 in three hundred rests; one row alone says 7.
        let rests = (1..=300).map(|i| Some(0.005 * f64::from(i))).chain([Some(-7.0)]);
        let held = Held::at_rest(&rests.clone().chain(vec![None; 400]).collect::<Vec<_>>(), 0.01).unwrap();
        assert!((held.torque - 1.49).abs() < 1e-12, "{held:?}");
        assert!(held.doubt > 0.01);
        assert!(Held::at_rest(&rests.chain(vec![None; 4000]).collect::<Vec<_>>(), 0.01).is_none());
        assert!(Held::at_rest(&[], 0.01).is_none());
    }
}
