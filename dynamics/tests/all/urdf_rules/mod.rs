//! Each rule of the URDF validator: what is refused, with the words that name it, and what is mended with a finding.

mod file;
mod joints;
mod links;
mod tree;

use gapscope_dynamics::{Loaded, Model, UrdfError};

const INERTIAL: &str = r#"<inertial><origin xyz="0 0 0.1"/><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>"#;
const LIMIT: &str = r#"<limit lower="-1" upper="1" velocity="2" effort="3"/>"#;

/// A base with a shoulder and an elbow: nothing to find.
fn arm() -> String {
    format!(
        r#"<robot name="arm">
  <link name="base"/>
  <link name="upper">{INERTIAL}</link>
  <link name="lower">{INERTIAL}</link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="elbow" type="revolute"><origin xyz="0 0 0.3" rpy="0 0 0"/><parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/>{LIMIT}</joint>
</robot>"#
    )
}

/// The arm with a part of its text replaced, once.
fn with(from: &str, to: &str) -> String {
    let text = arm();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// The arm with more elements at its end.
fn plus(more: &str) -> String {
    with("</robot>", &format!("{more}</robot>"))
}

#[track_caller]
fn load(xml: &str) -> Loaded {
    Model::from_urdf(xml).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refused(xml: &str, words: &[&str]) -> UrdfError {
    let error = Model::from_urdf(xml).map(|loaded| loaded.findings).unwrap_err();
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "`{message}` does not say `{word}`");
    }
    error
}

/// That loading gives exactly this finding.
#[track_caller]
fn found(xml: &str, about: &str, words: &[&str]) -> Loaded {
    let loaded = load(xml);
    let [finding] = loaded.findings.as_slice() else { panic!("{:?}", loaded.findings) };
    assert_eq!(finding.about, about);
    for word in words {
        assert!(finding.message.contains(word), "`{finding}` does not say `{word}`");
    }
    loaded
}
