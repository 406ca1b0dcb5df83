//! A delay is no lag, however noisy the effort: a lag smooths its noise and leaves less of it, whichever is true.

use gapscope_datasets::{Recipe, Sensors, generate};
use gapscope_effects::{ActuationDelay, ActuatorLag, Effect};
use gapscope_tests::{diagnose, robot};

/// What is named of an arm's logs with noisy effort, each way to be late by 12 ms.
fn named(effect: Effect) {
    let model = robot("arm6");
    let sensors = Sensors { position_noise: 1e-6, effort_noise: 0.01, ..Sensors::default() };
    let recipe = Recipe { sensors, ..Recipe::default() };
    let logs: Vec<_> =
        (1..5).map(|seed| generate(&model, std::slice::from_ref(&effect), seed, &recipe, "log.csv").unwrap()).collect();
    let found = diagnose(&model, &logs).diagnosis.effects;
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
