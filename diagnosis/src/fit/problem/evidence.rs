//! What logs say for an account at its exact law, and by how much for one rather than another.

use super::Problem;
use crate::fit::estimate::Fit;
use crate::numbers::decide::{EXACT_TO, FREEDOM, OUTLIER};
use crate::record::band::Band;
use crate::record::frequency::Equalizer;
use statrs::function::erf::erfc;

/// Steps towards the variance of what is left.
const TAIL_STEPS: usize = 30;
/// What logs say for an account, nats.
pub struct Evidence {
    /// Log likelihood of each block of time, ...
    pub seen: Vec<f64>,
    /// ... by a fit to the other folds, ...
    pub held_out: Vec<f64>,
    /// ... what the coefficients cost, ...
    pub occam: f64,
    /// ... and of that, how far from the URDF those lie of which a card says how far they may.
    pub far: f64,
    /// Variance of what is left of each joint, (N m)² or N².
    pub noise: Vec<f64>,
}

impl Evidence {
    /// Takes into account what each joint bears at rest beyond its friction, `borne[joint][row]`, where that is more than noise
    /// of a variance: a joint that rests bears any torque up to its friction.
    pub fn at_rest(&mut self, borne: &[Vec<Option<f64>>], variance: &[f64], correlation: &[f64], band: &Band) {
        for (j, borne) in borne.iter().enumerate() {
            for (row, borne) in band.rows.iter().zip(borne).filter(|(row, _)| row.fits) {
                let beyond = borne.map_or(0.0, |x| (x.abs() - OUTLIER.get() * variance[j].sqrt()).max(0.0));
                let square = beyond * beyond / (FREEDOM.get() * variance[j]);
                let nats = 0.5 * (FREEDOM.get() + 1.0) * square.ln_1p() / correlation[j];
                self.seen[row.block] -= nats;
                self.held_out[row.block] -= nats;
            }
        }
    }

    /// By how many nats this account is likelier than another. The evidence of one fit and that of what is held out must agree,
    /// and the lesser counts; how far bodies lie from the URDF belongs to both, as the same is predicted by a payload and by a
    /// last link that is off by as much. No account is exact: where blocks of time vote against each other, a majority is no more than
    /// one (Vuong, Econometrica 57(2) 1989), their spread told by those that vote against.
    pub fn against(&self, other: &Evidence) -> f64 {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>();
        let seen = sum(&self.seen, &other.seen) + self.occam - other.occam;
        let votes = || self.held_out.iter().zip(&other.held_out).map(|(a, b)| a - b);
        let held_out = votes().sum::<f64>() + self.far - other.far;
        if seen * held_out <= 0.0 {
            return 0.0;
        }
        let opposed: f64 = votes().filter(|vote| vote * held_out < 0.0).map(|vote| vote * vote).sum();
        let spread = (2.0 * opposed + 1.0).sqrt();
        seen.abs().min(held_out.abs()).min(odds_of_majority(held_out.abs() / spread)) * held_out.signum()
    }
}

/// Logarithm of the odds that a mean of normal votes has the sign that it has, so many standard errors from nothing.
fn odds_of_majority(errors: f64) -> f64 {
    let wrong = 0.5 * erfc(errors / std::f64::consts::SQRT_2);
    if wrong > 0.0 { (1.0 - wrong).ln() - wrong.ln() } else { f64::INFINITY }
}

/// Variance of some residuals under Student's law with few degrees of freedom, each with a variance of its own beside it,
/// and the log of their density.
fn heavy_tailed(rest: &[f64], own: &[f64], least: f64) -> (f64, Vec<f64>) {
    let mut variance = (rest.iter().map(|r| r * r).sum::<f64>() / rest.len() as f64).max(least);
    let weight = |r: f64, all: f64| (FREEDOM.get() + 1.0) / (FREEDOM.get() + r * r / all);
    for _ in 0..TAIL_STEPS {
        let (mut sum, mut count) = (0.0, 0.0);
        for (r, own) in rest.iter().zip(own) {
            let all = variance + own;
            sum += weight(*r, all) * r * r / all * (variance / all);
            count += variance / all;
        }
        variance = (variance * sum / count.max(f64::MIN_POSITIVE)).max(least);
    }
    let density = |(r, own): (&f64, &f64)| {
        let all = variance + own;
        -0.5 * all.ln() - 0.5 * (FREEDOM.get() + 1.0) * (r * r / (FREEDOM.get() * all)).ln_1p()
    };
    (variance, rest.iter().zip(own).map(density).collect())
}

impl Problem {
    /// Rows of each joint that count as one.
    pub fn correlation(&self) -> &[f64] {
        &self.correlation
    }

    /// Mean square of what a fit leaves of each joint, (N m)² or N².
    pub fn left(&self, fit: &Fit) -> Vec<f64> {
        let mean_square = |rest: Vec<f64>| rest.iter().map(|x| x * x).sum::<f64>() / rest.len().max(1) as f64;
        self.joints.iter().map(|joint| mean_square(joint.residual(&fit.columns, &fit.theta))).collect()
    }

