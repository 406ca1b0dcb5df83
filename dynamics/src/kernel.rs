//! What the fast kernels share: their scratch, the choice of instruction set, the sines of all joint angles.

use crate::forward_dynamics::Articulated;
use crate::inverse_dynamics::Moving;
use crate::mass_matrix::Composite;
use crate::matrix::{Matrix, Symmetric};
use crate::plane::{Back, Quarter, Straight, Turn};
use crate::real::{LANES, One, Real};
use crate::segments::{Segment, Segments, Tilt};
use crate::trigonometry::sin_cos;
use crate::vector::Vector;

/// Scratch of the kernels, of the one kind of number that this processor is fastest with.
#[derive(Debug, Clone)]
pub(crate) enum Kernel<A, B> {
    /// Any processor, one state at a time.
    Portable(Scratch<One<false>>),
    /// Found to have AVX2 and FMA.
    #[cfg_attr(not(target_arch = "x86_64"), expect(dead_code))]
    Avx2(Scratch<A>),
    /// Found to have AVX-512 F, DQ, VL and BW too.
    #[cfg_attr(not(target_arch = "x86_64"), expect(dead_code))]
    Avx512(Scratch<B>),
}

impl<A: Real, B: Real> Kernel<A, B> {
    pub fn new(joints: usize) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx2") && has!("fma") {
                let wide = has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("avx512bw");
                return if wide { Self::Avx512(Scratch::new(joints)) } else { Self::Avx2(Scratch::new(joints)) };
            }
        }
        Self::Portable(Scratch::new(joints))
    }
}

/// Buffers of the kernels for one kind of number. Entry 0 of the bodies is the base.
#[derive(Debug, Clone)]
pub(crate) struct Scratch<R> {
    angles: Vec<[f64; LANES]>,
    sine: Vec<[f64; LANES]>,
    cosine: Vec<[f64; LANES]>,
    pub moving: Vec<Moving<R>>,
    pub articulated: Vec<Articulated<R>>,
    pub composite: Vec<Composite<R>>,
    /// Entry k n + j: the motion, angular and linear, of link k at unit speed of joint j below it.
    pub axes: Vec<(Vector<R>, Vector<R>)>,
}

impl<R: Real> Scratch<R> {
    fn new(joints: usize) -> Self {
        let blocks = (joints * R::WIDTH).div_ceil(LANES);
        Self {
            angles: vec![[0.0; LANES]; blocks],
            sine: vec![[0.0; LANES]; blocks],
            cosine: vec![[0.0; LANES]; blocks],
            moving: vec![Moving::ZERO; joints + 1],
            articulated: vec![Articulated::ZERO; joints + 1],
            composite: vec![Composite::ZERO; joints + 1],
            axes: vec![(Vector::ZERO, Vector::ZERO); joints * joints],
        }
    }

    /// Sines and cosines of all joints at a part of the positions `q`, as one row of numbers.
    #[inline(always)]
    pub fn turn_joints(&mut self, segments: &Segments, q: &[R::Outside], part: usize) {
        let angles = self.angles.as_flattened_mut();
        for (i, (segment, q)) in segments.list.iter().zip(q).enumerate() {
            let fixed = R::splat(segment.angle);
            let angle = if segment.revolute { R::load(q, part) + fixed } else { fixed };
            angle.scatter(&mut angles[i * R::WIDTH..]);
        }
        for (angles, (sine, cosine)) in self.angles.iter().zip(self.sine.iter_mut().zip(&mut self.cosine)) {
            if R::FUSED {
                sin_cos::<true>(angles, sine, cosine);
            } else {
                sin_cos::<false>(angles, sine, cosine);
            }
        }
    }

    /// Cosine and sine of joint `i`.
    #[inline(always)]
    pub fn turn(&self, i: usize) -> Turn<R> {
        let at = i * R::WIDTH;
        Turn { c: R::gather(&self.cosine.as_flattened()[at..]), s: R::gather(&self.sine.as_flattened()[at..]) }
    }
}

/// Evaluates `$body` with `$tilt` the fastest form of the segment's tilt: copies of the code, without closures, which
/// would lose the vector instructions.
macro_rules! with_tilt {
    ($segment:expr, $tilt:ident => $body:expr) => {
        match $segment.tilt {
            Tilt::Straight => {
                let $tilt = Straight;
                $body
            }
            Tilt::Quarter => {
                let $tilt = Quarter;
                $body
            }
            Tilt::Back => {
                let $tilt = Back;
                $body
            }
            Tilt::Any(turn) => {
                let $tilt = Turn::constant(turn);
                $body
            }
        }
    };
}

