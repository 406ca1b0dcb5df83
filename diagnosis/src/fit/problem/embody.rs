//! Fits whose links are bodies: to the deviance comes, for each link, a little of its log-det divergence from the URDF
//! ([`gapscope_effects::Body`]), and Newton's method with a line search finds the least of the sum (an interior point
//! method: Boyd, Vandenberghe, Convex Optimization, 2004, chapter 11).

use super::Problem;
use gapscope_effects::Body;
use nalgebra::{DMatrix, DVector};

/// What the divergence of a link from the URDF counts, nats: so little that it moves what logs determine by nothing, enough
/// that what they do not determine stays a body.
const BODIES_PULL: f64 = 0.01;

/// Steps, at most, halvings of a step, at most, and the rise of the sum, nats, from which on it has settled.
const STEPS: usize = 40;
const HALVINGS: usize = 30;
const SETTLED: f64 = 1e-6;
/// Powers of ten by which the divergence counts more at first, where least squares alone would leave no body.
const FROM_OUTSIDE: i32 = 6;

/// A link, and where among some columns stand the ten numbers that add to it, an error and what it carries.
struct Link<'a> {
    body: &'a Body,
    at: Vec<usize>,
}

impl Link<'_> {
    fn more(&self, theta: &DVector<f64>) -> [f64; 10] {
        std::array::from_fn(|i| self.at.iter().map(|at| theta[at + i]).sum())
    }
}

impl Problem {
    /// The least of deviance and divergence, from the least of the deviance alone.
    pub(super) fn embody(
        &self,
        columns: &[usize],
        gram: &DMatrix<f64>,
        moment: &DVector<f64>,
        held: &mut [Option<f64>],
        theta: Vec<f64>,
    ) -> Vec<f64> {
        let links = self.links(columns, &theta);
        if links.is_empty() {
            return theta;
        }
        let mut here = DVector::from_vec(theta);
        let mut outside = false;
        for link in &links {
            // Towards the URDF until it is a body.
            while link.body.divergence(&link.more(&here)).is_none() {
                link.at.iter().for_each(|&at| (at..at + 10).for_each(|i| here[i] *= 0.5));
                outside = true;
            }
        }
        // From beyond the edge of what a body can be, the way leads through its middle: at the edge, every step is cut short.
        let first = if outside { FROM_OUTSIDE } else { 0 };
        for tenfold in (0..=first).rev() {
            here = self.settle(columns, gram, moment, held, here, &links, BODIES_PULL * 10f64.powi(tenfold));
        }
        here.iter().copied().collect()
    }

    /// The least of deviance and `pull` times the divergence of links, by Newton's method from a place where they are bodies.
    #[expect(clippy::too_many_arguments, reason = "the normal equations are four of them")]
    fn settle(
        &self,
        columns: &[usize],
        gram: &DMatrix<f64>,
        moment: &DVector<f64>,
        held: &mut [Option<f64>],
        mut here: DVector<f64>,
        links: &[Link<'_>],
        pull: f64,
    ) -> DVector<f64> {
        let sum = |theta: &DVector<f64>| -> f64 {
            let divergence = |link: &Link| link.body.divergence(&link.more(theta)).map_or(f64::INFINITY, |d| d.value);
            let fit = 0.5 * theta.dot(&(gram * theta)) - moment.dot(theta);
            fit + pull * links.iter().map(divergence).sum::<f64>()
        };
        let mut least = sum(&here);
        for _ in 0..STEPS {
            let (mut curved, mut pulled) = (gram.clone(), moment.clone());
            for link in links {
                let Some(divergence) = link.body.divergence(&link.more(&here)) else { continue };
                let (gradient, hessian) = (divergence.gradient * pull, divergence.hessian * pull);
                let own: DVector<f64> = DVector::from_row_slice(&link.more(&here));
                let target = hessian * own - gradient;
                for &a in &link.at {
                    for i in 0..10 {
                        pulled[a + i] += target[i];
                        for &b in &link.at {
                            (0..10).for_each(|k| curved[(a + i, b + k)] += hessian[(i, k)]);
                        }
                    }
                }
            }
            let step = DVector::from_vec(self.descend(columns, &curved, &pulled, held)) - &here;
            let tried = (0..HALVINGS).map(|halvings| &here + &step * 0.5f64.powi(halvings as i32));
            let Some((next, value)) =
                tried.map(|next| (sum(&next), next)).find(|(value, _)| *value < least).map(|(v, n)| (n, v))
            else {
                break;
            };
            let settled = least - value < SETTLED;
            (here, least) = (next, value);
            if settled {
                break;
            }
        }
        here
    }

    /// The links that some columns add to. A load that is there is a body of its own and no part of its link; one that is
    /// missing leaves the link that it is missing from.
    fn links(&self, columns: &[usize], theta: &[f64]) -> Vec<Link<'_>> {
        let mut links: Vec<Link> = Vec::new();
        for (link, body) in self.bodies.iter().enumerate().filter_map(|(link, body)| Some((link, body.as_ref()?))) {
            let adds = |e: &&super::Entry| e.candidate.link() == Some(link);
            let place = |e: &super::Entry| columns.iter().position(|c| *c == e.columns.start);
            let missing = |e: &super::Entry, at: usize| e.candidate.kind.is_calibration() || theta[at] < 0.0;
            let at: Vec<usize> =
                self.entries.iter().filter(adds).filter_map(|e| place(e).filter(|&at| missing(e, at))).collect();
            if !at.is_empty() {
                links.push(Link { body, at });
            }
        }
        links
    }
}

