//! From coefficients to effects with parameters and intervals.

use crate::fit::problem::Problem;
use crate::record::band::Band;
use crate::record::signals::Signals;
use crate::schema::{Estimate, Parameter, Quantity};
use gapscope_dynamics::{JointKind, Model};
use gapscope_effects::{Candidate, Effect, Kind, Plant, Value, keep_bodies, leave_to_link};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;

/// Step of the numerical derivative from coefficients to parameters, in standard errors.
const STEP: f64 = 1e-3;

/// Parts of a joint's speed, as many rows in each, over which a law must hold.
const PARTS: usize = 12;

/// The part of its speed in which each joint is at each row of a band: `[joint][row]`.
pub fn speeds(signals: &[Signals], band: &Band, joints: usize) -> Vec<Vec<usize>> {
    (0..joints)
        .map(|j| {
            let speed: Vec<f64> = band.rows.iter().map(|row| signals[row.episode].v[j][row.center].abs()).collect();
            let mut order: Vec<usize> = (0..speed.len()).collect();
            order.sort_by(|&a, &b| speed[a].total_cmp(&speed[b]));
            let mut part = vec![0; speed.len()];
            order.iter().enumerate().for_each(|(rank, &row)| part[row] = rank * PARTS / speed.len());
            part
        })
        .collect()
}

/// Half of a 95 % interval in standard errors, where so many groups of rows tell the error.
pub(crate) fn quantile(groups: usize) -> f64 {
    StudentsT::new(0.0, 1.0, groups.saturating_sub(1).max(1) as f64).map_or(1.96, |t| t.inverse_cdf(0.975))
}

/// A parameter with what the logs tell of each of its components.
#[derive(Debug, Clone)]
pub struct Told {
    /// Its value under its public name.
    pub value: Value,
    /// One a number of the value.
    pub components: Vec<Component>,
}

/// What the logs tell of one number.
#[derive(Debug, Clone)]
pub struct Component {
    /// What it changes by with the coefficients of the fit: place among the fit's columns, derivative.
    pub gradient: Vec<(usize, f64)>,
    /// Half of the 95 % interval for what the coefficients are off by, which other parameters share.
    pub shared: f64,
    /// The same for what is its own.
    pub own: f64,
}

impl Component {
    /// Half of its 95 % interval.
    pub fn half_width(&self) -> f64 {
        self.shared.hypot(self.own)
    }
}

/// A model in coefficients: a set of candidates fitted to some rows.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Indices of candidates.
    pub set: Vec<usize>,
    /// Columns of the problem, the alignment first.
    pub columns: Vec<usize>,
    /// Their coefficients.
    pub theta: Vec<f64>,
    /// Fold that it has not seen.
    pub without: Option<usize>,
}

impl Fit {
    /// Fit on all rows.
    pub fn on_all(problem: &Problem, set: &[usize]) -> Fit {
        let columns = problem.columns(set);
        let theta = problem.fit(&columns);
        Fit { set: set.to_vec(), columns, theta, without: None }
    }

    /// Fits on all rows outside each fold.
    pub fn without_folds(problem: &Problem, set: &[usize]) -> Vec<Fit> {
        let columns = problem.columns(set);
        let fit = |(fold, theta)| Fit { set: set.to_vec(), columns: columns.clone(), theta, without: Some(fold) };
        problem.fits_without(&columns).into_iter().enumerate().map(fit).collect()
    }

    /// Time by which the logged effort acts late against the position, s.
    pub fn alignment(&self) -> f64 {
        // Without effects there is nothing to correct, and the nominal model stays as it is.
        match (self.columns.first(), self.theta.first()) {
            (Some(0), Some(&theta)) if !self.set.is_empty() => theta,
            _ => 0.0,
        }
    }

    /// Position in `columns` of a candidate's own columns, and their coefficients.
    pub fn own(&self, problem: &Problem, candidate: usize) -> (Vec<usize>, Vec<f64>) {
        let range = problem.entries[candidate].columns.clone();
        self.columns
            .iter()
            .zip(&self.theta)
            .enumerate()
            .filter(|(_, (c, _))| range.contains(c))
            .map(|(i, (_, t))| (i, *t))
            .unzip()
    }

    /// The alignment's coefficient and those of each candidate of a problem, tangents of knobs aside.
    pub fn coefficients(&self, problem: &Problem) -> Vec<Vec<f64>> {
        let own = |c: usize| {
            let entry = &problem.entries[c];
            let mut theta = self.own(problem, c).1;
            theta.truncate(entry.columns.len() - usize::from(entry.tangent));
            theta
        };
        std::iter::once(vec![self.alignment()]).chain((0..problem.entries.len()).map(own)).collect()
    }

