//! What an account of a joint's drive leaves, and of that what noise leaves.

use super::*;
use crate::numbers::decide::{BLOCK_OF_NOISE, LIGHTEST_ROTOR, NOT_RIGID_LEAVES};

/// Part of the square of a column below which what others leave of it is rounding.
const OWN_PART: f64 = 1e-6;

impl Study<'_> {
    /// What a drive leaves at the rows of the band; nothing of the episodes that are not looked at.
    pub(super) fn rows(&self, drive: &Candidate, rotor: f64, view: View) -> Vec<f64> {
        self.rows_each(&[(Runs::Logged, drive, rotor)], view).pop().unwrap_or_default()
    }

    /// The same of several, each of these runs or those, a drive and a rotor.
    pub(super) fn rows_each(&self, asked: &[(Runs, &Candidate, f64)], view: View) -> Vec<Vec<f64>> {
        let all: Vec<(&JointRun, &Candidate, f64)> = (asked.iter())
            .flat_map(|&(of, drive, rotor)| self.episodes(view).map(move |e| (self.run(of, e), drive, rotor)))
            .collect();
        let mut left = JointRun::left_by_each(&all).into_iter();
        let rows = asked.iter().map(|_| self.at_rows(view, |_| left.next().unwrap_or_default())).collect();
        self.beside_calibration(view, rows)
    }

    /// Rows less what friction and bias of the joint could take of them: beside a drive they are others than beside a rigid one,
    /// and what they are beside that hides the drive.
    pub(super) fn beside_calibration(&self, view: View, mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let span = self.span(view);
        for rows in &mut rows {
            span.iter().for_each(|unit| less_along(rows, unit));
        }
        rows
    }

    /// What friction and bias of the joint span at the rows of the band.
    fn span(&self, view: View) -> Span {
        let known = || self.spans.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, span)) = known().iter().find(|(of, _)| *of == view) {
            return span.clone();
        }
        let mut span: Vec<Vec<f64>> = Vec::new();
        for c in 0..self.calibration.first().map_or(0, Vec::len) {
            let mut column = self.at_rows(view, |e| self.calibration[e][c].clone());
            let whole = dot(&column, &column);
            span.iter().for_each(|unit| less_along(&mut column, unit));
            let own = dot(&column, &column);
            if own > OWN_PART * whole {
                column.iter_mut().for_each(|x| *x /= own.sqrt());
                span.push(column);
            }
        }
        let span = Arc::new(span);
        known().push((view, span.clone()));
        span
    }

    pub(super) fn run(&self, of: Runs, episode: usize) -> &JointRun {
        match of {
            Runs::Logged => self.runs[episode],
            Runs::Noisier => &self.noisier[episode],
        }
    }

    /// Episodes that are looked at.
    pub(super) fn episodes(&self, view: View) -> impl Iterator<Item = usize> {
        (0..self.runs.len()).filter(move |e| view.episode.is_none_or(|only| only == *e))
    }

    /// A torque of each episode at the rows of the band, in a view.
    pub(super) fn at_rows(&self, view: View, mut torque: impl FnMut(usize) -> Vec<f64>) -> Vec<f64> {
        let mut rows = vec![0.0; self.logs.band.rows.len()];
        for e in self.episodes(view) {
            let seen = smooth(torque(e), view.smooth, self.runs[e].dt);
            let at_rows = self.logs.band.filter_where(e, &self.slides[e], &seen);
            for (row, seen) in rows[self.logs.band.of_episode[e].clone()].iter_mut().zip(at_rows) {
                *row = seen.unwrap_or(0.0);
            }
        }
        rows
    }

    /// How an account of the drive is held against a rigid one: springs, where a filter is asked for, through one that cuts
    /// at the resonance of rotor and link on the spring.
    pub(super) fn view(&self, drive: &Candidate, rotor: f64) -> View {
        let filtered =
            self.through && drive.kind.card().turning.is_some_and(|turning| turning.filtered == Some(drive.side));
        let resonance = || TAU * drive.shape * (1.0 + drive.inertia / rotor).sqrt();
        View { episode: None, smooth: filtered.then(resonance) }
    }

    pub(super) fn rigid_in(&self, view: View) -> Rigid {
        let rigid = [(Candidate::rotor(self.joint), self.rotor)];
        let (rest, noise) = self.rows_and_noise(&rigid, view).next().unwrap_or_default();
        let seen: Vec<f64> = noise.iter().copied().filter(|noise| *noise > 0.0).collect();
        let nothing = BLOCK_OF_NOISE.get() * mean(&seen) + self.unnoticed;
        let mut rigid = Rigid { noise, nothing, left: Vec::new() };
        rigid.left = self.beyond(rest, &taken_off(&rigid.noise, &rigid, view), nothing);
        rigid
    }

    /// What a rigid drive leaves where an account of a drive is held against it.
    pub(super) fn against(&self, drive: &Candidate, rotor: f64) -> Cow<'_, Rigid> {
        let view = self.view(drive, rotor);
        if view.smooth.is_none() { Cow::Borrowed(&self.rigid) } else { Cow::Owned(self.rigid_in(view)) }
    }

    /// Knob and rotor where a drive leaves least: a search along the two in steps that become smaller, through the filter
    /// of the first, as each through its own would favour those whose filter hides what they leave.
    pub(super) fn turn(&self, drive: Candidate, rotor: f64) -> (Candidate, f64) {
        let view = self.view(&drive, rotor);
        let rigid = self.against(&drive, rotor);
        let levels = |tries: &[(Candidate, f64)]| -> Vec<f64> {
            let left = self.left_in_each(tries, &rigid, view);
            left.iter().map(mean_logarithm).collect()
        };
        let first = vec![(drive, rotor)];
        let mut best = (levels(&first)[0], first[0].0.clone(), rotor);
        let mut step = STEPS.0;
        for _ in 0..MOVES {
            if step < STEPS.1 {
                break;
            }
            let mut tries = vec![(1.0, 1.0 + step), (1.0, 1.0 / (1.0 + step))];
            if best.1.shape > 0.0 {
                tries.extend([(1.0 + step, 1.0), (1.0 / (1.0 + step), 1.0)]);
            }
            let tries: Vec<(Candidate, f64)> = tries
                .into_iter()
                .map(|(knob, by)| (Candidate { shape: knob * best.1.shape, ..best.1.clone() }, by * best.2))
                .filter(|(_, rotor)| *rotor >= LIGHTEST_ROTOR.get() * self.inertia)
                .collect();
            let next = levels(&tries).into_iter().zip(tries).map(|(level, (drive, rotor))| (level, drive, rotor));
            let next = next.into_iter().find(|next| next.0 < best.0);
            match next {
                Some(next) => best = next,
                None => step /= 2.0,
            }
        }
        (best.1, best.2)
    }

    /// Mean logarithm of what is left of the blocks over what a rigid drive leaves: a burst of chatter counts as one block
    /// that is off.
    pub(super) fn measure(&self, drive: &Candidate, rotor: f64) -> f64 {
        let rigid = self.against(drive, rotor);
        mean_logarithm(self.left(drive, rotor, &rigid)) - mean_logarithm(&rigid.left)
    }

    /// Whether a drive that was not turned yet is half way to what [`beyond_doubt`] asks of it.
    pub(super) fn promises(&self, drive: &Candidate, rotor: f64) -> bool {
        let rigid = self.against(drive, rotor);
        leaves(NOT_RIGID_LEAVES.get().sqrt(), &rigid, &self.left(drive, rotor, &rigid))
    }

    /// A first look at the same of several drives with their rotors: of one episode alone, and with a rigid drive's noise.
    pub(super) fn first_measures(&self, episode: Option<usize>, plain: &Rigid, all: &[(Candidate, f64)]) -> Vec<f64> {
        let measure = |rows: Vec<f64>, rigid: &Rigid, view: View| {
            let left = self.beyond(rows, &taken_off(&rigid.noise, rigid, view), rigid.nothing);
            mean_logarithm(&left) - mean_logarithm(&rigid.left)
        };
        if self.through {
            let one = |(drive, rotor): &(Candidate, f64)| {
                let view = View { episode, ..self.view(drive, *rotor) };
                measure(self.rows(drive, *rotor, view), &self.rigid_in(view), view)
            };
            return all.iter().map(one).collect();
        }
        let view = View { episode, smooth: None };
        let asked: Vec<(Runs, &Candidate, f64)> =
            all.iter().map(|(drive, rotor)| (Runs::Logged, drive, *rotor)).collect();
        self.rows_each(&asked, view).into_iter().map(|rows| measure(rows, plain, view)).collect()
    }

    /// Mean square of each block that a drive leaves beyond noise and nothing, (N m)².
    pub(super) fn left(&self, drive: &Candidate, rotor: f64, rigid: &Rigid) -> Vec<f64> {
        let one = [(drive.clone(), rotor)];
        self.left_in_each(&one, rigid, self.view(drive, rotor)).pop().unwrap_or_default()
    }

    /// The same of several drives with their rotors, in one view.
    pub(super) fn left_in_each(&self, tries: &[(Candidate, f64)], rigid: &Rigid, view: View) -> Vec<Vec<f64>> {
        let left = |(rest, noise): (Vec<f64>, Vec<f64>)| {
            let noise = taken_off(&noise, rigid, view);
            self.beyond(rest, &noise, rigid.nothing)
        };
        self.rows_and_noise(tries, view).map(left).collect()
    }

    pub(super) fn beyond(&self, rest: Vec<f64>, noise: &[f64], nothing: f64) -> Vec<f64> {
        let left = self.mean_squares(rest).into_iter().zip(noise);
        left.map(|(left, noise)| (left - noise).max(0.0) + nothing).collect()
    }

    /// What each of some drives leaves at the rows of the band, and the mean square of what more noise changes of that in each
    /// block, (N m)².
    pub(super) fn rows_and_noise(
        &self,
        tries: &[(Candidate, f64)],
        view: View,
    ) -> impl Iterator<Item = (Vec<f64>, Vec<f64>)> {
        let with_noise = |(drive, rotor)| [Runs::Logged, Runs::Noisier].map(|of| (of, drive, rotor));
        let asked: Vec<(Runs, &Candidate, f64)> = tries.iter().map(|(d, r)| (d, *r)).flat_map(with_noise).collect();
        let mut rows = self.rows_each(&asked, view).into_iter();
        std::iter::from_fn(move || {
            let (rest, noisier) = (rows.next()?, rows.next()?);
            let noise = self.mean_squares(noisier.iter().zip(&rest).map(|(noisier, rest)| noisier - rest).collect());
            Some((rest, noise))
        })
    }

    /// Of every block that has rows.
    pub(super) fn mean_squares(&self, rows: Vec<f64>) -> Vec<f64> {
        rows::squares(&self.logs.band, &vec![rows], |_| true).iter().map(|block| block[0] / block[1]).collect()
    }

    /// Standard error of the knob, the rotor free: sandwich over blocks.
    pub(super) fn error(&self, drive: &Candidate, rotor: f64) -> f64 {
        let view = self.view(drive, rotor);
        let knob = |by: f64| Candidate { shape: drive.shape + by, ..drive.clone() };
        let by = [STEPS.1 * drive.shape, STEPS.1 * rotor];
        let (more, less) = (knob(by[0]), knob(-by[0]));
        let moved = [(drive, rotor), (&more, rotor), (&less, rotor), (drive, rotor + by[1]), (drive, rotor - by[1])];
        let rows = self.rows_each(&moved.map(|(drive, rotor)| (Runs::Logged, drive, rotor)), view);
        let slope = |step: f64, moved: &[f64], back: &[f64]| -> Vec<f64> {
            moved.iter().zip(back).map(|(m, b)| (m - b) / (2.0 * step)).collect()
        };
        let [rest, more, less, heavier, lighter] = rows.as_slice() else { return f64::INFINITY };
        let (knob, rotor) = (slope(by[0], more, less), slope(by[1], heavier, lighter));
        // The knob's slope less what the rotor could make up for.
        let part = dot(&knob, &rotor) / dot(&rotor, &rotor).max(f64::MIN_POSITIVE);
        let own: Vec<f64> = knob.iter().zip(&rotor).map(|(k, r)| k - part * r).collect();
        let mut scores = vec![0.0; self.logs.band.blocks];
        for (row, (own, rest)) in self.logs.band.rows.iter().zip(own.iter().zip(rest)) {
            scores[row.block] += own * rest;
        }
        dot(&scores, &scores).sqrt() / dot(&own, &own).max(f64::MIN_POSITIVE)
    }
}

