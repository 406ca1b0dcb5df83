//! A choice of kinds under way at one joint: fits of sets, what each kind promises beside one, and by how much sets differ.
//!
//! The score of a comparison is Schwarz's, with two things put right for logs of real servos. Errors of a simulation are
//! coloured, so that the effective number of independent samples counts, and each stretch of a log (motor on, motor off)
//! has an error level of its own, so that a long stretch of a poor kind does not drown a short good one.
//! Source: Schwarz, Ann. Statist. 6(2) 1978.

use crate::fit::{Fit, fit, normal};
use crate::kinds::Kind;
use crate::law::{Law, Param};
use crate::prepare::Joint;
use crate::simulate::errors;
use crate::weigh::independent;

/// A kind must lower the squared error by this share of what is left, and its square root by this share of perfect tracking's
/// error: no servo is modelled to better, and no integrator is another's to better.
pub const RELEVANT: [f64; 2] = [0.04, 0.005];
/// Steps of a fit that only decides whether a kind is worth more.
pub(crate) const TRIAL: usize = 8;
/// Steps of a fit that is kept.
pub(crate) const FULL: usize = 25;
/// Nats from which on a kind is taken: no law of a servo is exact, and what is left of it speaks for some kind or other.
pub(crate) const TAKEN: f64 = 4.0;

/// One comparison.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Kind that was proposed.
    pub proposed: Kind,
    /// By how many nats the logs speak for it.
    pub nats: f64,
    /// Whether it was taken.
    pub taken: bool,
    /// Whether it was held against the account with it dropped, at the end.
    pub last: bool,
}

/// Kinds that are tried in earnest in each round.
const TRIED: usize = 3;

/// Takes out of a change of the errors what the free parameters can do themselves.
pub(crate) struct Projector<'a> {
    sensitivity: &'a [Vec<f64>],
    inverse: Option<nalgebra::DMatrix<f64>>,
}

impl<'a> Projector<'a> {
    pub(crate) fn new(sensitivity: &'a [Vec<f64>]) -> Self {
        let (mut normal, _) = normal(sensitivity, &[]);
        for i in 0..sensitivity.len() {
            normal[(i, i)] *= 1.0 + 1e-9;
        }
        Projector { sensitivity, inverse: normal.try_inverse() }
    }

    pub(crate) fn clear(&self, mut change: Vec<f64>) -> Vec<f64> {
        let Some(inverse) = &self.inverse else { return change };
        let (_, along) = normal(self.sensitivity, &change);
        let parts = inverse * along;
        for (part, column) in parts.iter().zip(self.sensitivity) {
            change.iter_mut().zip(column).for_each(|(c, s)| *c -= part * s);
        }
        change
    }
}

/// A choice under way.
pub(crate) struct Choice<'a> {
    pub(crate) joint: &'a mut Joint,
    /// Parameters of the drive that are free beside any kind.
    pub(crate) base: Vec<Param>,
    /// Squared error of perfect tracking in the units of the costs.
    pub(crate) perfect: f64,
}