    /// Moves the coefficients to others of the same candidates by a part of the way, within their bounds; away from them where
    /// the part is negative. Tangents of knobs stay out.
    pub fn move_to(&mut self, problem: &Problem, others: &[Vec<f64>], part: f64) {
        let to = |own: f64, other: f64, column: usize| {
            let (low, high) = problem.bounds[column];
            (own + part * (other - own)).max(low).min(high)
        };
        if self.columns.first() == Some(&0) {
            self.theta[0] = to(self.theta[0], others[0][0], 0);
        }
        for (c, others) in others[1..].iter().enumerate() {
            let (at, _) = self.own(problem, c);
            for (i, place) in at.into_iter().enumerate() {
                self.theta[place] = to(self.theta[place], others.get(i).copied().unwrap_or(0.0), self.columns[place]);
            }
        }
    }

    /// The square of the step from other coefficients of the same candidates, in standard errors. A tangent's is the step of its
    /// knob.
    pub fn step_from(&self, problem: &Problem, others: &[Vec<f64>]) -> f64 {
        let mut from = self.clone();
        from.move_to(problem, others, 1.0);
        let step = DVector::from_iterator(self.theta.len(), self.theta.iter().zip(&from.theta).map(|(a, b)| a - b));
        step.dot(&(problem.precision(&self.columns) * &step))
    }

    /// The effects, one a kind where the kind has a value per joint. Candidates whose coefficients no physical effect has are
    /// left out. Links may be what no body is: where a search moves on from here, a body that was moved would lead it astray.
    pub fn effects(&self, problem: &Problem, model: &Model) -> Vec<Effect> {
        let mut effects: Vec<Effect> =
            self.effects_with_candidates(problem, model).into_iter().map(|(effect, _)| effect).collect();
        let loads = |c: &&usize| {
            let kind = problem.entries[**c].candidate.kind;
            kind.card().body && !kind.is_calibration()
        };
        for &c in self.set.iter().filter(loads) {
            let (_, theta) = self.own(problem, c);
            leave_to_link(&theta, &problem.entries[c].effects(model, &theta, self.without), &mut effects);
        }
        if Plant::new(model, &effects, 1e-3).is_err() {
            keep_bodies(model, &mut effects);
        }
        effects
    }

    /// The same with every link a body.
    pub fn bodies(&self, problem: &Problem, model: &Model) -> Vec<Effect> {
        let mut effects = self.effects(problem, model);
        keep_bodies(model, &mut effects);
        effects
    }

    /// The effects, each with the candidates that it is made of.
    pub fn effects_with_candidates(&self, problem: &Problem, model: &Model) -> Vec<(Effect, Vec<usize>)> {
        let mut effects: Vec<(Effect, Vec<usize>)> = Vec::new();
        for &c in &self.set {
            let (_, theta) = self.own(problem, c);
            for effect in problem.entries[c].effects(model, &theta, self.without) {
                let apart = effects
                    .iter_mut()
                    .try_fold(effect, |effect, (known, made_of)| known.absorb(effect).ok_or_else(|| made_of.push(c)));
                // An error says that a known effect of the same kind has taken it in.
                effects.extend(apart.ok().map(|effect| (effect, vec![c])));
            }
        }
        effects
    }

    /// Half-widths of the 95 % intervals of each candidate's own coefficients: the wider of what blocks of time tell, and parts of
    /// the speed of any of its joints.
    pub fn half_widths(&self, problem: &Problem, candidates: &[usize], speeds: &[Vec<usize>]) -> Vec<Vec<f64>> {
        let mut widths = Widths::new(self, problem, speeds);
        let of = |&c: &usize| {
            let (at, _) = self.own(problem, c);
            let accounts = widths.accounts(&problem.entries[c].candidate.joints, &at);
            (0..at.len()).map(|i| accounts.iter().map(|of| of[(i, i)]).fold(0.0, f64::max).sqrt()).collect()
        };
        candidates.iter().map(of).collect()
    }

    /// Parameters of an effect of a kind made of some candidates under their public names, with 95 % intervals.
    pub fn parameters(told: &[Told], model: &Model) -> BTreeMap<String, Parameter> {
        let mut parameters: BTreeMap<String, Parameter> = BTreeMap::new();
        for one in told {
            let half: Vec<f64> = one.components.iter().map(Component::half_width).collect();
            insert(&mut parameters, model, &one.value, &half);
        }
        parameters
    }

