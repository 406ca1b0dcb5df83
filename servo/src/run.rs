//! One joint's part of one log, ready to be simulated alone: what it was told, and what the rest of the arm does to it.

use gapscope_datasets::Episode;
use std::sync::OnceLock;

/// What stands in the place of a joint's torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Signal {
    /// Set point alone: torque per rad of error.
    Command,
    /// Voltage: torque per V.
    Voltage,
    /// Current: torque per A.
    Current,
    /// Torque itself.
    Effort,
}

impl Signal {
    /// Unit of w.
    pub fn unit(self) -> &'static str {
        match self {
            Signal::Command => "rad",
            Signal::Voltage => "V",
            Signal::Current => "A",
            Signal::Effort => "N m",
        }
    }
}

/// A signal that is held from each sample to the next, with its integral: its mean over any span is exact.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Held {
    time: Vec<f64>,
    values: Vec<f64>,
    integral: Vec<f64>,
}

impl Held {
    /// Of samples; what is not known is held from before.
    pub fn new(time: &[f64], samples: &[f64]) -> Held {
        let mut last = samples.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
        let values: Vec<f64> = samples
            .iter()
            .map(|&x| {
                if x.is_finite() {
                    last = x;
                }
                last
            })
            .collect();
        let mut integral = vec![0.0; values.len()];
        for k in 1..values.len() {
            integral[k] = integral[k - 1] + values[k - 1] * (time[k] - time[k - 1]);
        }
        Held { time: time.to_vec(), values, integral }
    }

    /// The value at a sample.
    pub fn at(&self, k: usize) -> f64 {
        self.values[k]
    }

    /// Its rate at each sample, by the samples on both sides: a jump is spread over a sample before and one after it, so that
    /// it acts when it should in the mean.
    pub fn rate(&self) -> Held {
        let last = self.values.len() - 1;
        let of = |k: usize| {
            let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
            (self.values[to] - self.values[from]) / (self.time[to] - self.time[from]).max(1e-9)
        };
        Held::new(&self.time, &(0..=last).map(of).collect::<Vec<_>>())
    }

    /// ∫ from the first sample to t; `hint` is a sample near t, moved to the last one before it.
    #[inline(always)]
    fn until(&self, t: f64, hint: &mut usize) -> f64 {
        let last = self.values.len() - 1;
        while *hint > 0 && self.time[*hint] > t {
            *hint -= 1;
        }
        while *hint < last && self.time[*hint + 1] <= t {
            *hint += 1;
        }
        // Before the first sample the first value was there.
        self.integral[*hint] + self.values[*hint] * (t - self.time[*hint])
    }

    /// Mean from `t` to `t + h`.
    #[inline(always)]
    pub fn mean(&self, t: f64, h: f64, hint: &mut usize) -> f64 {
        let start = self.until(t, hint);
        (self.until(t + h, hint) - start) / h
    }
}

/// What the rest of the arm does to one joint at an instant. With the joint elsewhere than at `position` by d, gravity is
/// `gravity` cos d + `slope` sin d: exact for a joint that turns, as is an inertia that does not change with d.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Around {
    /// Position of the joint, rad.
    pub position: f64,
    /// M_jj, kg m².
    pub inertia: f64,
    /// Gravity torque there, N m.
    pub gravity: f64,
    /// Its derivative by the joint's own position, N m/rad.
    pub slope: f64,
    /// Torque by the motion of other joints, N m.
    pub coupling: f64,
}

impl Around {
    /// Part of the way to another.
    #[inline]
    pub fn towards(&self, next: &Around, part: f64) -> Around {
        let between = |a: f64, b: f64| a + part * (b - a);
        Around {
            position: between(self.position, next.position),
            inertia: between(self.inertia, next.inertia),
            gravity: between(self.gravity, next.gravity),
            slope: between(self.slope, next.slope),
            coupling: between(self.coupling, next.coupling),
        }
    }
}

