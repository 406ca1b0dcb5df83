//! Whether an effect is the same in every regime. A law holds slow and fast, here and there, early and late; what stands in
//! for a law that the catalogue does not have holds only on average, and falls apart when it is fitted to the slowest
//! and the fastest third of the rows, the first and the last, either end of the range, or to what changes slowly and what
//! changes fast. The last tells what the robot does from what is done to it: a joint that something outside shakes
//! accelerates in step with the shaking, and looks heavier or lighter at that frequency alone.

use crate::band::Band;
use crate::estimate::Fit;
use crate::kernel::Kernel;
use crate::problem::Problem;
use crate::signals::Signals;
use gapscope_effects::{Candidate, Kind};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Two thirds disagree where their torques differ by this part of the greater.
const APART: f64 = 0.35;
/// Frequencies that part slow from fast, Hz. Below what shakes a joint lies its motion alone, a small part of its acceleration:
/// the parting must be sharp, and reach down to that.
const PARTINGS: [f64; 3] = [1.6, 0.8, 0.4];
/// Slow and fast fits disagree where they lie so many standard errors apart, too: each holds little of some laws, ...
const BEYOND_NOISE: f64 = 3.0;
/// ... where so many blocks tell what a standard error is, ...
const BLOCKS: usize = 10;
/// ... and where the fast one holds this part of a law's torque: what is left of dry friction is what smoothing makes of it.
const SHOWS: f64 = 0.1;
/// Kinds that no third can be asked about: they act at times of their own.
const OF_THE_MOMENT: [Kind; 3] = [Kind::ExternalContact, Kind::ThermalDrift, Kind::TorqueSaturation];

