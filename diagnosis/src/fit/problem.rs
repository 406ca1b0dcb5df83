//! The least-squares problem behind the choice of effects, kept as normal equations per block, so that any subset of
//! candidates is fitted, held out and resampled in microseconds.

mod behind;
mod embody;
mod evidence;
mod score;
mod solve;
mod together;
mod weigh;

use crate::fit::terms::{Entry, Term};
use crate::record::band::Band;
use crate::record::frequency::{Equalizer, in_bands};
use crate::record::known::Known;
use crate::record::rows::effort_deviation;
use crate::record::signals::Signals;
use gapscope_dynamics::Model;
use gapscope_effects::{Body, Candidate, Column, EncoderSide, Kind};
use rayon::prelude::*;
pub use score::{Score, Solved};
use solve::{JointNormal, Normal};
use std::borrow::Cow;
pub use together::Together;

/// Rows of one joint: filtered columns and target.
#[derive(Debug, Clone)]
struct JointRows {
    /// Columns of the problem that touch this joint.
    columns: Vec<usize>,
    /// Index into the band's rows.
    rows: Vec<usize>,
    /// Row-major values, `rows × columns`: what a unit of each coefficient takes of the logged effort.
    values: Vec<f64>,
    target: Vec<f64>,
    /// The target before any bending.
    linear_target: Vec<f64>,
    /// Robust weight of each row.
    robust: Vec<f64>,
}

/// The problem: all candidates on all rows of a data set.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Candidates and their columns. Column 0 is the alignment of effort and position and belongs to none.
    pub entries: Vec<Entry>,
    /// Least and greatest value of each coefficient.
    pub bounds: Vec<(f64, f64)>,
    /// Kinds that no climb brings in.
    pub closed: Vec<Kind>,
    /// Gravity under which the columns of bodies stand, m/s² in the frame of the base.
    pub gravity: [f64; 3],
    /// Precision that each coefficient has before any log is seen, 1 over the square of its unit: 0 where any size is plausible.
    prior: Vec<f64>,
    /// Time between two samples of the fastest log, s.
    pub sample: f64,
    /// Standard deviation of the effort of each joint, N m or N.
    pub scale: Vec<f64>,
    /// Standard deviation of what the weighing set does not explain, N m or N, with the immaterial part as its least value.
    pub sigma: Vec<f64>,
    /// Root mean square of what all effects together are to explain of each joint, N m or N.
    pub gap: Vec<f64>,
    /// Rows of each joint that count as one independent row.
    correlation: Vec<f64>,
    /// What keeps each link a body.
    bodies: Vec<Option<Body>>,
    joints: Vec<JointRows>,
    fold_of_block: Vec<usize>,
    folds: usize,
    normals: Vec<JointNormal>,
    blocks: Vec<Normal>,
    training: Vec<Normal>,
    /// Of the rows of each fold.
    held: Vec<Normal>,
    total: Normal,
}

