//! A first look at knobs with too many places to try: only the best few go on.

use crate::record::data::Data;
use gapscope_effects::{Candidate, Column, Grid, Kind, Place, Range};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Ripples of one joint that go on.
const RIPPLES: usize = 2;
/// Places of one joint that go on, of rubs and of catches.
const PLACES: usize = 6;
/// Two ripples are apart if their cycles differ by this factor.
const APART: f64 = 1.15;
/// Powers of the position that a ripple must be seen beside: pose moves torque too, but slowly.
const POWERS: i32 = 5;

/// The ripples that take most out of each joint's residual (`[episode][joint][signal]`) beside a smooth function of pose
/// and speed, beside a load on the flange, which can hide them in each joint that bears it, and beside some candidates.
pub fn ripples(data: &Data<'_>, ranges: &[Range], residuals: &[Vec<Vec<f64>>], beside: &[Candidate]) -> Vec<Candidate> {
    let loads = Candidate::all(data.model).into_iter().filter(|c| c.kind.card().place == Place::Leaf);
    let beside: Vec<Candidate> = loads.chain(beside.iter().cloned()).collect();
    per_joint(
        data,
        ranges,
        residuals,
        &beside,
        |j| scanned(&Kind::ALL, j, &ranges[j]),
        |scored| {
            let mut kept: Vec<Candidate> = Vec::new();
            for candidate in scored {
                let ratio = |other: &Candidate| (candidate.shape / other.shape).max(other.shape / candidate.shape);
                if kept.len() < RIPPLES && kept.iter().all(|other| ratio(other) > APART) {
                    kept.push(candidate);
                }
            }
            kept
        },
    )
}

/// The places of each joint's travel at which friction or torque of their own would take most out of it, seen the same way.
pub fn places(data: &Data<'_>, ranges: &[Range], residuals: &[Vec<Vec<f64>>], beside: &[Candidate]) -> Vec<Candidate> {
    let of = |kind| {
        per_joint(
            data,
            ranges,
            residuals,
            beside,
            |j| scanned(&[kind], j, &ranges[j]),
            |mut scored| {
                scored.truncate(PLACES);
                scored
            },
        )
    };
    let is_scanned = |kind: &Kind| kind.card().knob.is_some_and(|knob| matches!(knob.grid, Grid::Scanned(_)));
    Kind::OUTSIDE.into_iter().filter(is_scanned).flat_map(of).collect()
}

/// Candidates of some kinds at a joint, of those that are looked at on a fine grid.
fn scanned(kinds: &[Kind], joint: usize, range: &Range) -> Vec<Candidate> {
    kinds.iter().flat_map(|&kind| Candidate::scanned(kind, joint, range)).collect()
}

/// For each joint that moves, what `keep` keeps of its candidates, the one that takes most out of the residual first.
fn per_joint(
    data: &Data<'_>,
    ranges: &[Range],
    residuals: &[Vec<Vec<f64>>],
    beside: &[Candidate],
    candidates: impl Fn(usize) -> Vec<Candidate> + Sync,
    keep: impl Fn(Vec<Candidate>) -> Vec<Candidate> + Sync,
) -> Vec<Candidate> {
    let joints: Vec<usize> = (0..ranges.len()).filter(|&j| data.moving[j]).collect();
    let columns = |candidate: &Candidate| -> Vec<Vec<Column>> {
        data.signals.iter().map(|s| candidate.columns(&s.motion(data.model, data.standstill))).collect()
    };
    // Of each candidate beside, `[episode][column]`.
    let beside: Vec<Vec<Vec<Column>>> = beside.par_iter().map(columns).collect();
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
            for runs in &beside {
                for i in 0..runs[0].len() {
                    // The same column touches the same joints in every episode.
                    if let Some(at) = runs[0][i].rows.iter().position(|(row, _)| *row == j) {
                        base.push(at_rows(&|e| runs[e][i].rows[at].1.clone()));
                    }
                }
            }
            let target = at_rows(&|e| residuals[e][j].clone());
            let x = DMatrix::from_fn(target.len(), base.len(), |r, c| base[c][r]);
            let q = x.qr().q();
            let project = |y: &[f64]| {
                let y = DVector::from_column_slice(y);
                let inside = &q * q.tr_mul(&y);
                y - inside
            };
            let rest = project(&target);
            let gain = |candidate: &Candidate| {
                let runs = columns(candidate);
                let columns: Vec<DVector<f64>> =
                    (0..runs[0].len()).map(|i| project(&at_rows(&|e| runs[e][i].rows[0].1.clone()))).collect();
                let k = columns.len();
                let gram = DMatrix::from_fn(k, k, |a, b| columns[a].dot(&columns[b]));
                let moment = DVector::from_fn(k, |a, _| columns[a].dot(&rest));
                // Two columns that are one tell nothing.
                let apart = gram.determinant() > 1e-9 * gram.diagonal().product();
                gram.cholesky().filter(|_| apart).map_or(0.0, |f| moment.dot(&f.solve(&moment)))
            };
            let mut scored: Vec<(f64, Candidate)> = candidates(j).into_iter().map(|c| (gain(&c), c)).collect();
            scored.retain(|(gain, _)| *gain > 0.0);
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            keep(scored.into_iter().map(|(_, candidate)| candidate).collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::plant::residual;
    use crate::record::band::Band;
    use crate::record::signals::{Signals, standstill};
    use crate::search::first::ranges;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::{Effect, Payload, Plant, TorqueRipple};

    /// A ripple of 0.03 N m in a joint that bears most of a load of 3 kg.
    #[test]
    fn a_ripple_is_seen_beside_a_load_on_the_flange() {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let on = |value: f64| [("joint5".to_owned(), value)].into();
        let effects = [
            Effect::Payload(Payload {
                joint: "joint6".into(),
                mass: 3.0,
                com: [0.05, 0.05, 0.15],
                inertia: [0.01, 0.0, 0.01, 0.0, 0.0, 0.01],
            }),
            Effect::TorqueRipple(TorqueRipple { amplitude: on(0.03), cycles: on(14.0), phase: on(0.7) }),
        ];
        let signals: Vec<Signals> = (1..4)
            .map(|seed| generate(&model, &effects, seed, &Recipe::default(), "log").unwrap())
            .map(|log| Signals::new(&model, &log).unwrap())
            .collect();
        let (band, still) = (Band::new(&signals), standstill(&signals, 6));
        let data = Data {
            model: &model,
            signals: &signals,
            band: &band,
            standstill: &still,
            moving: &[true; 6],
            noise: &[1e-3; 6],
            known: &crate::record::known::Known::default(),
        };
        let nominal = |s: &Signals| residual(&mut Plant::nominal(&model, s.dt), &model, s, &still, 0.0);
        let residuals: Vec<_> = signals.iter().map(nominal).collect();
        let found = ripples(&data, &ranges(&model, &signals), &residuals, &[]);
        let first = found.iter().find(|c| c.joints == [4]).unwrap();
        assert!((first.shape - 14.0).abs() < 0.5, "{found:?}");
    }
}
