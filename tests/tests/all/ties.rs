//! What logs cannot tell is said beside what is named.

use gapscope_datasets::{Recipe, generate};
use gapscope_diagnosis::schema::FoundEffect;
use gapscope_dynamics::InertialSource;
use gapscope_effects::{CoulombFriction, Effect, LinkInertiaError, Payload};
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

/// On a used arm, whose links are all off by a little, a load of many times its link is told from them: the last link could
/// take it over, had it not a mass of its own.
#[test]
fn a_load_of_many_times_its_link_is_none_of_the_link() {
    let model = robot("arm6");
    let scale = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| 0.06 * x).collect() };
    let link = |joint: &gapscope_dynamics::Joint| {
        let body = &joint.inertia;
        let six = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)].map(|(i, j)| body.rotational.col(j)[i]);
        Effect::LinkInertiaError(LinkInertiaError {
            joint: joint.name.clone(),
            mass_delta: 0.06 * body.mass,
            first_moment_delta: scale(&body.first_moment.to_array()).try_into().unwrap(),
            inertia_delta: scale(&six).try_into().unwrap(),
        })
    };
    let last = model.joints().last().unwrap();
    let mass = 15.0 * last.inertia.mass;
    let com = [0.02, 0.01, 0.15];
    let load = Payload { joint: last.name.clone(), mass, com, inertia: [1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3] };
    let mut effects: Vec<Effect> = model.joints().iter().map(link).collect();
    effects.push(Effect::Payload(load));
    let log = |seed| generate(&model, &effects, seed, &Recipe::default(), "log.csv").unwrap();
    let found = diagnose(&model, &[log(1), log(2), log(3)]).diagnosis.effects;
    let load = found.iter().find(|e| e.kind == "payload");
    assert!(load.is_some_and(|load| load.confidence > 0.9), "{found:#?}");
}