/// Whether enough blocks of time show something, by what is left of each: a spread takes two. A joint that its load holds on one
/// side may cross its play once or twice.
pub(super) fn tells(rigid: &Rigid, left: &[f64]) -> bool {
    left.iter().filter(|left| **left > 2.0 * rigid.nothing).count() >= 2
}

/// Whether an account leaves this part, or less, of what a rigid drive leaves: in all, or of the blocks of time in the mean of
/// logarithms, as a burst of chatter is one block.
fn leaves(part: f64, rigid: &Rigid, with: &[f64]) -> bool {
    let gain = mean(&rigid.left.iter().zip(with).map(|(r, d)| (r / d).ln()).collect::<Vec<_>>());
    gain > -part.ln() || mean(with) < part * mean(&rigid.left)
}

/// By how many standard errors less is left of the blocks with an account than by a rigid drive, where that is beyond
/// doubt and worth it.
pub(super) fn beyond_doubt(rigid: &Rigid, with: &[f64]) -> Option<f64> {
    let ratios = rigid.left.iter().zip(with);
    let telling: Vec<f64> =
        ratios.filter(|(r, d)| r.max(**d) > 2.0 * rigid.nothing).map(|(r, d)| (r / d).ln()).collect();
    let beyond = telling.iter().sum::<f64>() / mean_square(&telling).sqrt() / (telling.len().max(1) as f64).sqrt();
    (beyond > 0.0 && leaves(NOT_RIGID_LEAVES.get(), rigid, with)).then_some(beyond)
}

