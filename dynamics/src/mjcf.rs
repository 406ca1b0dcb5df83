//! A [`Model`] from MJCF, MuJoCo's own model files.
//!
//! The way of a file: `source` reads the XML with what it includes; `settings` holds `<compiler>` and the default
//! classes; `frame` and `geom` read places and bodies from attributes; `tree` walks the bodies and makes the joints.
//!
//! What the file models of a joint beside rigid bodies becomes part of the nominal model: damping, frictionloss and
//! armature. Contacts, visuals, sensors and keyframes are no part of the dynamics and are passed over. Tendons,
//! equality constraints, ball joints and floating bases are refused by name.

mod constraint;
mod error;
mod frame;
mod geom;
mod settings;
mod source;
mod tree;

pub use error::MjcfError;

use crate::finding::Finding;
use crate::model::Model;
use crate::urdf::Loaded;
use settings::Settings;

impl Model {
    /// Reads an MJCF file: a tree of hinges and slides on a fixed base, in SI units, with the joints named in `locked`
    /// held still at position zero.
    ///
    /// `include` gives the text of a file that an `<include>` names, or says why there is none. Joint limits come from
    /// `range`, effort limits from `actuatorfrcrange` or from the actuator's `forcerange`. Gravity is the file's.
    ///
    /// # Errors
    /// [`MjcfError`] says where, what was found, and the mend.
    pub fn from_mjcf(
        xml: &str,
        include: &dyn Fn(&str) -> Result<String, String>,
        locked: &[&str],
    ) -> Result<Loaded, MjcfError> {
        let root = source::read(xml, include)?;
        let mut findings = Vec::new();
        let settings = Settings::read(&root, &mut findings)?;
        constraint::check(&root, locked)?;
        let mut loaded = tree::assemble(&root, &settings, locked, findings)?;
        loaded.model = loaded.model.with_gravity(settings.gravity);
        constraint::limit_effort(&root, &settings, loaded)
    }

    /// Whether the text of a robot description is MJCF, by its outermost element.
    pub fn is_mjcf(xml: &str) -> bool {
        source::outermost(xml).is_some_and(|name| name == "mujoco" || name == "mujocoinclude")
    }
}

/// Notes a finding about an element.
fn note(findings: &mut Vec<Finding>, about: impl Into<String>, message: impl Into<String>) {
    findings.push(Finding::new(about, message));
}
