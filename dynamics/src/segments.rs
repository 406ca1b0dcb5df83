//! The model as the kernels see it: link frames whose z axis is the joint's axis, so that a joint's motion is a plane
//! rotation and its motion subspace one coordinate.
//!
//! With A_i the kernel's frame in the link's frame, the fixed rotation A_pᵀ R_i A_i is split in Euler angles
//! z(γ) x(α) z(θ₀). The last joins the joint's own angle, and the first is absorbed in the parent's free turn about its
//! own axis: between neighbours of a chain, only x(α) is left. A further child of the same parent keeps its γ. The split
//! is exact for every rotation, also for nearly parallel axes.

use crate::matrix::Symmetric;
use crate::model::{Joint, JointKind};
use crate::plane::Turn;
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Angles this near to a quarter turn are one; farther off they are what the file says (`1.5708` stays itself).
const SNAP: f64 = 1e-14;

/// The rotation x(α): most robots' joints are parallel or at right angles.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Tilt {
    /// α = 0.
    Straight,
    /// α = 90°.
    Quarter,
    /// α = −90°.
    Back,
    /// Any other.
    Any(Turn<f64>),
}

/// A joint with its link, in the kernels' frames.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    /// 0 for the base, else 1 + index of the parent joint.
    pub parent: usize,
    /// Rotation about z, else translation along z.
    pub revolute: bool,
    /// No joint hangs from this one.
    pub leaf: bool,
    /// The first child to report to its parent when joints are visited backwards.
    pub first_to_report: bool,
    /// γ, where it is not zero.
    pub turn: Option<Turn<f64>>,
    /// α.
    pub tilt: Tilt,
    /// θ₀, rad.
    pub angle: f64,
    /// Whether the origin ever differs from the parent's.
    pub offset: bool,
    /// Origin at position zero, m, parent's frame.
    pub origin: DVec3,
    /// Axis in the parent's frame, for prismatic joints; zero otherwise.
    pub slide: DVec3,
    /// The link's frame from this one, where they differ.
    pub link_from_kernel: Option<DMat3>,
    /// Mass, kg.
    pub mass: f64,
    /// First moment, kg m.
    pub first_moment: DVec3,
    /// Rotational inertia about the origin, kg m².
    pub rotational: Symmetric<f64>,
    /// ∫ x xᵀ dm = ½ tr(I) 1 − I, kg m².
    pub second_moment: Symmetric<f64>,
    /// Rotor inertia.
    pub armature: f64,
}

/// All segments, and gravity in the kernels' frame of the base.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    pub list: Vec<Segment>,
    pub gravity: DVec3,
}

impl Segments {
    pub fn new(joints: &[Joint], gravity: DVec3, armature: &[f64]) -> Self {
        let n = joints.len();
        // Kernel frame in link frame: entry 0 is the base.
        let mut frames = vec![DMat3::IDENTITY; n + 1];
        let mut angles = vec![0.0; n + 1];
        let mut has_child = vec![false; n + 1];
        let mut splits = Vec::with_capacity(n);
        for (i, joint) in joints.iter().enumerate() {
            frames[i + 1] = frame_with_z_along(joint.axis);
            let parent = joint.parent.map_or(0, |p| p + 1);
            let fixed = frames[parent].transpose() * joint.placement.rotation * frames[i + 1];
            let (mut gamma, alpha, theta) = euler(fixed);
            if !has_child[parent] {
                has_child[parent] = true;
                frames[parent] *= matrix_about_z(gamma);
                angles[parent] += gamma;
                gamma = 0.0;
            }
            angles[i + 1] += theta;
            splits.push((parent, gamma, alpha));
        }
        let mut reported = vec![false; n + 1];
        let mut first = vec![false; n];
        for (i, (parent, ..)) in splits.iter().enumerate().rev() {
            first[i] = !std::mem::replace(&mut reported[*parent], true);
        }
        let list = joints.iter().enumerate().map(|(i, joint)| {
            let (parent, gamma, alpha) = splits[i];
            let (frame, parent_frame) = (frames[i + 1], frames[parent]);
            let revolute = joint.kind != JointKind::Prismatic;
            let origin = parent_frame.transpose() * joint.placement.translation;
            let rotational = frame.transpose() * joint.inertia.rotational * frame;
            let trace = rotational.x_axis.x + rotational.y_axis.y + rotational.z_axis.z;
            Segment {
                parent,
                revolute,
                leaf: !has_child[i + 1],
                first_to_report: first[i],
                turn: (gamma != 0.0).then(|| turn(gamma)),
                tilt: tilt(alpha),
                angle: angles[i + 1],
                offset: !revolute || origin != DVec3::ZERO,
                origin,
                slide: if revolute {
                    DVec3::ZERO
                } else {
                    parent_frame.transpose() * (joint.placement.rotation * joint.axis)
                },
                link_from_kernel: (frame != DMat3::IDENTITY).then_some(frame),
                mass: joint.inertia.mass,
                first_moment: frame.transpose() * joint.inertia.first_moment,
                rotational: symmetric(rotational),
                second_moment: symmetric(0.5 * trace * DMat3::IDENTITY - rotational),
                armature: armature[i],
            }
        });
        Self { list: list.collect(), gravity: frames[0].transpose() * gravity }
    }
}