/// What is taken off for the noise of an account: what a rigid drive has of it at most, as play is so sensitive that noise
/// might account for all that it leaves; through a filter, where noise is nearly the same for both, what it has more.
pub(super) fn taken_off(noise: &[f64], rigid: &Rigid, view: View) -> Vec<f64> {
    if view.smooth.is_some() {
        return vec![mean(noise) - mean(&rigid.noise); noise.len()];
    }
    noise.iter().zip(&rigid.noise).map(|(noise, rigid)| noise.min(*rigid)).collect()
}

/// A signal through a low-pass filter: two first-order lags of the same cut-off, rad/s, in a row.
pub(crate) fn smooth(mut x: Vec<f64>, cutoff: Option<f64>, dt: f64) -> Vec<f64> {
    if let Some(cutoff) = cutoff {
        let pass = -(-cutoff * dt).exp_m1();
        let (mut once, mut twice) = (0.0, 0.0);
        for x in &mut x {
            once += pass * (*x - once);
            twice += pass * (once - twice);
            *x = twice;
        }
    }
    x
}

/// A run in which a joint's position and effort have noise of some standard deviation once more.
pub(super) fn noisier(s: &Signals, run: &JointRun, position: f64, effort: f64, seed: u64) -> JointRun {
    let kernel = derivative_kernel(s.raw.dt);
    let mut random = Pcg64::seed_from_u64(seed);
    let samples = s.raw.position.first().map_or(0, Vec::len);
    let mut white = |deviation: f64| -> Vec<f64> {
        (0..samples).map(|_| deviation * random.sample::<f64, _>(StandardNormal)).collect()
    };
    let (position, effort) = (white(position), white(effort));
    let mut noisier = run.clone();
    for k in 0..run.rest.len() {
        let from = s.first + k * s.stride - kernel.reach;
        let (acceleration, effort) = (apply(&kernel.second, &position, from), apply(&kernel.value, &effort, from));
        noisier.acceleration[k] += acceleration;
        noisier.delivered[k] += effort;
        noisier.rest[k] += effort - run.inertia[k] * acceleration;
    }
    noisier
}

/// Takes off a signal what of it lies along another of length one.
fn less_along(x: &mut [f64], unit: &[f64]) {
    let part = dot(x, unit);
    x.iter_mut().zip(unit).for_each(|(x, unit)| *x -= part * unit);
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

pub(super) fn mean_logarithm(x: impl AsRef<[f64]>) -> f64 {
    let mean = mean(&x.as_ref().iter().map(|x| x.ln()).collect::<Vec<_>>());
    if mean.is_finite() { mean } else { f64::INFINITY }
}

pub(super) fn mean_square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64
}
