//! Linear sums of however many logs: what a first pass over a fleet keeps of all of them.
//!
//! Each joint's torque gap r is held against columns A in which it is linear: the bodies that the joint carries, and its own
//! viscous and Coulomb friction, rotor and bias. Kept are AᵀA, Aᵀr and rᵀr, row by row in the band of the diagnosis. The sums
//! of one log are added as integers, so that logs may be added and sums merged in any order: the bits are the same.

use crate::record::band::Band;
use crate::record::signals::{Signals, standstill};
use gapscope_datasets::Episode;
use gapscope_dynamics::Model;
use gapscope_effects::{Candidate, Kind};
use nalgebra::{DMatrix, DVector};

/// Parts of one in which sums are counted: fine beside any noise, and 2⁶³ fits.
const UNIT: f64 = 18_446_744_073_709_551_616.0;
/// The greatest sum of one log: a hundred million of them fit.
const MOST: f64 = 6.9e10;
/// Parameters of a body.
const BODY: usize = 10;
/// What columns that no log moves weigh, as a part of those that one does: enough to solve, too little to count.
const RIDGE: f64 = 1e-9;
/// Rounds in which joints get weights by what is left of them.
const ROUNDS: usize = 4;
/// Logs are unlike those that were chosen where a fit to all takes so many times as much off what the chosen ones leave of all
/// as these leave of themselves, root mean squares: a tenth of the logs shows so, and noisier logs do not, ...
const UNLIKE: f64 = 1.0;
/// ... and more than this part of the gap of the nominal model.
const LEAST: f64 = 0.02;

/// Sums of logs of one robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sums {
    episodes: u64,
    joints: Vec<Gram>,
}

/// Of one joint: rows, and the lower triangle of \[A r\]ᵀ\[A r\] in parts of one.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Gram {
    rows: u64,
    triangle: Vec<i128>,
}

/// What a log is worth where not all of them can be taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Logs of the lowest rank are taken: a log whose joints slide for twice as long is so with twice the odds. It depends on
    /// the log alone.
    pub rank: f64,
    /// Digest of its samples.
    pub digest: u64,
}

/// Why sums cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SumsError {
    /// A log with fewer samples than the smallest window.
    #[error("{0} is too short to form derivatives; leave it out")]
    Short(String),
    /// Sums beyond what is counted.
    #[error("{0} has torques or motions beyond any robot's; check its units with `gapscope inspect`")]
    Beyond(String),
    /// Sums of different robots.
    #[error("the sums are of different robots; merge those of one")]
    Other,
    /// Bytes that are no sums of this robot.
    #[error("these bytes are no sums of this robot, or another version wrote them; make them anew")]
    Bytes,
}

impl Sums {
    /// Of no log.
    pub fn new(model: &Model) -> Sums {
        let gram = |j: usize| Gram { rows: 0, triangle: vec![0; triangle(columns(model, j).len() + 1)] };
        Sums { episodes: 0, joints: (0..model.dof()).map(gram).collect() }
    }

    /// Number of logs.
    pub fn episodes(&self) -> u64 {
        self.episodes
    }

    /// Adds a log of torque; returns its place among all.
    ///
    /// # Errors
    /// A log that is too short or beyond all bounds; nothing is added then.
    pub fn add(&mut self, model: &Model, episode: &Episode) -> Result<Place, SumsError> {
        let signals = Signals::new(model, episode).ok_or_else(|| SumsError::Short(episode.name.clone()))?;
        let signals = std::slice::from_ref(&signals);
        let still = standstill(signals, model.dof());
        let one = Sums::of(model, signals, &still).ok_or_else(|| SumsError::Beyond(episode.name.clone()))?;
        self.merge(&one)?;
        let samples = |j: usize| signals[0].slides(j, still[j]).into_iter().filter(|slides| *slides).count();
        let seconds = signals[0].dt * (0..model.dof()).map(samples).sum::<usize>() as f64;
        let digest = episode.motion_digest();
        let uniform = (digest as f64 + 0.5) / UNIT;
        Ok(Place { rank: -uniform.ln() / seconds, digest })
    }

    /// Adds other sums.
    ///
    /// # Errors
    /// Sums of another robot.
    pub fn merge(&mut self, other: &Sums) -> Result<(), SumsError> {
        let sizes = |sums: &Sums| sums.joints.iter().map(|gram| gram.triangle.len()).collect::<Vec<_>>();
        if sizes(self) != sizes(other) {
            return Err(SumsError::Other);
        }
        self.episodes += other.episodes;
        for (own, more) in self.joints.iter_mut().zip(&other.joints) {
            own.rows += more.rows;
            own.triangle.iter_mut().zip(&more.triangle).for_each(|(own, more)| *own += more);
        }
        Ok(())
    }

