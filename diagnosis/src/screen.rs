//! A first look at knobs with too many places to try: only the best few go on.

use crate::refine::Data;
use gapscope_effects::{Candidate, Range};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Ripples of one joint that go on.
const RIPPLES: usize = 2;
/// Two ripples are apart if their cycles differ by this factor.
const APART: f64 = 1.15;
/// Powers of the position that a ripple must be seen beside: pose moves torque too, but slowly.
const POWERS: i32 = 5;

/// The ripples that take most out of each joint's residual (`[episode][joint][signal]`) beside a smooth function of pose
/// and speed.
pub fn ripples(data: &Data<'_>, ranges: &[Range], residuals: &[Vec<Vec<f64>>]) -> Vec<Candidate> {
    let joints: Vec<usize> = (0..ranges.len()).filter(|&j| data.moving[j]).collect();
    joints
        .into_par_iter()
        .flat_map(|j| {
            let at_rows = |of: &dyn Fn(usize) -> Vec<f64>| -> Vec<f64> {
                (0..data.signals.len()).flat_map(|e| data.band.filter(e, &of(e))).collect()
            };
            let middle = |e: usize| {
                let q = &data.signals[e].q[j];
                let span = ranges[j].span.max(1e-9);
                q.iter().map(|q| 2.0 * q / span).collect::<Vec<f64>>()
            };
            let mut base: Vec<Vec<f64>> =
                (0..=POWERS).map(|power| at_rows(&|e| middle(e).iter().map(|x| x.powi(power)).collect())).collect();
            base.push(at_rows(&|e| data.signals[e].v[j].clone()));
            base.push(at_rows(&|e| data.signals[e].a[j].clone()));
            base.push(at_rows(&|e| data.signals[e].nominal[j].clone()));
            base.push(at_rows(&|e| {
                data.signals[e].v[j].iter().map(|v| (v / data.standstill[j]).clamp(-1.0, 1.0)).collect()
            }));
            let target = at_rows(&|e| residuals[e][j].clone());
            let rows = target.len();
            let x = DMatrix::from_fn(rows, base.len(), |r, c| base[c][r]);
            let q = x.qr().q();
            let project = |y: &[f64]| {
                let y = DVector::from_column_slice(y);
                let inside = &q * q.tr_mul(&y);
                y - inside
            };
            let rest = project(&target);
            let mut scored: Vec<(f64, Candidate)> = Candidate::ripples(j, &ranges[j])
                .into_iter()
                .map(|candidate| {
                    let runs: Vec<_> = data
                        .signals
                        .iter()
                        .map(|s| candidate.columns(&s.motion(data.model, data.standstill)))
                        .collect();
                    let wave = |i: usize| project(&at_rows(&|e| runs[e][i].rows[0].1.clone()));
                    let (s, c) = (wave(0), wave(1));
                    let (ss, sc, cc) = (s.norm_squared(), s.dot(&c), c.norm_squared());
                    let (sy, cy) = (s.dot(&rest), c.dot(&rest));
                    let determinant = ss * cc - sc * sc;
                    let gain = if determinant > 1e-9 * ss * cc {
                        (cc * sy * sy - 2.0 * sc * sy * cy + ss * cy * cy) / determinant
                    } else {
                        0.0
                    };
                    (gain, candidate)
                })
                .collect();
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            let mut kept: Vec<Candidate> = Vec::new();
            for (gain, candidate) in scored {
                let ratio = |other: &Candidate| (candidate.shape / other.shape).max(other.shape / candidate.shape);
                if gain > 0.0 && kept.len() < RIPPLES && kept.iter().all(|other| ratio(other) > APART) {
                    kept.push(candidate);
                }
            }
            kept
        })
        .collect()
}
