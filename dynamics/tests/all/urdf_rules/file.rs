//! The file as a whole: that it is URDF, what is not read, and how large it may be.

use super::{INERTIAL, LIMIT, arm, found, load, plus, refused, with};
use gapscope_dynamics::{Finding, JointKind};
use glam::DVec3;

#[test]
fn a_clean_file_has_no_findings() {
    let loaded = load(&arm());
    assert_eq!(loaded.findings, Vec::<Finding>::new());
    let model = loaded.model;
    assert_eq!((model.name(), model.base(), model.dof()), ("arm", "base", 2));
    let elbow = &model.joints()[1];
    assert_eq!((elbow.name.as_str(), elbow.link.as_str(), elbow.parent), ("elbow", "lower", Some(0)));
    assert_eq!(elbow.kind, JointKind::Revolute);
    assert_eq!(elbow.placement.translation, DVec3::new(0.0, 0.0, 0.3));
    assert_eq!(elbow.axis, DVec3::Y);
    let limits = elbow.limits;
    assert_eq!(
        (limits.lower, limits.upper, limits.velocity, limits.effort),
        (Some(-1.0), Some(1.0), Some(2.0), Some(3.0))
    );
    assert_eq!((elbow.damping, elbow.friction), (0.0, 0.0));
    assert_eq!(elbow.inertia.mass, 2.0);
    assert_eq!(elbow.inertia.first_moment, DVec3::new(0.0, 0.0, 0.2));
    assert!((elbow.inertia.rotational.x_axis.x - (0.02 + 2.0 * 0.1 * 0.1)).abs() < 1e-15);
}

#[test]
fn text_that_is_no_urdf_is_refused() {
    refused("", &["well-formed XML"]);
    refused("<robot name='a'><link></robot>", &["well-formed XML", "1:"]);
    refused("<mujoco/>", &["<mujoco>", "<robot>", "MJCF"]);
    refused("<robot name='a'/>", &["no <link>"]);
    refused("<robot name='a'><link name='a'/></robot>", &["no joint that moves"]);
    let xacro =
        with("<robot name=\"arm\">", "<robot name=\"arm\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:arm/>");
    refused(&xacro, &["<xacro:arm>", "expand"]);
    refused(&with("value=\"2\"", "value=\"${m}\""), &["${m}", "xacro"]);
}

#[test]
fn a_nameless_robot_is_named() {
    for name in ["", " name=\"\"", " name=\" \""] {
        let loaded = found(&with(" name=\"arm\"", name), "<robot>", &["no name"]);
        assert_eq!(loaded.model.name(), "robot");
    }
}

#[test]
fn fields_that_are_not_read_are_listed_by_kind() {
    let visual = "<visual><geometry><teapot/></geometry></visual>";
    let xml = with(INERTIAL, &format!("{visual}{visual}{INERTIAL}<collision/>"))
        .replacen(
            "</joint>",
            "<safety_controller k_velocity='1'/><calibration rising='0'/><dynamics damping='0' spring='1'/></joint>",
            1,
        )
        .replace("</robot>", "<transmission name='t'/><gazebo/><gazebo/><ros2_control/></robot>");
    let findings: Vec<String> = load(&xml).findings.iter().map(|finding| finding.about.clone()).collect();
    let kinds = [
        "<calibration>",
        "<collision>",
        "<dynamics spring>",
        "<gazebo>",
        "<ros2_control>",
        "<safety_controller>",
        "<transmission>",
        "<visual>",
    ];
    assert_eq!(findings, kinds);
    let loaded = load(&xml);
    assert!(loaded.findings[7].message.starts_with("2 not read"));
    assert!(loaded.findings[3].message.contains("springs"));
}

#[test]
fn elements_of_other_namespaces_are_not_urdf() {
    let xml = with("<robot ", "<robot xmlns:drake=\"http://drake.mit.edu\" ")
        .replace("</robot>", "<drake:joint name='x'/></robot>");
    found(&xml, "<joint>", &["1 not read"]);
    assert!(load(&with("<robot ", "<robot xmlns=\"http://www.ros.org\" ")).findings.is_empty());
    let attribute = with("<robot ", "<robot xmlns:d=\"d\" ").replacen("<link ", "<link d:name='x' ", 1);
    found(&attribute, "<link name>", &["1 not read"]);
}

#[test]
fn of_two_elements_the_first_counts_and_the_second_is_a_finding() {
    let twice = |first: &str, second: &str| with(first, &format!("{first}{second}"));
    let heavier = INERTIAL.replace("value=\"2\"", "value=\"3\"");
    let about = "link `upper`";
    let loaded = found(&twice(INERTIAL, &heavier), about, &["second <inertial>", "line 3", "the first counts"]);
    assert_eq!(loaded.model.joints()[0].inertia.mass, 2.0);
    let loaded = found(&twice("<mass value=\"2\"/>", "<mass value=\"3\"/>"), about, &["second <mass>"]);
    assert_eq!(loaded.model.joints()[0].inertia.mass, 2.0);
    found(&twice(LIMIT, LIMIT), "joint `shoulder`", &["second <limit>"]);
    let origin = r#"<origin xyz="0 0 1"/>"#;
    let moved = arm().replacen("<parent ", &format!("{origin}<origin xyz=\"0 0 9\"/><parent "), 1);
    let once = arm().replacen("<parent ", &format!("{origin}<parent "), 1);
    let loaded = found(&moved, "joint `shoulder`", &["second <origin>", "the first counts"]);
    assert_eq!(loaded.model.joints()[0].placement, load(&once).model.joints()[0].placement);
}

#[test]
fn awkward_names_pass() {
    let xml = arm().replace("\"upper\"", "\"a &lt;b&gt; &amp; &quot;c&quot; 'd' é ${x}\"");
    assert_eq!(load(&xml).model.joints()[0].link, "a <b> & \"c\" 'd' é ${x}");
}

#[test]
fn too_many_links_are_refused() {
    let many: String = (0..10_001).map(|i| format!("<link name='l{i}'/>")).collect();
    refused(&format!("<robot name='r'>{many}</robot>"), &["10001 links", "at most 10000"]);
}

#[test]
fn deep_and_long_files_do_not_overflow_the_stack() {
    let deep = format!("{}{}", "<a>".repeat(200_000), "</a>".repeat(200_000));
    found(&plus(&deep), "<a>", &["1 not read"]);
    refused(&"<a>".repeat(200_000), &["well-formed"]);
    // As many joints as are read, in one chain, fixed but for the first.
    let mut chain = String::from("<robot name='r'><link name='l0'/>");
    for i in 1..10_000 {
        let (kind, parent) = (if i == 1 { "continuous" } else { "fixed" }, i - 1);
        chain.push_str(&format!("<link name='l{i}'>{INERTIAL}</link><joint name='j{i}' type='{kind}'><parent link='l{parent}'/><child link='l{i}'/><axis xyz='1 0 0'/></joint>"));
    }
    chain.push_str("</robot>");
    let loaded = load(&chain);
    assert_eq!((loaded.model.dof(), loaded.links.len()), (1, 10_000));
    assert!((loaded.model.joints()[0].inertia.mass - 2.0 * 9_999.0).abs() < 1e-6);
}