#[cfg(test)]
mod tests {
    use crate::fit::support::fitted;
    use gapscope_effects::{Body, Kind};

    /// A torque that takes more away than the link has: least squares alone would leave it lighter than nothing.
    #[test]
    fn a_link_stays_a_body_whatever_the_logs_say() {
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let body = Body::new(&model, 0).unwrap();
        let (_, _, problem, fit) = fitted(Kind::LinkInertiaError, |s| {
            let nominal = s.nominal[0].clone();
            s.tau[0].iter_mut().zip(nominal).for_each(|(tau, nominal)| *tau -= 3.0 * nominal);
        });
        let own = |theta: &[f64]| -> [f64; 10] {
            let at = problem.entries[0].columns.start;
            let first = fit.columns.iter().position(|c| *c == at).unwrap();
            std::array::from_fn(|i| theta[first + i])
        };
        assert!(body.divergence(&own(&fit.theta)).is_some(), "{:?}", fit.theta);
        let free = problem.solve_unbounded(&fit.columns, &problem.total);
        assert!(body.divergence(&own(&free)).is_none(), "{free:?}");
    }

    /// A torque that takes away half as much again as the link has: no body takes it over, and what it leaves in the joint shows
    /// that the edge of what a body can be holds the fit back.
    #[test]
    fn what_no_body_takes_over_is_left_in_the_joint() {
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let own = model.joints()[0].inertia.parameters();
        let (_, _, problem, fit) = fitted(Kind::LinkInertiaError, |s| {
            for k in 0..s.len() {
                let at = |x: &[Vec<f64>]| [x[0][k], x[1][k]];
                let (mut data, mut block) = (gapscope_dynamics::Data::new(&model), nalgebra::DMatrix::zeros(2, 20));
                model.regressor(&mut data, &at(&s.q), &at(&s.v), &at(&s.a), &mut block);
                s.tau[0][k] -= 1.5 * (0..10).map(|i| block[(0, i)] * own[i]).sum::<f64>();
            }
        });
        let (left, free) = (problem.left(&fit), problem.free_left(&fit));
        assert!(free[0] < 0.8 * left[0], "{free:?} {left:?}");
    }

    /// A thin rod whose middle lies beside its line: the first moment alone would leave no body, and the way to the second
    /// moments that make it one leads along the edge.
    #[test]
    fn a_body_far_from_a_rod_is_found() {
        let model = gapscope_dynamics::robots::model("double_pendulum").unwrap().unwrap().model;
        let beside = [0.0, 0.06, 0.0, 0.0, 0.0, 0.0, 1e-2, 0.0, 0.0, 1e-2];
        let added = |s: &crate::record::signals::Signals, k: usize| -> f64 {
            let at = |x: &[Vec<f64>]| [x[0][k], x[1][k]];
            let (mut data, mut block) = (gapscope_dynamics::Data::new(&model), nalgebra::DMatrix::zeros(2, 20));
            model.regressor(&mut data, &at(&s.q), &at(&s.v), &at(&s.a), &mut block);
            (0..10).map(|i| block[(0, i)] * beside[i]).sum()
        };
        let (signals, _, problem, fit) = fitted(Kind::LinkInertiaError, |s| {
            let torque: Vec<f64> = (0..s.len()).map(|k| added(s, k)).collect();
            s.tau[0].iter_mut().zip(torque).for_each(|(tau, torque)| *tau += torque);
        });
        let all: Vec<f64> = signals.iter().flat_map(|s| (0..s.len()).map(|k| added(s, k).powi(2))).collect();
        let part = problem.left(&fit)[0] / (all.iter().sum::<f64>() / all.len() as f64);
        assert!(part < 1e-4, "{part} of the torque of a bent rod is left: {:?}", fit.theta);
    }
}
