//! A push at a point that nobody knows to a centimetre: no other effect is named for the lever.

use gapscope_datasets::{Episode, Recipe, Sensors, generate};
use gapscope_diagnosis::schema::Verdict;
use gapscope_effects::{CoulombFriction, Effect, ExternalContact, ViscousFriction};
use gapscope_tests::{diagnose, recipe, robot};
use std::collections::BTreeMap;

#[test]
fn a_push_off_the_centre_of_the_hand_is_no_torque_gain() {
    let model = robot("arm7");
    let each = |values: [f64; 7]| -> BTreeMap<String, f64> {
        model.joints().iter().map(|joint| joint.name.clone()).zip(values).collect()
    };
    let friction = [
        Effect::CoulombFriction(CoulombFriction { coulomb: each([0.11, 1.05, 0.9, 1.16, 0.22, 0.18, 0.18]) }),
        Effect::ViscousFriction(ViscousFriction { viscous: each([0.12, 2.95, 0.44, 0.63, 0.145, 0.1, 0.245]) }),
    ];
    let (force, offset) = ([12.2, -5.6, -2.7], [0.008, 0.004, -0.02]);
    let sensors = Sensors { position_noise: 5e-6, effort_noise: 0.01, ..Sensors::default() };
    let recipe = Recipe { sensors, ..recipe() };
    let log = |seed: u64| -> Episode {
        let from = 1.0 + 0.7 * seed as f64;
        let link = model.joints()[6].link.clone();
        let intervals = vec![[from, from + 0.7], [from + 1.9, from + 2.5]];
        let push = Effect::ExternalContact(ExternalContact { link, intervals, force, offset });
        generate(&model, &[friction.as_slice(), &[push]].concat(), seed, &recipe, "log.csv").unwrap()
    };
    let diagnosis = diagnose(&model, &(1..6).map(log).collect::<Vec<_>>()).diagnosis;
    let mut kinds: Vec<&str> = diagnosis.effects.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["coulomb_friction", "external_contact", "viscous_friction"], "{:#?}", diagnosis.effects);
    assert_eq!(diagnosis.verdict, Verdict::Explained);
    let push = diagnosis.effects.iter().find(|e| e.kind == "external_contact").unwrap();
    let push = serde_json::to_value(push).unwrap();
    for (name, truth, within) in [("force", force, 0.5), ("offset", offset, 0.003)] {
        for (i, truth) in truth.iter().enumerate() {
            let found = push["parameters"][name]["value"][i].as_f64().unwrap();
            assert!((found - truth).abs() < within, "{name} {i}: {found}, not {truth}");
        }
    }
}
