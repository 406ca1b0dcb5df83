//! Inside and outside the region of the training data.

use super::arm::{BOTH, Budget, DT, medians, model, random_steps, trained_errors, truth};
use super::{Cell, Findings, Picture, measured};
use crate::picture::Series;
use crate::report::axis::{Axis, extent};
use crate::train::velocity_rms;
use anyhow::Result;
use gapscope_dynamics::Transitions;
use gapscope_effects::Plant;
use rayon::prelude::*;

pub const NAME: &str = "region";
const SCALES: [f64; 6] = [0.5, 0.75, 1.0, 1.25, 1.5, 2.0];
const SAMPLES: usize = 5000;
const TEST: usize = 1000;

pub fn run(budget: &Budget) -> Result<Findings> {
    let model = model()?;
    let mut robot = truth(&model, 1.0)?;
    let tests: Vec<Transitions> =
        SCALES.iter().map(|&scale| random_steps(&model, &mut robot, TEST, Some(scale), 77)).collect();
    let tests: Vec<&Transitions> = tests.iter().collect();
    let jobs: Vec<_> = BOTH.iter().flat_map(|&(o, _)| (0..budget.repeats).map(move |seed| (o, seed))).collect();
    budget.bar.set_length(jobs.len() as u64);
    let errors: Vec<Vec<f64>> = jobs
        .par_iter()
        .map(|&(opponent, seed)| {
            let train = random_steps(&model, &mut truth(&model, 1.0)?, SAMPLES, None, 100 + seed);
            trained_errors(opponent, || Plant::nominal(&model, DT), &train, &tests, budget, seed)
        })
        .collect::<Result<_>>()?;
    let repeats = budget.repeats as usize;
    let (residual, pure) = (medians(&errors[..repeats]), medians(&errors[repeats..]));
    let physics: Vec<f64> = tests.iter().map(|test| velocity_rms(test, &mut Plant::nominal(&model, DT))).collect();
    let rows = (0..SCALES.len())
        .map(|k| {
            let mut row = vec![Cell::Text(SCALES[k].to_string())];
            row.extend([physics[k], residual[k], pure[k]].map(Cell::Figure));
            row
        })
        .collect();
    let line = |name: &str, values: &[f64]| measured(name, SCALES.iter().zip(values).map(|(s, e)| [*s, *e]).collect());
    let mut series = vec![line("residual", &residual), line("pure", &pure), line("physics alone", &physics)];
    let (least, most) = extent(series.iter().flat_map(|s| &s.points).map(|p| p[1]));
    let edge = vec![[1.0, least], [1.0, most]];
    let name = "edge of the training region".into();
    series.push(Series { name, points: edge, dashed: true, ..Series::default() });
    let (inside, outside) = (2, SCALES.len() - 1);
    let findings = vec![
        format!(
            "From the edge of the region to twice its size, the residual's error grows {:.1} times, the pure network's {:.1} times, that of physics alone {:.1} times.",
            residual[outside] / residual[inside],
            pure[outside] / pure[inside],
            physics[outside] / physics[inside],
        ),
        format!(
            "At twice the size the residual model {} physics alone ({:.2e} against {:.2e} rad/s); the pure network has {:.2e}.",
            if residual[outside] < physics[outside] { "is still better than" } else { "is worse than" },
            residual[outside],
            physics[outside],
            pure[outside],
        ),
    ];
    let x = Axis::tight(SCALES, "distance of the test states, in sizes of the training region", 6);
    let y = Axis::powers(series.iter().flat_map(|s| &s.points).map(|p| p[1]), "one-step velocity error, rad/s rms");
    Ok(Findings {
        name: NAME,
        title: "Inside and outside the training region",
        method: format!(
            "The arm, mismatch (size 1) and networks of the study of [samples](samples.md), trained on {SAMPLES} steps from the box; tested on \
             {TEST} states each on the surface of boxes of other sizes, so that 1 is the edge of what was seen. {} steps of training, median of {}.",
            budget.steps, budget.repeats
        ),
        head: ["size of the box", "physics alone", "residual", "pure"].map(Into::into).into(),
        rows,
        findings,
        picture: Picture { x, y, series },
    })
}
