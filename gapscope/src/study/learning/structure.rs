//! Physics of the wrong structure: a joint is missing, or hangs on the wrong link, or points or sits elsewhere.

use super::arm::{BOTH, Budget, DT, medians, model, random_steps, trained_errors, truth};
use super::{Cell, Findings, Picture, measured};
use crate::report::axis::Axis;
use crate::train::velocity_rms;
use anyhow::{Context, Result};
use gapscope_dynamics::{Discrete, Integrator, Model, StepModel, Transitions, robots};
use gapscope_effects::Plant;
use gapscope_residual::StepFn;
use rayon::prelude::*;
use std::fmt::Write;

pub const NAME: &str = "structure";
const SAMPLES: [usize; 6] = [100, 300, 1000, 3000, 10_000, 30_000];
const TEST: usize = 2000;
/// Joints that some of the wrong models lack.
const MISSING: [usize; 2] = [3, 1];
/// The other wrong models: what is wrong, the joint, and the attribute of its URDF as it is and as it is taken to be.
const MISTAKEN: [[&str; 4]; 3] = [
    ["joint 3 10 cm off", "joint3", r#"xyz="0 -0.316 0""#, r#"xyz="0 -0.216 0""#],
    ["axis 4 backwards", "joint4", r#"axis xyz="0 0 1""#, r#"axis xyz="0 0 -1""#],
    ["wrist on link 3", "joint5", r#"parent link="link4""#, r#"parent link="link3""#],
];

/// A simulator given by a closure.
type Simulator = StepFn<Box<dyn FnMut(&mut [f64], &[f64])>>;
/// Makes one.
type Make = Box<dyn Fn() -> Simulator + Sync>;

/// The arm as someone would have it who took joint `missing` for a weld: the others move as a 6-joint arm, this one
/// coasts.
fn without(missing: usize) -> Result<Make> {
    let name = format!("joint{}", missing + 1);
    let rest: Model = Model::from_urdf_locking(robots::arm7(), &[name.as_str()])?.model;
    Ok(Box::new(move || {
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
        StepFn::new(n, DT, Box::new(step))
    }))
}

/// The arm as someone would have it who wrote `taken` for `is` in the description of a joint.
fn mistaken([_, joint, is, taken]: [&str; 4]) -> Result<Make> {
    let urdf = robots::arm7();
    let at = urdf.find(&format!(r#"<joint name="{joint}""#)).context("a joint of the arm")?;
    let wrong = Model::from_urdf(&format!("{}{}", &urdf[..at], urdf[at..].replacen(is, taken, 1)))?.model;
    Ok(Box::new(move || {
        let mut steps = Plant::nominal(&wrong, DT);
        StepFn::new(wrong.dof(), DT, Box::new(move |x: &mut [f64], tau: &[f64]| steps.step(x, tau)))
    }))
}

/// The structures by name, the right one first.
fn structures() -> Result<Vec<(String, Make)>> {
    let right = ["right structure", "joint1", "", ""];
    let mut all = Vec::new();
    for one in [right].into_iter().chain(MISTAKEN) {
        all.push((one[0].to_owned(), mistaken(one)?));
    }
    for joint in MISSING {
        all.push((format!("joint {} missing", joint + 1), without(joint)?));
    }
    Ok(all)
}

/// Velocity error of a model that says: nothing moves the robot, rad/s rms.
fn coasting(test: &Transitions) -> f64 {
    velocity_rms(test, &mut StepFn::new(test.joints, DT, |_: &mut [f64], _: &[f64]| {}))
}

pub fn run(budget: &Budget) -> Result<Findings> {
    let model = model()?;
    let test = random_steps(&model, &mut truth(&model, 0.3)?, TEST, None, 77);
    let structures = structures()?;
    // Learner 0 is pure, the others residual on each of the structures.
    let jobs: Vec<(usize, usize)> = (0..=structures.len()).flat_map(|l| SAMPLES.map(|n| (l, n))).collect();
    budget.bar.set_length(jobs.len() as u64 * budget.repeats);
    let errors: Vec<f64> = jobs
        .par_iter()
        .map(|&(learner, samples)| -> Result<f64> {
            let mut repeats = Vec::new();
            for seed in 0..budget.repeats {
                let train = random_steps(&model, &mut truth(&model, 0.3)?, samples, None, 100 + seed);
                let opponent = BOTH[usize::from(learner == 0)].0;
                let physics = &structures[learner.saturating_sub(1)].1;
                repeats.push(trained_errors(opponent, physics, &train, &[&test], budget, seed)?);
            }
            Ok(medians(&repeats)[0])
        })
        .collect::<Result<_>>()?;
    let mut names = vec!["pure".to_owned()];
    names.extend(structures.iter().map(|(name, _)| format!("residual, {name}")));
    let mut alone = vec![coasting(&test)];
    alone.extend(structures.iter().map(|(_, make)| velocity_rms(&test, &mut make())));
    let own = |l: usize| &errors[l * SAMPLES.len()..(l + 1) * SAMPLES.len()];
    let (mut rows, mut series, mut findings) = (Vec::new(), Vec::new(), Vec::new());
    for (l, name) in names.iter().enumerate() {
        let mut row = vec![Cell::Text(name.clone()), Cell::Figure(alone[l])];
        row.extend(own(l).iter().map(|e| Cell::Figure(*e)));
        rows.push(row);
        series.push(measured(name.clone(), SAMPLES.iter().zip(own(l)).map(|(n, e)| [*n as f64, *e]).collect()));
        if l > 0 {
            findings.push(format!("{name}: {}.", overtaken(own(0), own(l))));
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
            "The arm of the study of [samples](samples.md) with mismatch 0.3, and models of it whose structure is wrong. Three are wrong trees of seven joints: joint 3 \
             sits 10 cm too near the shoulder, the axis of joint 4 points the other way, or the wrist hangs on link 3 instead of link 4. Two take a joint for a weld: the \
             other six move as a 6-joint arm under semi-implicit Euler, the missing one coasts. The pure network has no structure to get wrong; its *physics alone* is a \
             robot that coasts. {} steps of training, median of {}; error on {TEST} states of the training region.",
            budget.steps, budget.repeats
        ),
        head,
        rows,
        findings,
        picture: Picture { x, y, series },
    })
}

/// Which of the two is ahead, from which number of samples on, in words.
fn overtaken(pure: &[f64], residual: &[f64]) -> String {
    let pure_leads = |k: usize| pure[k] < residual[k];
    let mut text = format!("at N = {} the {} ahead", SAMPLES[0], leader(pure_leads(0)));
    for k in (1..SAMPLES.len()).filter(|&k| pure_leads(k) != pure_leads(k - 1)) {
        let _ = write!(text, ", from N = {} on the {}", SAMPLES[k], leader(pure_leads(k)));
    }
    let last = SAMPLES.len() - 1;
    let _ =
        write!(text, "; at N = {} pure has {:.2e}, residual {:.2e} rad/s", SAMPLES[last], pure[last], residual[last]);
    text
}

fn leader(pure: bool) -> &'static str {
    if pure { "pure network is" } else { "residual is" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wrong_structure_is_wrong_and_the_right_one_is_not() {
        let model = model().unwrap();
        let steps = random_steps(&model, &mut Plant::nominal(&model, DT), 20, None, 1);
        let errors: Vec<f64> =
            structures().unwrap().iter().map(|(_, make)| velocity_rms(&steps, &mut make())).collect();
        assert!(errors[0] < 1e-12, "{errors:?}");
        assert!(errors[1..].iter().all(|e| *e > 1e-3), "{errors:?}");
    }

    #[test]
    fn who_is_ahead_and_from_where() {
        let residual = [3.0; SAMPLES.len()];
        let text = overtaken(&[9.0, 9.0, 9.0, 1.0, 1.0, 1.0], &residual);
        assert!(
            text.starts_with("at N = 100 the residual is ahead, from N = 3000 on the pure network is; at"),
            "{text}"
        );
        let text = overtaken(&[1.0; SAMPLES.len()], &residual);
        assert!(text.starts_with("at N = 100 the pure network is ahead; at N = 30000"), "{text}");
    }
}
