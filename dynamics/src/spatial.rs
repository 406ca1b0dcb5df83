//! Spatial vectors about a link's origin in its axes (Featherstone 2008, chapter 2), for the algorithms that favour
//! plainness over the last nanosecond.

use crate::model::{Inertia, Joint, JointKind, Placement};
use glam::{DMat3, DVec3};
use std::ops::{Add, AddAssign, Mul};

/// A velocity or an acceleration: of the body, at the point at the frame's origin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Motion {
    /// rad/s, or rad/s².
    pub angular: DVec3,
    /// m/s, or m/s².
    pub linear: DVec3,
}

/// A force, or a momentum: its moment about the frame's origin and its resultant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Force {
    /// N m.
    pub moment: DVec3,
    /// N.
    pub force: DVec3,
}

impl Motion {
    /// Motion of both.
    pub fn cross(self, other: Self) -> Self {
        Self {
            angular: self.angular.cross(other.angular),
            linear: self.angular.cross(other.linear) + self.linear.cross(other.angular),
        }
    }

    /// v ×* f: rate of change of a force that moves along (Featherstone 2008, eq. 2.32).
    pub fn cross_force(self, f: Force) -> Force {
        Force { moment: self.angular.cross(f.moment) + self.linear.cross(f.force), force: self.angular.cross(f.force) }
    }

    /// Power of a force on this motion, or the scalar product in general.
    pub fn dot(self, f: Force) -> f64 {
        self.angular.dot(f.moment) + self.linear.dot(f.force)
    }
}

impl Add for Motion {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }
}

impl Mul<f64> for Motion {
    type Output = Self;
    fn mul(self, scale: f64) -> Self {
        Self { angular: self.angular * scale, linear: self.linear * scale }
    }
}

impl Add for Force {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { moment: self.moment + other.moment, force: self.force + other.force }
    }
}

impl AddAssign for Force {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Placement {
    /// The child's frame on the parent's.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// `a_from_b.compose(&b_from_c)` is a_from_c.
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }

    /// Parent to child.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Coordinates in the parent, m, of a point given in the child, m.
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// A motion of the parent's frame, in the child's.
    pub(crate) fn motion_to_child(&self, m: Motion) -> Motion {
        let rotation = self.rotation.transpose();
        Motion { angular: rotation * m.angular, linear: rotation * (m.linear + m.angular.cross(self.translation)) }
    }

    /// A motion of the child's frame, in the parent's.
    pub(crate) fn motion_to_parent(&self, m: Motion) -> Motion {
        let angular = self.rotation * m.angular;
        Motion { angular, linear: self.rotation * m.linear + self.translation.cross(angular) }
    }
}

impl Inertia {
    /// Momentum of the body moving so, or the inertial force to an acceleration.
    pub(crate) fn apply(&self, m: Motion) -> Force {
        Force {
            moment: self.rotational * m.angular + self.first_moment.cross(m.linear),
            force: self.mass * m.linear + m.angular.cross(self.first_moment),
        }
    }
}

impl Joint {
    /// The motion subspace S: the motion at unit speed, link frame.
    pub(crate) fn subspace(&self) -> Motion {
        match self.kind {
            JointKind::Revolute | JointKind::Continuous => Motion { angular: self.axis, linear: DVec3::ZERO },
            JointKind::Prismatic => Motion { angular: DVec3::ZERO, linear: self.axis },
        }
    }

    /// The parent link's frame from the link's frame at position `q`, rad or m.
    pub fn parent_from_link(&self, q: f64) -> Placement {
        match self.kind {
            JointKind::Revolute | JointKind::Continuous => Placement {
                rotation: self.placement.rotation * DMat3::from_axis_angle(self.axis, q),
                translation: self.placement.translation,
            },
            JointKind::Prismatic => Placement {
                rotation: self.placement.rotation,
                translation: self.placement.translation + self.placement.rotation * (self.axis * q),
            },
        }
    }
}
