//! Robots for tests.
#![allow(dead_code, clippy::unwrap_used)]

use gapscope_dynamics::{Inertia, Joint, JointKind, Limits, Model, Placement, robots};
use gapscope_effects::{Armature, CoulombFriction, Effect, ViscousFriction};
use glam::{DMat3, DVec3};

pub fn built_in(name: &str) -> Model {
    robots::model(name).unwrap().unwrap().model
}

fn joint(name: &str, parent: Option<usize>, kind: JointKind, axis: DVec3, limits: Limits) -> Joint {
    Joint {
        name: name.into(),
        link: format!("{name}_link"),
        parent,
        kind,
        placement: Placement { rotation: DMat3::IDENTITY, translation: DVec3::new(0.1, 0.0, 0.2) },
        axis,
        inertia: Inertia::from_com(
            2.0,
            DVec3::new(0.05, -0.02, 0.15),
            DMat3::from_diagonal(DVec3::new(0.02, 0.03, 0.025)),
        ),
        limits,
        damping: 0.3,
        friction: 0.2,
    }
}

/// A mass of 2 kg on a vertical rail.
pub fn slider() -> Model {
    let limits = Limits { lower: Some(0.0), upper: Some(0.5), velocity: Some(0.4), effort: Some(40.0) };
    let rail = joint("rail", None, JointKind::Prismatic, DVec3::Z, limits);
    Model::new("slider".into(), "base".into(), vec![rail]).unwrap()
}

/// A continuous joint without limits, behind it two branches: one with limits on one side, one that slides.
pub fn tree() -> Model {
    let one_sided = Limits { upper: Some(0.5), effort: Some(30.0), ..Limits::default() };
    let tight = Limits { lower: Some(-0.1), upper: Some(0.3), velocity: Some(0.2), effort: Some(60.0) };
    let joints = vec![
        joint("turn", None, JointKind::Continuous, DVec3::Z, Limits::default()),
        joint("lift", Some(0), JointKind::Revolute, DVec3::Y, one_sided),
        joint("slide", Some(0), JointKind::Prismatic, DVec3::X, tight),
        joint("wrist", Some(1), JointKind::Revolute, DVec3::X, Limits::default()),
    ];
    Model::new("tree".into(), "base".into(), joints).unwrap()
}

/// A pendulum that its drive cannot hold level.
pub fn weak() -> Model {
    let limits = Limits { lower: Some(-3.0), upper: Some(3.0), velocity: Some(5.0), effort: Some(1.5) };
    let hinge = joint("hinge", None, JointKind::Revolute, DVec3::Y, limits);
    Model::new("weak".into(), "base".into(), vec![hinge]).unwrap()
}

pub fn all() -> Vec<Model> {
    robots::NAMES.iter().map(|name| built_in(name)).chain([slider(), tree(), weak()]).collect()
}

/// What drives of real joints have: Coulomb and viscous friction of a hundredth of the greatest effort, and a rotor.
pub fn drives(model: &Model) -> Vec<Effect> {
    let each = |size: &dyn Fn(f64) -> f64| {
        model.joints().iter().map(|j| (j.name.clone(), size(j.limits.effort.unwrap_or(20.0)))).collect()
    };
    vec![
        Effect::CoulombFriction(CoulombFriction { coulomb: each(&|effort| 0.015 * effort) }),
        Effect::ViscousFriction(ViscousFriction { viscous: each(&|effort| 0.01 * effort) }),
        Effect::Armature(Armature { armature: each(&|effort| 0.004 * effort) }),
    ]
}
