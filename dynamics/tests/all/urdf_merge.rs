//! Links merged across fixed joints, joints held, and the order of joints, on examples worked out by hand.

use gapscope_dynamics::{JointKind, Model, UrdfError};
use glam::{DMat3, DVec3};

/// A link of given mass and centre of mass, with inertia diag(1, 2, 2.5)/100 about it, turned by `rpy`.
fn link(name: &str, mass: f64, com: &str, rpy: &str) -> String {
    format!(
        "<link name='{name}'><inertial><origin xyz='{com}' rpy='{rpy}'/><mass value='{mass}'/>\
         <inertia ixx='0.01' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.025'/></inertial></link>"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, origin: &str, more: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><origin {origin}/><parent link='{parent}'/><child link='{child}'/>\
         <axis xyz='0 0 1'/><limit lower='-3' upper='3' velocity='1' effort='1'/>{more}</joint>"
    )
}

fn robot(parts: &[String]) -> String {
    format!("<robot name='r'>{}</robot>", parts.concat())
}

/// An arm with a bracket fixed to it (a quarter turn about z) and a sensor fixed to the bracket (a quarter turn about x).
fn bracketed() -> String {
    robot(&[
        "<link name='base'/>".into(),
        link("arm", 2.0, "0 0 0.5", "0 0 0"),
        link("bracket", 1.0, "0.1 0 0", "0 0 0"),
        link("sensor", 0.5, "0 0.2 0", "0 0 1.5707963267948966"),
        joint("hinge", "revolute", "base", "arm", "xyz='0 0 1'", ""),
        joint("b", "fixed", "arm", "bracket", "xyz='0.3 0 1' rpy='0 0 1.5707963267948966'", ""),
        joint("s", "fixed", "bracket", "sensor", "xyz='0 0 0.4' rpy='1.5707963267948966 0 0'", ""),
    ])
}

fn close(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < 1e-14
}

#[test]
fn fixed_links_are_merged_exactly() {
    let loaded = Model::from_urdf(&bracketed()).unwrap();
    assert!(loaded.findings.is_empty());
    assert_eq!(loaded.model.dof(), 1);
    let body = loaded.model.joints()[0].inertia;
    assert!((body.mass - 3.5).abs() < 1e-15);
    // Centres of mass in the arm's frame, by hand: the bracket's x is y there; the sensor's y is z there.
    let centres = [DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.3, 0.1, 1.0), DVec3::new(0.3, 0.0, 1.6)];
    let masses = [2.0, 1.0, 0.5];
    // Inertias in the arm's axes. Bracket: x and y change places. Sensor: inertial x is sensor y is bracket z is arm z;
    // inertial y is minus sensor x, bracket x, arm y; inertial z is sensor z, minus bracket y, arm x.
    let principal = [DVec3::new(0.01, 0.02, 0.025), DVec3::new(0.02, 0.01, 0.025), DVec3::new(0.025, 0.02, 0.01)];
    let (mut moment, mut rotational) = (DVec3::ZERO, DMat3::ZERO);
    for ((mass, c), inertia) in masses.into_iter().zip(centres).zip(principal) {
        moment += mass * c;
        let cross = DMat3::from_cols(c * c.x, c * c.y, c * c.z);
        rotational += DMat3::from_diagonal(inertia) + (DMat3::IDENTITY * c.length_squared() - cross) * mass;
    }
    assert!(close(body.first_moment, moment), "{} {moment}", body.first_moment);
    assert!((body.rotational - rotational).to_cols_array().iter().all(|x| x.abs() < 1e-14), "{}", body.rotational);
    assert_eq!(body.rotational, body.rotational.transpose());
}

#[test]
fn merged_links_keep_name_and_place() {
    let loaded = Model::from_urdf(&bracketed()).unwrap();
    let names: Vec<_> = loaded.links.iter().map(|link| (link.name.as_str(), link.joint)).collect();
    assert_eq!(names, [("base", None), ("arm", Some(0)), ("bracket", Some(0)), ("sensor", Some(0))]);
    let sensor = loaded.link("sensor").unwrap().placement;
    assert!(close(sensor.translation, DVec3::new(0.3, 0.0, 1.4)));
    assert!(close(sensor.rotation.y_axis, DVec3::Z));
    assert!(loaded.link("tool").is_none());
}

#[test]
fn joints_come_depth_first_in_document_order() {
    let names = ["left", "right", "left_tip", "right_tip"];
    let links = names.map(|name| link(&format!("l_{name}"), 1.0, "0.1 0 0", "0 0 0"));
    let xml = robot(&[
        // The tips first: a child before its parent in the document.
        joint("right_tip", "prismatic", "l_right", "l_right_tip", "xyz='0 0 0'", ""),
        joint("left_tip", "continuous", "l_left", "l_left_tip", "xyz='0 0 0'", ""),
        links.concat(),
        joint("left", "revolute", "mount", "l_left", "xyz='0 1 0'", ""),
        joint("right", "revolute", "mount", "l_right", "xyz='0 -1 0'", ""),
        joint("m", "fixed", "base", "mount", "xyz='0 0 2' rpy='0 0 3.141592653589793'", ""),
        "<link name='base'/><link name='mount'/>".into(),
    ]);
    let model = Model::from_urdf(&xml).unwrap().model;
    let order: Vec<_> = model.joints().iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
    assert_eq!(order, [("left", None), ("left_tip", Some(0)), ("right", None), ("right_tip", Some(2))]);
    assert!(close(model.joints()[0].placement.translation, DVec3::new(0.0, -1.0, 2.0)));
    let kinds: Vec<_> = model.joints().iter().map(|joint| joint.kind).collect();
    assert_eq!(kinds, [JointKind::Revolute, JointKind::Continuous, JointKind::Revolute, JointKind::Prismatic]);
}

