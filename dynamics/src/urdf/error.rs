//! Why a URDF could not be read.

use crate::model::ModelError;
use thiserror::Error;

/// Why a URDF could not be read: what was found, what was expected, and the mend.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// Not well-formed XML.
    #[error("the text is not well-formed XML ({0}): mend it there, or write it again with the tool that made it")]
    Xml(String),
    /// XML, but not a robot.
    #[error("found <{found}> as the outermost element, expected <robot>: give a URDF file{hint}")]
    NotUrdf {
        /// The outermost element.
        found: String,
        /// What the file may be instead.
        hint: &'static str,
    },
    /// A xacro file that was not expanded.
    #[error(
        "found <{element}> (line {line}), an element of xacro: expand the file first, `xacro robot.urdf.xacro > robot.urdf`"
    )]
    Xacro {
        /// The element, with its prefix.
        element: String,
        /// Its line, from 1.
        line: u32,
    },
    /// More links or joints than a robot has.
    #[error("found {found} {what}, expected at most {most}: cut the file down to the robot")]
    TooMany {
        /// `links` or `joints`.
        what: &'static str,
        /// How many.
        found: usize,
        /// How many are read.
        most: usize,
    },
    /// An element or attribute is missing.
    #[error("{about} (line {line}) has no {missing}: add {mend}")]
    Missing {
        /// The link or joint.
        about: String,
        /// Its line, from 1.
        line: u32,
        /// What is missing.
        missing: &'static str,
        /// What to write.
        mend: &'static str,
    },
    /// A number, or three, cannot be read or is not finite.
    #[error("{about} (line {line}): found {field}=\"{found}\", expected {expected}{hint}")]
    Number {
        /// The link or joint.
        about: String,
        /// Its line, from 1.
        line: u32,
        /// The attribute, with its element.
        field: String,
        /// Its text.
        found: String,
        /// What it should be.
        expected: &'static str,
        /// What may have happened.
        hint: &'static str,
    },
    /// Two links or two joints share a name.
    #[error("two {what}s are named `{name}` (lines {first} and {second}), expected each name once: rename one")]
    Duplicate {
        /// `link` or `joint`.
        what: &'static str,
        /// The name.
        name: String,
        /// Line of the first, from 1.
        first: u32,
        /// Line of the second, from 1.
        second: u32,
    },
    /// A joint is of a kind that URDF does not know.
    #[error("joint `{joint}` (line {line}) has type \"{found}\", expected revolute, continuous, prismatic or fixed")]
    UnknownType {
        /// The joint.
        joint: String,
        /// Its line, from 1.
        line: u32,
        /// The type found.
        found: String,
    },
    /// A joint has more or fewer degrees of freedom than one.
    #[error(
        "joint `{joint}` is {kind}, expected revolute, continuous, prismatic or fixed: make it fixed where the robot stands still there, lock it, or write it as joints of one degree of freedom with links between"
    )]
    Unsupported {
        /// The joint.
        joint: String,
        /// `floating`, `planar` or `spherical`.
        kind: &'static str,
    },
    /// Joints that follow others.
    #[error("found joints that mimic another, expected independent joints: {}. Lock them (with their leader they are held at their offset), make them fixed, or delete <mimic> where the joint has a motor of its own", pairs(.followers))]
    Mimic {
        /// Each follower with its leader.
        followers: Vec<(String, String)>,
    },
    /// A joint names a link that is not there.
    #[error(
        "joint `{joint}` (line {line}) names the {role} link `{link}`, which the file does not have: add <link name=\"{link}\"/> or correct the name"
    )]
    UnknownLink {
        /// The joint.
        joint: String,
        /// Its line, from 1.
        line: u32,
        /// `parent` or `child`.
        role: &'static str,
        /// The link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error(
        "link `{link}` is the child of both joint `{first}` and joint `{second}`, expected one parent (a tree, no closed loop): delete one of the joints"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// The first of its joints.
        first: String,
        /// The second.
        second: String,
    },
    /// Joints that close a loop.
    #[error("the links {} form a closed loop with no way to the base, expected a tree: delete one of the joints between them or turn it round", names(.links))]
    Cycle {
        /// The links of one loop.
        links: Vec<String>,
    },
    /// Several trees.
    #[error("found {} links without a parent joint ({}), expected one, the base: join them by a fixed joint, or delete what does not belong to the robot", .roots.len(), names(.roots))]
    SeveralRoots {
        /// The roots.
        roots: Vec<String>,
    },
    /// No link at all.
    #[error("found no <link>, expected at least a base and a link that moves")]
    NoLink,
    /// Nothing moves.
    #[error(
        "found no joint that moves, expected at least one: give one of the joints the type revolute, continuous or prismatic, or lock fewer"
    )]
    NothingMoves,
    /// A mass is negative.
    #[error("link `{link}` (line {line}) has mass {mass} kg, expected 0 or more: correct the sign")]
    NegativeMass {
        /// The link.
        link: String,
        /// The line of its `<mass>`, from 1.
        line: u32,
        /// kg.
        mass: f64,
    },
    /// A moved body has a negative principal moment of inertia.
    #[error("what moves with link `{link}` has the principal moments of inertia {:.3e}, {:.3e} and {:.3e} kg m² about its centre of mass, expected none below 0: correct <inertia> of that link or of those fixed to it (the off-diagonal terms or their signs, most often)", .moments[0], .moments[1], .moments[2])]
    NegativeInertia {
        /// The link that the joint moves.
        link: String,
        /// kg m², rising.
        moments: [f64; 3],
    },
    /// An axis of length zero.
    #[error(
        "joint `{joint}` (line {line}) moves along an axis of length zero, expected a direction: write one, such as <axis xyz=\"0 0 1\"/>"
    )]
    ZeroAxis {
        /// The joint.
        joint: String,
        /// The line of its `<axis>`, from 1.
        line: u32,
    },
    /// Negative damping or friction.
    #[error(
        "joint `{joint}` has {field} {value}, expected 0 or more, since less would feed energy in: correct the sign"
    )]
    NegativeFriction {
        /// The joint.
        joint: String,
        /// `damping` or `friction`.
        field: &'static str,
        /// The value.
        value: f64,
    },
    /// The mass matrix is singular in every position.
    #[error(
        "joint `{joint}` has nothing to move: {what}, so that the mass matrix is singular and no acceleration follows from a torque. Give link `{link}` mass and inertia, make the joint fixed, or lock it"
    )]
    NothingToMove {
        /// The joint.
        joint: String,
        /// The link it moves.
        link: String,
        /// What is missing beyond the joint.
        what: &'static str,
    },
    /// Sums of origins or inertias that overflow.
    #[error(
        "the place or inertia of what moves with link `{link}` is beyond what a 64-bit number holds: correct the origins, masses and inertias there"
    )]
    TooFar {
        /// The link.
        link: String,
    },
    /// A name to lock that no joint has.
    #[error("asked to lock joint `{joint}`, which the file does not have: it has {}", names(.known))]
    UnknownLocked {
        /// The name asked for.
        joint: String,
        /// The joints of the file.
        known: Vec<String>,
    },
    /// urdf-rs would not read what passed the checks.
    #[error("the URDF reader found: {0}")]
    Reader(String),
    /// The model would not take the joints.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// How many names a message lists.
const LISTED: usize = 8;

fn names(all: &[String]) -> String {
    list(all.iter().map(|name| format!("`{name}`")))
}

fn pairs(all: &[(String, String)]) -> String {
    list(all.iter().map(|(joint, leader)| format!("`{joint}` follows `{leader}`")))
}

fn list(all: impl ExactSizeIterator<Item = String>) -> String {
    if all.len() == 0 {
        return "none".into();
    }
    let more = all.len().saturating_sub(LISTED);
    let mut text = all.take(LISTED).collect::<Vec<_>>().join(", ");
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}