    /// Little-endian: number of logs; of each joint rows and sums.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = self.episodes.to_le_bytes().to_vec();
        for gram in &self.joints {
            out.extend(gram.rows.to_le_bytes());
            gram.triangle.iter().for_each(|sum| out.extend(sum.to_le_bytes()));
        }
        out
    }

    /// The sums that [`Sums::to_bytes`] gave, of this robot.
    ///
    /// # Errors
    /// Bytes of another length.
    pub fn from_bytes(model: &Model, bytes: &[u8]) -> Result<Sums, SumsError> {
        let mut sums = Sums::new(model);
        let mut rest = bytes;
        let mut take = |count: usize| -> Result<[u8; 16], SumsError> {
            let (head, tail) = rest.split_at_checked(count).ok_or(SumsError::Bytes)?;
            rest = tail;
            let mut out = [0; 16];
            out[..count].copy_from_slice(head);
            Ok(out)
        };
        let count = |bytes: [u8; 16]| u128::from_le_bytes(bytes) as u64;
        sums.episodes = count(take(8)?);
        for gram in &mut sums.joints {
            gram.rows = count(take(8)?);
            for sum in &mut gram.triangle {
                *sum = i128::from_le_bytes(take(16)?);
            }
        }
        if rest.is_empty() { Ok(sums) } else { Err(SumsError::Bytes) }
    }

    /// What a linear fit to the logs of `chosen` leaves of all, N m or N: where a fit to all leaves much less, in words, joint by
    /// joint.
    pub fn unlike(&self, model: &Model, chosen: &Sums) -> Vec<String> {
        let (of_chosen, of_all) = (chosen.fit(model), self.fit(model));
        let mut said = Vec::new();
        for (j, joint) in model.joints().iter().enumerate() {
            let (gap, least) = (self.left(model, j, None), self.left(model, j, Some(&of_all)));
            let (left, own) = (self.left(model, j, Some(&of_chosen)), chosen.left(model, j, Some(&of_chosen)));
            let gained = (left * left - least * least).max(0.0).sqrt();
            if gained > UNLIKE * own && gained > LEAST * gap {
                said.push(format!(
                    "joint `{}`: bodies and friction as in the logs that were diagnosed leave a gap of {left:.3} over all logs, where they leave {own:.3} of their own: \
                     robots or days differ. Diagnose them apart, and put the results side by side with `gapscope compare`",
                    joint.name
                ));
            }
        }
        said
    }

    /// Gap of a joint over all logs, rms in N m or N: of the nominal model, or with coefficients.
    fn left(&self, model: &Model, joint: usize, coefficients: Option<&DVector<f64>>) -> f64 {
        let (gram, columns) = (self.joints[joint].dense(), columns(model, joint));
        let last = columns.len();
        let mut x = DVector::zeros(last + 1);
        x[last] = 1.0;
        if let Some(coefficients) = coefficients {
            columns.iter().enumerate().for_each(|(i, column)| x[i] = -coefficients[*column]);
        }
        let rows = self.joints[joint].rows.max(1) as f64;
        ((&gram * &x).dot(&x).max(0.0) / rows).sqrt()
    }

    /// Coefficients that leave least, joints weighted by what is left of them, bodies held near the model by what they are
    /// plausibly off by.
    fn fit(&self, model: &Model) -> DVector<f64> {
        let n = model.dof();
        let size = (BODY + of_joints().count()) * n;
        let mut prior = DVector::zeros(size);
        for (j, body) in bodies(n).enumerate() {
            let scales = body.scales(model).unwrap_or_default();
            scales.iter().enumerate().for_each(|(i, scale)| prior[BODY * j + i] = scale.powi(-2));
        }
        let mut left: Vec<f64> = (0..n).map(|j| self.left(model, j, None)).collect();
        let mut fit = DVector::zeros(size);
        for _ in 0..ROUNDS {
            let (mut normal, mut target) = (DMatrix::from_diagonal(&prior), DVector::zeros(size));
            for j in 0..n {
                let (gram, columns) = (self.joints[j].dense(), columns(model, j));
                let weight = left[j].max(f64::MIN_POSITIVE.sqrt()).powi(-2);
                for (i, &a) in columns.iter().enumerate() {
                    target[a] += weight * gram[(columns.len(), i)];
                    for (k, &b) in columns.iter().enumerate() {
                        normal[(a, b)] += weight * gram[(i, k)];
                    }
                }
            }
            // Brought to a diagonal of ones: parameters have different units.
            let scale = normal.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 1.0 });
            for a in 0..size {
                for b in 0..size {
                    normal[(a, b)] *= scale[a] * scale[b];
                }
                normal[(a, a)] += RIDGE;
            }
            let Some(factors) = normal.cholesky() else { return fit };
            fit = factors.solve(&target.component_mul(&scale)).component_mul(&scale);
            left = (0..n).map(|j| self.left(model, j, Some(&fit))).collect();
        }
        fit
    }

    /// The sums of one log; `None` where one is beyond all bounds.
    fn of(model: &Model, signals: &[Signals], still: &[f64]) -> Option<Sums> {
        let band = Band::whole(signals);
        let motion = signals[0].motion(model, still);
        let n = model.dof();
        // By joint: the columns that move it, in the order of `columns`.
        let mut tables: Vec<Vec<Vec<f64>>> = vec![Vec::new(); n];
        let own = of_joints().flat_map(|kind| (0..n).map(move |j| Candidate::new(kind, vec![j])));
        for column in bodies(n).chain(own).flat_map(|candidate| candidate.columns(&motion)) {
            for (joint, values) in column.rows {
                tables[joint].push(values);
            }
        }
        let mut sums = Sums::new(model);
        sums.episodes = 1;
        for (j, table) in tables.iter_mut().enumerate() {
            let gap = signals[0].tau[j].iter().zip(&signals[0].nominal[j]).map(|(tau, nominal)| tau - nominal);
            table.push(gap.collect());
            debug_assert_eq!(table.len(), columns(model, j).len() + 1);
            let slides = signals[0].slides(j, still[j]);
            let filtered: Vec<Vec<f64>> =
                table.iter().map(|x| band.filter_where(0, &slides, x).into_iter().flatten().collect()).collect();
            sums.joints[j].rows = filtered[0].len() as u64;
            let mut at = 0;
            for (i, a) in filtered.iter().enumerate() {
                for b in &filtered[..=i] {
                    let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    if sum.is_nan() || sum.abs() > MOST {
                        return None;
                    }
                    sums.joints[j].triangle[at] = (sum * UNIT).round() as i128;
                    at += 1;
                }
            }
        }
        Some(sums)
    }
}

