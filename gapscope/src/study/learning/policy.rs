//! Data from the controller in use against data from elsewhere.

use super::arm::{BOTH, Budget, DT, controlled_steps, medians, model, random_steps, trained_errors, truth};
use super::{Cell, Findings, Picture, measured};
use crate::report::axis::Axis;
use crate::train::velocity_rms;
use anyhow::Result;
use gapscope_effects::Plant;
use rayon::prelude::*;

pub const NAME: &str = "policy";
const SAMPLES: [usize; 4] = [400, 1200, 4000, 12_000];
const TEST: usize = 4000;
const DATA: [&str; 2] = ["on-policy", "off-policy"];

pub fn run(budget: &Budget) -> Result<Findings> {
    let model = model()?;
    let robot = || truth(&model, 1.0);
    let tests =
        [controlled_steps(&model, &mut robot()?, TEST, 900)?, random_steps(&model, &mut robot()?, TEST, None, 77)];
    let tests = [&tests[0], &tests[1]];
    let mut jobs = Vec::new();
    for (opponent, name) in BOTH {
        for data in 0..2 {
            jobs.extend(SAMPLES.map(|samples| (opponent, name, data, samples)));
        }
    }
    budget.bar.set_length(jobs.len() as u64 * budget.repeats);
    let errors: Vec<Vec<f64>> = jobs
        .par_iter()
        .map(|&(opponent, _, data, samples)| {
            let mut repeats = Vec::new();
            for seed in 0..budget.repeats {
                let mut robot = robot()?;
                let train = if data == 0 {
                    controlled_steps(&model, &mut robot, samples, 100 + seed)?
                } else {
                    random_steps(&model, &mut robot, samples, None, 100 + seed)
                };
                repeats.push(trained_errors(opponent, || Plant::nominal(&model, DT), &train, &tests, budget, seed)?);
            }
            Ok(medians(&repeats))
        })
        .collect::<Result<_>>()?;
    let physics = tests.map(|test| velocity_rms(test, &mut Plant::nominal(&model, DT)));
    let mut rows: Vec<Vec<Cell>> = jobs
        .iter()
        .zip(&errors)
        .map(|((_, name, data, samples), error)| {
            let mut row =
                vec![Cell::Text((*name).into()), Cell::Text(DATA[*data].into()), Cell::Text(samples.to_string())];
            row.extend(error.iter().map(|e| Cell::Figure(*e)));
            row
        })
        .collect();
    let mut alone = vec![Cell::Text("physics alone".into()), Cell::Text("–".into()), Cell::Text("–".into())];
    alone.extend(physics.map(Cell::Figure));
    rows.push(alone);
    let count = SAMPLES.len();
    let mut series = Vec::new();
    for (l, (_, name)) in BOTH.iter().enumerate() {
        for (d, data) in DATA.iter().enumerate() {
            let own = &errors[(2 * l + d) * count..(2 * l + d + 1) * count];
            series.push(measured(
                format!("{name}, {data} data"),
                SAMPLES.iter().zip(own).map(|(n, e)| [*n as f64, e[0]]).collect(),
            ));
        }
    }
    let at = |l: usize, d: usize, test: usize| errors[(2 * l + d) * count + count - 1][test];
    let findings = (0..2)
        .map(|l| {
            format!(
                "{}, N = {}: on the controller's own states, off-policy data give {:.1} times the error of on-policy data; on the states of the box, \
                 on-policy data give {:.1} times that of off-policy data.",
                BOTH[l].1, SAMPLES[count - 1], at(l, 1, 0) / at(l, 0, 0), at(l, 0, 1) / at(l, 1, 1),
            )
        })
        .chain([format!("Physics alone: {:.2e} rad/s on-policy, {:.2e} off-policy.", physics[0], physics[1])])
        .collect();
    let x = Axis::places(&SAMPLES.map(|n| n as f64), "samples N");
    let y = Axis::powers(series.iter().flat_map(|s| &s.points).map(|p| p[1]), "error on-policy, rad/s rms");
    Ok(Findings {
        name: NAME,
        title: "On-policy against off-policy data",
        method: format!(
            "The arm and mismatch (size 1) of the study of [samples](samples.md). On-policy: the states that a computed-torque controller visits while it \
             tracks random Fourier motions, a new one every 4 s: N = 400 is one motion. Off-policy: states drawn evenly from the box of that study. Tested on {TEST} steps of each kind, \
             other motions and other draws. {} steps of training, median of {}. The picture shows the error on-policy.",
            budget.steps, budget.repeats
        ),
        head: ["learner", "trained on", "N", "error on-policy", "error off-policy"].map(Into::into).into(),
        rows,
        findings,
        picture: Picture { x, y, series },
    })
}
