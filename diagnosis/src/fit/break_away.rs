//! Friction at rest: no fit of motion tells it where a joint leaves rest too fast to be seen, but rests do, by what they bear.

use crate::fit::estimate::Fit;
use crate::fit::held::Held;
use crate::fit::problem::Problem;
use crate::record::data::Data;
use gapscope_dynamics::Model;
use gapscope_effects::EffectError;

impl Fit {
    /// Whether a friction that can do so rises towards rest by more than it may be off by, at its printed interval. Any other kind
    /// does. What does not rise slides.
    pub fn rises(&self, problem: &Problem, model: &Model, candidate: usize, speeds: &[Vec<usize>]) -> bool {
        let kind = problem.entries[candidate].candidate.kind;
        let Some(rests) = kind.card().rests else { return true };
        let told = self.told(problem, model, kind, &[candidate], speeds);
        let of = |name: &str| told.iter().find(|told| told.value.name == name);
        let (Some(sliding), Some(at_rest)) = (of(rests.sliding), of(rests.at_rest)) else { return false };
        let least: f64 = at_rest.value.value[0] - at_rest.components[0].half_width();
        least > sliding.value.value[0]
    }
}

impl Data<'_> {
    /// Tells each Stribeck friction of a fit what its joint held at rest, fold by fold: the break-away torque.
    ///
    /// # Errors
    /// An effect that the robot cannot have.
    pub fn break_away(&self, problem: &mut Problem, fit: &Fit) -> Result<(), EffectError> {
        let rests = |c: usize| problem.entries[c].candidate.kind.card().rests;
        let sticks = |&c: &usize| rests(c).is_some();
        let (set, others): (Vec<usize>, Vec<usize>) = fit.set.iter().partition(|c| sticks(c));
        if set.is_empty() {
            return Ok(());
        }
        // What friction holds is what all else leaves.
        let rest = self.rest(problem, &Fit { set: others, ..fit.clone() })?;
        let held: Vec<(usize, Vec<Option<Held>>)> = set
            .into_iter()
            .filter_map(|c| {
                let rests = rests(c)?;
                let &[j] = problem.entries[c].candidate.joints.as_slice() else { return None };
                let mut folds = vec![Vec::new(); self.band.folds];
                for (e, s) in self.signals.iter().enumerate() {
                    let still = s.rests(j, self.standstill[j]);
                    let rows = self.band.of_episode[e].clone().zip(self.band.filter_where(e, &still, &rest[e][j]));
                    for (row, x) in rows {
                        folds[self.band.rows[row].fold].push(x);
                    }
                }
                Some((c, folds.iter().map(|rows| Held::at_rest(rows, self.noise[j], &rests)).collect()))
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
    use crate::fit::estimate::speeds;
    use crate::fit::support::{fitted_as, torque};
    use gapscope_effects::{Candidate, Kind};

    #[test]
    fn friction_rises_towards_rest_where_it_does_so_beyond_doubt() {
        let sticking = Candidate { shape: 0.2, ..Candidate::new(Kind::StribeckFriction, vec![0]) };
        let rises = |law: fn(f64) -> f64| {
            let (signals, band, problem, fit) = fitted_as(vec![sticking.clone()], torque(law));
            let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
            fit.rises(&problem, &model, 0, &speeds(&signals, &band, 2))
        };
        assert!(!rises(|v| 0.4 * v.signum()), "it slides");
        assert!(!rises(|v| (0.4 - 0.2 * (-(v / 0.2).powi(2)).exp()) * v.signum()), "it falls");
        assert!(rises(|v| (0.4 + 0.4 * (-(v / 0.2).powi(2)).exp()) * v.signum()), "it sticks");
    }
}
