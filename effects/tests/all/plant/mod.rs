//! The plant against laws written out a second time, and the physics that any robot keeps to.

mod alike;
mod energy;
mod errors;
mod inverse;
mod order;
mod repeat;
mod rest;

use crate::common;

use common::{
    Draw, Reference, assert_close, between, calm_tree, delta, heavier_link, is_dry, moving_state, on_all, one_of_each,
    payload, robot, rubbing, with_body,
};
use gapscope_dynamics::{Data, Discrete, Inertia, Integrator, Joint, JointKind, Limits, Model, Placement, StepModel};
use gapscope_effects::{
    Armature, CoulombFriction, Effect, EffectError, GravityMisalignment, JointCoupling, Kind, LinkInertiaError,
    ParallelSpring, Payload, Plant, TorqueBias, TorqueGainError, ViscousFriction,
};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

fn coulomb(values: BTreeMap<String, f64>) -> Effect {
    Effect::CoulombFriction(CoulombFriction { coulomb: values })
}

/// State after `steps` steps under a held effort.
fn run(plant: &mut impl StepModel, q: &[f64], v: &[f64], tau: &[f64], steps: usize) -> Vec<f64> {
    let mut x = vec![0.0; plant.state_len()];
    plant.start(q, v, &mut x);
    for _ in 0..steps {
        plant.step(&mut x, tau);
    }
    x
}

/// Acceleration at which the plant's residual is zero; the residual is affine in it.
fn inverse_acceleration(plant: &mut Plant, q: &[f64], v: &[f64], tau: &[f64], still: &[f64]) -> Vec<f64> {
    let n = q.len();
    let mut at = |a: &[f64]| {
        let mut rest = vec![0.0; n];
        plant.residual(q, v, a, tau, still, &mut rest);
        DVector::from_vec(rest)
    };
    let rest = at(&vec![0.0; n]);
    let columns: Vec<DVector<f64>> = (0..n)
        .map(|j| {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            &rest - at(&unit)
        })
        .collect();
    DMatrix::from_columns(&columns).lu().solve(&rest).unwrap().as_slice().to_vec()
}

/// A mass of 2 kg that slides on a level rail.
fn slider() -> Model {
    let joint = Joint {
        name: "rail".into(),
        link: "block".into(),
        parent: None,
        kind: JointKind::Prismatic,
        placement: Placement::IDENTITY,
        axis: DVec3::X,
        inertia: Inertia::from_com(2.0, DVec3::ZERO, DMat3::IDENTITY * 0.01),
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
    };
    Model::new("slider".into(), "base".into(), vec![joint]).unwrap()
}

fn trees() -> impl Iterator<Item = (Model, Draw)> {
    (0..10).map(|seed| {
        let mut draw = Draw::new(seed);
        let tree = draw.tree(1 + seed as usize % 6);
        (rubbing(&mut draw, &tree), draw)
    })
}