    /// What the logs tell of the parameters of an effect of a kind made of some candidates, by the delta method: the wider
    /// of what blocks of time and of what parts of the speed of each of its joints tell, `speeds` telling the part of each row of
    /// the band for each joint.
    pub fn told(
        &self,
        problem: &Problem,
        model: &Model,
        kind: Kind,
        candidates: &[usize],
        speeds: &[Vec<usize>],
    ) -> Vec<Told> {
        let mut widths = Widths::new(self, problem, speeds);
        let mut told = Vec::new();
        for &c in candidates {
            let (at, theta) = self.own(problem, c);
            let candidate = &problem.entries[c].candidate;
            let accounts = widths.accounts(&candidate.joints, &at);
            let values = |theta: &[f64]| -> Option<Vec<Value>> {
                let effects = problem.entries[c].effects(model, theta, self.without);
                Some(effects.iter().find(|e| e.kind() == kind)?.law().parameters())
            };
            let Some(estimates) = values(&theta) else { continue };
            // What a knob known by other means may be off by.
            let knob_moved: Option<Vec<Value>> = (candidate.knob_error > 0.0).then_some(candidate).and_then(|known| {
                let moved = Candidate { shape: known.shape + known.knob_error, ..known.clone() }.effects(model, &theta);
                Some(moved.iter().find(|e| e.kind() == kind)?.law().parameters())
            });
            let slopes: Vec<Option<(f64, Vec<Value>)>> = (0..theta.len())
                .map(|i| {
                    let step = STEP * accounts[0][(i, i)].sqrt();
                    let mut moved = theta.clone();
                    moved[i] += step;
                    (step.is_finite() && step > 0.0).then_some(())?;
                    Some((step, values(&moved)?))
                })
                .collect();
            for (v, estimate) in estimates.iter().enumerate() {
                let systematic = kind.card().exact_to;
                let size = estimate.value.iter().map(|x| x * x).sum::<f64>().sqrt();
                let at_rest = problem.entries[c].held(self.without);
                let components = (0..estimate.value.len())
                    .map(|component| {
                        let gradient: Vec<f64> = slopes
                            .iter()
                            .map(|slope| {
                                slope.as_ref().map_or(0.0, |(step, moved)| {
                                    (moved[v].value[component] - estimate.value[component]) / step
                                })
                            })
                            .collect();
                        if let (Some(rests), Some(held)) = (kind.card().rests, at_rest.as_ref())
                            && estimate.name == rests.at_rest
                            && estimate.value == [held.torque]
                        {
                            let own = held.doubt.hypot(systematic * size);
                            return Component { gradient: Vec::new(), shared: 0.0, own };
                        }
                        let along = DVector::from_vec(gradient.clone());
                        let square = accounts.iter().map(|own| along.dot(&(own * &along))).fold(0.0, f64::max);
                        let knob = knob_moved
                            .as_ref()
                            .map_or(0.0, |moved| moved[v].value[component] - estimate.value[component]);
                        let timing = kind.card().exact_to_samples * problem.sample;
                        let knob = knob * quantile(problem.blocks_used());
                        let own = knob.hypot(systematic * size).hypot(timing);
                        Component { gradient: at.iter().copied().zip(gradient).collect(), shared: square.sqrt(), own }
                    })
                    .collect();
                told.push(Told { value: estimate.clone(), components });
            }
        }
        told
    }

    /// Squares of half-widths of 95 % intervals of the coefficients, and how they go together, by what blocks of time tell.
    pub fn over_time(&self, problem: &Problem) -> DMatrix<f64> {
        problem.covariance(&self.columns, &self.theta) * quantile(problem.blocks_used()).powi(2)
    }
}

/// Squares of half-widths of 95 % intervals of the coefficients of a fit, by every account that there is of them.
struct Widths<'a> {
    fit: &'a Fit,
    problem: &'a Problem,
    /// The part of the speed of each joint in which each row of the band is.
    speeds: &'a [Vec<usize>],
    over_time: DMatrix<f64>,
    /// By parts of the speed of the joints that were asked for.
    over_speed: BTreeMap<usize, DMatrix<f64>>,
}

