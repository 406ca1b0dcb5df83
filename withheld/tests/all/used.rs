//! Used arms: that they are robots, that what is further shows, and that banks of them hold what they should.

use gapscope_dynamics::{Inertia, Model, robots};
use gapscope_effects::Kind;
use gapscope_withheld::{Case, CaseSpec, Difficulty, Part, Plan, Robot, SealedEffect, Truth, Used, make_case};
use serde_json::Value;
use std::collections::BTreeSet;

fn robot(name: &str) -> Robot {
    let urdf = robots::urdf(name).unwrap();
    Robot::new(name.into(), urdf.into(), Model::from_urdf(urdf).unwrap().model).unwrap()
}

fn plan(used: Used, arms: usize) -> Plan {
    let mut plan = Plan {
        faulty: false,
        servo: false,
        cases: 0,
        multi: 0,
        mixed: 0,
        none: 0,
        unknown: 0,
        robots: vec!["double_pendulum".into()],
        seed: 5,
        difficulty: Difficulty::Mixed,
        seconds: 3.0,
        episodes: 1,
        tests: 1,
        used: Some(used),
    };
    plan.share_out(arms);
    plan
}

fn cases(used: Used, arms: usize, robot: &Robot) -> Vec<Case> {
    plan(used, arms).specs().iter().map(|spec| make_case(robot, spec).unwrap_or_else(|e| panic!("{e}"))).collect()
}

fn effect(truth: &Truth, kind: Kind) -> Option<&SealedEffect> {
    truth.effects.iter().find(|effect| effect.kind == kind.name())
}

/// Rows of numbers, one for each joint affected.
fn rows(effect: &SealedEffect, name: &str) -> Vec<Vec<f64>> {
    let numbers = |row: &Value| match row {
        Value::Array(row) => row.iter().map(|x| x.as_f64().unwrap()).collect(),
        one => vec![one.as_f64().unwrap()],
    };
    effect.parameters[name].as_array().unwrap().iter().map(numbers).collect()
}

#[test]
fn every_body_is_one_and_the_robot_that_is_handed_out_too() {
    let arm = robot("arm6");
    let spec = |used, seed| CaseSpec {
        faulty: false,
        servo: false,
        sorts: vec![],
        used: Some(used),
        seed,
        difficulty: Difficulty::Mixed,
        seconds: 2.0,
        episodes: 1,
        tests: 0,
    };
    let mut links = 0;
    for (used, seed) in Used::ALL.into_iter().flat_map(|used| (0..6).map(move |seed| (used, seed))) {
        let case = make_case(&arm, &spec(used, seed)).unwrap();
        let described = Model::from_urdf(&case.urdf).unwrap().model;
        let mut bodies: Vec<Inertia> = described.joints().iter().map(|joint| joint.inertia).collect();
        assert!(bodies.iter().all(Inertia::is_physical));
        if let Some(error) = effect(&case.truth, Kind::LinkInertiaError) {
            let [mass, moment, inertia] =
                ["mass_delta", "first_moment_delta", "inertia_delta"].map(|name| rows(error, name));
            for (i, &j) in error.joints.iter().enumerate() {
                let delta = [&mass[i][..], &moment[i], &inertia[i]].concat();
                let [most, center] = if used == Used::Little { [0.08, 0.01] } else { [1.0 / 3.0, 0.02] };
                assert!(delta[0].abs() <= most * bodies[j].mass);
                let other = bodies[j].add(&Inertia::from_parameters(&delta.try_into().unwrap()));
                let moved = other.center_of_mass().unwrap() - bodies[j].center_of_mass().unwrap();
                assert!(moved.abs().max_element() <= center * (1.0 + 1e-9), "{moved}");
                bodies[j] = other;
                links += 1;
            }
        }
        if let Some(tool) = effect(&case.truth, Kind::Payload) {
            let mass = tool.parameters["mass"].as_f64().unwrap();
            let (before, now) = (arm.model.joints()[5].inertia.mass, described.joints()[5].inertia.mass);
            // What is too many stands in the description; what is missing does not.
            assert!((now - before - (-mass).max(0.0)).abs() < 1e-9, "{mass} {before} {now}");
        }
        assert!(bodies.iter().all(Inertia::is_physical), "{:?}", case.truth);
    }
    assert!(links > 30, "{links}");
}

#[test]
fn what_is_further_shows_and_hides_in_no_fault() {
    let pendulum = robot("double_pendulum");
    for used in Used::ALL {
        for case in cases(used, 24, &pendulum) {
            let truth = &case.truth;
            assert_eq!((truth.used, truth.kinds.is_empty()), (Some(used), false));
            assert!((100.0..=1000.0).contains(&truth.rate.unwrap()));
            assert_eq!(case.episodes[0].len(), (3.0 * truth.rate.unwrap()) as usize);
            let further: Vec<_> = truth.effects.iter().filter(|e| e.part == Some(Part::Further)).collect();
            assert!(further.len() < 2);
            for effect in &truth.effects {
                let calibration = used.calibration().iter().any(|kind| kind.name() == effect.kind);
                assert_eq!(effect.part == Some(Part::Calibration), calibration, "{}", effect.kind);
                assert!(effect.visibility().is_none_or(|power| power >= 5.0));
            }
            if let Some(further) = further.first().filter(|e| e.kind != Kind::Payload.name()) {
                let beside = further.parameters.get("beside").map(|beside| beside.as_array().unwrap());
                let most = beside.map(|beside| beside.iter().map(|x| x.as_f64().unwrap()).fold(0.0, f64::max));
                assert!(most.is_none_or(|most| most >= 8.0), "{}: {most:?}", further.kind);
                assert!(most.is_some() || further.kind == Kind::TorqueSaturation.name());
            }
            let on = |kind: Kind| effect(truth, kind).map_or(&[][..], |effect| &effect.joints);
            for (one, other) in [
                (Kind::ParallelSpring, Kind::TorqueBias),
                (Kind::JointElasticity, Kind::Armature),
                (Kind::Backlash, Kind::Armature),
                (Kind::Payload, Kind::LinkInertiaError),
                (Kind::StribeckFriction, Kind::CoulombFriction),
                (Kind::PreslidingFriction, Kind::CoulombFriction),
                (Kind::ThermalDrift, Kind::CoulombFriction),
            ] {
                assert!(on(one).iter().all(|joint| !on(other).contains(joint)), "{one} {other}");
            }
        }
    }
}

#[test]
fn a_bank_holds_every_fault_and_every_further_kind_and_the_seed_decides() {
    let pendulum = robot("double_pendulum");
    let arms = cases(Used::Much, Plan::used_arms(Used::Much), &pendulum);
    let kinds: BTreeSet<&str> = arms.iter().flat_map(|case| &case.truth.kinds).map(String::as_str).collect();
    assert!(Kind::ALL.iter().all(|kind| kinds.contains(kind.name())), "{kinds:?}");
    assert!(kinds.iter().any(|kind| gapscope_withheld::is_unknown(kind)));
    let tools = || arms.iter().filter_map(|case| effect(&case.truth, Kind::Payload)?.parameters["mass"].as_f64());
    assert!(tools().any(|mass| mass > 0.0) && tools().any(|mass| mass < 0.0));
    let specs = plan(Used::Much, 3).specs();
    for spec in &specs {
        assert_eq!(make_case(&pendulum, spec).unwrap(), make_case(&pendulum, spec).unwrap());
    }
}