impl Gram {
    /// The whole symmetric matrix.
    fn dense(&self) -> DMatrix<f64> {
        let size = (0..).find(|&size| triangle(size) >= self.triangle.len()).unwrap_or(0);
        let at = |i: usize, k: usize| self.triangle[i.max(k) * (i.max(k) + 1) / 2 + i.min(k)] as f64 / UNIT;
        DMatrix::from_fn(size, size, at)
    }
}

/// Numbers in a lower triangle.
fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

/// Which of all coefficients (ten of each body, then one of each kind and joint) move the torque of a joint.
fn columns(model: &Model, joint: usize) -> Vec<usize> {
    let carries = |body: usize| {
        let mut link = Some(body);
        while let Some(at) = link.filter(|at| *at != joint) {
            link = model.joints()[at].parent;
        }
        link.is_some()
    };
    let n = model.dof();
    let bodies = (0..n).filter(|body| carries(*body)).flat_map(|body| BODY * body..BODY * (body + 1));
    bodies.chain((0..of_joints().count()).map(|kind| BODY * n + kind * n + joint)).collect()
}

/// Kinds that are a little off on every robot, and of which each joint has its own.
fn of_joints() -> impl Iterator<Item = Kind> {
    Kind::ALL.into_iter().filter(|kind| kind.is_calibration() && !kind.card().body)
}

