//! The robot model: a tree of one-degree-of-freedom joints, immutable once built.

use crate::segments::Segments;
use glam::{DMat3, DVec3};

/// Standard gravity used by the nominal model, m/s², in the base frame (z up).
pub const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Rotation about the axis, with limits; position in rad.
    Revolute,
    /// Rotation about the axis, without limits; position in rad.
    Continuous,
    /// Translation along the axis; position in m.
    Prismatic,
}

/// A rigid transform that maps coordinates of a child frame to its parent: `x_parent = rotation · x_child + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation, columns are the child's axes in the parent.
    pub rotation: DMat3,
    /// Origin of the child in the parent, m.
    pub translation: DVec3,
}

/// Inertia of a rigid body in its link's frame: the ten parameters in which inverse dynamics is linear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertia {
    /// Mass, kg.
    pub mass: f64,
    /// First moment m·c, kg m, link frame.
    pub first_moment: DVec3,
    /// Rotational inertia about the origin of the link's frame (not the centre of mass), kg m², symmetric.
    pub rotational: DMat3,
}

/// Limits from the URDF; `None` where the file gives none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Lowest position, rad or m.
    pub lower: Option<f64>,
    /// Highest position, rad or m.
    pub upper: Option<f64>,
    /// Greatest speed, rad/s or m/s.
    pub velocity: Option<f64>,
    /// Greatest effort, N m or N.
    pub effort: Option<f64>,
}

/// A joint with the link that it moves. Links behind fixed joints are merged into it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name in the URDF.
    pub name: String,
    /// Name of the link that the joint moves.
    pub link: String,
    /// Index of the joint that moves the parent link; `None` where that is the base. Always less than the joint's own index.
    pub parent: Option<usize>,
    /// How it moves.
    pub kind: JointKind,
    /// Parent link's frame from this link's frame at position zero (the parent being a moved link or the base, after merging).
    pub placement: Placement,
    /// Axis of motion, of length one, in the link's frame.
    pub axis: DVec3,
    /// Inertia of the link with all that is fixed to it, link's frame.
    pub inertia: Inertia,
    /// Limits.
    pub limits: Limits,
    /// Viscous damping from `<dynamics damping>`, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction from `<dynamics friction>`, N m or N.
    pub friction: f64,
}

/// Why a list of joints is not a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A joint hangs from itself or from a later joint.
    #[error(
        "joint `{joint}` (index {index}) has parent index {parent}; a parent must come before its children: sort the joints from the base outwards"
    )]
    Order {
        /// Name of the joint.
        joint: String,
        /// Its index.
        index: usize,
        /// The index that it names as its parent.
        parent: usize,
    },
    /// An axis is not of length one.
    #[error("the axis of joint `{joint}` has length {length}, expected 1: divide it by its length")]
    Axis {
        /// Name of the joint.
        joint: String,
        /// Length found.
        length: f64,
    },
    /// A placement's rotation is not a rotation.
    #[error(
        "the placement of joint `{joint}` is not a rotation: RᵀR differs from identity by {deviation}, or det R is not 1"
    )]
    Rotation {
        /// Name of the joint.
        joint: String,
        /// Largest entry of |RᵀR − 1|.
        deviation: f64,
    },
    /// A number is infinite or not a number.
    #[error("{what} of joint `{joint}` is not finite: write a finite number")]
    NotFinite {
        /// Name of the joint.
        joint: String,
        /// Which quantity.
        what: &'static str,
    },
    /// Two joints or two links share a name.
    #[error("two {what}s are named `{name}`: names must be unique")]
    Duplicate {
        /// `joint` or `link`.
        what: &'static str,
        /// The name.
        name: String,
    },
}

/// Radius of the ball that a link without inertia becomes once it has a mass, m.
const BALL: f64 = 0.05;

/// Where the inertial parameters of a link come from: how far they may be from the true ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InertialSource {
    /// Weighed and balanced, or identified.
    Weighed,
    /// Computed from the drawing, as those of most robot descriptions.
    #[default]
    Cad,
    /// Guessed, or left at what a tool wrote.
    Guessed,
    /// The mass is from a scale, where it lies is guessed: a tool on the last link.
    MassKnown,
}

/// A robot arm on a fixed base: a tree of joints with their links, gravity, and rotor inertias. Immutable once built.
///
/// World is the base link's frame. The state is `q` (rad or m) and `v` (rad/s or m/s), one number a joint, in the
/// order of [`Model::joints`].
#[derive(Debug, Clone)]
pub struct Model {
    name: String,
    base: String,
    joints: Vec<Joint>,
    gravity: DVec3,
    armature: Vec<f64>,
    sources: Vec<InertialSource>,
    segments: Segments,
}

/// How far an axis' length and a rotation's RᵀR may be from one.
const UNIT_TOLERANCE: f64 = 1e-9;

