//! Robots and effects for tests.
#![allow(dead_code, clippy::unwrap_used)]

use gapscope_dynamics::{Inertia, Joint, JointKind, Limits, Model, Placement, StepModel};
use gapscope_effects::*;
use glam::{DMat3, DVec3};
use std::collections::BTreeMap;

/// Step of a log at 500 Hz, s.
pub const DT: f64 = 0.002;

/// A hinge about the vertical, without gravity torque, of this inertia.
pub fn hinge(inertia: f64) -> Model {
    let joint = Joint {
        name: "joint1".into(),
        link: "link1".into(),
        parent: None,
        kind: JointKind::Revolute,
        placement: Placement::IDENTITY,
        axis: DVec3::Z,
        inertia: Inertia::from_com(1.0, DVec3::ZERO, DMat3::IDENTITY * inertia),
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
    };
    Model::new("hinge".into(), "base".into(), vec![joint]).unwrap()
}

/// Signals from the start of a log in which nothing pushes, gears loaded by the nominal torque; `[q, v, a, τ, nominal τ]`.
pub fn motion<'a>(model: &'a Model, signals: [&'a [Vec<f64>]; 5], dt: f64, standstill: &'a [f64]) -> Motion<'a> {
    let [q, v, a, tau, nominal] = signals;
    Motion {
        model,
        bodies: model,
        q,
        v,
        a,
        tau,
        nominal,
        load: nominal,
        taken: nominal,
        drives: &[],
        effort_noise: &[],
        held: None,
        dt,
        start: 0.0,
        pushed: &[],
        standstill,
    }
}

/// A value on the hinge.
pub fn one(value: f64) -> BTreeMap<String, f64> {
    [("joint1".to_owned(), value)].into()
}

/// A plant with its state, at rest at zero.
pub struct Run {
    pub plant: Plant,
    pub x: Vec<f64>,
}

impl Run {
    pub fn new(model: &Model, effects: &[Effect], dt: f64) -> Run {
        let plant = Plant::new(model, effects, dt).unwrap();
        let mut x = vec![0.0; plant.state_len()];
        let zero = vec![0.0; model.dof()];
        plant.start(&zero, &zero, &mut x);
        Run { plant, x }
    }

    pub fn step(&mut self, tau: &[f64]) {
        self.plant.step(&mut self.x, tau);
    }
}

/// One of each kind on a joint, in the order of the catalogue.
pub fn all(joint: &str) -> Vec<Effect> {
    let on = |value: f64| BTreeMap::from([(joint.to_owned(), value)]);
    vec![
        Effect::ViscousFriction(ViscousFriction { viscous: on(0.5) }),
        Effect::CoulombFriction(CoulombFriction { coulomb: on(0.4) }),
        Effect::StribeckFriction(StribeckFriction { coulomb: on(0.3), r#static: on(0.5), stribeck_velocity: on(0.1) }),
        Effect::LoadDependentFriction(LoadDependentFriction { load_coefficient: on(0.1) }),
        Effect::PreslidingFriction(PreslidingFriction { coulomb: on(0.3), bristle_stiffness: on(30.0) }),
        Effect::ThermalDrift(ThermalDrift { coulomb: on(0.4), ratio: on(0.5), time_constant: on(5.0) }),
        Effect::Payload(Payload {
            joint: joint.to_owned(),
            mass: 0.3,
            com: [0.01, 0.0, 0.05],
            inertia: [0.001, 0.0, 0.001, 0.0, 0.0, 0.001],
        }),
        Effect::LinkInertiaError(LinkInertiaError {
            joint: joint.to_owned(),
            mass_delta: 0.1,
            first_moment_delta: [0.0, 0.0, -0.01],
            inertia_delta: [0.002, 0.0, 0.002, 0.0, 0.0, 0.002],
        }),
        Effect::Armature(Armature { armature: on(0.2) }),
        Effect::GravityMisalignment(GravityMisalignment { roll: 0.03, pitch: -0.02 }),
        Effect::TorqueGainError(TorqueGainError { gain: on(0.9) }),
        Effect::TorqueBias(TorqueBias { bias: on(0.2) }),
        Effect::ActuationDelay(ActuationDelay { delay: 0.0053 }),
        Effect::ActuatorLag(ActuatorLag { time_constant: 0.004 }),
        Effect::TorqueSaturation(TorqueSaturation { limit: on(100.0) }),
        Effect::TorqueRipple(TorqueRipple { amplitude: on(0.3), cycles: on(12.0), phase: on(0.5) }),
        Effect::JointElasticity(JointElasticity { stiffness: on(8000.0), damping: on(10.0) }),
        Effect::Backlash(Backlash { gap: on(0.02) }),
        Effect::ParallelSpring(ParallelSpring { stiffness: on(5.0), rest_position: on(0.1) }),
        Effect::JointZeroOffset(JointZeroOffset { offset: on(0.05) }),
        Effect::ExternalContact(ExternalContact {
            link: joint.to_owned(),
            intervals: vec![[1.0, 1.5], [3.0, 4.25]],
            force: [5.0, -3.0, 4.0],
            offset: [0.01, -0.02, 0.03],
        }),
        Effect::JointCoupling(JointCoupling {
            joints: [joint.to_owned(), "joint2".to_owned()],
            ratio: -1.0,
            coulomb: 0.2,
            viscous: 0.1,
            armature: 0.01,
        }),
    ]
}