impl Problem {
    /// Sets up the problem: signatures of every candidate on every episode, filtered, those that are known taken as they
    /// are. Before use it must be weighed.
    pub fn new(
        model: &Model,
        signals: &[Signals],
        band: &Band,
        standstill: &[f64],
        moving: &[bool],
        terms: Vec<Term>,
        known: &Known,
    ) -> Problem {
        let n = model.dof();
        let terms: Vec<Term> = terms.into_iter().filter(|t| t.candidate.joints.iter().all(|&j| moving[j])).collect();
        let sample = signals.iter().map(|s| s.raw.dt).fold(f64::INFINITY, f64::min);
        let half_sample = 0.5 * sample;
        let nominal = model.gravity().to_array();
        let gravity = signals.first().map_or(nominal, |s| s.gravity(model));
        let weighs_otherwise = |term: &Term| term.candidate.kind.card().body && gravity != nominal;
        let stays = |term: &Term| term.tangent_at.is_none() && !weighs_otherwise(term);
        let known_of = |term: &Term| known.of(&term.candidate).filter(|_| stays(term));
        let mut entries = Vec::new();
        let mut bounds = vec![(-half_sample, half_sample)];
        // Anywhere within half a sample, each place alike.
        let mut prior = vec![3.0 / (half_sample * half_sample)];
        let mut joints: Vec<JointRows> = (0..n)
            .map(|_| JointRows {
                columns: vec![],
                rows: vec![],
                values: vec![],
                target: vec![],
                linear_target: vec![],
                robust: vec![],
            })
            .collect();
        for (e, s) in signals.iter().enumerate() {
            let motion = s.motion(model, standstill);
            let alignment = alignment(s, n);
            let fresh: Vec<Option<Vec<Column>>> =
                terms.par_iter().map(|t| known_of(t).is_none().then(|| t.columns(&motion))).collect();
            let columns: Vec<Columns<'_>> = terms
                .iter()
                .zip(&fresh)
                .map(|(term, fresh)| match fresh {
                    Some(columns) => Columns::Samples(columns),
                    None => Columns::Rows(known_of(term).unwrap_or_default()),
                })
                .collect();
            if e == 0 {
                for (term, columns) in terms.iter().zip(&columns) {
                    let begin = bounds.len();
                    bounds.extend(columns.list().iter().map(|c| (c.at_least, c.at_most)));
                    let scales = term.candidate.scales(model).unwrap_or_default();
                    prior.extend(scales.iter().map(|scale| scale.powi(-2)));
                    prior.resize(bounds.len(), 0.0);
                    let tangent = term.tangent_at.is_some();
                    let candidate = term.candidate.clone();
                    entries.push(Entry { candidate, columns: begin..bounds.len(), tangent, held: Vec::new() });
                }
                let all = std::iter::once(&alignment).chain(columns.iter().flat_map(Columns::list));
                for (index, column) in all.enumerate() {
                    for (j, _) in &column.rows {
                        joints[*j].columns.push(index);
                    }
                }
            }
            let of_episode = &band.of_episode[e];
            joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
                if !moving[j] {
                    return;
                }
                let counts = s.slides(j, standstill[j]);
                let residual: Vec<f64> =
                    s.tau[j].iter().zip(&s.nominal[j]).map(|(tau, nominal)| tau - nominal).collect();
                let target = band.filter_where(e, &counts, &residual);
                let at_rows = |x: &[f64]| -> Cow<'_, [f64]> {
                    band.filter_where(e, &counts, x).into_iter().map(|x| x.unwrap_or(0.0)).collect()
                };
                let once = Columns::Samples(std::slice::from_ref(&alignment));
                let filtered: Vec<Cow<'_, [f64]>> = std::iter::once(&once)
                    .chain(&columns)
                    .flat_map(|columns| columns.list().iter().map(move |c| (columns, c)))
                    .flat_map(|(columns, c)| c.rows.iter().filter(|(row, _)| *row == j).map(move |(_, x)| (columns, x)))
                    .map(|(columns, x)| match columns {
                        Columns::Samples(_) => at_rows(x),
                        Columns::Rows(_) => Cow::Borrowed(&x[of_episode.clone()]),
                    })
                    .collect();
                for (i, row) in of_episode.clone().enumerate() {
                    let Some(target) = target[i] else { continue };
                    if !band.rows[row].fits {
                        continue;
                    }
                    rows.rows.push(row);
                    rows.linear_target.push(target);
                    rows.target.push(target);
                    rows.robust.push(1.0);
                    rows.values.extend(filtered.iter().map(|x| x[i]));
                }
            });
        }
        // What is the same all the time a bias explains exactly.
        let scale = (0..n).map(|j| effort_deviation(signals, j).max(1e-9)).collect();
        let p = bounds.len();
        let mut fold_of_block = vec![0; band.blocks];
        for row in &band.rows {
            fold_of_block[row.block] = row.fold;
        }
        let mut problem = Problem {
            entries,
            bounds,
            closed: Vec::new(),
            gravity,
            prior,
            sample,
            scale,
            sigma: vec![1.0; n],
            gap: joints.iter().map(JointRows::gap).collect(),
            correlation: vec![1.0; n],
            bodies: (0..n).map(|j| Body::new(model, j)).collect(),
            joints,
            fold_of_block,
            folds: band.folds,
            normals: Vec::new(),
            blocks: Vec::new(),
            training: Vec::new(),
            held: Vec::new(),
            total: Normal::zeros(p),
        };
        problem.put_behind(signals, band, standstill);
        problem
    }

    /// Adds to the target what effects that were found change of the residual beyond their linear signature, so that fitting
    /// again finds them exactly: a chord method. `change` is what they change (`[episode][joint][signal]`), `signature` the
    /// coefficients of columns of this problem that stand for it.
    pub fn bend(
        &mut self,
        signals: &[Signals],
        band: &Band,
        standstill: &[f64],
        change: &[Vec<Vec<f64>>],
        signature: &[(usize, f64)],
    ) {
        let (columns, theta): (Vec<usize>, Vec<f64>) = signature.iter().copied().unzip();
        self.joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
            let mut bent = vec![0.0; band.rows.len()];
            for (e, s) in signals.iter().enumerate() {
                let counts = s.slides(j, standstill[j]);
                for (row, x) in band.of_episode[e].clone().zip(band.filter_where(e, &counts, &change[e][j])) {
                    bent[row] = x.unwrap_or(0.0);
                }
            }
            let linear = rows.predict(&columns, &theta);
            for (i, &row) in rows.rows.iter().enumerate() {
                rows.target[i] = rows.linear_target[i] + bent[row] + linear[i];
            }
        });
        self.accumulate(band);
    }

    /// Holds the rotors of drives that turn on their own where their accounts begin.
    pub fn begin_with_rotors(&mut self) {
        for entry in self.entries.iter().filter(|e| e.candidate.turns() && e.candidate.rotor > 0.0) {
            let rotor = entry.candidate.rotor;
            entry.columns.clone().take(1).for_each(|c| self.bounds[c] = (rotor, rotor));
        }
    }

    /// Number of blocks that hold rows.
    pub fn blocks_used(&self) -> usize {
        self.blocks.iter().filter(|b| b.square > 0.0).count()
    }

    /// All columns, those of no candidate first.
    pub fn all_columns(&self) -> Vec<usize> {
        (0..self.bounds.len()).collect()
    }

    /// Columns of a set of candidates, the alignment first, unless an effect of the set says how late the effort acts.
    pub fn columns(&self, set: &[usize]) -> Vec<usize> {
        let late = |&c: &usize| self.entries[c].candidate.kind.card().is_late();
        let alignment = (!set.iter().any(late)).then_some(0);
        alignment.into_iter().chain(set.iter().flat_map(|&c| self.entries[c].columns.clone())).collect()
    }

    /// The entries of a set that stand for laws outside the catalogue.
    pub fn outside(&self, set: &[usize]) -> Vec<usize> {
        set.iter().copied().filter(|&c| self.entries[c].candidate.kind.is_outside()).collect()
    }

    /// Joints whose drives turn on their own in a set.
    pub fn turning(&self, set: &[usize]) -> Vec<bool> {
        let mut turning = vec![false; self.joints.len()];
        for candidate in set.iter().map(|&c| &self.entries[c].candidate).filter(|c| c.turns()) {
            candidate.joints.iter().for_each(|&j| turning[j] = true);
        }
        turning
    }

    /// Side of the transmission that a set takes the log to show.
    pub fn side(&self, set: &[usize]) -> EncoderSide {
        let motor = set.iter().any(|&c| self.entries[c].candidate.side == EncoderSide::Motor);
        if motor { EncoderSide::Motor } else { EncoderSide::Link }
    }

    /// Puts other candidates of the same kinds and joints in the places of some entries, and reads anew what the alignment does.
    /// Where another gravity was found, all bodies are to be among them. Columns are of torque on the joint: a problem to choose
    /// from holds accounts without the gears and drives that were found.
    pub fn replace(
        &mut self,
        model: &Model,
        signals: &[Signals],
        band: &Band,
        standstill: &[f64],
        changes: &[(usize, Candidate)],
    ) {
        let taken: Vec<Vec<Column>> = signals.iter().map(|s| vec![alignment(s, self.joints.len())]).collect();
        self.fill(signals, band, standstill, 0, &taken);
        let of = |candidate: &Candidate| -> Vec<Vec<Column>> {
            signals.iter().map(|s| candidate.columns(&s.motion(model, standstill))).collect()
        };
        let runs: Vec<Vec<Vec<Column>>> = changes.par_iter().map(|(_, candidate)| of(candidate)).collect();
        for ((c, candidate), runs) in changes.iter().zip(&runs) {
            let begin = self.entries[*c].columns.start;
            self.fill(signals, band, standstill, begin, runs);
            for (i, column) in runs[0].iter().enumerate() {
                self.bounds[begin + i] = (column.at_least, column.at_most);
            }
            self.entries[*c].candidate = candidate.clone();
        }
        self.gravity = signals.first().map_or(self.gravity, |s| s.gravity(model));
        self.accumulate(band);
    }

    /// Writes new values, `[run][column]`, over the columns from `begin` on. A joint that a column does not act on keeps what
    /// it has.
    fn fill(&mut self, signals: &[Signals], band: &Band, standstill: &[f64], begin: usize, runs: &[Vec<Column>]) {
        let width = runs.first().map_or(0, Vec::len);
        self.joints.par_iter_mut().enumerate().for_each(|(j, rows)| {
            let m = rows.columns.len();
            let counts: Vec<_> = signals.iter().map(|s| s.slides(j, standstill[j])).collect();
            for i in 0..width {
                let of_joint = |run: &Vec<Column>| run[i].rows.iter().any(|(row, _)| *row == j);
                let Some(at) = rows.columns.iter().position(|&column| column == begin + i) else { continue };
                if !runs.iter().any(of_joint) {
                    continue;
                }
                let mut values = vec![0.0; band.rows.len()];
                for (e, run) in runs.iter().enumerate() {
                    for (_, x) in run[i].rows.iter().filter(|(row, _)| *row == j) {
                        for (row, x) in band.of_episode[e].clone().zip(band.filter_where(e, &counts[e], x)) {
                            values[row] = x.unwrap_or(0.0);
                        }
                    }
                }
                for (r, &row) in rows.rows.iter().enumerate() {
                    rows.values[r * m + at] = values[row];
                }
            }
        });
    }
}

