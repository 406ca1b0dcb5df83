//! A delay is no lag, however noisy the effort: a lag smooths its noise and leaves less of it, whichever is true.

use gapscope_datasets::{Recipe, Sensors, generate};
use gapscope_diagnosis::schema::FoundEffect;
use gapscope_effects::{ActuationDelay, ActuatorLag, Effect};
use gapscope_tests::{diagnose, recipe, robot};

/// What is found in an arm's logs with noisy effort.
fn found(effect: &Effect, position_noise: f64) -> Vec<FoundEffect> {
    let model = robot("arm6");
    let sensors = Sensors { position_noise, effort_noise: 0.01, ..Sensors::default() };
    let recipe = Recipe { sensors, ..recipe() };
    let logs: Vec<_> =
        (1..5).map(|seed| generate(&model, std::slice::from_ref(effect), seed, &recipe, "log.csv").unwrap()).collect();
    diagnose(&model, &logs).diagnosis.effects
}

/// Each way to be late by 12 ms is named.
fn named(effect: Effect) {
    let found = found(&effect, 1e-6);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].kind, effect.kind().name(), "{found:#?}");
    assert!(found[0].confidence > 0.9 && found[0].indistinguishable_from.is_empty(), "{found:#?}");
}

#[test]
fn a_delay_in_noisy_effort() {
    named(Effect::ActuationDelay(ActuationDelay { delay: 0.012 }));
}

#[test]
fn a_lag_in_noisy_effort() {
    named(Effect::ActuatorLag(ActuatorLag { time_constant: 0.012 }));
}

#[test]
fn a_short_lag_is_no_delay_for_certain_where_a_servo_answers_to_noise() {
    // A servo's answer to the noise of the position goes with that noise, and so would speak for a delay.
    let found = found(&Effect::ActuatorLag(ActuatorLag { time_constant: 0.0058 }), 1e-5);
    let lag =
        |e: &FoundEffect| e.kind == "actuator_lag" || e.indistinguishable_from.contains(&"actuator_lag".to_owned());
    assert!(found.len() == 1 && lag(&found[0]), "{found:#?}");
}
