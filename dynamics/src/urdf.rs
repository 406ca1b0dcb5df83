//! A [`Model`] from URDF text: read, validated, and merged across fixed joints.
//!
//! The way of a file: `source` reads the raw XML, so that it knows what the file leaves out, repeats or misspells, and
//! writes the part that bears on the dynamics anew; urdf-rs reads the values from that; `tree` sorts the links;
//! `joint` and `link` check the values one by one; `body` merges what is fixed together and checks what moves.
//!
//! What the equations of motion need must be right, or loading fails with the mend named: masses, inertias, origins,
//! axes, damping, friction, and the tree itself. What only bounds the motion (limits), and what can be read in only one
//! way, is mended with a finding. Nothing is left out silently: each kind of field that is not read gives a finding.

mod body;
mod error;
mod joint;
mod link;
mod lock;
mod reader;
mod source;
mod tree;

pub use error::UrdfError;

use crate::finding::Finding;
use crate::model::{Model, Placement};
use source::Source;

/// A model read from a URDF, with what was noticed on the way.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The model. Its base is the URDF's root link, with all that is fixed to it.
    pub model: Model,
    /// What was ignored, mended or doubted, in a fixed order.
    pub findings: Vec<Finding>,
    /// Every link of the file, also those merged into another across a fixed joint, in the order of the tree.
    pub links: Vec<LinkFrame>,
}

impl Loaded {
    /// Where the link of this name went.
    pub fn link(&self, name: &str) -> Option<&LinkFrame> {
        self.links.iter().find(|link| link.name == name)
    }
}

/// Where a link of the URDF is in the model.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrame {
    /// Name in the URDF.
    pub name: String,
    /// Index of the joint that moves it; `None` where it is part of the base.
    pub joint: Option<usize>,
    /// Its frame in the frame of the link which that joint moves (or of the base): identity unless it was merged
    /// across a fixed joint.
    pub placement: Placement,
}

impl Model {
    /// Reads a URDF: a tree of revolute, continuous, prismatic and fixed joints, in SI units.
    ///
    /// Links behind fixed joints are merged into the link that carries them (mass, first moment and rotational inertia
    /// are carried over exactly; [`Loaded::links`] keeps their names and places). Joints come depth first in the order
    /// of the document, parents before children. Damping and friction are read from `<dynamics>`, limits from
    /// `<limit>`. A parent `world` of a fixed joint, named but not described, is read as the base.
    ///
    /// # Errors
    /// [`UrdfError`] says what was found, what was expected and how to mend it. Mimic, floating and planar joints are
    /// errors, as the model has independent joints of one degree of freedom: [`Model::from_urdf_locking`] can leave
    /// them out.
    pub fn from_urdf(xml: &str) -> Result<Loaded, UrdfError> {
        Self::from_urdf_locking(xml, &[])
    }

    /// Reads a URDF as [`Model::from_urdf`] does, with the joints of these names held still at position zero, as if
    /// they were fixed: for the joints of which a log says nothing, such as a gripper's.
    ///
    /// A joint that mimics a held or fixed joint is held with it, at its own offset.
    ///
    /// # Errors
    /// Those of [`Model::from_urdf`], and a name that no joint has.
    pub fn from_urdf_locking(xml: &str, locked: &[&str]) -> Result<Loaded, UrdfError> {
        let mut findings = Vec::new();
        let source = Source::read(xml, &mut findings)?;
        let robot = urdf_rs::read_from_string(&source.reduced).map_err(|e| UrdfError::Reader(e.to_string()))?;
        if robot.links.len() != source.links.len() || robot.joints.len() != source.joints.len() {
            return Err(UrdfError::Reader("urdf-rs found another number of links or joints".into()));
        }
        let held = lock::held(&source, &robot, locked, &mut findings)?;
        let order = tree::sort(&source, &mut findings)?;
        let links = link::inertias(&source, &robot, &mut findings)?;
        let joints = joint::read(&source, &robot, &held, &mut findings)?;
        body::assemble(&source, &order, &links, &joints, findings)
    }
}
