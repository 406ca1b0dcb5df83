//! The tree: names, ends, roots, loops.

use super::{found, load, plus, refused, with};
use gapscope_dynamics::UrdfError;
use glam::DVec3;

#[test]
fn names_are_unique() {
    refused(&with("link name=\"lower\"", "link name=\"upper\""), &["two links", "`upper`", "lines 3 and 4"]);
    refused(&with("joint name=\"elbow\"", "joint name=\"shoulder\""), &["two joints", "`shoulder`", "lines 5 and 6"]);
    // A link and a joint may share a name.
    load(&with("joint name=\"elbow\"", "joint name=\"lower\""));
}

#[test]
fn names_and_ends_are_required() {
    refused(&with("<link name=\"base\"/>", "<link/>"), &["link (line 2)", "no name"]);
    refused(&with("<link name=\"base\"/>", "<link name=\" \"/>"), &["link (line 2)", "no name"]);
    refused(&with("joint name=\"elbow\"", "joint"), &["joint (line 6)", "no name"]);
    refused(&with("type=\"revolute\"", ""), &["joint `shoulder`", "no type"]);
    refused(&with("<parent link=\"base\"/>", ""), &["joint `shoulder`", "no <parent>"]);
    refused(&with("<child link=\"upper\"/>", ""), &["joint `shoulder`", "no <child>"]);
    refused(&with("<child link=\"upper\"/>", "<child/>"), &["joint `shoulder`", "no link", "<child>"]);
    refused(&with("type=\"revolute\"", "type=\"hinge\""), &["joint `shoulder`", "hinge", "revolute, continuous"]);
}

#[test]
fn unknown_links_are_refused() {
    refused(&with("parent link=\"base\"", "parent link=\"bse\""), &["joint `shoulder`", "parent link `bse`"]);
    refused(&with("child link=\"lower\"", "child link=\"lover\""), &["joint `elbow`", "child link `lover`"]);
    // `world` is forgiven only as the parent of a fixed joint.
    refused(&with("parent link=\"base\"", "parent link=\"world\""), &["joint `shoulder`", "`world`"]);
    refused(&plus("<joint name='w' type='fixed'><parent link='map'/><child link='base'/></joint>"), &["`map`"]);
}

#[test]
fn a_world_that_is_not_described_is_the_base() {
    let xml =
        plus("<joint name='weld' type='fixed'><origin xyz='0 0 1'/><parent link='world'/><child link='base'/></joint>");
    let loaded = found(&xml, "joint `weld`", &["`world`", "base"]);
    assert_eq!(loaded.model.base(), "world");
    assert_eq!(loaded.model.joints()[0].placement.translation, DVec3::Z);
    assert_eq!(loaded.link("base").unwrap().placement.translation, DVec3::Z);
}

#[test]
fn the_tree_is_a_tree() {
    let joint = |name, parent, child| {
        format!("<joint name='{name}' type='fixed'><parent link='{parent}'/><child link='{child}'/></joint>")
    };
    refused(&plus(&joint("again", "base", "lower")), &["link `lower`", "`elbow`", "`again`"]);
    refused(&plus(&joint("back", "lower", "base")), &["closed loop", "`base`", "`upper`", "`lower`"]);
    refused(&plus("<link name='lonely'/>"), &["2 links", "`base`, `lonely`"]);
    let island = format!("<link name='a'/><link name='b'/>{}{}", joint("ab", "a", "b"), joint("ba", "b", "a"));
    let error = refused(&plus(&island), &["closed loop"]);
    assert!(matches!(error, UrdfError::Cycle { links } if links.len() == 2));
    refused(&plus(&format!("<link name='a'/>{}", joint("aa", "a", "a"))), &["closed loop", "`a`"]);
}
