//! A law that the catalogue does not have: it is never named as an effect, an effect beside it still is, and what is left is
//! told by what it resembles.

use gapscope_datasets::{Episode, Recipe, Sensors, generate};
use gapscope_diagnosis::schema::{Diagnosis, Verdict};
use gapscope_dynamics::{Data, Model};
use gapscope_effects::{ActuationDelay, Armature, Backlash, Effect, ParallelSpring, TorqueRipple, ViscousFriction};
use gapscope_tests::{diagnose, recipe, robot};
use nalgebra::DMatrix;

/// Torque that a law takes of the drives, from q and q̇.
type Law = dyn Fn(&Model, &[f64], &[f64]) -> Vec<f64>;

const ROBOT: &str = "double_pendulum";

/// Drag of 0.5 N s²/m² on the last link.
fn drag(model: &Model, q: &[f64], v: &[f64]) -> Vec<f64> {
    let n = model.dof();
    let mut jacobian = DMatrix::zeros(6, n);
    let center = model.joints()[n - 1].inertia.center_of_mass().unwrap();
    model.jacobian(&mut Data::new(model), q, n - 1, center, &mut jacobian);
    let velocity: Vec<f64> = (0..3).map(|i| (0..n).map(|j| jacobian[(i, j)] * v[j]).sum()).collect();
    let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    (0..n).map(|j| 0.5 * speed * (0..3).map(|i| jacobian[(i, j)] * velocity[i]).sum::<f64>()).collect()
}

/// A spot of 0.2 rad at which the second joint rubs with 0.3 N m.
fn rub(model: &Model, q: &[f64], v: &[f64]) -> Vec<f64> {
    let mut torque = vec![0.0; model.dof()];
    torque[1] = 0.3 * (-((q[1] - 0.2) / 0.1).powi(2)).exp() * (v[1] / 0.01).tanh();
    torque
}

/// A hose that stiffens on either side of 0.1 rad in the second joint.
fn hose(model: &Model, q: &[f64], _: &[f64]) -> Vec<f64> {
    let mut torque = vec![0.0; model.dof()];
    torque[1] = 2.0 * (q[1] - 0.1).powi(3);
    torque
}

/// A diagnosis of logs in which the drives also overcome a law: the motion is the same, the effort is larger.
fn diagnosed(effects: &[Effect], law: &Law) -> Diagnosis {
    diagnosed_with(effects, law, Sensors { position_noise: 1e-6, effort_noise: 1e-3, ..Sensors::default() })
}

/// The same with other sensors.
fn diagnosed_with(effects: &[Effect], law: &Law, sensors: Sensors) -> Diagnosis {
    let model = robot(ROBOT);
    let n = model.dof();
    let recipe = Recipe { sensors, ..recipe() };
    let log = |seed| -> Episode {
        let mut log = generate(&model, effects, seed, &recipe, "log.csv").unwrap();
        for k in 1..log.len() - 1 {
            let dt = log.time[k + 1] - log.time[k];
            let q: Vec<f64> = log.position.iter().map(|q| 0.5 * (q[k] + q[k + 1])).collect();
            let v: Vec<f64> = log.position.iter().map(|q| (q[k + 1] - q[k]) / dt).collect();
            let torque = law(&model, &q, &v);
            (0..n).for_each(|j| log.effort[j][k] += torque[j]);
        }
        log
    };
    diagnose(&model, &(1..5).map(log).collect::<Vec<_>>()).diagnosis
}

fn laws(diagnosis: &Diagnosis) -> Vec<&str> {
    let like = diagnosis.unexplained.resembles.as_ref();
    like.map_or(vec![], |like| like.laws.iter().map(|l| l.law.as_str()).collect())
}

#[test]
fn a_drag_alone_is_unknown_and_said_to_be_like_a_drag() {
    let found = diagnosed(&[], &drag);
    assert_eq!(found.verdict, Verdict::UnknownEffect, "{:#?}", found.effects);
    assert!(found.effects.is_empty(), "{:#?}", found.effects);
    assert_eq!(laws(&found), ["link_drag"]);
    assert!(found.unexplained.resembles.unwrap().share > 0.95);
}

/// A light wrist whose ripple passes at tens of hertz: from sample to sample its law is not exact, and a drag takes what it leaves.
#[test]
fn a_law_that_takes_what_concerns_nobody_leaves_the_gap_explained() {
    let model = robot("arm6");
    let wrist = model.joints()[5].name.clone();
    let on = |value: f64| [(wrist.clone(), value)].into();
    let ripple = TorqueRipple { amplitude: on(0.3), cycles: on(14.0), phase: on(5.07) };
    let log = |seed| generate(&model, &[Effect::TorqueRipple(ripple.clone())], seed, &recipe(), "log.csv").unwrap();
    let found = diagnose(&model, &(1..5).map(log).collect::<Vec<_>>()).diagnosis;
    assert_eq!(laws(&found), ["joint_drag"], "else this is no test");
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.unexplained);
}

/// A linear spring is the nearest that the catalogue has, and is none.
#[test]
fn a_hose_that_stiffens_is_no_spring() {
    let found = diagnosed(&[], &hose);
    assert!(found.effects.is_empty(), "{:#?}", found.effects);
    assert_eq!(found.verdict, Verdict::UnknownEffect);
    assert_eq!(laws(&found), ["nonlinear_spring"]);
    assert!(found.unexplained.resembles.unwrap().share > 0.9);
}

