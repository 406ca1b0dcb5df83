//! The corrected model of a robot in the files of simulators, with a ledger of what these hold.
//!
//! A target has two parts, a file each: `carry` is its table, which says of every effect as what it stands there, and a writer
//! that puts the sums of the effects into a file. What a target holds of an effect is itself a list of effects: our own plant
//! with them predicts what the target's torque gap will be, before the target runs.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod c;
mod carry;
mod isaaclab;
mod ledger;
mod mjcf;
mod number;
mod paste;
mod ranges;
mod totals;
mod urdf;
mod xml;

pub use c::{Fmu, fmu, weights};
pub use carry::{Carried, How, Usual};
pub use ledger::{Entry, LEDGER_SCHEMA, Ledger, TargetLedger};
pub use mjcf::motor_joint;
pub use ranges::{RANGES_SCHEMA, RangeOf, Ranges, SAMPLER};

use carry::Context;
use gapscope_datasets::Episode;
use gapscope_diagnosis::{Corrected, EncoderSide, torque_changes};
use gapscope_dynamics::Loaded;
use gapscope_effects::{Effect, EffectError, Plant};
use totals::Totals;

/// Where the corrected model is written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The user's own URDF, edited.
    Urdf,
    /// MuJoCo's model file.
    Mjcf,
    /// A configuration for Isaac Lab, which reads the URDF beside it.
    IsaacLab,
    /// A C file that steps the robot.
    C,
    /// A class of C++ over that file, which it needs beside it.
    Cpp,
    /// A Simulink S-function over that file, which it needs beside it.
    Simulink,
    /// A co-simulation unit (FMI 2.0) of that file.
    Fmu,
}

impl Target {
    /// All of them.
    pub const ALL: [Target; 7] =
        [Target::Urdf, Target::Mjcf, Target::IsaacLab, Target::C, Target::Cpp, Target::Simulink, Target::Fmu];

    /// Name on the command line and in the ledger.
    pub fn name(self) -> &'static str {
        match self {
            Target::Urdf => "urdf",
            Target::Mjcf => "mjcf",
            Target::IsaacLab => "isaaclab",
            Target::C => "c",
            Target::Cpp => "cpp",
            Target::Simulink => "simulink",
            Target::Fmu => "fmu",
        }
    }

    /// Name of its file.
    pub fn file(self) -> &'static str {
        match self {
            Target::Urdf => "robot.urdf",
            Target::Mjcf => "robot.xml",
            Target::IsaacLab => "isaaclab_robot.py",
            Target::C => "robot.c",
            Target::Cpp => "robot.hpp",
            Target::Simulink => "robot_sfun.c",
            Target::Fmu => "robot.fmu",
        }
    }

    /// Whether the robot there is the C file.
    pub fn is_c(self) -> bool {
        matches!(self, Target::C | Target::Cpp | Target::Simulink | Target::Fmu)
    }

    /// The target that must stand beside it.
    pub fn needs(self) -> Option<Target> {
        match self {
            Target::IsaacLab => Some(Target::Urdf),
            Target::Cpp | Target::Simulink => Some(Target::C),
            Target::Urdf | Target::Mjcf | Target::C | Target::Fmu => None,
        }
    }
}

/// The robot as it was given.
#[derive(Debug, Clone, Copy)]
pub struct Robot<'a> {
    /// Text of the description, xacro expanded.
    pub text: &'a str,
    /// What was read from it, joints of which the logs say nothing held.
    pub loaded: &'a Loaded,
    /// Whether the text is MJCF.
    pub is_mjcf: bool,
    /// Length of a step in targets that have one of their own, s.
    pub dt: f64,
}

/// Length of a step where nothing says otherwise, s.
pub const DT: f64 = 1e-3;

/// A file for a target, and what it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The target.
    pub target: Target,
    /// Text of the file; of an FMU the C code in it, which [`fmu()`] packs.
    pub text: String,
    /// What became of the effects.
    pub ledger: TargetLedger,
}