/// Some rotation whose z axis is `axis`; of whole quarter turns where that can be.
fn frame_with_z_along(axis: DVec3) -> DMat3 {
    // The coordinate axis farthest from it; x among equals.
    let [x, y, z] = axis.abs().to_array();
    let helper = match x.min(y).min(z) {
        least if least == x => DVec3::X,
        least if least == y => DVec3::Y,
        _ => DVec3::Z,
    };
    let first = (helper - axis * axis.dot(helper)).normalize();
    DMat3::from_cols(first, axis.cross(first), axis)
}

/// Euler angles (γ, α, θ) of z(γ) x(α) z(θ), γ in (−π/2, π/2], snapped to quarter turns.
fn euler(rotation: DMat3) -> (f64, f64, f64) {
    let z = rotation.z_axis;
    let sine = z.x.hypot(z.y);
    let gamma = if sine > SNAP { snap(z.x.atan2(-z.y)) } else { 0.0 };
    let (gamma, sine) = match gamma {
        g if g > FRAC_PI_2 => (g - PI, -sine),
        g if g <= -FRAC_PI_2 => (g + PI, -sine),
        g => (g, sine),
    };
    let alpha = snap(sine.atan2(z.z));
    // What is left is about z, up to the snapping.
    let rest = matrix_about_x(alpha).transpose() * matrix_about_z(gamma).transpose() * rotation;
    (gamma, alpha, snap(rest.x_axis.y.atan2(rest.x_axis.x)))
}

fn snap(angle: f64) -> f64 {
    let quarters = (angle / FRAC_PI_2).round();
    if (angle - quarters * FRAC_PI_2).abs() < SNAP { quarters * FRAC_PI_2 } else { angle }
}

/// Cosine and sine, exact at quarter turns.
fn turn(angle: f64) -> Turn<f64> {
    let (s, c) = angle.sin_cos();
    let clean = |x: f64| if x.abs() < SNAP { 0.0 } else { x };
    Turn { c: clean(c), s: clean(s) }
}

fn tilt(alpha: f64) -> Tilt {
    match turn(alpha) {
        Turn { c, s } if s == 0.0 && c > 0.0 => Tilt::Straight,
        Turn { c, s } if c == 0.0 && s > 0.0 => Tilt::Quarter,
        Turn { c: 0.0, .. } => Tilt::Back,
        any => Tilt::Any(any),
    }
}

fn matrix_about_x(angle: f64) -> DMat3 {
    let Turn { c, s } = turn(angle);
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c))
}

fn matrix_about_z(angle: f64) -> DMat3 {
    let Turn { c, s } = turn(angle);
    DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z)
}

fn symmetric(m: DMat3) -> Symmetric<f64> {
    Symmetric { xx: m.x_axis.x, xy: m.y_axis.x, xz: m.z_axis.x, yy: m.y_axis.y, yz: m.z_axis.y, zz: m.z_axis.z }
}