impl Choice<'_> {
    fn free(&self, kinds: &[Kind]) -> Vec<Param> {
        let mut free = self.base.clone();
        for (param, _, _) in kinds.iter().flat_map(|kind| kind.parameters()) {
            if !free.contains(param) {
                free.push(*param);
            }
        }
        free
    }

    fn begin(&self, kind: Kind, law: &mut Law, start: f64) {
        kind.begin(law, start, &self.joint.ranges.scale, &self.joint.given, self.joint.sizes.inertia);
    }

    /// The best fit of some kinds from a law, with those of `new` started afresh.
    pub(crate) fn fit(&self, law: &Law, kinds: &[Kind], new: Option<Kind>, steps: usize) -> Fit {
        let free = self.free(kinds);
        let from = |(start, link_side): (f64, bool)| {
            let mut law = *law;
            if let Some(kind) = new {
                self.begin(kind, &mut law, start);
                law.link_side |= link_side;
            }
            fit(&law, &free, &self.joint.runs, &self.joint.ranges, steps)
        };
        let starts: &[f64] = new.map_or(&[1.0], Kind::starts);
        // The log does not say on which side of the play its encoder is: both are tried.
        let sides: &[bool] = if new == Some(Kind::Backlash) { &[false, true] } else { &[false] };
        let starts = starts.iter().flat_map(|&start| sides.iter().map(move |&side| (start, side)));
        let mut fits: Vec<Fit> = starts.map(from).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        fits.swap_remove(0)
    }

    /// The kinds that promise most beside a fit, by one linearised step: at most [`TRIED`].
    pub(crate) fn screen(&self, best: &Fit, kinds: &[Kind], possible: &[Kind], why: &mut Vec<Comparison>) -> Vec<Kind> {
        let samples = independent(self.joint, &best.errors);
        let project = Projector::new(&best.sensitivity);
        let mut promises = Vec::new();
        for &kind in possible.iter().filter(|kind| !kinds.contains(kind)) {
            if kinds.iter().any(|other| kind.excludes(*other)) {
                continue;
            }
            if kind.base().is_some_and(|base| !kinds.contains(&base)) {
                continue;
            }
            let gain = kind.starts().iter().map(|&start| self.promise(best, &project, kind, start)).fold(0.0, f64::max);
            let rest = (best.cost - gain).max(1e-3 * best.cost);
            let nats = 0.5 * samples * (best.cost / rest).ln() - 0.5 * samples.ln() - kind.cost();
            if nats > 0.0 && gain > self.least(rest) {
                promises.push((nats, kind));
            } else {
                why.push(Comparison { proposed: kind, nats, taken: false, last: false });
            }
        }
        promises.sort_by(|a, b| b.0.total_cmp(&a.0));
        promises.into_iter().take(TRIED).map(|(_, kind)| kind).collect()
    }

    /// Squared error that a kind would take away if errors were linear in it from a small start on.
    fn promise(&self, best: &Fit, project: &Projector, kind: Kind, start: f64) -> f64 {
        let Some(&(param, _, _)) = kind.parameters().first() else { return 0.0 };
        let mut law = best.law;
        if kind.base().is_some() {
            law[Param::StribeckVelocity] = self.joint.ranges.scale[Param::StribeckVelocity as usize];
        }
        let size = self.joint.ranges.scale[param as usize];
        if kind.is_threshold() {
            self.begin(kind, &mut law, start);
        } else {
            law[param] += 0.1 * start * size;
        }
        let mut moved = Vec::new();
        errors(&law, &self.joint.runs, &mut moved);
        let change: Vec<f64> = moved.iter().zip(&best.errors).map(|(m, b)| m - b).collect();
        let clear = project.clear(change);
        let energy: f64 = clear.iter().map(|c| c * c).sum();
        let along: f64 = clear.iter().zip(&best.errors).map(|(c, e)| c * e).sum();
        let signed = matches!(param, Param::Bias | Param::Offset | Param::Scale | Param::Damping | Param::Latency);
        if energy <= 0.0 || (!signed && along >= 0.0) { 0.0 } else { along * along / energy }
    }

    /// Nats by which a richer fit is ahead of a poorer one.
    pub(crate) fn nats(&self, rich: &Fit, poor: &Fit, kind: Kind, samples: f64) -> f64 {
        let more = kind.parameters().len() as f64;
        0.5 * samples * (poor.cost / rich.cost.max(1e-300)).ln() - 0.5 * more * samples.ln() - kind.cost()
    }

    /// The least fall of the squared error that counts, where `rest` is left.
    pub(crate) fn least(&self, rest: f64) -> f64 {
        (RELEVANT[0] * rest).max(RELEVANT[1] * RELEVANT[1] * self.perfect)
    }

    pub(crate) fn relevant(&self, rich: &Fit, poor: &Fit) -> bool {
        poor.cost - rich.cost > self.least(rich.cost)
    }

    pub(crate) fn measure_perfect(&mut self) {
        let mut sum = 0.0;
        for run in &self.joint.runs {
            let Some(target) = &run.target else {
                // Without a set point the motion itself is what a model has to explain.
                let mean = run.position.iter().sum::<f64>() / run.position.len() as f64;
                sum += run.position.iter().zip(&run.weight).map(|(q, w)| (w * (q - mean)).powi(2)).sum::<f64>();
                continue;
            };
            for k in 0..run.time.len() {
                if run.on[k] {
                    sum += (run.weight[k] * (target.at(k) - run.position[k])).powi(2);
                }
            }
        }
        self.perfect = sum;
    }
}

/// Whether all that a kind frees is given.
pub(crate) fn is_given(joint: &Joint, kind: Kind) -> bool {
    kind.parameters().iter().all(|(param, _, _)| joint.given[*param as usize])
}
