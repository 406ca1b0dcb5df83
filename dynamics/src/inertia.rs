//! Rigid-body inertias: the ten parameters, changes of frame, sums, physical consistency.

use crate::model::{Inertia, Placement};
use glam::{DMat3, DVec3};

impl Inertia {
    /// No mass at all.
    pub const ZERO: Self = Self { mass: 0.0, first_moment: DVec3::ZERO, rotational: DMat3::ZERO };

    /// From mass (kg), centre of mass (m, link frame) and rotational inertia about the centre of mass (kg m², axes
    /// of the link): I_o = I_c + m (c·c 1 − c cᵀ), the parallel-axis theorem (Featherstone 2008, eq. 2.63).
    pub fn from_com(mass: f64, com: DVec3, inertia_about_com: DMat3) -> Self {
        Self { mass, first_moment: mass * com, rotational: inertia_about_com + mass * about_origin(com) }
    }

    /// The parameters `[m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz]` about the link's origin: Pinocchio's order.
    pub fn parameters(&self) -> [f64; 10] {
        let h = self.first_moment;
        let i = self.rotational;
        [self.mass, h.x, h.y, h.z, i.x_axis.x, i.x_axis.y, i.y_axis.y, i.x_axis.z, i.y_axis.z, i.z_axis.z]
    }

    /// The inverse of [`Inertia::parameters`].
    pub fn from_parameters(parameters: &[f64; 10]) -> Self {
        let [mass, hx, hy, hz, xx, xy, yy, xz, yz, zz] = *parameters;
        Self {
            mass,
            first_moment: DVec3::new(hx, hy, hz),
            rotational: DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)),
        }
    }

    /// Centre of mass, m, link frame; `None` without mass.
    pub fn center_of_mass(&self) -> Option<DVec3> {
        (self.mass != 0.0).then(|| self.first_moment / self.mass)
    }

    /// Rotational inertia about the centre of mass, kg m², axes of the link; about the origin without mass.
    pub fn about_center_of_mass(&self) -> DMat3 {
        match self.center_of_mass() {
            Some(com) => self.rotational - self.mass * about_origin(com),
            None => self.rotational,
        }
    }

    /// The inertia of both bodies joined rigidly; both in the same frame.
    #[must_use]
    pub fn add(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            rotational: self.rotational + other.rotational,
        }
    }

    /// The same body seen from the parent frame of `placement`, this inertia being in its child frame
    /// (Featherstone 2008, eq. 2.66).
    #[must_use]
    pub fn transform(&self, placement: &Placement) -> Self {
        let rotation = placement.rotation;
        let t = placement.translation;
        let h = rotation * self.first_moment;
        // ∫(|x|² 1 − x xᵀ)dm at x + t: cross terms are linear in h.
        let cross = 2.0 * t.dot(h) * DMat3::IDENTITY - outer(t, h) - outer(h, t);
        let turned = rotation * self.rotational * rotation.transpose();
        Self {
            mass: self.mass,
            first_moment: h + self.mass * t,
            rotational: turned + cross + self.mass * about_origin(t),
        }
    }

    /// Whether a distribution of positive mass has this inertia: m > 0 and the pseudo-inertia's second moment
    /// ½ tr(I_c) 1 − I_c about the centre of mass positive semidefinite, up to rounding (Wensing, Kim and Slotine
    /// 2018). That includes the triangle inequalities. The empty body counts as physical too.
    pub fn is_physical(&self) -> bool {
        if *self == Self::ZERO {
            return true;
        }
        if self.mass <= 0.0 || !self.parameters().iter().all(|x| x.is_finite()) {
            return false;
        }
        let inertia = self.about_center_of_mass();
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let moment = 0.5 * trace * DMat3::IDENTITY - inertia;
        let scale = trace.abs().max(self.first_moment.length_squared() / self.mass);
        // Invariants of a symmetric 3×3 matrix: positive semidefinite when all principal minors are non-negative.
        let [a, b, c] = [moment.x_axis.x, moment.y_axis.y, moment.z_axis.z];
        let [d, e, f] = [moment.x_axis.y, moment.x_axis.z, moment.y_axis.z];
        let tolerance = 1e-12 * scale;
        let minors = [a * b - d * d, a * c - e * e, b * c - f * f];
        [a, b, c].iter().all(|&x| x >= -tolerance)
            && minors.iter().all(|&x| x >= -tolerance * scale)
            && moment.determinant() >= -tolerance * scale * scale
    }
}

/// |x|² 1 − x xᵀ: the inertia of a unit point mass at x.
fn about_origin(x: DVec3) -> DMat3 {
    x.length_squared() * DMat3::IDENTITY - outer(x, x)
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