    /// The same of a fit of the same columns whose links need not be bodies.
    pub fn free_left(&self, fit: &Fit) -> Vec<f64> {
        self.left(&Fit { theta: self.solve_unbounded(&fit.columns, &self.total), ..fit.clone() })
    }

    /// Sum over the joints of the mean logarithm of what a fit leaves of each block of time, each joint by its rows: a burst
    /// that no law of the catalogue hits counts as one block that is off.
    pub fn misfit(&self, fit: &Fit, band: &Band) -> f64 {
        self.misfits(fit, band).iter().sum()
    }

    /// The misfit of each joint.
    pub fn misfits(&self, fit: &Fit, band: &Band) -> Vec<f64> {
        let of = |(j, joint): (usize, &super::JointRows)| {
            let mut blocks = vec![(0.0, 0.0); band.blocks];
            for (row, rest) in joint.rows.iter().zip(joint.residual(&fit.columns, &fit.theta)) {
                let (sum, count) = &mut blocks[band.rows[*row].block];
                *sum += rest * rest;
                *count += 1.0;
            }
            let used: Vec<f64> =
                blocks.iter().filter(|b| b.1 > 0.0).map(|b| (b.0 / b.1 + self.least_noise(j)).ln()).collect();
            joint.rows.len() as f64 * used.iter().sum::<f64>() / used.len().max(1) as f64
        };
        self.joints.iter().enumerate().map(of).collect()
    }

    /// What logs say for an account at its exact law, as good as the whole problem is linear about it (Laplace). What is left
    /// has heavy tails, so that neither a glitch nor a blow decides, and a level of its own in each band of frequencies
    /// (Whittle, Arkiv för Matematik 2(23) 1953): noise at some of them does not drown what the others say.
    ///
    /// Of `unpredicted` rows (`[joint][row]`) an account knows no more than the size of the effort.
    pub fn evidence(
        &self,
        fit: &Fit,
        equalizer: Option<&Equalizer>,
        unpredicted: Option<&[Vec<bool>]>,
        band: &Band,
    ) -> Evidence {
        let folds = Fit::without_folds(self, &fit.set);
        let blocks = vec![0.0; band.blocks];
        let noise = vec![1.0; self.joints.len()];
        let mut evidence = Evidence { seen: blocks.clone(), held_out: blocks, occam: 0.0, far: 0.0, noise };
        for (j, joint) in self.joints.iter().enumerate().filter(|(_, joint)| !joint.rows.is_empty()) {
            let inexact: Vec<f64> = joint.linear_target.iter().map(|x| (EXACT_TO.get() * x).powi(2)).collect();
            let least = self.least_noise(j);
            let open = |i: usize| unpredicted.is_some_and(|rows| rows[j][joint.rows[i]]);
            let told: Vec<usize> = (0..joint.rows.len()).filter(|&i| !open(i)).collect();
            let nats = |rest: Vec<f64>| -> Vec<f64> {
                let mut nats = vec![0.0; rest.len()];
                for (part, width) in joint.in_bands(band, j, rest, equalizer) {
                    let inexact: Vec<f64> = told.iter().map(|&i| inexact[i] * width).collect();
                    let part: Vec<f64> = told.iter().map(|&i| part[i]).collect();
                    let mut own = vec![-(self.scale[j] * width.sqrt()).ln(); nats.len()];
                    if !told.is_empty() {
                        let (_, density) = heavy_tailed(&part, &inexact, least * width);
                        told.iter().zip(density).for_each(|(&i, density)| own[i] = density);
                    }
                    // So many of the rows of a band are independent.
                    nats.iter_mut().zip(own).for_each(|(nats, own)| *nats += own * width);
                }
                nats
            };
            let block = |row: &usize| band.rows[*row].block;
            let rest = joint.residual(&fit.columns, &fit.theta);
            evidence.noise[j] = heavy_tailed(&rest, &inexact, least).0;
            for (row, nats) in joint.rows.iter().zip(nats(rest)) {
                evidence.seen[block(row)] += nats;
            }
            let rests: Vec<Vec<f64>> = folds.iter().map(|fit| joint.residual(&fit.columns, &fit.theta)).collect();
            let rest: Vec<f64> = joint.rows.iter().enumerate().map(|(i, &r)| rests[band.rows[r].fold][i]).collect();
            for (row, nats) in joint.rows.iter().zip(nats(rest)) {
                evidence.held_out[block(row)] += nats;
            }
        }
        let score = self.score_of(&fit.columns, evidence.noise.clone());
        // The coefficients are those of the fit, which knows more bounds than each its own.
        let far: f64 = fit.columns.iter().zip(&fit.theta).map(|(&c, t)| (t / score.spread[c]).powi(2)).sum();
        evidence.occam = score.solve(&fit.columns).map_or(f64::NEG_INFINITY, |solved| solved.occam - 0.5 * far);
        evidence.far = self.far(fit);
        evidence
    }