impl Model {
    /// A model from its joints, sorted from the base outwards. Gravity is [`GRAVITY`], armatures are zero.
    ///
    /// # Errors
    /// A parent that does not come before its child, an axis not of length one, a placement that is not a rotation,
    /// a number that is not finite, or a name used twice. Inertias may be unphysical: see [`Inertia::is_physical`].
    pub fn new(name: String, base: String, joints: Vec<Joint>) -> Result<Self, ModelError> {
        for (index, joint) in joints.iter().enumerate() {
            check_joint(index, joint)?;
            for earlier in &joints[..index] {
                if earlier.name == joint.name {
                    return Err(ModelError::Duplicate { what: "joint", name: joint.name.clone() });
                }
                if earlier.link == joint.link {
                    return Err(ModelError::Duplicate { what: "link", name: joint.link.clone() });
                }
            }
            if joint.link == base {
                return Err(ModelError::Duplicate { what: "link", name: base });
            }
        }
        let armature = vec![0.0; joints.len()];
        let segments = Segments::new(&joints, GRAVITY, &armature);
        let sources = vec![InertialSource::default(); joints.len()];
        Ok(Self { name, base, joints, gravity: GRAVITY, armature, sources, segments })
    }

    /// The robot's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The base link's name; its frame is the world.
    pub fn base(&self) -> &str {
        &self.base
    }

    /// The joints, parents before children.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Degrees of freedom n: the number of joints.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Index of the joint of this name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Acceleration of gravity, m/s², world frame.
    pub fn gravity(&self) -> DVec3 {
        self.gravity
    }

    /// Rotor inertia of each joint as seen at the joint, kg m² (kg for a prismatic joint): added to the diagonal of M.
    pub fn armature(&self) -> &[f64] {
        &self.armature
    }

    /// The same model under another gravity, m/s², world frame.
    #[must_use]
    pub fn with_gravity(mut self, gravity: DVec3) -> Self {
        self.gravity = gravity;
        self.prepared()
    }

    /// The same model with another inertia of the link that `joint` moves.
    ///
    /// # Panics
    /// If `joint` is not less than [`Model::dof`].
    #[must_use]
    pub fn with_inertia(mut self, joint: usize, inertia: Inertia) -> Self {
        self.joints[joint].inertia = inertia;
        self.prepared()
    }

    /// The same model with other rotor inertias, kg m² (kg for a prismatic joint), one a joint.
    ///
    /// # Panics
    /// If there is not one number a joint.
    #[must_use]
    pub fn with_armature(mut self, armature: &[f64]) -> Self {
        assert_eq!(armature.len(), self.dof(), "one armature a joint");
        self.armature.copy_from_slice(armature);
        self.prepared()
    }

    /// Where the inertial parameters of the link that `joint` moves come from. No equation of motion uses it.
    ///
    /// # Panics
    /// If `joint` is not less than [`Model::dof`].
    pub fn inertial_source(&self, joint: usize) -> InertialSource {
        self.sources[joint]
    }

    /// The same model with another source of the inertial parameters of the link that `joint` moves.
    ///
    /// # Panics
    /// If `joint` is not less than [`Model::dof`].
    #[must_use]
    pub fn with_inertial_source(mut self, joint: usize, source: InertialSource) -> Self {
        self.sources[joint] = source;
        self
    }

    /// The same model with another mass of the link that `joint` moves, kg, of the same shape about the same centre; a link
    /// without inertia becomes a ball about its origin.
    ///
    /// # Panics
    /// If `joint` is not less than [`Model::dof`].
    #[must_use]
    pub fn with_mass(self, joint: usize, mass: f64) -> Self {
        let body = self.joints[joint].inertia;
        let inertia = if body.mass > 0.0 {
            let times = mass / body.mass;
            Inertia { mass, first_moment: times * body.first_moment, rotational: body.rotational * times }
        } else {
            Inertia::from_com(mass, DVec3::ZERO, DMat3::IDENTITY * (0.4 * mass * BALL * BALL))
        };
        self.with_inertia(joint, inertia)
    }

    /// The model as the kernels see it.
    pub(crate) fn segments(&self) -> &Segments {
        &self.segments
    }

    fn prepared(mut self) -> Self {
        self.segments = Segments::new(&self.joints, self.gravity, &self.armature);
        self
    }
}

fn check_joint(index: usize, joint: &Joint) -> Result<(), ModelError> {
    if let Some(parent) = joint.parent
        && parent >= index
    {
        return Err(ModelError::Order { joint: joint.name.clone(), index, parent });
    }
    let limits = &joint.limits;
    let limit = [limits.lower, limits.upper, limits.velocity, limits.effort];
    let finite = [
        ("the axis", joint.axis.is_finite()),
        ("the rotation of the origin", joint.placement.rotation.is_finite()),
        ("the translation of the origin", joint.placement.translation.is_finite()),
        ("the inertia", joint.inertia.parameters().iter().all(|x| x.is_finite())),
        ("a limit", limit.iter().flatten().all(|x| !x.is_nan())),
        ("the damping", joint.damping.is_finite()),
        ("the friction", joint.friction.is_finite()),
    ];
    if let Some((what, _)) = finite.iter().find(|(_, ok)| !ok) {
        return Err(ModelError::NotFinite { joint: joint.name.clone(), what });
    }
    let length = joint.axis.length();
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(ModelError::Axis { joint: joint.name.clone(), length });
    }
    let rotation = joint.placement.rotation;
    let gram = rotation.transpose() * rotation - DMat3::IDENTITY;
    let deviation = gram.to_cols_array().iter().fold(0.0, |worst: f64, x| worst.max(x.abs()));
    if deviation > UNIT_TOLERANCE || rotation.determinant() < 0.0 {
        return Err(ModelError::Rotation { joint: joint.name.clone(), deviation });
    }
    Ok(())
}