impl Segment {
    /// Origin in the parent's frame at position `q`.
    #[inline(always)]
    pub fn origin_at<R: Real>(&self, q: R) -> Vector<R> {
        let origin = Vector::constant(self.origin);
        if self.revolute { origin } else { Vector::constant(self.slide).scaled_plus(q, origin) }
    }

    /// The turn γ, for all but a parent's first child.
    #[inline(always)]
    fn unturn<R: Real>(&self, v: Vector<R>) -> Vector<R> {
        match self.turn {
            Some(turn) => v.out_of_z(Turn::constant(turn)),
            None => v,
        }
    }

    /// Two vectors of this frame in the parent's.
    #[inline(always)]
    pub fn pair_to_parent<R: Real>(&self, turn: Turn<R>, a: Vector<R>, b: Vector<R>) -> (Vector<R>, Vector<R>) {
        let (a, b) = (a.out_of_z(turn), b.out_of_z(turn));
        let (a, b) = with_tilt!(self, tilt => (a.out_of_x(tilt), b.out_of_x(tilt)));
        (self.unturn(a), self.unturn(b))
    }

    /// First moment and rotational inertia of this frame in the parent's axes.
    #[inline(always)]
    pub fn rigid_to_parent<R: Real>(&self, turn: Turn<R>, h: Vector<R>, i: Symmetric<R>) -> (Vector<R>, Symmetric<R>) {
        let (h, i) = (h.out_of_z(turn), i.out_of_z(turn));
        let (h, i) = with_tilt!(self, tilt => (h.out_of_x(tilt), i.out_of_x(tilt)));
        match self.turn {
            Some(turn) => (h.out_of_z(Turn::constant(turn)), i.out_of_z(Turn::constant(turn))),
            None => (h, i),
        }
    }

    /// An articulated inertia (inertia, coupling, mass) of this frame in the parent's axes.
    #[inline(always)]
    pub fn articulated_to_parent<R: Real>(
        &self,
        turn: Turn<R>,
        (i, h, m): (Symmetric<R>, Matrix<R>, Symmetric<R>),
    ) -> (Symmetric<R>, Matrix<R>, Symmetric<R>) {
        let (i, h, m) = (i.out_of_z(turn), h.out_of_z(turn), m.out_of_z(turn));
        let (i, h, m) = with_tilt!(self, tilt => (i.out_of_x(tilt), h.out_of_x(tilt), m.out_of_x(tilt)));
        match self.turn {
            Some(turn) => {
                let turn = Turn::constant(turn);
                (i.out_of_z(turn), h.out_of_z(turn), m.out_of_z(turn))
            }
            None => (i, h, m),
        }
    }

    /// Two vectors of the parent's frame in this one.
    #[inline(always)]
    pub fn pair_into_child<R: Real>(&self, turn: Turn<R>, a: Vector<R>, b: Vector<R>) -> (Vector<R>, Vector<R>) {
        let (a, b) = match self.turn {
            Some(turn) => (a.into_z(Turn::constant(turn)), b.into_z(Turn::constant(turn))),
            None => (a, b),
        };
        let (a, b) = with_tilt!(self, tilt => (a.into_x(tilt), b.into_x(tilt)));
        (a.into_z(turn), b.into_z(turn))
    }

    /// A vector of the parent's frame in this one.
    #[inline(always)]
    pub fn vector_into_child<R: Real>(&self, turn: Turn<R>, v: Vector<R>) -> Vector<R> {
        let v = match self.turn {
            Some(turn) => v.into_z(Turn::constant(turn)),
            None => v,
        };
        with_tilt!(self, tilt => v.into_x(tilt)).into_z(turn)
    }

    /// A vector of this frame in the link's own.
    #[inline(always)]
    pub fn to_link<R: Real>(&self, v: Vector<R>) -> Vector<R> {
        match &self.link_from_kernel {
            Some(rotation) => v.turned(rotation),
            None => v,
        }
    }
}

