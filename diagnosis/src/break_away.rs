//! Friction at rest: no fit of motion tells it where a joint leaves rest too fast to be seen, but rests do, by what they bear.

use crate::estimate::Fit;
use crate::problem::Problem;
use crate::refine::Data;
use crate::regimes::quantile;
use gapscope_effects::{EffectError, Kind};

/// Part of a fold that a joint must rest for its rests to tell: the blows of other joints would outweigh few of them.
const RESTS: f64 = 0.1;
/// Part of the rests of a fold that end well below the break-away torque: by so many times what the others differ, it may
/// lie higher, as a rest that ends in a moment is averaged with what comes before.
const WELL_BELOW: f64 = 0.98;
const SPREADS: f64 = 3.0;

/// What friction held at rest in the rows of a fold, N m or N.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    /// Break-away torque, from below.
    pub torque: f64,
    /// What it may be off by.
    pub doubt: f64,
}

impl Held {
    /// From torques beyond a friction that was assumed, in the rows at rest, and the noise on them.
    fn at_rest(friction: f64, rows: &[Option<f64>], noise: f64) -> Option<Held> {
        let mut beyond: Vec<f64> = rows.iter().filter_map(|x| x.map(f64::abs)).collect();
        beyond.sort_by(f64::total_cmp);
        // One row alone may be a glitch.
        let &[.., second, greatest] = beyond.as_slice() else { return None };
        let spread = greatest - quantile(&beyond, WELL_BELOW);
        (beyond.len() as f64 >= RESTS * rows.len() as f64)
            .then_some(Held { torque: friction + second - noise, doubt: SPREADS * spread + 2.0 * noise })
    }
}

impl Data<'_> {
    /// Tells each Stribeck friction of a fit what its joint held at rest, fold by fold: the break-away torque, from below.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn break_away(&self, problem: &mut Problem, fit: &Fit) -> Result<(), EffectError> {
        let set = || fit.set.iter().filter(|&&c| problem.entries[c].candidate.kind == Kind::StribeckFriction);
        if set().next().is_none() {
            return Ok(());
        }
        let rest = self.rest(problem, fit)?;
        let held: Vec<(usize, Vec<Option<Held>>)> = set()
            .filter_map(|&c| {
                let &[j] = problem.entries[c].candidate.joints.as_slice() else { return None };
                let friction: f64 = fit.own(problem, c).1.iter().take(2).sum();
                let mut folds = vec![Vec::new(); self.band.folds];
                for (e, s) in self.signals.iter().enumerate() {
                    let still: Vec<bool> = s.v[j].iter().map(|v| v.abs() < self.standstill[j]).collect();
                    let rows = self.band.of_episode[e].clone().zip(self.band.filter_where(e, &still, &rest[e][j]));
                    for (row, x) in rows {
                        folds[self.band.rows[row].fold].push(x);
                    }
                }
                Some((c, folds.iter().map(|rows| Held::at_rest(friction, rows, self.noise[j])).collect()))
            })
            .collect();
        for (c, held) in held {
            problem.entries[c].held = held;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_bound_friction_from_below_where_they_are_not_few() {
        // Torques beyond a friction of 1 grow to 0.5 in a hundred rests; one row alone says 7.
        let rests = (1..=100).map(|i| Some(0.005 * f64::from(i))).chain([Some(-7.0)]);
        let held = Held::at_rest(1.0, &rests.clone().chain(vec![None; 400]).collect::<Vec<_>>(), 0.01).unwrap();
        assert!((held.torque - 1.49).abs() < 1e-12, "{held:?}");
        assert!(held.doubt > 0.01);
        assert!(Held::at_rest(1.0, &rests.chain(vec![None; 4000]).collect::<Vec<_>>(), 0.01).is_none());
        assert!(Held::at_rest(1.0, &[], 0.01).is_none());
    }
}
