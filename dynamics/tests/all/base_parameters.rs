//! Base parameters: known ranks, and torques of the base parameters alone.

use crate::common;

use common::{Draw, assert_close, column};
use gapscope_dynamics::{BaseParameters, Data, Inertia, Joint, JointKind, Limits, Model, Placement, base_parameters};
use glam::{DMat3, DVec3};
use nalgebra::DMatrix;

fn joint(index: usize, kind: JointKind, axis: DVec3, translation: DVec3) -> Joint {
    Joint {
        name: format!("joint{index}"),
        link: format!("link{index}"),
        parent: index.checked_sub(1),
        kind,
        placement: Placement { rotation: DMat3::IDENTITY, translation },
        axis,
        inertia: Inertia::from_com(1.0, DVec3::new(0.1, 0.2, -0.3), DMat3::IDENTITY * 0.02),
        limits: Limits::default(),
        damping: 0.0,
        friction: 0.0,
    }
}

fn rank(joints: Vec<Joint>) -> usize {
    base_parameters(&Model::new("arm".into(), "base".into(), joints).unwrap(), 1).rank()
}

#[test]
fn simple_arms_have_their_known_ranks() {
    let arm = DVec3::new(0.0, 0.0, -0.4);
    let turn = |index, axis| joint(index, JointKind::Revolute, axis, arm);
    // A pendulum: its inertia and two first moments. A turntable: its inertia. A lift: its mass.
    assert_eq!(rank(vec![turn(0, DVec3::Y)]), 3);
    assert_eq!(rank(vec![turn(0, DVec3::Z)]), 1);
    assert_eq!(rank(vec![joint(0, JointKind::Prismatic, DVec3::Z, arm)]), 1);
    // A planar double pendulum: three a link.
    assert_eq!(rank(vec![turn(0, DVec3::Y), turn(1, DVec3::Y)]), 6);
    // A gantry: two masses, of which the first axis moves the sum.
    let slide = |index, axis| joint(index, JointKind::Prismatic, axis, arm);
    assert_eq!(rank(vec![slide(0, DVec3::X), slide(1, DVec3::Z)]), 2);
}

#[test]
fn the_panda_has_43() {
    // Gaz et al. 2019, "Dynamic identification of the Franka Emika Panda robot".
    let model = Model::from_urdf(include_str!("../../robots/arm7.urdf")).unwrap().model;
    assert_eq!(base_parameters(&model, 1).rank(), 43);
}

#[test]
fn base_parameters_give_the_whole_torque() {
    for seed in 0..12 {
        let mut draw = Draw::new(seed);
        let n = 1 + draw.below(7);
        let model = draw.tree(n).with_armature(&vec![0.0; n]);
        let base = base_parameters(&model, seed);
        check(&model, &base, &mut draw);
        assert_eq!(base, base_parameters(&model, seed), "the same seed, the same result");
        assert_eq!(base.rank(), base_parameters(&model, seed + 1).rank());
    }
    let model = Model::from_urdf(include_str!("../../robots/arm6.urdf")).unwrap().model;
    check(&model, &base_parameters(&model, 3), &mut Draw::new(3));
}

fn check(model: &Model, base: &BaseParameters, draw: &mut Draw) {
    let n = model.dof();
    let mut data = Data::new(model);
    let parameters: Vec<f64> = model.joints().iter().flat_map(|joint| joint.inertia.parameters()).collect();
    let combined = base.combine(&parameters);
    let mut regressor = DMatrix::zeros(n, 10 * n);
    let mut tau = vec![0.0; n];
    for _ in 0..5 {
        let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 10.0));
        model.regressor(&mut data, &q, &v, &a, &mut regressor);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        let torque = base.reduce(&regressor) * &combined;
        assert_close(torque.as_slice(), &tau, 1e-10);
        assert_close((&regressor * column(&parameters)).as_slice(), &tau, 1e-10);
    }
}
