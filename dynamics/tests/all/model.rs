//! What a model refuses, and inertias.

use crate::common;

use common::{Draw, assert_close};
use gapscope_dynamics::{Inertia, Joint, Model, ModelError, Placement};
use glam::{DMat3, DVec3};

fn build(change: impl FnOnce(&mut Vec<Joint>)) -> Result<Model, ModelError> {
    let mut joints = Draw::new(4).tree(4).joints().to_vec();
    change(&mut joints);
    Model::new("arm".into(), "base".into(), joints)
}

#[test]
fn a_model_refuses_what_cannot_be_computed_with() {
    assert!(build(|_| ()).is_ok());
    assert!(matches!(build(|j| j[1].parent = Some(1)), Err(ModelError::Order { index: 1, parent: 1, .. })));
    assert!(matches!(build(|j| j[1].parent = Some(9)), Err(ModelError::Order { .. })));
    assert!(matches!(build(|j| j[2].axis *= 2.0), Err(ModelError::Axis { .. })));
    assert!(matches!(build(|j| j[2].axis = DVec3::NAN), Err(ModelError::NotFinite { what: "the axis", .. })));
    assert!(matches!(build(|j| j[2].placement.rotation *= 1.1), Err(ModelError::Rotation { .. })));
    assert!(matches!(build(|j| j[2].placement.rotation.x_axis *= -1.0), Err(ModelError::Rotation { .. })));
    assert!(matches!(build(|j| j[0].inertia.mass = f64::INFINITY), Err(ModelError::NotFinite { .. })));
    assert!(matches!(build(|j| j[0].name = j[3].name.clone()), Err(ModelError::Duplicate { what: "joint", .. })));
    assert!(matches!(build(|j| j[0].link = j[3].link.clone()), Err(ModelError::Duplicate { what: "link", .. })));
    assert!(matches!(build(|j| j[0].link = "base".into()), Err(ModelError::Duplicate { what: "link", .. })));
}

#[test]
fn a_model_without_joints_is_one() {
    let model = Model::new("post".into(), "base".into(), Vec::new()).unwrap();
    let mut data = gapscope_dynamics::Data::new(&model);
    model.inverse_dynamics(&mut data, &[], &[], &[], &mut []);
    model.forward_dynamics(&mut data, &[], &[], &[], &mut []);
    assert_eq!(model.kinetic_energy(&mut data, &[], &[]), 0.0);
    assert_eq!(gapscope_dynamics::base_parameters(&model, 1).rank(), 0);
}

#[test]
fn joints_are_found_by_name() {
    let model = build(|_| ()).unwrap();
    assert_eq!(model.joint_index("joint2"), Some(2));
    assert_eq!(model.joint_index("link2"), None);
    assert_eq!(model.dof(), 4);
}

#[test]
fn parameters_go_there_and_back() {
    let inertia = Draw::new(1).inertia();
    let back = Inertia::from_parameters(&inertia.parameters());
    assert_eq!(inertia.parameters(), back.parameters());
}

#[test]
fn a_moved_inertia_is_that_of_the_moved_points() {
    let mut draw = Draw::new(2);
    let placement = Placement { rotation: draw.rotation(), translation: draw.vector(1.0) };
    let (mut here, mut there) = (Inertia::ZERO, Inertia::ZERO);
    for _ in 0..6 {
        let (mass, at) = (1.0 + draw.uniform(0.9), draw.vector(1.0));
        here = here.add(&Inertia::from_com(mass, at, DMat3::ZERO));
        there = there.add(&Inertia::from_com(mass, placement.transform_point(at), DMat3::ZERO));
    }
    assert_close(&here.transform(&placement).parameters(), &there.parameters(), 1e-14);
    assert_close(&there.transform(&placement.inverse()).parameters(), &here.parameters(), 1e-14);
}

#[test]
fn physical_inertias_are_told_from_others() {
    let mut draw = Draw::new(3);
    for _ in 0..100 {
        assert!(draw.inertia().is_physical());
    }
    let com = DVec3::new(0.1, -0.2, 0.3);
    let diagonal = |x, y, z| DMat3::from_diagonal(DVec3::new(x, y, z));
    assert!(Inertia::ZERO.is_physical());
    assert!(Inertia::from_com(1.0, com, DMat3::ZERO).is_physical(), "a point");
    assert!(Inertia::from_com(1.0, com, diagonal(1.0, 1.0, 0.0)).is_physical(), "a thin rod");
    assert!(Inertia::from_com(1.0, com, diagonal(1.0, 1.0, 2.0)).is_physical(), "a thin disc");
    assert!(!Inertia::from_com(1.0, com, diagonal(1.0, 1.0, 2.01)).is_physical(), "beyond the triangle");
    assert!(!Inertia::from_com(1.0, com, diagonal(-0.1, 1.0, 1.0)).is_physical());
    assert!(!Inertia::from_com(-1.0, com, diagonal(1.0, 1.0, 1.0)).is_physical());
    assert!(!Inertia { mass: f64::NAN, ..draw.inertia() }.is_physical());
    let light = Inertia { mass: 0.0, first_moment: com, rotational: DMat3::IDENTITY };
    assert!(!light.is_physical());
}
