//! Random seeded trees and states for the property tests.
#![allow(dead_code)]

use gapscope_dynamics::{Inertia, Joint, JointKind, Limits, Model, Placement};
use glam::{DMat3, DQuat, DVec3};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A seeded source of numbers.
pub struct Draw(Pcg64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    pub fn uniform(&mut self, reach: f64) -> f64 {
        self.0.random_range(-reach..reach)
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    pub fn vector(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.uniform(reach), self.uniform(reach), self.uniform(reach))
    }

    pub fn numbers(&mut self, n: usize, reach: f64) -> Vec<f64> {
        (0..n).map(|_| self.uniform(reach)).collect()
    }

    pub fn rotation(&mut self) -> DMat3 {
        let q = DQuat::from_xyzw(self.uniform(1.0), self.uniform(1.0), self.uniform(1.0), self.uniform(1.0));
        DMat3::from_quat(q.normalize())
    }

    /// Physical by construction: eight point masses.
    pub fn inertia(&mut self) -> Inertia {
        let mut sum = Inertia::ZERO;
        let center = self.vector(0.2);
        for _ in 0..8 {
            let mass = 0.3 + self.uniform(0.25);
            let at = center + self.vector(0.3);
            sum = sum.add(&Inertia::from_com(mass, at, DMat3::ZERO));
        }
        sum
    }

    /// A quarter of all axes and rotations are aligned, as in real files.
    pub fn joint(&mut self, index: usize, parent: Option<usize>) -> Joint {
        let aligned = self.below(4) == 0;
        let axis = match self.below(6) {
            0 => DVec3::X,
            1 => DVec3::Y,
            2 => DVec3::Z,
            3 => DVec3::NEG_Z,
            _ => (self.vector(1.0) + DVec3::splat(1e-3)).normalize(),
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        let rotation = if aligned {
            DMat3::from_rotation_x(quarter * self.below(4) as f64)
                * DMat3::from_rotation_z(quarter * self.below(4) as f64)
        } else {
            self.rotation()
        };
        let translation = if self.below(4) == 0 { DVec3::ZERO } else { self.vector(0.5) };
        Joint {
            name: format!("joint{index}"),
            link: format!("link{index}"),
            parent,
            kind: [JointKind::Revolute, JointKind::Continuous, JointKind::Prismatic, JointKind::Revolute]
                [self.below(4)],
            placement: Placement { rotation, translation },
            axis,
            inertia: self.inertia(),
            limits: Limits::default(),
            damping: 0.0,
            friction: 0.0,
        }
    }

    /// A random tree of n joints, chains favoured.
    pub fn tree(&mut self, n: usize) -> Model {
        let joints = (0..n)
            .map(|i| {
                let parent = match i {
                    0 => None,
                    _ if self.below(3) > 0 => Some(i - 1),
                    _ => Some(self.below(i + 1)).filter(|&p| p < i),
                };
                self.joint(i, parent)
            })
            .collect();
        let armature: Vec<f64> = (0..n).map(|_| 0.1 + self.uniform(0.1)).collect();
        let gravity = self.vector(10.0);
        Model::new("tree".into(), "base".into(), joints).unwrap().with_armature(&armature).with_gravity(gravity)
    }
}

/// Sizes and seeds that every property is tried on.
pub fn trees() -> impl Iterator<Item = (Model, Draw)> {
    (0..60_u64).map(|seed| {
        let mut draw = Draw::new(seed);
        let n = 1 + (seed as usize) % 12;
        (draw.tree(n), draw)
    })
}

/// |a − b| ≤ tolerance · max(1, |a|, |b|), entry by entry against the largest entry.
#[track_caller]
pub fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).fold(1.0, |s: f64, x| s.max(x.abs()));
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tolerance * scale, "entry {i}: {x} and {y} differ by {:e}", (x - y).abs());
    }
}

pub fn column(v: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(v)
}

pub fn square(n: usize) -> DMatrix<f64> {
    DMatrix::zeros(n, n)
}