/// The bodies of all links.
fn bodies(joints: usize) -> impl Iterator<Item = Candidate> {
    let kind = Kind::ALL.into_iter().find(|kind| kind.is_calibration() && kind.card().body);
    kind.into_iter().flat_map(move |kind| (0..joints).map(move |j| Candidate::new(kind, vec![j])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_datasets::{Recipe, generate};
    use gapscope_dynamics::robots;
    use gapscope_effects::Effect;

    fn robot(name: &str) -> Model {
        robots::model(name).unwrap().unwrap().model
    }

    fn logs(model: &Model, viscous: f64, seeds: std::ops::Range<u64>) -> Vec<Episode> {
        let effects: Vec<Effect> = serde_json::from_str(&format!(
            r#"[{{"kind": "viscous_friction", "viscous": {{"joint1": {viscous}, "joint2": {viscous}}}}},
                {{"kind": "coulomb_friction", "coulomb": {{"joint1": 0.3}}}}]"#
        ))
        .unwrap();
        let recipe = Recipe { seconds: 6.0, rate: 250.0, ..Recipe::default() };
        seeds.map(|seed| generate(model, &effects, seed, &recipe, &format!("log {seed}")).unwrap()).collect()
    }

    fn summed(model: &Model, logs: &[Episode]) -> Sums {
        let mut sums = Sums::new(model);
        logs.iter().for_each(|log| {
            sums.add(model, log).unwrap();
        });
        sums
    }

    #[test]
    fn any_order_gives_the_same_bits() {
        let model = robot("arm6");
        let mut all = logs(&model, 0.2, 0..5);
        let whole = summed(&model, &all);
        all.reverse();
        let (mut left, right) = (summed(&model, &all[..2]), summed(&model, &all[2..]));
        left.merge(&right).unwrap();
        assert_eq!(left.to_bytes(), whole.to_bytes());
        assert_eq!(whole.episodes(), 5);
        assert_eq!(Sums::from_bytes(&model, &whole.to_bytes()).unwrap(), whole);
        let bytes = whole.to_bytes();
        assert_eq!(Sums::from_bytes(&model, &bytes[1..]), Err(SumsError::Bytes));
        assert_eq!(Sums::from_bytes(&robot("arm7"), &bytes), Err(SumsError::Bytes));
        assert_eq!(left.merge(&Sums::new(&robot("double_pendulum"))), Err(SumsError::Other));
    }

    #[test]
    fn a_fit_finds_what_a_joint_rubs_by_and_what_it_leaves_is_noise() {
        let model = robot("double_pendulum");
        let sums = summed(&model, &logs(&model, 0.2, 0..6));
        let fit = sums.fit(&model);
        let of = |kind: Kind| {
            let at = of_joints().position(|own| own == kind).unwrap();
            [fit[2 * (BODY + at)], fit[2 * (BODY + at) + 1]]
        };
        let (viscous, dry) = (of(Kind::ViscousFriction), of(Kind::CoulombFriction));
        assert!((viscous[0] - 0.2).abs() < 0.01 && (viscous[1] - 0.2).abs() < 0.01, "{viscous:?}");
        assert!((dry[0] - 0.3).abs() < 0.02 && dry[1].abs() < 0.02, "{dry:?}");
        for joint in 0..2 {
            let (gap, left) = (sums.left(&model, joint, None), sums.left(&model, joint, Some(&fit)));
            assert!(left < 0.1 * gap, "{joint}: {left} of {gap}");
        }
    }

    #[test]
    fn logs_that_are_unlike_the_chosen_are_said_and_others_are_not() {
        let model = robot("double_pendulum");
        let (one, same) = (logs(&model, 0.2, 0..4), logs(&model, 0.2, 4..12));
        let (chosen, mut all) = (summed(&model, &one), summed(&model, &one));
        all.merge(&summed(&model, &same)).unwrap();
        assert_eq!(all.unlike(&model, &chosen), Vec::<String>::new());
        // One log of thirteen is of a robot that rubs more.
        all.merge(&summed(&model, &logs(&model, 0.8, 12..13))).unwrap();
        let said = all.unlike(&model, &chosen);
        assert!(said.len() == 2 && said[0].starts_with("joint `joint1`: bodies and friction"), "{said:?}");
    }

    #[test]
    fn what_cannot_be_summed_is_refused_and_changes_nothing() {
        let model = robot("double_pendulum");
        let log = logs(&model, 0.2, 0..1).remove(0);
        let mut sums = Sums::new(&model);
        let short = log.part(0, 8, "short");
        assert_eq!(sums.add(&model, &short), Err(SumsError::Short("short".into())));
        let mut wild = log.clone();
        wild.effort[0].iter_mut().for_each(|tau| *tau *= 1e9);
        assert_eq!(sums.add(&model, &wild), Err(SumsError::Beyond("log 0".into())));
        assert_eq!(sums, Sums::new(&model));
        let place = sums.add(&model, &log).unwrap();
        assert_eq!(sums.add(&model, &log).unwrap(), place, "a place is the log's own");
        // It moves most of its six seconds, in both joints.
        assert!(place.rank > 0.0 && place.rank.is_finite(), "{place:?}");
    }
}
