//! What logs cannot tell is said beside what is named.

use gapscope_datasets::{Recipe, generate};
use gapscope_diagnosis::schema::FoundEffect;
use gapscope_dynamics::InertialSource;
use gapscope_effects::{CoulombFriction, Effect, Payload};
use gapscope_tests::{diagnose, robot};

/// The body found where the last link of an arm, whose inertials come from `source`, carries `mass`, kg, in its centre: on the
/// last axis, where it is one with the last link but one, too.
fn body_found(mass: f64, source: InertialSource) -> FoundEffect {
    let model = (0..6).fold(robot("arm6"), |model, j| model.with_inertial_source(j, source));
    let last = model.joints().last().unwrap();
    let com = (last.inertia.first_moment / last.inertia.mass).to_array();
    let load = Payload { joint: last.name.clone(), mass, com, inertia: [0.0; 6] };
    let friction = model.joints().iter().map(|j| (j.name.clone(), 0.5)).collect();
    let effects = [Effect::Payload(load), Effect::CoulombFriction(CoulombFriction { coulomb: friction })];
    let log = |seed| generate(&model, &effects, seed, &Recipe::default(), "log.csv").unwrap();
    let found = diagnose(&model, &[log(1), log(2), log(3)]).diagnosis.effects;
    let bodies: Vec<FoundEffect> = found.into_iter().filter(|e| e.kind != "coulomb_friction").collect();
    assert_eq!(bodies.len(), 1, "{bodies:#?}");
    bodies[0].clone()
}

/// A link that is off by as much as links are is likelier than a load; one that is off by its mass several times is not.
#[test]
fn a_light_load_could_be_a_link_and_a_heavy_one_could_not() {
    let light = body_found(0.5, InertialSource::Cad);
    assert_eq!(
        (light.kind.as_str(), &light.indistinguishable_from[..]),
        ("link_inertia_error", &["payload".to_owned()][..])
    );
    let heavy = body_found(1.0, InertialSource::Cad);
    assert_eq!((heavy.kind.as_str(), heavy.indistinguishable_from.len()), ("payload", 0), "{heavy:#?}");
}

#[test]
fn beside_links_that_were_weighed_a_light_load_is_a_load() {
    let load = body_found(0.5, InertialSource::Weighed);
    assert_eq!((load.kind.as_str(), load.indistinguishable_from.len()), ("payload", 0), "{load:#?}");
}
