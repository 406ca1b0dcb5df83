//! The closed-loop gap: plan in the model, deploy on a robot with an effect that the model lacks.
//!
//! The robot is a plant with a hidden effect, stepped ten times as finely as the models. Its logs are made and diagnosed
//! as any robot's; learners see the same logs. Each model then serves three controllers on the same reaching motion. The
//! cost that the loop runs up on the model itself is the one promised, the one on the robot is paid.

mod models;
mod page;

use crate::cli::ClosedLoop;
use crate::output;
use crate::report::terminal::{fill, pad};
use crate::report::{figure, percent};
use anyhow::{Context, Result, bail, ensure};
use gapscope_dynamics::{Data, Model, robots};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, ParallelSpring, Payload, Plant, TorqueGainError, ViscousFriction,
};
use gapscope_rollout::control::{ComputedTorque, Controller, Ilqr, Mppi, MppiSettings, Task, run as drive};
use indicatif::{ProgressBar, ProgressStyle};
use models::{Contender, contenders};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Control period and the models' step, s, and the robot's own step.
pub const DT: f64 = 0.01;
const ROBOT_DT: f64 = 0.001;
/// The motion: from and to, rad; time to get there and to stay, s.
const FROM: [f64; 7] = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.6];
const TO: [f64; 7] = [1.0, 0.3, -0.5, -1.4, 0.6, 2.2, -0.4];
const SPAN: [f64; 2] = [0.8, 0.2];
/// Computed torque: natural frequency, rad/s, and damping ratio of the tracking error.
const SERVO: [f64; 2] = [10.0, 1.0];
/// Steps that the sampling planner looks ahead, and the spread of its samples as an acceleration of each joint, rad/s².
const AHEAD: usize = 20;
const SPREAD: f64 = 6.0;

/// Controllers in the order of the table.
const CONTROLLERS: [&str; 3] = ["computed torque", "iLQR", "MPPI"];

/// Cost promised and paid by one controller on one model.
pub struct Figure {
    /// Hidden effect.
    pub effect: &'static str,
    /// Controller.
    pub controller: &'static str,
    /// Model.
    pub model: &'static str,
    /// Cost of the loop on the model, no unit.
    pub promised: f64,
    /// Cost of the loop on the robot.
    pub paid: f64,
    /// Root mean square of the robot's position error, rad.
    pub error: f64,
}

/// Runs the study; returns what to print.
///
/// # Errors
/// Results that exist or cannot be written.
pub fn run(args: &ClosedLoop) -> Result<String> {
    ensure!(args.samples > 0, "--samples is 0, expected at least one");
    let out = match &args.out {
        Some(out) => out.clone(),
        None => output::new_folder(Path::new(""), "gapscope-closed-loop")?,
    };
    let [table, picture] = ["closed-loop.md", "closed-loop.svg"].map(|name| out.join(name));
    if let (Some(there), false) = ([&table, &picture].into_iter().find(|f| f.exists()), args.force) {
        bail!(
            "{} exists already; choose another folder with --out, or allow it to be replaced with --force",
            there.display()
        );
    }
    let robot = robots::model("arm7").context("the 7-joint arm is built in")??.model;
    let hidden = hidden(&robot);
    let bar = ProgressBar::new(hidden.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len}  {msg}") {
        bar.set_style(style);
    }
    let mut figures = Vec::new();
    for (name, effects) in &hidden {
        bar.set_message(format!("{name}: logs, diagnosis"));
        let mut found = Vec::new();
        for contender in contenders(&robot, effects)? {
            bar.set_message(format!("{name}: {}", contender.name));
            found.extend(study(&robot, name, effects, &contender, args.samples)?);
        }
        // Models one under the other for each controller.
        found.sort_by_key(|f| CONTROLLERS.iter().position(|own| *own == f.controller));
        figures.extend(found);
        bar.inc(1);
    }
    bar.finish_and_clear();
    output::write(&table, &markdown(&figures))?;
    output::write(&picture, &page::svg(&figures))?;
    Ok(format!("{}\nTable and picture  {}  {}", terminal(&figures), table.display(), picture.display()))
}

/// The hidden effects, one case each.
fn hidden(robot: &Model) -> Vec<(&'static str, Vec<Effect>)> {
    // Joints near the base carry more and rub more.
    let each = |value: f64| -> BTreeMap<String, f64> {
        let size = [1.0, 1.0, 0.8, 0.8, 0.4, 0.4, 0.3];
        robot.joints().iter().zip(size).map(|(joint, size)| (joint.name.clone(), value * size)).collect()
    };
    let one =
        |joint: usize, value: f64| -> BTreeMap<String, f64> { [(robot.joints()[joint].name.clone(), value)].into() };
    vec![
        ("Coulomb friction", vec![Effect::CoulombFriction(CoulombFriction { coulomb: each(2.5) })]),
        (
            "payload",
            vec![Effect::Payload(Payload {
                joint: robot.joints().last().map(|j| j.name.clone()).unwrap_or_default(),
                mass: 2.0,
                com: [0.02, 0.0, 0.15],
                inertia: [0.004, 0.0, 0.004, 0.0, 0.0, 0.003],
            })],
        ),
        (
            "viscous friction and rotors",
            vec![
                Effect::ViscousFriction(ViscousFriction { viscous: each(4.0) }),
                Effect::Armature(Armature { armature: each(0.3) }),
            ],
        ),
        (
            "spring and torque gain",
            vec![
                Effect::ParallelSpring(ParallelSpring { stiffness: one(1, 25.0), rest_position: one(1, -0.3) }),
                Effect::TorqueGainError(TorqueGainError { gain: one(3, 0.85) }),
            ],
        ),
    ]
}