/// What the rest of the arm does to one joint along a log: some rows in each interval between samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// Rows in an interval.
    pub per: usize,
    /// The rows.
    pub rows: Vec<Around>,
    /// Integral of the coupling up to each row, N m times the time between rows.
    impulse: Vec<f64>,
}

impl Surroundings {
    /// Of so many rows in an interval.
    pub fn new(per: usize, rows: Vec<Around>) -> Surroundings {
        let mut impulse = vec![0.0; rows.len()];
        for row in 1..rows.len() {
            impulse[row] = impulse[row - 1] + 0.5 * (rows[row - 1].coupling + rows[row].coupling);
        }
        Surroundings { per, rows, impulse }
    }

    /// At a sample.
    #[inline]
    pub fn at(&self, sample: usize) -> Around {
        self.rows[sample * self.per]
    }

    /// In the middle of a step behind a sample, which lies `from` one part `to` another of the way to the next. Other joints jolt
    /// this one within less than a step: their torque is its mean over the step, and no impulse is lost.
    #[inline(always)]
    pub fn over(&self, sample: usize, [from, to]: [f64; 2]) -> Around {
        let (start, per) = (sample * self.per, self.per as f64);
        let along = 0.5 * (from + to) * per;
        let row = start + along as usize;
        let middle = self.rows[row].towards(&self.rows[row + 1], along.fract());
        let until = |part: f64| {
            let along = part * per;
            let row = (start + along as usize).min(self.rows.len() - 2);
            let rest = start as f64 + along - row as f64;
            let [a, b] = [row, row + 1].map(|row| self.rows[row].coupling);
            self.impulse[row] + rest * (a + 0.5 * rest * (b - a))
        };
        Around { coupling: (until(to) - until(from)) / ((to - from) * per), ..middle }
    }
}

/// One joint's part of one log.
#[derive(Debug, Clone)]
pub struct Run {
    /// Time, s, from zero.
    pub time: Vec<f64>,
    /// Measured position, rad.
    pub position: Vec<f64>,
    /// Set point.
    pub target: Option<Held>,
    /// Its rate, rad/s.
    pub target_rate: Option<Held>,
    /// Logged w, where nothing else tells what the drive does.
    pub delivered: Option<Held>,
    /// Whether the motor is on, from each sample to the next.
    pub on: Vec<bool>,
    /// Gain of this log over the one of the first.
    pub gain: f64,
    /// The servo's own number for its gain in this log, where it was given.
    pub own_gain: Option<f64>,
    /// w per rad of set point error, where the log shows both.
    pub seen_feedback: Option<f64>,
    /// What the rest of the arm does.
    pub around: Surroundings,
    /// Mean inertia of the bodies about the joint, kg m²: what a spring's frequency is told by.
    pub mass: f64,
    /// Weight of each sample's error; zero where it is not compared.
    pub weight: Vec<f64>,
    /// Which samples repeat the one before while the arm moves: they are not compared.
    pub stale: Vec<bool>,
    /// Whether its stamps were counted and not read: samples then lie off them by what the recorder's clock jitters.
    pub is_counted: bool,
    /// How much that is, rms, as the last weighting found it, s; zero where stamps were read.
    pub strays: f64,
    /// Samples at which the simulation starts anew from the log, in order: where no closed loop holds it to the log.
    pub restarts: Vec<usize>,
    /// Longest step of the integrator, s.
    pub step: f64,
    /// Steps of the integrator, once they were asked for.
    pub steps: Steps,
    /// Index of the log.
    pub log: usize,
}

/// A step of the integrator: what of it no law changes.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Sample that it lies behind.
    pub sample: usize,
    /// Where it begins and ends, in parts of the way to the next sample.
    pub span: [f64; 2],
    /// When it begins, and how long it is, s.
    pub time: f64,
    /// See `time`.
    pub length: f64,
    /// What the rest of the arm does in its middle.
    pub around: Around,
    /// Whether the next sample lies at its end.
    pub is_last: bool,
}