/// Why nothing can be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A robot that was not given as URDF.
    #[error("a URDF is the user's own file with the corrections, and the robot was given as MJCF; use --to mjcf")]
    NoUrdf,
    /// A text that is no XML.
    #[error("the robot description is not well-formed XML ({0}); mend it there")]
    Text(String),
    /// A link or joint of the model that the text does not have under its name.
    #[error("the robot description has no <{0}> named `{1}` to correct; give each a name of its own")]
    Missing(&'static str, String),
    /// An effect that the robot cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// Writes the corrected model for a target; with logs, predicts what its torque gap shrinks by there.
///
/// # Errors
/// A robot that the target cannot start from, or an effect that the robot cannot have.
pub fn export(target: Target, robot: &Robot, corrected: &Corrected, logs: &[Episode]) -> Result<Exported, ExportError> {
    if matches!(target, Target::Urdf | Target::IsaacLab) && robot.is_mjcf {
        return Err(ExportError::NoUrdf);
    }
    let model = &robot.loaded.model;
    let transmissions = Plant::new(model, &corrected.effects, 1e-3)?.transmissions();
    let usual = usual(logs, model.dof());
    let context = Context { model, transmissions: &transmissions, usual: usual.as_ref() };
    let carried: Vec<Carried> = corrected
        .effects
        .iter()
        .flat_map(|effect| match target {
            Target::Urdf => urdf::carry(effect, &context, |joint| urdf::has_limit(robot, joint)),
            Target::Mjcf => mjcf::carry(effect, &context),
            Target::IsaacLab => isaaclab::carry(effect, &context, |joint| urdf::has_limit(robot, joint)),
            Target::C | Target::Cpp | Target::Simulink | Target::Fmu => vec![c::carry(effect)],
        })
        .collect();
    let held = held(&carried);
    let totals = Totals::new(model, &held)?;
    let mut emptied = Vec::new();
    let text = match target {
        Target::Urdf => {
            let (text, without) = urdf::write(robot, &totals)?;
            emptied = without;
            text
        }
        Target::Mjcf => mjcf::write(model, &totals, &held),
        Target::IsaacLab => isaaclab::write(model, &totals, &corrected.effects),
        Target::Cpp => c::CPP.to_owned(),
        Target::Simulink => c::SIMULINK.to_owned(),
        Target::C | Target::Fmu => {
            let plant = Corrected { effects: held, ..corrected.clone() }.plant(model, robot.dt)?;
            let of = |joint: &gapscope_dynamics::Joint| corrected.standstill.get(&joint.name).copied().unwrap_or(0.0);
            c::write(&plant, &model.joints().iter().map(of).collect::<Vec<_>>())
        }
    };
    let mut ledger = predict(robot, corrected, logs, &carried)?;
    ledger.target = target.name().to_owned();
    ledger.file = target.file().to_owned();
    ledger.paste = match target {
        Target::Urdf => paste::urdf(model, &totals),
        Target::Mjcf => paste::mjcf(model, &totals),
        Target::IsaacLab | Target::C | Target::Cpp | Target::Simulink | Target::Fmu => Vec::new(),
    };
    ledger.notes = notes(target, robot.dt, corrected, &totals);
    ledger.notes.extend(emptied.iter().map(|link| {
        format!(
            "link `{link}` has no mass of its own any more: the link that it is fixed to has that of both, corrected"
        )
    }));
    Ok(Exported { target, text, ledger })
}

/// Everything that the target holds.
fn held(carried: &[Carried]) -> Vec<Effect> {
    carried.iter().flat_map(|carried| carried.held.clone()).collect()
}

fn usual(logs: &[Episode], joints: usize) -> Option<Usual> {
    if logs.is_empty() {
        return None;
    }
    let mean = |j: usize| {
        let all = || logs.iter().flat_map(|log| &log.effort[j]);
        all().map(|effort| effort.abs()).sum::<f64>() / all().count().max(1) as f64
    };
    let seconds = logs.iter().map(Episode::duration).fold(0.0, f64::max);
    Some(Usual { seconds, load: (0..joints).map(mean).collect() })
}

/// The ledger of what is carried over: each effect alone held as the target holds it, and all of them.
fn predict(
    robot: &Robot,
    corrected: &Corrected,
    logs: &[Episode],
    carried: &[Carried],
) -> Result<TargetLedger, ExportError> {
    let mut ledger = TargetLedger {
        target: String::new(),
        file: String::new(),
        shrink: None,
        shrink_here: None,
        effects: carried.iter().map(|carried| Entry::new(carried, None)).collect(),
        paste: Vec::new(),
        notes: Vec::new(),
    };
    if logs.is_empty() {
        return Ok(ledger);
    }
    let changed: Vec<usize> = (0..carried.len()).filter(|&i| carried[i].held != [carried[i].part.clone()]).collect();
    let whole = |i: usize| -> Vec<Effect> {
        let of = |(k, c): (usize, &Carried)| if k == i { c.held.clone() } else { vec![c.part.clone()] };
        carried.iter().enumerate().flat_map(of).collect()
    };
    let mut instead: Vec<Vec<Effect>> = vec![held(carried)];
    instead.extend(changed.iter().map(|&i| whole(i)));
    let shrinks: Vec<Option<f64>> = torque_changes(&robot.loaded.model, logs, corrected, &instead)?
        .into_iter()
        .map(|change| change.shrink)
        .collect();
    ledger.shrink = shrinks.first().copied().flatten();
    ledger.shrink_here = shrinks.get(1).copied().flatten().filter(|_| carried.iter().all(|c| c.predicted));
    let loss = |without: Option<f64>| ledger.shrink.zip(without).map(|(with, without)| with - without);
    for (i, entry) in ledger.effects.iter_mut().enumerate() {
        entry.loss = match changed.iter().position(|&c| c == i) {
            _ if !carried[i].predicted => None,
            Some(at) => loss(shrinks.get(at + 2).copied().flatten()),
            None => ledger.shrink.map(|_| 0.0),
        };
    }
    Ok(ledger)
}

/// What a target does otherwise, whatever the effects.
fn notes(target: Target, dt: f64, corrected: &Corrected, totals: &Totals) -> Vec<String> {
    let mut notes = Vec::new();
    for joint in totals.model.joints().iter().filter(|joint| !joint.inertia.is_physical()) {
        notes.push(format!(
            "the corrected inertia of link `{}` is that of no body: simulators may refuse it or change it",
            joint.link
        ));
    }
    if target == Target::Urdf && totals.friction.iter().any(|friction| *friction > 0.0) {
        notes.push("Drake reads no `friction` of a URDF; MuJoCo and PyBullet do".to_owned());
    }
    if target == Target::Mjcf {
        if totals.model.joints().iter().any(|joint| joint.limits.effort.is_some()) {
            notes.push("commands are held to the effort limits of the robot description, as ctrlrange".to_owned());
        }
        notes.push("shapes, meshes and contacts of the robot description are not carried over".to_owned());
        let turning = totals.transmissions.iter().filter(|t| t.rotor > 0.0);
        for joint in turning.map(|t| &totals.model.joints()[t.joint].name) {
            let shown = if corrected.encoder_side == EncoderSide::Motor { motor_joint(joint) } else { joint.clone() };
            notes.push(format!("the encoder of `{joint}` shows the position of joint `{shown}` of the file"));
        }
    }
    if target.is_c() {
        notes.push(format!("a step is {dt} s, as --dt says; hold commands over it"));
        notes.push("limits of position, speed and effort in the robot description are not carried over".to_owned());
    }
    if target == Target::Simulink {
        notes.push("not run in Simulink: MATLAB is not where the project is tested".to_owned());
    }
    if target == Target::IsaacLab {
        notes.push("not run here: Isaac Sim is not where the project is tested".to_owned());
    }
    if corrected.alignment != 0.0 {
        let late = corrected.alignment;
        notes.push(format!("the logger's shift of {late:.2e} s between effort and position is no part of the robot"));
    }
    notes
}