/// The column that says how late the effort of a run comes behind its position.
fn alignment(s: &Signals, joints: usize) -> Column {
    let rows = (0..joints).map(|j| (j, s.taken_rate(j))).collect();
    Column { rows, at_least: f64::NEG_INFINITY, at_most: f64::INFINITY }
}

/// Columns of a candidate on one run, sample by sample, or on all runs at the rows of the band.
enum Columns<'a> {
    Samples(&'a [Column]),
    Rows(&'a [Column]),
}

impl<'a> Columns<'a> {
    fn list(&self) -> &'a [Column] {
        let (Columns::Samples(columns) | Columns::Rows(columns)) = self;
        columns
    }
}

impl JointRows {
    fn gap(&self) -> f64 {
        let sum: f64 = self.linear_target.iter().map(|x| x * x).sum();
        (sum / self.linear_target.len().max(1) as f64).sqrt()
    }

    fn predict(&self, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        let used: Vec<(usize, f64)> = columns
            .iter()
            .zip(theta)
            .filter_map(|(c, &t)| self.columns.binary_search(c).ok().map(|at| (at, t)))
            .collect();
        let m = self.columns.len();
        (0..self.rows.len()).map(|i| used.iter().map(|&(at, t)| self.values[i * m + at] * t).sum()).collect()
    }

    /// What is left of the rows in each band of frequencies, at the noise that an equaliser brings it to.
    fn in_bands(
        &self,
        band: &Band,
        joint: usize,
        rest: Vec<f64>,
        equalizer: Option<&Equalizer>,
    ) -> Vec<(Vec<f64>, f64)> {
        let mut all = vec![0.0; band.rows.len()];
        self.rows.iter().zip(rest).for_each(|(&row, rest)| all[row] = rest);
        if let Some(equalizer) = equalizer {
            equalizer.apply(band, joint, &mut all);
        }
        let own = |part: &Vec<f64>| self.rows.iter().map(|&row| part[row]).collect();
        in_bands(band, &all).iter().map(|(part, width)| (own(part), *width)).collect()
    }

    fn residual(&self, columns: &[usize], theta: &[f64]) -> Vec<f64> {
        self.predict(columns, theta).iter().zip(&self.target).map(|(p, y)| y - p).collect()
    }
}

#[cfg(test)]
mod tests;