/// The steps of a run, cut when they are first asked for.
#[derive(Debug, Clone, Default)]
pub struct Steps(OnceLock<Vec<Step>>);

impl Run {
    /// The steps of the integrator, in order.
    pub fn steps(&self) -> &[Step] {
        self.steps.0.get_or_init(|| {
            let mut steps = Vec::new();
            for (k, pair) in self.time.windows(2).enumerate() {
                let dt = pair[1] - pair[0];
                let parts = (dt / self.step - 1e-6).ceil().max(1.0);
                let (length, of_sample) = (dt / parts, 1.0 / parts);
                steps.extend((0..parts as usize).map(|part| {
                    let span = [part, part + 1].map(|part| part as f64 * of_sample);
                    Step {
                        sample: k,
                        span,
                        time: pair[0] + part as f64 * length,
                        length,
                        around: self.around.over(k, span),
                        is_last: part + 1 == parts as usize,
                    }
                }));
            }
            steps
        })
    }

    /// Goes by steps of at most `longest` s from now on.
    pub fn step_by(&mut self, longest: f64) {
        if self.step != longest {
            self.step = longest;
            self.steps = Steps::default();
        }
    }

    /// Puts it into other surroundings.
    pub fn surround(&mut self, around: Surroundings) {
        self.around = around;
        self.steps = Steps::default();
    }

    /// The samples from `from` to `to`, the latter included, as a run that begins in the state that the log shows.
    pub fn part(&self, [from, to]: [usize; 2]) -> Run {
        let per = self.around.per;
        let restarts = self.restarts.iter().filter(|k| (from..to).contains(*k)).map(|k| k - from);
        let begins_anew = from > 0 && !self.restarts.contains(&from);
        Run {
            time: self.time[from..=to].to_vec(),
            position: self.position[from..=to].to_vec(),
            on: self.on[from..=to].to_vec(),
            around: Surroundings::new(per, self.around.rows[from * per..=to * per].to_vec()),
            weight: self.weight[from..=to].to_vec(),
            stale: self.stale[from..=to].to_vec(),
            restarts: begins_anew.then_some(0).into_iter().chain(restarts).collect(),
            steps: Steps::default(),
            ..self.clone()
        }
    }

    /// Measured position, rad, and speed by the parabola through the samples around, rad/s.
    pub fn state(&self, k: usize) -> (f64, f64) {
        crate::around::state(&self.time, &self.position, k)
    }

    /// Samples of a channel of one joint, where it has a number.
    pub fn channel(samples: &Option<Vec<Vec<f64>>>, joint: usize) -> Option<&[f64]> {
        let row = samples.as_ref()?.get(joint)?;
        row.iter().any(|x| x.is_finite()).then_some(row.as_slice())
    }

    /// Which samples have the motor on. Where the log does not say, it is on.
    pub fn enabled(episode: &Episode, joint: usize) -> Vec<bool> {
        match Run::channel(&episode.enabled, joint) {
            Some(row) => row.iter().map(|&x| x != 0.0).collect(),
            None => vec![true; episode.len()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jolt_between_the_middles_of_steps_is_felt_in_full() {
        // Four rows in each of two intervals; a jolt of 1 N m at one row has an impulse of 1 N m times the time between rows.
        let row = |k: usize| Around { coupling: f64::from(u8::from(k == 3)), gravity: k as f64, ..Around::default() };
        let around = Surroundings::new(4, (0..9).map(row).collect());
        for steps in [1, 2, 3, 5, 8] {
            let part = 1.0 / f64::from(steps);
            let spans = (0..2).flat_map(|k| (0..steps).map(move |i| (k, [i, i + 1].map(|i| f64::from(i) * part))));
            let impulse: f64 = spans.map(|(k, span)| around.over(k, span).coupling * 4.0 * part).sum();
            assert!((impulse - 1.0).abs() < 1e-12, "{steps}: {impulse}");
        }
        let middle = around.over(1, [0.25, 0.75]);
        assert!((middle.gravity - 6.0).abs() < 1e-12);
    }
}