/// Three controllers on one model.
fn study(
    robot: &Model,
    effect: &'static str,
    effects: &[Effect],
    contender: &Contender,
    samples: usize,
) -> Result<Vec<Figure>> {
    let task = Task::reach(robot, &FROM, &TO, SPAN, DT);
    let model = || (contender.make)();
    let computed = || ComputedTorque::new(model(), robot, &task, SERVO);
    let mut figures = Vec::new();
    let mut judge = |name: &'static str, make: &mut dyn FnMut() -> Box<dyn Controller>| -> Result<()> {
        let promised = drive(&mut *make(), &mut model(), &task);
        let paid = drive(&mut *make(), &mut Plant::new(robot, effects, ROBOT_DT)?, &task);
        let figure = Figure {
            effect,
            controller: name,
            model: contender.name,
            promised: promised.cost,
            paid: paid.cost,
            error: paid.position_error,
        };
        figures.push(figure);
        Ok(())
    };
    let [computed_torque, ilqr, mppi] = CONTROLLERS;
    judge(computed_torque, &mut || Box::new(computed()))?;
    let plan = Ilqr::new(model(), &task).plan(&mut ComputedTorque::new(model(), robot, &task, SERVO));
    judge(ilqr, &mut || Box::new(plan.clone()))?;
    let mut mass = DMatrix::zeros(robot.dof(), robot.dof());
    robot.mass_matrix(&mut Data::new(robot), &FROM, &mut mass);
    let settings = MppiSettings {
        samples,
        horizon: AHEAD,
        deviation: mass.diagonal().iter().map(|inertia| SPREAD * inertia).collect(),
        correlation: 0.8,
        temperature: 0.05,
        seed: 1,
    };
    judge(mppi, &mut || Box::new(Mppi::new(model, &task, settings.clone())))?;
    Ok(figures)
}

/// Cost paid beyond what the best model pays, as a part of what the nominal model pays beyond it: what is left.
fn removed(figures: &[Figure], of: &Figure) -> Option<f64> {
    let of_model = |model: &str| {
        figures.iter().find(|f| f.effect == of.effect && f.controller == of.controller && f.model == model)
    };
    let (nominal, best) = (of_model("nominal")?, of_model("true effects")?);
    let gap = nominal.paid - best.paid;
    (gap > 0.0).then(|| (nominal.paid - of.paid) / gap)
}

/// One row a model, controllers side by side.
fn rows(figures: &[Figure]) -> Vec<[String; 7]> {
    figures
        .iter()
        .map(|f| {
            let shrink = match removed(figures, f) {
                Some(part) if part < 0.0 => "worse".into(),
                part => part.map_or("–".into(), percent),
            };
            let error = figure(1e3 * f.error);
            [f.effect.into(), f.controller.into(), f.model.into(), figure(f.promised), figure(f.paid), error, shrink]
        })
        .collect()
}

const HEAD: [&str; 7] = ["hidden effect", "controller", "model", "promised", "paid", "error, mrad", "gap removed"];

fn terminal(figures: &[Figure]) -> String {
    let width = [28, 17, 14];
    let mut text = String::new();
    for row in std::iter::once(HEAD.map(String::from)).chain(rows(figures)) {
        for (cell, width) in row.iter().zip(width) {
            text.push_str(&pad(cell, width));
        }
        for cell in &row[3..] {
            text.push_str(&fill(cell, 13));
        }
        text.push('\n');
    }
    text
}

fn markdown(figures: &[Figure]) -> String {
    let mut text = String::from(
        "# The closed-loop gap\n\nWhat `gapscope study closed-loop` prints. The built-in 7-joint arm reaches from one posture to \
         another in 0.8 s and stands for 0.2 s; the cost adds squared errors of position (100/rad²) and velocity (1/(rad/s)²) and the \
         effort off the nominal feedforward (10⁻⁴/(N m)²), over time. *Promised* is the cost of the loop on the model that the \
         controller trusts, *paid* on the robot with the hidden effect. *Gap removed* is 100 % where a model pays as little as the \
         true effects do, 0 % where it pays what the nominal model does, *worse* where it pays more; *error* is the robot's position error, rms.\n\n![Promised and paid](closed-loop.svg)\n\n",
    );
    let _ = writeln!(text, "| {} |\n|---|---|---|--:|--:|--:|--:|", HEAD.join(" | "));
    for row in rows(figures) {
        let _ = writeln!(text, "| {} |", row.join(" | "));
    }
    text
}
