//! A motion with the effort that drove it: what signatures are evaluated on.

use gapscope_dynamics::Model;

/// Joint signals of one continuous run on a uniform grid, joint-major: `q[j][k]` is joint j at sample k.
///
/// All four signals went through the same zero-phase operator, so that they stay consistent with each other:
/// `v` and `a` are derivatives of `q`, and `tau` is the effort, held between samples, averaged by the same kernel.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// The nominal robot.
    pub model: &'a Model,
    /// Positions, rad or m.
    pub q: &'a [Vec<f64>],
    /// Velocities, rad/s or m/s.
    pub v: &'a [Vec<f64>],
    /// Accelerations, rad/s² or m/s².
    pub a: &'a [Vec<f64>],
    /// Efforts as logged, N m or N.
    pub tau: &'a [Vec<f64>],
    /// Torque that this motion takes of the nominal robot, damping and friction of its URDF included, N m or N.
    pub nominal: &'a [Vec<f64>],
    /// Time from one sample to the next, s.
    pub dt: f64,
    /// Time of the first sample since the start of the episode, s.
    pub start: f64,
    /// Speed per joint below which it counts as standing, rad/s or m/s.
    pub standstill: &'a [f64],
}

impl Motion<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.q.first().map_or(0, Vec::len)
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Sign of a speed, linear inside the standstill band, where the true friction force is not known.
pub fn soft_sign(speed: f64, standstill: f64) -> f64 {
    if speed.abs() >= standstill { speed.signum() } else { speed / standstill }
}
