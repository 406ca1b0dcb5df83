//! The plant of an account along a measured run.

use crate::record::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Effect, EffectError, EncoderSide, ExternalContact, Motion, Plant};
use std::collections::BTreeMap;

/// Values of a map by joint name, in model order; 0 where a joint is missing.
pub fn per_joint(model: &Model, map: &BTreeMap<String, f64>) -> Vec<f64> {
    model.joints().iter().map(|j| map.get(&j.name).copied().unwrap_or(0.0)).collect()
}

/// A robot with effects whose log shows positions on a side of its transmissions.
///
/// # Errors
/// An effect that the robot cannot have.
pub fn plant(model: &Model, effects: &[Effect], side: EncoderSide, dt: f64) -> Result<Plant, EffectError> {
    plant_pushed(model, effects, side, dt, &[])
}

/// The same while something outside pushes, as one log has it: contacts take their times from the log.
///
/// # Errors
/// An effect that the robot cannot have.
pub fn plant_pushed(
    model: &Model,
    effects: &[Effect],
    side: EncoderSide,
    dt: f64,
    pushed: &[[f64; 2]],
) -> Result<Plant, EffectError> {
    let here: Vec<Effect> = effects
        .iter()
        .map(|effect| match effect {
            Effect::ExternalContact(contact) => {
                Effect::ExternalContact(ExternalContact { intervals: pushed.to_vec(), ..contact.clone() })
            }
            other => other.clone(),
        })
        .collect();
    let plant = Plant::new(model, &here, dt)?;
    Ok(if side == EncoderSide::Motor { plant.with_motor_encoders() } else { plant })
}

/// Residual torque of a measured motion on a plant of a model, joint-major like the signals; N m or N.
pub fn residual(
    plant: &mut Plant,
    model: &Model,
    signals: &Signals,
    standstill: &[f64],
    alignment: f64,
) -> Vec<Vec<f64>> {
    aligned(model, signals, standstill, alignment, |motion| plant.residuals(motion))
}

/// What a function makes of a measured motion whose effort acts by `alignment` s late against the position.
pub fn aligned<T>(
    model: &Model,
    signals: &Signals,
    standstill: &[f64],
    alignment: f64,
    of: impl FnOnce(&Motion<'_>) -> T,
) -> T {
    let motion = signals.motion(model, standstill);
    if alignment == 0.0 {
        return of(&motion);
    }
    let shift = |(tau, rate): (&f64, &f64)| tau - alignment * rate;
    let tau: Vec<Vec<f64>> =
        signals.tau.iter().zip(&signals.tau_rate).map(|(t, r)| t.iter().zip(r).map(shift).collect()).collect();
    of(&Motion { tau: &tau, ..motion })
}