impl<'a> Widths<'a> {
    fn new(fit: &'a Fit, problem: &'a Problem, speeds: &'a [Vec<usize>]) -> Widths<'a> {
        Widths { fit, problem, speeds, over_time: fit.over_time(problem), over_speed: BTreeMap::new() }
    }

    /// Of the coefficients at some places of the fit: by blocks of time, then by parts of the speed of each of some joints.
    fn accounts(&mut self, joints: &[usize], at: &[usize]) -> Vec<DMatrix<f64>> {
        let Widths { fit, problem, speeds, over_time, over_speed } = self;
        for &j in joints {
            over_speed.entry(j).or_insert_with(|| {
                problem.covariance_over(&fit.columns, &fit.theta, &speeds[j]) * quantile(PARTS).powi(2)
            });
        }
        std::iter::once(&*over_time)
            .chain(joints.iter().filter_map(|j| over_speed.get(j)))
            .map(|all| DMatrix::from_fn(at.len(), at.len(), |i, k| all[(at[i], at[k])]))
            .collect()
    }
}

fn insert(parameters: &mut BTreeMap<String, Parameter>, model: &Model, value: &Value, half: &[f64]) {
    let quantity = |values: Vec<f64>| match values.as_slice() {
        &[one] => Quantity::Scalar(one),
        _ => Quantity::Vector(values),
    };
    let shifted = |sign: f64| quantity(value.value.iter().zip(half).map(|(v, h)| v + sign * h).collect());
    let prismatic = value
        .joint
        .as_deref()
        .and_then(|name| model.joint_index(name))
        .is_some_and(|j| model.joints()[j].kind == JointKind::Prismatic);
    let estimate = Estimate {
        value: quantity(value.value.clone()),
        ci95: [shifted(-1.0), shifted(1.0)],
        unit: if prismatic { value.unit_prismatic } else { value.unit }.to_owned(),
    };
    match &value.joint {
        None => {
            parameters.insert(value.name.to_owned(), Parameter::Single(estimate));
        }
        Some(joint) => {
            let entry = parameters.entry(value.name.to_owned()).or_insert_with(|| Parameter::PerJoint(BTreeMap::new()));
            if let Parameter::PerJoint(map) = entry {
                map.insert(joint.clone(), estimate);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::support::{fitted, fitted_as, torque};

    /// A drag that grows with the square of the speed, fitted as one that grows with it, is too weak at any high speed and too
    /// strong at any low one: in every block of time the two are nearly even, and only parts of the speed tell.
    #[test]
    fn a_law_that_is_not_the_robots_is_less_certain_by_parts_of_the_speed() {
        let (signals, band, problem, fit) = fitted(Kind::ViscousFriction, torque(|v| 0.5 * v * v.abs()));
        let (at, _) = fit.own(&problem, 0);
        let over_time = problem.covariance(&fit.columns, &fit.theta)[(at[0], at[0])];
        let part = &speeds(&signals, &band, 2)[0];
        let over_speed = problem.covariance_over(&fit.columns, &fit.theta, part)[(at[0], at[0])];
        assert!(over_speed > 2.0 * over_time, "{over_speed} and {over_time}");
        // As many rows in each part.
        let rows = |of: usize| part.iter().filter(|p| **p == of).count();
        assert!((0..PARTS).all(|of| rows(of).abs_diff(part.len() / PARTS) <= 1));
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let told = fit.told(&problem, &model, Kind::ViscousFriction, &[0], &speeds(&signals, &band, 2));
        let told = Fit::parameters(&told, &model);
        let Parameter::PerJoint(joints) = &told["viscous"] else { panic!("one a joint") };
        let Some(Estimate { ci95: [Quantity::Scalar(low), Quantity::Scalar(high)], .. }) = joints.values().next()
        else {
            panic!("one number")
        };
        assert!(0.5 * (high - low) > 1.96 * over_speed.sqrt(), "{low} to {high}");
    }

    /// Half a kilogram whose second moments are less than nothing along one axis, there or missing.
    #[test]
    fn a_load_and_the_error_of_its_link_add_up_to_what_was_fitted() {
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let candidates = [Kind::LinkInertiaError, Kind::Payload].map(|kind| Candidate::new(kind, vec![1]));
        let (_, _, problem, mut fit) = fitted_as(candidates.to_vec(), torque(|_| 0.0));
        let link = model.joints()[1].inertia;
        for sign in [1.0, -1.0] {
            let load = [0.5, 0.0, 0.01, 0.03, 0.004, 0.0, 0.004, 0.0, 0.0, 0.006].map(|x| 0.2 * sign * link.mass * x);
            let error = link.parameters().map(|x| 0.1 * x);
            for (c, own) in [(0, error), (1, load)] {
                let (at, _) = fit.own(&problem, c);
                at.into_iter().zip(own).for_each(|(at, own)| fit.theta[at] = own);
            }
            let plant = Plant::new(&model, &fit.effects(&problem, &model), 1e-3).unwrap();
            let whole = plant.model().joints()[1].inertia.parameters();
            for (i, nominal) in link.parameters().into_iter().enumerate() {
                assert!((whole[i] - nominal - error[i] - load[i]).abs() < 1e-9, "{sign} {i}");
            }
        }
    }
}
