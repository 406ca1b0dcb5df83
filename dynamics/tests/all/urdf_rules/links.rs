//! Links: mass, inertia, and that what moves can be moved.

use super::{INERTIAL, arm, found, load, plus, refused, with};

#[test]
fn negative_mass_is_refused() {
    refused(&with("value=\"2\"", "value=\"-2\""), &["link `upper`", "line 3", "-2 kg", "sign"]);
}

#[test]
fn numbers_that_are_none_are_refused() {
    for bad in ["nan", "inf", "1e400", "", " ", "2 kg", "2,5", "two"] {
        refused(&with("value=\"2\"", &format!("value=\"{bad}\"")), &["link `upper`", bad, "finite number"]);
    }
    for bad in ["nan", "1 2", ""] {
        refused(&with("ixx=\"0.02\"", &format!("ixx=\"{bad}\"")), &["link `upper`", "<inertia> ixx"]);
    }
    for bad in ["0 0", "0 0 0 0", "0 0 0.3 m", "0 nan 0", "0 0 1e999", "a b c", "0,0,0.3"] {
        refused(&with("xyz=\"0 0 0.3\"", &format!("xyz=\"{bad}\"")), &["joint `elbow`", "line 6", bad, "three finite"]);
    }
    refused(&with("rpy=\"0 0 0\"", "rpy=\"0 0 x\""), &["joint `elbow`", "<origin> rpy"]);
    refused(&with("axis xyz=\"0 1 0\"", "axis xyz=\"0 1\""), &["joint `shoulder`", "<axis> xyz"]);
    refused(&with("lower=\"-1\"", "lower=\"-1 rad\""), &["joint `shoulder`", "<limit> lower"]);
    refused(&with("</joint>", r#"<dynamics damping="x"/></joint>"#), &["joint `shoulder`", "<dynamics> damping"]);
}

#[test]
fn sums_that_overflow_are_refused() {
    // Two steps of 1e308 m across fixed joints, on the base and on a moved link.
    let step = |parent, child| {
        format!(
            "<link name='{child}'/><joint name='{child}' type='fixed'><origin xyz='0 0 1e308'/><parent link='{parent}'/><child link='{child}'/></joint>"
        )
    };
    for root in ["base", "lower"] {
        load(&plus(&step(root, "a")));
        refused(&plus(&format!("{}{}", step(root, "a"), step("a", "b"))), &["link `b`", "64-bit"]);
    }
    refused(&with("value=\"2\"", "value=\"1e308\"").replace("0 0 0.1", "0 0 1e200"), &["link `upper`", "64-bit"]);
}

#[test]
fn unphysical_inertia_is_found_or_refused() {
    let negative = ["link `upper`", "principal moments", "below 0"];
    refused(&with("ixx=\"0.02\"", "ixx=\"-0.02\""), &negative);
    refused(&with("ixy=\"0\"", "ixy=\"0.03\""), &negative);
    found(&with("ixx=\"0.02\"", "ixx=\"0.04\""), "link `upper`", &["exceeds the sum"]);
    found(
        &with("ixx=\"0.02\"", "ixx=\"-1e-10\"").replacen("iyy=\"0.02\"", "iyy=\"0.01\"", 1),
        "link `upper`",
        &["slightly negative"],
    );
    // Equality, a rod or a disc, and rounding in the sixth digit are nothing to find.
    assert!(load(&with("izz=\"0.01\"", "izz=\"0\"")).findings.is_empty());
    assert!(load(&with("izz=\"0.01\"", "izz=\"0.04000001\"")).findings.is_empty());
}

#[test]
fn a_negative_moment_that_does_not_move_or_is_outweighed_is_found() {
    let odd = r#"<inertial><mass value="1e-6"/><inertia ixx="-4e-8" ixy="0" ixz="0" iyy="9e-8" iyz="0" izz="9e-8"/></inertial>"#;
    found(&with("<link name=\"base\"/>", &format!("<link name=\"base\">{odd}</link>")), "link `base`", &["negative"]);
    let antenna = format!(
        "<link name='antenna'>{odd}</link><joint name='a' type='fixed'><parent link='upper'/><child link='antenna'/></joint>"
    );
    found(&plus(&antenna), "link `antenna`", &["negative"]);
}

#[test]
fn parts_of_an_inertial_that_are_missing() {
    refused(&with("<mass value=\"2\"/>", ""), &["link `upper`", "no <mass>"]);
    refused(&with("<mass value=\"2\"/>", "<mass/>"), &["link `upper`", "no value in its <mass>"]);
    refused(&with("ixx=\"0.02\" ", ""), &["link `upper`", "ixx"]);
    let point = r#"<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/>"#;
    let loaded = found(&with(point, ""), "link `upper`", &["point mass"]);
    assert!((loaded.model.joints()[0].inertia.rotational.x_axis.x - 0.02).abs() < 1e-15);
    found(&with("ixy=\"0\" ixz=\"0\" ", ""), "link `upper`", &["ixy, ixz", "read as 0"]);
    found(&with("value=\"2\"", "value=\"0\""), "link `upper`", &["inertia but mass 0"]);
}

#[test]
fn a_moved_link_without_inertial_is_found() {
    let loaded = found(&with(INERTIAL, ""), "link `upper`", &["no <inertial>", "massless"]);
    assert_eq!(loaded.model.joints()[0].inertia.mass, 0.0);
    // Carried by what is fixed to it: said with the mass.
    let tool = format!(
        "<link name='t'>{INERTIAL}</link><joint name='t' type='fixed'><parent link='upper'/><child link='t'/></joint>"
    );
    found(&with(INERTIAL, "").replace("</robot>", &format!("{tool}</robot>")), "link `upper`", &["bring 2 kg"]);
    // A frame behind a fixed joint needs none.
    assert!(
        load(&plus("<link name='f'/><joint name='f' type='fixed'><parent link='lower'/><child link='f'/></joint>"))
            .findings
            .is_empty()
    );
}

#[test]
fn nothing_to_move_is_refused_or_found() {
    let bare = arm().replace(INERTIAL, "");
    refused(&bare, &["joint `shoulder`", "nothing to move", "singular"]);
    let last = format!("<link name='lower'>{INERTIAL}</link>").replace('\'', "\"");
    refused(&with(&last, "<link name=\"lower\"/>"), &["joint `elbow`", "link `lower`", "mass matrix is singular"]);
    // Inertia that the axis does not feel, without mass.
    let across =
        r#"<inertial><mass value="0"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0" iyz="0" izz="0.1"/></inertial>"#;
    refused(&with(&last, &format!("<link name=\"lower\">{across}</link>")), &["joint `elbow`", "about its axis"]);
    let slider = with(&last, &format!("<link name=\"lower\">{across}</link>"))
        .replace("name=\"elbow\" type=\"revolute\"", "name=\"elbow\" type=\"prismatic\"");
    refused(&slider, &["joint `elbow`", "no mass"]);
    // Mass on the axis: torque can be computed, acceleration cannot (the Stäubli TX40's last link, rounded, is so).
    let on_axis =
        r#"<inertial><mass value="0.2"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>"#;
    found(
        &with(&last, &format!("<link name=\"lower\">{on_axis}</link>")),
        "joint `elbow`",
        &["singular in every position", "rotor"],
    );
    // Inertia without mass moves, but is odd.
    let massless = load(&with(&last, &last.replace("value=\"2\"", "value=\"0\"")));
    let about: Vec<_> = massless.findings.iter().map(|f| f.about.as_str()).collect();
    assert_eq!(about, ["link `lower`", "joint `elbow`"]);
}