/// And a spring is no hose, be it slack where no joint goes.
#[test]
fn a_spring_is_no_hose_that_stiffens() {
    let model = robot(ROBOT);
    let on = |value: f64| [(model.joints()[1].name.clone(), value)].into();
    let spring = Effect::ParallelSpring(ParallelSpring { stiffness: on(2.0), rest_position: on(3.0) });
    let found = diagnosed(&[spring], &|model, _, _| vec![0.0; model.dof()]);
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["parallel_spring"], "{:#?}", found.effects);
    assert_eq!(found.verdict, Verdict::Explained);
    assert!(laws(&found).is_empty(), "{:?}", laws(&found));
}

#[test]
fn rotors_are_found_beside_a_drag() {
    let model = robot(ROBOT);
    let armature = model.joints().iter().map(|j| (j.name.clone(), 0.01)).collect();
    let found = diagnosed(&[Effect::Armature(Armature { armature })], &drag);
    assert_eq!(found.verdict, Verdict::PartlyExplained, "{:#?}", found.effects);
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["armature"]);
    assert!(found.effects[0].confidence > 0.9, "what the drag accounts for does not speak against the rotors");
    assert_eq!(laws(&found), ["link_drag"]);
}

#[test]
fn friction_is_found_beside_a_spot_that_rubs() {
    let model = robot(ROBOT);
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 0.05)).collect();
    let found = diagnosed(&[Effect::ViscousFriction(ViscousFriction { viscous })], &rub);
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["viscous_friction"], "{:#?}", found.effects);
    assert_eq!(found.effects[0].joints.len(), 2, "{:#?}", found.effects);
    assert_eq!(found.verdict, Verdict::PartlyExplained);
}

#[test]
fn a_spot_that_rubs_beside_friction_of_its_size_is_said_to_be_like_one() {
    let model = robot(ROBOT);
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 0.05)).collect();
    let found = diagnosed(&[Effect::ViscousFriction(ViscousFriction { viscous })], &rub);
    assert!(laws(&found).contains(&"rub"), "{:?}", laws(&found));
}

/// A spot that rubs in one joint is a thousandth of the squared gap beside friction of that size, and of no concern by that;
/// but what is left there is no noise, and a law that the catalogue does not have accounts for it.
#[test]
fn a_small_unknown_beside_a_large_effect_is_not_explained_away() {
    let model = robot(ROBOT);
    let viscous = model.joints().iter().map(|j| (j.name.clone(), 3.0)).collect();
    let found = diagnosed(&[Effect::ViscousFriction(ViscousFriction { viscous })], &rub);
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["viscous_friction"], "{:#?}", found.effects);
    assert!(found.unexplained.fraction < 0.003, "{}", found.unexplained.fraction);
    assert_eq!(found.verdict, Verdict::PartlyExplained);
    assert!(laws(&found).contains(&"rub"), "{:?}", laws(&found));
    assert!(found.effects[0].confidence > 0.9, "{:#?}", found.effects);
}

/// Efforts are great where a place rubs, and a limit cuts great efforts: that is not what it is.
#[test]
fn a_spot_that_rubs_alone_is_unknown_and_no_limit() {
    let found = diagnosed(&[], &rub);
    assert_eq!(found.verdict, Verdict::UnknownEffect, "{:#?}", found.effects);
    assert!(found.effects.is_empty(), "{:#?}", found.effects);
}

/// Play in the first joint and a spot that rubs in the second: the play takes most of the gap, and does not take the spot
/// with it.
#[test]
fn a_spot_that_rubs_is_told_beside_play() {
    let model = robot(ROBOT);
    let first = model.joints()[0].name.clone();
    let gap = [(first.clone(), 0.03)].into();
    let armature = [(first.clone(), 0.2)].into();
    let found = diagnosed(&[Effect::Backlash(Backlash { gap }), Effect::Armature(Armature { armature })], &rub);
    let mut kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["armature", "backlash"], "{:#?}", found.effects);
    assert!(found.effects.iter().all(|e| e.joints == std::slice::from_ref(&first)), "{:#?}", found.effects);
    assert_eq!(found.verdict, Verdict::PartlyExplained);
    assert!(laws(&found).contains(&"rub"), "{:?}", laws(&found));
}

/// What a delay leaves beside a drag is noise alone, in which a third of the rows says little of a delay.
#[test]
#[ignore = "missed since the competition on one score: issue 23"]
fn a_short_delay_is_found_beside_a_drag_in_noise() {
    let sensors = Sensors { position_noise: 1e-5, effort_noise: 5e-3, ..Sensors::default() };
    let found = diagnosed_with(&[Effect::ActuationDelay(ActuationDelay { delay: 0.003 })], &drag, sensors);
    assert_eq!(found.verdict, Verdict::PartlyExplained, "{:#?}", found.effects);
    let [late] = found.effects.as_slice() else { panic!("{:#?}", found.effects) };
    // In this noise a lag as short is as likely.
    let named = |kind: &str| late.kind == kind || late.indistinguishable_from.iter().any(|other| other == kind);
    assert!(named("actuation_delay"), "{late:#?}");
    assert_eq!(laws(&found), ["link_drag"]);
}
