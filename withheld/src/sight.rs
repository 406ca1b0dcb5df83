//! Which effects of a case can be seen in its logs.

use crate::case::simulate;
use crate::draw::Drawn;
use crate::robot::Robot;
use crate::truth::{DETECTABLE, Part, SealedEffect};
use crate::visibility::{beside, less, power, residual};
use gapscope_datasets::{GenerateError, Recipe};
use gapscope_effects::Kind;
use serde_json::Value;

/// Signature over noise that the further effect of a used arm must have beside what calibration can take over.
const VISIBLE: f64 = 8.0;

/// Writes into each effect how visible it is, compared with the same robot without it and without noise; a drive that
/// winds up, with one that has only its rotor. A saturation's torque is in the log, so that its signature says nothing.
/// Of a used arm, what calibration cannot take over of the further effect is written too.
pub(crate) fn see(
    robot: &Robot,
    drawn: &mut [Drawn],
    seed: u64,
    recipe: &Recipe,
    quiet: &Recipe,
    used: bool,
) -> Result<(), GenerateError> {
    if drawn.is_empty() {
        return Ok(());
    }
    let log = |drawn: &[Drawn], recipe: &Recipe| simulate(robot, drawn, 0, seed, recipe);
    let run = |drawn: &[Drawn], recipe: &Recipe| -> Result<Vec<Vec<f64>>, GenerateError> {
        Ok(residual(&robot.model, &log(drawn, recipe)?))
    };
    let whole = log(drawn, quiet)?;
    let with = residual(&robot.model, &whole);
    let noise = match used {
        false => run(&[], recipe)?,
        // Of the robot as it is: friction may be most of a light joint's effort, and noise goes by effort.
        true => less(&run(drawn, recipe)?, &with),
    };
    for which in 0..drawn.len() {
        if drawn[which].sealed.kind == Kind::TorqueSaturation.name() {
            continue;
        }
        let mut rest = drawn.to_vec();
        rest[which].effects.clear();
        rest[which].contacts.clear();
        rest[which].outside = None;
        // A robot that falls over without its effect says nothing about its size.
        let Ok(without) = run(&rest, quiet) else { continue };
        let sealed = &mut drawn[which].sealed;
        sealed.power = power(&with, &without, &noise);
        if sealed.part == Some(Part::Further) {
            let beside = beside(&robot.model, &whole, &with, &without, &noise);
            sealed.parameters.insert("beside".into(), beside.into());
        }
    }
    Ok(())
}

/// Whether an effect of a used arm stands out of the noise far enough, where that can be said; a further effect beside all
/// that calibration could take over of it, but for a payload, which bodies take over as it is one.
pub(crate) fn shows(effect: &SealedEffect) -> bool {
    let most = |power: &Value| power.as_array().into_iter().flatten().filter_map(Value::as_f64).reduce(f64::max);
    let further = effect.part == Some(Part::Further);
    let beside = effect.parameters.get("beside").filter(|_| effect.kind != Kind::Payload.name()).and_then(most);
    let least = if further { VISIBLE } else { DETECTABLE };
    effect.visibility().is_none_or(|power| power >= least) && beside.is_none_or(|power| power >= VISIBLE)
}
