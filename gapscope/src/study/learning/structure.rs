//! Physics of the wrong structure: a joint is missing.

use super::arm::{BOTH, Budget, DT, medians, model, random_steps, trained_errors, truth};
use super::{Cell, Findings, Picture, measured};
use crate::report::axis::Axis;
use crate::train::velocity_rms;
use anyhow::Result;
use gapscope_dynamics::{Discrete, Integrator, Model, StepModel, robots};
use gapscope_effects::Plant;
use gapscope_residual::StepFn;
use rayon::prelude::*;

pub const NAME: &str = "structure";
const SAMPLES: [usize; 6] = [100, 300, 1000, 3000, 10_000, 30_000];
const TEST: usize = 2000;
/// Joints that the wrong models lack.
const MISSING: [usize; 2] = [3, 1];

/// A simulator given by a closure.
type Simulator = StepFn<Box<dyn FnMut(&mut [f64], &[f64])>>;

/// The arm as someone would have it who took joint `missing` for a weld: the others move as a 6-joint arm, this one
/// coasts.
fn without(missing: usize) -> Result<impl Fn() -> Simulator + Sync> {
    let name = format!("joint{}", missing + 1);
    let rest: Model = Model::from_urdf_locking(robots::arm7(), &[name.as_str()])?.model;
    Ok(move || {
        let mut steps = Discrete::new(rest.clone(), DT, Integrator::SemiImplicitEuler);
        let n = rest.dof() + 1;
        let (mut x6, mut tau6) = (vec![0.0; 2 * (n - 1)], vec![0.0; n - 1]);
        let others: Vec<usize> = (0..n).filter(|j| *j != missing).collect();
        let step = move |x: &mut [f64], tau: &[f64]| {
            for (i, &j) in others.iter().enumerate() {
                (x6[i], x6[n - 1 + i], tau6[i]) = (x[j], x[n + j], tau[j]);
            }
            steps.step(&mut x6, &tau6);
            for (i, &j) in others.iter().enumerate() {
                (x[j], x[n + j]) = (x6[i], x6[n - 1 + i]);
            }
            x[missing] += DT * x[n + missing];
        };
        StepFn::new(n, DT, Box::new(step) as Box<dyn FnMut(&mut [f64], &[f64])>)
    })
}

pub fn run(budget: &Budget) -> Result<Findings> {
    let model = model()?;
    let test = random_steps(&model, &mut truth(&model, 0.3)?, TEST, None, 77);
    let wrong = MISSING.map(without).into_iter().collect::<Result<Vec<_>>>()?;
    // Learner 0: pure; 1: residual on the right structure; 2, 3: on wrong ones.
    let learners = 2 + MISSING.len();
    let jobs: Vec<(usize, usize)> = (0..learners).flat_map(|l| SAMPLES.map(|n| (l, n))).collect();
    budget.bar.set_length(jobs.len() as u64 * budget.repeats);
    let errors: Vec<f64> = jobs
        .par_iter()
        .map(|&(learner, samples)| -> Result<f64> {
            let mut repeats = Vec::new();
            for seed in 0..budget.repeats {
                let train = random_steps(&model, &mut truth(&model, 0.3)?, samples, None, 100 + seed);
                let right = || Plant::nominal(&model, DT);
                repeats.push(match learner {
                    0 => trained_errors(BOTH[1].0, right, &train, &[&test], budget, seed),
                    1 => trained_errors(BOTH[0].0, right, &train, &[&test], budget, seed),
                    wrong_one => trained_errors(BOTH[0].0, &wrong[wrong_one - 2], &train, &[&test], budget, seed),
                }?);
            }
            Ok(medians(&repeats)[0])
        })
        .collect::<Result<_>>()?;
    let mut names = vec!["pure".to_owned(), "residual, right structure".to_owned()];
    names.extend(MISSING.map(|j| format!("residual, joint {} missing", j + 1)));
    let mut physics = vec![f64::NAN, velocity_rms(&test, &mut Plant::nominal(&model, DT))];
    physics.extend(wrong.iter().map(|wrong| velocity_rms(&test, &mut wrong())));
    let own = |l: usize| &errors[l * SAMPLES.len()..(l + 1) * SAMPLES.len()];
    let (mut rows, mut series, mut findings) = (Vec::new(), Vec::new(), Vec::new());
    for (l, name) in names.iter().enumerate() {
        let alone = if physics[l].is_finite() { Cell::Figure(physics[l]) } else { Cell::Text("–".into()) };
        let mut row = vec![Cell::Text(name.clone()), alone];
        row.extend(own(l).iter().map(|e| Cell::Figure(*e)));
        rows.push(row);
        series.push(measured(name.clone(), SAMPLES.iter().zip(own(l)).map(|(n, e)| [*n as f64, *e]).collect()));
        if l > 0 {
            let overtaken = (0..SAMPLES.len()).find(|&k| own(0)[k] < own(l)[k]);
            findings.push(match overtaken {
                Some(k) => format!(
                    "{name}: the pure network overtakes it at N = {} ({:.2e} against {:.2e} rad/s).",
                    SAMPLES[k], own(0)[k], own(l)[k]
                ),
                None => format!(
                    "{name}: the pure network does not overtake it up to N = {}, where it has {:.2e} against {:.2e} rad/s.",
                    SAMPLES[SAMPLES.len() - 1], own(0)[SAMPLES.len() - 1], own(l)[SAMPLES.len() - 1]
                ),
            });
        }
    }
    let x = Axis::places(&SAMPLES.map(|n| n as f64), "samples N");
    let y = Axis::powers(errors.iter().copied(), "one-step velocity error, rad/s rms");
    let mut head: Vec<String> = vec!["learner".into(), "physics alone".into()];
    head.extend(SAMPLES.map(|n| format!("N = {n}")));
    Ok(Findings {
        name: NAME,
        title: "Physics of the wrong structure",
        method: format!(
            "The arm of the study of [samples](samples.md) with mismatch 0.3, and models of it that take one joint for a weld: the other six move as a \
             6-joint arm under semi-implicit Euler, the missing one coasts. The pure network has no structure to get wrong. {} steps of training, median of {}; \
             error on {TEST} states of the training region.",
            budget.steps, budget.repeats
        ),
        head,
        rows,
        findings,
        picture: Picture { x, y, series },
    })
}