/// Runs the calling file's `body(segments, scratch, arguments)`, compiled for the instruction set that the scratch was
/// made for: its `portable`, `avx2` or `avx512`.
macro_rules! run_kernel {
    ($kernel:expr, $segments:expr, $($argument:expr),+) => {
        match $kernel {
            crate::kernel::Kernel::Portable(scratch) => portable($segments, scratch, $($argument),+),
            // SAFETY: these variants exist only where `Kernel::new` found the instructions.
            #[cfg(target_arch = "x86_64")]
            crate::kernel::Kernel::Avx2(scratch) => unsafe { avx2($segments, scratch, $($argument),+) },
            #[cfg(target_arch = "x86_64")]
            crate::kernel::Kernel::Avx512(scratch) => unsafe { avx512($segments, scratch, $($argument),+) },
            #[cfg(not(target_arch = "x86_64"))]
            crate::kernel::Kernel::Avx2(scratch) | crate::kernel::Kernel::Avx512(scratch) => {
                body($segments, scratch, $($argument),+)
            }
        }
    };
}
pub(crate) use run_kernel;

/// What the `_lanes` methods do where there are no wide registers: `$single` of one state after the other.
macro_rules! lane_by_lane {
    ($single:ident, $segments:expr, $scratch:expr, $buffers:expr, $a:expr, $b:expr, $c:expr, $out:expr) => {{
        let [a, b, c, out] = $buffers;
        for k in 0..LANES {
            for i in 0..out.len() {
                (a[i], b[i], c[i]) = ($a[i][k], $b[i][k], $c[i][k]);
            }
            $single($segments, $scratch, a, b, c, out);
            for (row, value) in $out.iter_mut().zip(out.iter()) {
                row[k] = *value;
            }
        }
    }};
}
pub(crate) use lane_by_lane;

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::data::{Data, LaneData};
    use crate::model::Model;
    use nalgebra::DMatrix;

    /// All kernels' answers, one after the other.
    fn answers(model: &Model, data: &mut Data, lanes: &mut LaneData) -> Vec<f64> {
        let n = model.dof();
        let row = |phase: f64| -> Vec<f64> { (0..n).map(|i| 3.0 * (1.9 * i as f64 + phase).sin()).collect() };
        let rows = |phase: f64| -> Vec<[f64; LANES]> {
            row(phase).iter().map(|x| std::array::from_fn(|k| x + 0.37 * k as f64)).collect()
        };
        let mut all = Vec::new();
        let mut out = vec![0.0; n];
        model.inverse_dynamics(data, &row(0.1), &row(0.2), &row(0.3), &mut out);
        all.extend_from_slice(&out);
        model.forward_dynamics(data, &row(0.1), &row(0.2), &row(0.3), &mut out);
        all.extend_from_slice(&out);
        let mut mass = DMatrix::zeros(n, n);
        model.mass_matrix(data, &row(0.1), &mut mass);
        all.extend_from_slice(mass.as_slice());
        let mut regressor = DMatrix::zeros(n, 10 * n);
        model.regressor(data, &row(0.1), &row(0.2), &row(0.3), &mut regressor);
        all.extend_from_slice(regressor.as_slice());
        let mut out = vec![[0.0; LANES]; n];
        model.inverse_dynamics_lanes(lanes, &rows(0.1), &rows(0.2), &rows(0.3), &mut out);
        all.extend_from_slice(out.as_flattened());
        model.forward_dynamics_lanes(lanes, &rows(0.1), &rows(0.2), &rows(0.3), &mut out);
        all.extend_from_slice(out.as_flattened());
        all
    }

    #[test]
    fn instruction_sets_agree() {
        for urdf in [include_str!("../robots/arm7.urdf"), include_str!("../golden/branched.urdf")] {
            let model = Model::from_urdf(urdf).unwrap().model;
            let n = model.dof();
            let (mut data, mut lanes) = (Data::new(&model), LaneData::new(&model));
            let found = answers(&model, &mut data, &mut lanes);
            data.kernel = Kernel::Portable(Scratch::new(n));
            lanes.kernel = Kernel::Portable(Scratch::new(n));
            let mut others = vec![answers(&model, &mut data, &mut lanes)];
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                data.kernel = Kernel::Avx2(Scratch::new(n));
                lanes.kernel = Kernel::Avx2(Scratch::new(n));
                others.push(answers(&model, &mut data, &mut lanes));
            }
            for other in others {
                for (a, b) in found.iter().zip(&other) {
                    assert!((a - b).abs() <= 1e-11 * a.abs().max(b.abs()).max(100.0), "{a} and {b}");
                }
            }
        }
    }
}