/// The entries of a fit that fall apart, worst first, each with the part of its torque by which its parts differ. Entries in
/// doubt are asked about every regime; the others about slow and fast alone, where noise has been allowed for.
pub fn inconsistent(
    problem: &Problem,
    fit: &Fit,
    signals: &[Signals],
    band: &Band,
    doubt: impl Fn(&Candidate) -> bool,
) -> Vec<(usize, f64)> {
    let doubtful = |&c: &usize| doubt(&problem.entries[c].candidate);
    let splits = if fit.set.iter().any(doubtful) { splits(problem, fit, signals, band) } else { Vec::new() };
    let thirds: Vec<(Option<usize>, [Fit; 2])> = splits
        .into_par_iter()
        .map(|(joint, third)| {
            let part = |part: usize| Fit::on_all(&problem.masked(band, |row| third[row] == part), &fit.set);
            (joint, [part(0), part(2)])
        })
        .collect();
    let spacing = band.rows.windows(2).find(|rows| rows[0].episode == rows[1].episode).map_or(0.0, |rows| {
        let s = &signals[rows[0].episode];
        (rows[1].center - rows[0].center) as f64 * s.dt
    });
    let parts: Vec<[(Problem, Fit); 2]> = PARTINGS
        .into_par_iter()
        .filter(|_| spacing > 0.0)
        .map(|parting| {
            problem.slow_and_fast(band, &Kernel::low_pass(parting, spacing)).map(|part| {
                let fit = Fit::on_all(&part, &fit.set);
                (part, fit)
            })
        })
        .collect();
    let always_there = |candidate: &Candidate| !OF_THE_MOMENT.contains(&candidate.kind) && !candidate.kind.is_outside();
    let mut found: Vec<(usize, f64)> = fit
        .set
        .iter()
        .filter(|&&c| always_there(&problem.entries[c].candidate))
        .filter_map(|&c| {
            let candidate = &problem.entries[c].candidate;
            let whole = size(problem, fit, c);
            // It stood in for what has been taken out.
            if whole <= 0.0 {
                return Some((c, 1.0));
            }
            let asked = |joint: &Option<usize>| joint.is_none_or(|j| candidate.joints.contains(&j));
            let apart = thirds
                .iter()
                .filter(|(joint, _)| doubt(candidate) && asked(joint))
                .map(|(_, thirds)| apart(problem, c, [&thirds[0], &thirds[1]]))
                .fold(0.0, f64::max);
            let apart = parts
                .iter()
                .filter(|parts| size(&parts[1].0, fit, c) > SHOWS * whole && beyond_noise(c, parts))
                .map(|[(_, slow), (_, fast)]| self::apart(problem, c, [slow, fast]))
                .fold(apart, f64::max);
            (apart > APART).then_some((c, apart))
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    found
}

/// Thirds of the rows, 0 to 2: by the size of the speed and by the place of each joint that the fit names, and by time.
fn splits(problem: &Problem, fit: &Fit, signals: &[Signals], band: &Band) -> Vec<(Option<usize>, Vec<usize>)> {
    let candidates: Vec<&Candidate> = fit.set.iter().map(|&c| &problem.entries[c].candidate).collect();
    let mut joints: Vec<usize> = candidates.iter().flat_map(|c| c.joints.iter().copied()).collect();
    joints.sort_unstable();
    joints.dedup();
    let thirds = |value: &dyn Fn(&Signals, usize) -> f64| -> Vec<usize> {
        let values: Vec<f64> = band.rows.iter().map(|row| value(&signals[row.episode], row.center)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let border = |part: usize| sorted.get(part * sorted.len() / 3).copied().unwrap_or(0.0);
        let borders = [border(1), border(2)];
        values.iter().map(|v| borders.iter().filter(|border| v >= border).count()).collect()
    };
    let mut splits = vec![(None, thirds(&|s, k| k as f64 / s.len().max(1) as f64))];
    if candidates.iter().any(|c| c.joints.is_empty()) {
        splits.push((None, thirds(&|s, k| s.v.iter().map(|v| v[k] * v[k]).sum())));
    }
    for j in joints {
        splits.push((Some(j), thirds(&|s, k| s.v[j][k].abs())));
        splits.push((Some(j), thirds(&|s, k| s.q[j][k])));
    }
    splits
}

/// Size of an entry's torque by a fit, on the rows of a problem.
fn size(problem: &Problem, fit: &Fit, entry: usize) -> f64 {
    let columns: Vec<usize> = problem.entries[entry].columns.clone().collect();
    let (_, theta) = fit.own(problem, entry);
    problem.contribution(&columns, &theta).iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Part of an entry's torque by which two fits differ.
fn apart(problem: &Problem, entry: usize, fits: [&Fit; 2]) -> f64 {
    let own: Vec<Vec<f64>> = fits.iter().map(|fit| fit.own(problem, entry).1).collect();
    let difference: Vec<f64> = own[0].iter().zip(&own[1]).map(|(a, b)| a - b).collect();
    let columns: Vec<usize> = problem.entries[entry].columns.clone().collect();
    let size = |theta: &[f64]| problem.contribution(&columns, theta).iter().map(|x| x * x).sum::<f64>().sqrt();
    let greater = size(&own[0]).max(size(&own[1]));
    if greater > 0.0 { size(&difference) / greater } else { 0.0 }
}

/// Whether an entry's coefficients on two parts differ by more than their standard errors say.
fn beyond_noise(entry: usize, parts: &[(Problem, Fit); 2]) -> bool {
    if parts.iter().any(|(part, _)| part.blocks_used() < BLOCKS) {
        return false;
    }
    let own = parts.each_ref().map(|(part, fit)| {
        let (at, theta) = fit.own(part, entry);
        let covariance = part.covariance(&fit.columns, &fit.theta);
        (theta, DMatrix::from_fn(at.len(), at.len(), |i, j| covariance[(at[i], at[j])]))
    });
    let [(a, of_a), (b, of_b)] = own;
    let difference = DVector::from_iterator(a.len(), a.iter().zip(&b).map(|(a, b)| a - b));
    let square = (of_a + of_b).cholesky().map_or(0.0, |errors| difference.dot(&errors.solve(&difference)));
    square > BEYOND_NOISE * BEYOND_NOISE * a.len() as f64
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::problem::Term;
    use crate::refine::Data;
    use crate::signals::standstill;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;

    /// A kind fitted to the first joint of a double pendulum, of logs to which something is done.
    pub(crate) fn fitted(kind: Kind, done: impl Fn(&mut Signals)) -> (Vec<Signals>, Band, Problem, Fit) {
        let model = robots::model("double_pendulum").unwrap().unwrap().model;
        let recipe = Recipe { seconds: 12.0, rate: 250.0, ..Recipe::default() };
        let signals: Vec<Signals> = (1..4)
            .map(|seed| {
                let mut s = Signals::new(&model, &generate(&model, &[], seed, &recipe, "log").unwrap()).unwrap();
                done(&mut s);
                s
            })
            .collect();
        let (band, still) = (Band::new(&signals), standstill(&signals, 2));
        let data = Data {
            model: &model,
            signals: &signals,
            band: &band,
            standstill: &still,
            moving: &[true; 2],
            noise: &[1e-3; 2],
            rubbing: false,
        };
        let term = Term { candidate: Candidate::new(kind, vec![0]), tangent_at: None };
        let problem = data.problem(vec![term], &Kind::ALL);
        let fit = Fit::on_all(&problem, &[0]);
        (signals, band, problem, fit)
    }

    /// What falls apart of it, all being in doubt.
    fn fitted_as(kind: Kind, done: impl Fn(&mut Signals)) -> Vec<(usize, f64)> {
        let (signals, band, problem, fit) = fitted(kind, done);
        inconsistent(&problem, &fit, &signals, &band, |_| true)
    }

    /// Torque on the first joint, from its velocity.
    pub(crate) fn torque(law: fn(f64) -> f64) -> impl Fn(&mut Signals) {
        move |s| s.tau[0].iter_mut().zip(&s.v[0]).for_each(|(tau, v)| *tau += law(*v))
    }

    #[test]
    fn a_law_holds_in_every_regime_and_its_substitute_does_not() {
        assert_eq!(fitted_as(Kind::ViscousFriction, torque(|v| 0.5 * v)), []);
        let apart = fitted_as(Kind::ViscousFriction, torque(|v| 0.5 * v * v.abs()));
        assert!(apart.len() == 1 && apart[0].1 > 0.5, "{apart:?}");
    }

    /// Something shakes the first joint: effort and acceleration go together, at any speed, anywhere and at any time, but at
    /// the frequency of the shaking alone, or as well by a part `everything` of all acceleration.
    fn shaken(frequency: f64, everything: f64) -> impl Fn(&mut Signals) {
        move |s| {
            let size = (s.a[0].iter().map(|a| a * a).sum::<f64>() / s.len() as f64).sqrt();
            for k in 0..s.len() {
                let shake = 10.0 * size * (std::f64::consts::TAU * frequency * k as f64 * s.dt).sin();
                s.tau[0][k] += 0.02 * (shake + everything * s.a[0][k]);
                s.a[0][k] += shake;
            }
        }
    }

    #[test]
    fn a_law_holds_in_slow_changes_and_in_fast_ones() {
        for frequency in [1.2, 4.0] {
            assert_eq!(fitted_as(Kind::Armature, shaken(frequency, 1.0)), []);
            let apart = fitted_as(Kind::Armature, shaken(frequency, 0.0));
            assert!(apart.len() == 1 && apart[0].1 > 0.5, "{frequency} Hz: {apart:?}");
        }
        // A constant has nothing that is fast.
        assert_eq!(fitted_as(Kind::TorqueBias, torque(|_| 0.5)), []);
    }

    #[test]
    fn slow_and_fast_are_asked_beyond_doubt_too_where_blocks_tell_the_noise() {
        let (signals, band, problem, fit) = fitted(Kind::Armature, shaken(1.2, 0.0));
        let fallen = |blocks: usize| {
            let part = problem.masked(&band, |row| band.rows[row].block < blocks);
            inconsistent(&part, &fit, &signals, &band, |_| false).len()
        };
        assert_eq!((fallen(band.blocks), fallen(BLOCKS - 1)), (1, 0));
        let (signals, band, problem, fit) = fitted(Kind::ViscousFriction, torque(|v| 0.5 * v * v.abs()));
        assert_eq!(inconsistent(&problem, &fit, &signals, &band, |_| false), []);
    }

    #[test]
    fn a_law_that_fits_to_nothing_has_no_place() {
        assert_eq!(fitted_as(Kind::ViscousFriction, torque(|v| -0.5 * v)), [(0, 1.0)]);
    }
}
