//! Joints: axis, limits, friction, orientation, and kinds that the model does not have.

use super::{LIMIT, found, load, plus, refused, with};
use gapscope_dynamics::Model;
use glam::DVec3;

#[test]
fn damping_and_friction_are_read() {
    let loaded = load(&with("</joint>", r#"<dynamics damping="0.5" friction="0.25"/></joint>"#));
    assert_eq!((loaded.model.joints()[0].damping, loaded.model.joints()[0].friction), (0.5, 0.25));
    assert!(loaded.findings.is_empty());
}

#[test]
fn an_axis_must_be_a_direction() {
    let loaded = found(&with("axis xyz=\"0 1 0\"", "axis xyz=\"0 3 4\""), "joint `shoulder`", &["length 5"]);
    assert!((loaded.model.joints()[0].axis - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15);
    assert!(load(&with("axis xyz=\"0 1 0\"", "axis xyz=\"0 0.7071 0.7071\"")).findings.is_empty());
    let huge = load(&with("axis xyz=\"0 1 0\"", "axis xyz=\"0 1e300 0\""));
    assert_eq!(huge.model.joints()[0].axis, DVec3::Y);
    for zero in ["0 0 0", "0 -0 1e-300"] {
        refused(&with("axis xyz=\"0 1 0\"", &format!("axis xyz=\"{zero}\"")), &["joint `shoulder`", "length zero"]);
    }
    let absent = found(&with("<axis xyz=\"0 1 0\"/>", ""), "joint `shoulder`", &["no <axis>", "1 0 0"]);
    assert_eq!(absent.model.joints()[0].axis, DVec3::X);
    refused(&with("<axis xyz=\"0 1 0\"/>", "<axis/>"), &["joint `shoulder`", "no xyz"]);
}

#[test]
fn a_fixed_joint_needs_no_axis() {
    let fixed = |axis| {
        plus(&format!(
            "<link name='f'/><joint name='f' type='fixed'><parent link='lower'/><child link='f'/>{axis}</joint>"
        ))
    };
    assert!(load(&fixed("<axis xyz='0 0 1'/>")).findings.is_empty());
    for axis in ["<axis xyz='0 0 0'/>", "<axis xyz='nan 0 0'/>", "<axis xyz='up'/>"] {
        found(&fixed(axis), "<axis> of a fixed joint", &["1 not read"]);
    }
}

#[test]
fn mimic_is_refused_unless_fixed_or_locked() {
    let mimic = with(LIMIT, &format!("{LIMIT}<mimic joint=\"elbow\" multiplier=\"2\" offset=\"0.5\"/>"));
    refused(&mimic, &["`shoulder` follows `elbow`", "Lock them"]);
    let held = Model::from_urdf_locking(&mimic, &["shoulder"]).unwrap();
    assert_eq!(held.model.dof(), 1);
    assert!(held.findings.is_empty());
    let fixed = plus(
        "<link name='f'/><joint name='f' type='fixed'><parent link='lower'/><child link='f'/><mimic joint='elbow'/></joint>",
    );
    found(&fixed, "<mimic> of a fixed joint", &["1 not read"]);
    refused(&with(LIMIT, &format!("{LIMIT}<mimic/>")), &["joint `shoulder`", "no joint", "<mimic>"]);
}

#[test]
fn joints_of_several_freedoms_are_refused_unless_locked() {
    for kind in ["floating", "planar", "spherical"] {
        let xml = with("type=\"revolute\"", &format!("type=\"{kind}\""));
        refused(&xml, &["joint `shoulder`", kind, "fixed"]);
        assert_eq!(Model::from_urdf_locking(&xml, &["shoulder"]).unwrap().model.dof(), 1);
    }
}

#[test]
fn limits_that_mean_nothing_are_found() {
    let limits = |text: &str, words: &[&str]| {
        let loaded = found(&with(LIMIT, text), "joint `shoulder`", words);
        loaded.model.joints()[0].limits
    };
    let none = limits("", &["no <limit>"]);
    assert_eq!((none.lower, none.upper, none.velocity, none.effort), (None, None, None, None));
    let open = limits(r#"<limit velocity="2" effort="3"/>"#, &["no lower and no upper"]);
    assert_eq!((open.lower, open.upper, open.velocity, open.effort), (None, None, Some(2.0), Some(3.0)));
    let crossed =
        limits(r#"<limit lower="1" upper="-1" velocity="2" effort="3"/>"#, &["lower limit 1", "upper limit -1"]);
    assert_eq!((crossed.lower, crossed.upper), (None, None));
    let negative = limits(r#"<limit lower="-1" upper="1" velocity="-2" effort="3"/>"#, &["velocity limit -2"]);
    assert_eq!((negative.velocity, negative.effort), (None, Some(3.0)));
    let zero = limits(r#"<limit lower="-1" upper="1" velocity="2" effort="0"/>"#, &["effort limit 0"]);
    assert_eq!(zero.effort, None);
    let nan = limits(r#"<limit lower="nan" upper="1" velocity="2" effort="3"/>"#, &["lower limit NaN"]);
    assert_eq!((nan.lower, nan.upper), (None, Some(1.0)));
}

#[test]
fn limits_that_may_be_absent_are_not_found() {
    let endless = load(&with(LIMIT, r#"<limit lower="-inf" upper="inf" velocity="2" effort="1e999"/>"#));
    let limits = endless.model.joints()[0].limits;
    assert_eq!((limits.lower, limits.upper, limits.velocity, limits.effort), (None, None, Some(2.0), None));
    assert!(endless.findings.is_empty());
    let continuous = with("type=\"revolute\"", "type=\"continuous\"");
    assert_eq!(load(&continuous).model.joints()[0].limits.lower, None);
    assert!(load(&continuous.replacen(LIMIT, "", 1)).findings.is_empty());
    let version = with("<robot ", "<robot version=\"1.2\" ").replacen(LIMIT, "", 1);
    assert!(load(&version).findings.is_empty());
}

#[test]
fn negative_damping_and_friction_are_refused() {
    for field in ["damping", "friction"] {
        let xml = with("</joint>", &format!("<dynamics {field}=\"-0.1\"/></joint>"));
        refused(&xml, &["joint `shoulder`", field, "-0.1"]);
    }
}

#[test]
fn quaternions_are_read_from_version_1_1() {
    let turned =
        |robot: &str, origin: &str| with("<robot ", robot).replace(r#"<origin xyz="0 0 0.3" rpy="0 0 0"/>"#, origin);
    let quaternion = r#"<origin xyz="0 0 0.3" quat_xyzw="0 0 1 1"/>"#;
    let loaded = load(&turned("<robot version=\"1.1\" ", quaternion));
    let rotation = loaded.model.joints()[1].placement.rotation;
    assert!((rotation.x_axis - DVec3::Y).length() < 1e-15);
    assert!(loaded.findings.is_empty());
    refused(&turned("<robot ", quaternion), &["joint `elbow`", "quat_xyzw", "rpy"]);
    for bad in ["0 0 0 0", "0 0 1", "nan 0 0 1"] {
        let origin = format!(r#"<origin quat_xyzw="{bad}"/>"#);
        refused(&turned("<robot version=\"1.1\" ", &origin), &["joint `elbow`", bad, "four finite"]);
    }
    let both = r#"<origin rpy="0 0 0" quat_xyzw="0 0 1 1"/>"#;
    refused(&turned("<robot version=\"1.1\" ", both), &["joint `elbow`", "not both"]);
}
