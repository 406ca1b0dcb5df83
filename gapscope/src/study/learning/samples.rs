//! Error against number of samples, at several sizes of mismatch.

use super::arm::{BOTH, Budget, DT, INPUTS, Opponent, medians, model, random_steps, trained_errors, truth};
use super::{Cell, Findings, Picture, exponent, measured};
use crate::picture::Series;
use crate::report::axis::Axis;
use crate::train::velocity_rms;
use anyhow::Result;
use gapscope_effects::Plant;
use rayon::prelude::*;

pub const NAME: &str = "samples";
const SAMPLES: [usize; 5] = [100, 300, 1000, 3000, 10_000];
const SIZES: [f64; 3] = [0.1, 0.3, 1.0];
const TEST: usize = 2000;

pub fn run(budget: &Budget) -> Result<Findings> {
    let model = model()?;
    let mut jobs = Vec::new();
    for size in SIZES {
        for (opponent, name) in BOTH {
            for samples in SAMPLES {
                jobs.push((size, opponent, name, samples));
            }
        }
    }
    budget.bar.set_length(jobs.len() as u64 * budget.repeats);
    let errors: Vec<f64> = jobs
        .par_iter()
        .map(|&(size, opponent, _, samples)| -> Result<f64> {
            let mut robot = truth(&model, size)?;
            let test = random_steps(&model, &mut robot, TEST, None, 77);
            let mut repeats = Vec::new();
            for seed in 0..budget.repeats {
                let train = random_steps(&model, &mut robot, samples, None, 100 + seed);
                let physics = || Plant::nominal(&model, DT);
                repeats.push(trained_errors(opponent, physics, &train, &[&test], budget, seed)?);
            }
            Ok(medians(&repeats)[0])
        })
        .collect::<Result<_>>()?;
    let physics: Vec<f64> = SIZES
        .iter()
        .map(|&size| {
            let test = random_steps(&model, &mut truth(&model, size)?, TEST, None, 77);
            Ok(velocity_rms(&test, &mut Plant::nominal(&model, DT)))
        })
        .collect::<Result<_>>()?;

    let mut rows = Vec::new();
    let (mut series, mut findings) = (Vec::new(), Vec::new());
    for (s, size) in SIZES.iter().enumerate() {
        for (o, (opponent, name)) in BOTH.iter().enumerate() {
            let own = &errors[(2 * s + o) * SAMPLES.len()..][..SAMPLES.len()];
            let points: Vec<[f64; 2]> = SAMPLES.iter().zip(own).map(|(n, e)| [*n as f64, *e]).collect();
            let slope = exponent(&points);
            let mut row = vec![Cell::Text(size.to_string()), Cell::Text((*name).into()), Cell::Figure(physics[s])];
            row.extend(own.iter().map(|e| Cell::Figure(*e)));
            row.push(Cell::Text(format!("{slope:.2}")));
            rows.push(row);
            // Of the pure network one line is enough, at the largest mismatch.
            if *opponent == Opponent::Residual || s == SIZES.len() - 1 {
                series.push(measured(format!("{name}, mismatch {size}: N^−{:.2}", -slope), points));
            }
        }
        let at = |o: usize, k: usize| errors[(2 * s + o) * SAMPLES.len() + k];
        let last = SAMPLES.len() - 1;
        findings.push(format!(
            "Mismatch {size}: with {} samples the residual's error is {:.0} % of the pure network's, with {} {:.0} %; physics alone has {:.2e} rad/s.",
            SAMPLES[0], 100.0 * at(0, 0) / at(1, 0), SAMPLES[last], 100.0 * at(0, last) / at(1, last), physics[s],
        ));
    }
    let from = errors[2 * (SIZES.len() - 1) * SAMPLES.len()];
    let law = SAMPLES.iter().map(|&n| [n as f64, from * (SAMPLES[0] as f64 / n as f64).sqrt()]).collect();
    let name = "√(d/N), to compare".into();
    series.push(Series { name, points: law, dashed: true, ..Series::default() });
    findings.push(format!(
        "A bound of the form √(d/N), d = {INPUTS} inputs, would fall as N^−0.5; the exponents measured are in the last column. \
         There is no noise here: what is left is approximation, optimisation and too few rows."
    ));
    let x = Axis::places(&SAMPLES.map(|n| n as f64), "samples N");
    let y = Axis::powers(series.iter().flat_map(|s| &s.points).map(|p| p[1]), "one-step velocity error, rad/s rms");
    let mut head: Vec<String> = ["mismatch", "learner", "physics alone"].map(Into::into).into();
    head.extend(SAMPLES.map(|n| format!("N = {n}")));
    head.push("exponent".into());
    Ok(Findings {
        name: NAME,
        title: "Error against number of samples",
        method: format!(
            "A 7-joint arm whose robot has friction and a payload that its model lacks, in three sizes (1: viscous 2 N m s/rad, \
             Coulomb 1.5 N m, 2 to 10 % of that at the wrist; payload 1.5 kg). N steps of 0.01 s from states drawn evenly from a box (±0.8 rad, ±1 rad/s, accelerations \
             of ±4 rad/s²), a fifth of them held out to choose the epoch; networks 21-128-128-14, tanh, Adam 1e-3 along half a \
             cosine, batch 64, λ = 1e-3 on the residual; {} steps of training whatever N is, residual and pure alike; median of {}. \
             Figures: one-step velocity error on {TEST} other states, rad/s rms over joints.",
            budget.steps, budget.repeats
        ),
        head,
        rows,
        findings,
        picture: Picture { x, y, series },
    })
}