    /// Nats that a fit costs by how far bodies lie from the URDF, less than nothing: all of which a card says how far it may be.
    pub fn far(&self, fit: &Fit) -> f64 {
        -0.5 * fit.columns.iter().zip(&fit.theta).map(|(&c, t)| self.prior[c] * t * t).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two accounts: by how many nats the first is likelier in each of twenty blocks, seen and held out.
    fn odds(seen: [f64; 20], held_out: [f64; 20]) -> f64 {
        let account = |seen: &[f64], held_out: &[f64]| Evidence {
            seen: seen.to_vec(),
            held_out: held_out.to_vec(),
            occam: 0.0,
            far: 0.0,
            noise: Vec::new(),
        };
        let (first, second) = (account(&seen, &held_out), account(&[0.0; 20], &[0.0; 20]));
        let (ahead, behind) = (first.against(&second), second.against(&first));
        assert!((ahead + behind).abs() < 1e-12, "what speaks for one speaks against the other: {ahead} {behind}");
        ahead
    }

    #[test]
    fn what_one_fit_gains_counts_as_far_as_it_is_gained_held_out_and_blocks_agree() {
        let all = [2.0; 20];
        assert!((odds(all, [1.0; 20]) - 20.0).abs() < 1e-12, "the lesser counts");
        assert_eq!(odds(all, [-1.0; 20]), 0.0, "a gain that is lost held out is none");
        // The same sum from blocks that vote against each other is a bare majority.
        let split: [f64; 20] = std::array::from_fn(|i| if i % 2 == 0 { 24.0 } else { -20.0 });
        let bare = odds(split, split);
        assert!(bare > 0.0 && bare < 2.0, "{bare}");
        // One block alone may tell, where no other speaks against it.
        let one: [f64; 20] = std::array::from_fn(|i| if i == 3 { 40.0 } else { 0.0 });
        assert!((odds(one, one) - 40.0).abs() < 1e-12);
    }

    #[test]
    fn of_two_accounts_that_predict_the_same_the_one_is_likelier_whose_bodies_are_nearer_to_the_urdf() {
        let account = |occam: f64, far: f64| Evidence {
            seen: vec![0.0; 20],
            held_out: vec![0.0; 20],
            occam,
            far,
            noise: Vec::new(),
        };
        // A last link twice as heavy, and a payload that costs ten coefficients and leaves the link as it is.
        let (link, payload) = (account(-150.0, -120.0), account(-60.0, -5.0));
        assert!((payload.against(&link) - 90.0).abs() < 1e-12, "the lesser of what is seen and what is known");
        // A link that is off by a little costs less than the coefficients of a payload.
        let (link, payload) = (account(-32.0, -2.0), account(-60.0, 0.0));
        assert!(payload.against(&link) <= 0.0);
    }

    #[test]
    fn a_rest_counts_by_what_it_bears_beyond_friction_and_noise() {
        let at = |borne: f64| {
            let signals = crate::fit::support::fitted(gapscope_effects::Kind::CoulombFriction, |_| {}).0;
            let band = Band::new(&signals);
            let blocks = vec![0.0; band.blocks];
            let mut evidence =
                Evidence { seen: blocks.clone(), held_out: blocks, occam: 0.0, far: 0.0, noise: Vec::new() };
            evidence.at_rest(&[vec![Some(borne); band.rows.len()]], &[1.0], &[1.0], &band);
            evidence.seen.iter().sum::<f64>()
        };
        assert_eq!(at(0.9 * OUTLIER.get()), 0.0);
        assert!(at(2.0 * OUTLIER.get()) < 0.0 && at(4.0 * OUTLIER.get()) < at(2.0 * OUTLIER.get()));
    }

    #[test]
    fn of_rows_that_do_not_feel_the_effort_an_account_knows_no_more_than_its_size() {
        let (_, band, problem, fit) = crate::fit::support::fitted(gapscope_effects::Kind::CoulombFriction, |_| {});
        let sum = |open: &dyn Fn(usize) -> bool| {
            let open: Vec<bool> = (0..band.rows.len()).map(open).collect();
            let unpredicted = [open, vec![false; band.rows.len()]];
            problem.evidence(&fit, None, Some(&unpredicted), &band).seen.iter().sum::<f64>()
        };
        let (none, some, all) = (sum(&|_| false), sum(&|row| row % 4 == 0), sum(&|_| true));
        let plain: f64 = problem.evidence(&fit, None, None, &band).seen.iter().sum();
        assert!((none - plain).abs() < 1e-9 * plain.abs());
        // The logs hold hardly any noise: every row that an account does not predict costs it nats.
        let rows = problem.joints[0].rows.len() as f64;
        assert!(some < none - 0.5 * rows && all < some - rows, "{none} {some} {all} of {rows} rows");
    }
}