#[test]
fn angles_are_roll_pitch_yaw_about_fixed_axes() {
    let turned = bracketed().replace("origin xyz='0 0 1'", "origin rpy='0 1.5707963267948966 1.5707963267948966'");
    let rotation = Model::from_urdf(&turned).unwrap().model.joints()[0].placement.rotation;
    // Pitch carries x to -z, which yaw leaves there; z to x, which yaw carries to y.
    assert!(close(rotation.x_axis, -DVec3::Z) && close(rotation.z_axis, DVec3::Y), "{rotation}");
    let turned = bracketed().replace("origin xyz='0 0 1'", "origin rpy='1.5707963267948966 1.5707963267948966 0'");
    let rotation = Model::from_urdf(&turned).unwrap().model.joints()[0].placement.rotation;
    // Roll carries y to z, and pitch that to x.
    assert!(close(rotation.y_axis, DVec3::X), "{rotation}");
}

#[test]
fn locked_joints_are_fixed_at_zero() {
    let open = bracketed().replace("name='s' type='fixed'", "name='s' type='revolute'");
    assert_eq!(Model::from_urdf(&open).unwrap().model.dof(), 2);
    let locked = Model::from_urdf_locking(&open, &["s"]).unwrap();
    let fixed = Model::from_urdf(&bracketed()).unwrap();
    assert_eq!(locked.model.joints(), fixed.model.joints());
    assert_eq!(locked.links, fixed.links);
    assert!(locked.findings.is_empty());
}

#[test]
fn locking_is_checked() {
    let error = Model::from_urdf_locking(&bracketed(), &["hing"]).unwrap_err();
    assert_eq!(error, UrdfError::UnknownLocked { joint: "hing".into(), known: vec!["hinge".into()] });
    assert_eq!(Model::from_urdf_locking(&bracketed(), &["hinge"]).unwrap_err(), UrdfError::NothingMoves);
    // Zero outside the limits: held there, with a finding.
    let open = bracketed().replace("name='s' type='fixed'", "name='s' type='revolute'");
    let (head, tail) = open.split_at(open.find("name='s'").unwrap());
    let loaded =
        Model::from_urdf_locking(&format!("{head}{}", tail.replace("lower='-3'", "lower='1'")), &["s"]).unwrap();
    let [finding] = loaded.findings.as_slice() else { panic!("{:?}", loaded.findings) };
    assert!(finding.to_string().contains("joint `s`: is held at 0, outside its limits 1 to 3"), "{finding}");
}

/// A gripper: `thumb` leads, `finger` follows it, `tip` follows the finger.
fn gripper(thumb: &str) -> String {
    robot(&[
        "<link name='base'/>".into(),
        ["arm", "l_thumb", "l_finger", "l_tip"].map(|name| link(name, 1.0, "0.1 0 0", "0 0 0")).concat(),
        joint("hinge", "revolute", "base", "arm", "xyz='0 0 0'", ""),
        joint(
            "tip",
            "prismatic",
            "l_finger",
            "l_tip",
            "xyz='1 0 0'",
            "<mimic joint='finger' multiplier='-2' offset='1.25'/>",
        ),
        joint("finger", "revolute", "arm", "l_finger", "xyz='0 0 0'", "<mimic joint='thumb' offset='0.5'/>"),
        joint("thumb", thumb, "arm", "l_thumb", "xyz='0 0 0'", ""),
    ])
}

#[test]
fn followers_of_a_held_joint_are_held_at_their_offset() {
    let error = Model::from_urdf(&gripper("revolute")).unwrap_err();
    assert!(matches!(error, UrdfError::Mimic { followers } if followers.len() == 2));
    let locked = Model::from_urdf_locking(&gripper("revolute"), &["thumb"]).unwrap();
    let fixed = Model::from_urdf(&gripper("fixed")).unwrap();
    for loaded in [locked, fixed] {
        assert_eq!(loaded.model.dof(), 1);
        let finger = loaded.link("l_finger").unwrap().placement;
        assert!(close(finger.rotation.x_axis, DVec3::new(0.5_f64.cos(), 0.5_f64.sin(), 0.0)));
        // The tip: 1 along the finger, then -2 · 0.5 + 1.25 along z.
        let tip = loaded.link("l_tip").unwrap().placement;
        assert!(close(tip.translation, finger.rotation.x_axis + 0.25 * DVec3::Z));
        assert!(close(tip.rotation.x_axis, finger.rotation.x_axis));
    }
}

#[test]
fn followers_that_go_round_in_circles_are_refused() {
    let xml = gripper("revolute").replace("<mimic joint='thumb' offset='0.5'/>", "<mimic joint='tip'/>");
    let error = Model::from_urdf(&xml).unwrap_err();
    assert!(error.to_string().contains("`tip` follows `finger`, `finger` follows `tip`"), "{error}");
    let held = Model::from_urdf_locking(&xml, &["finger", "tip"]).unwrap();
    assert_eq!(held.model.dof(), 2);
}
