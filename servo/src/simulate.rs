//! One joint, simulated freely under what it was told, the others moving as they were measured.

use crate::around::Trace;
use crate::law::{Law, Order, Param};
use crate::run::{Around, Held, Run, Step};
use crate::wind_up::{Shaft, Wound};

/// Step of the integrator, s: this part of the servo's own time constant, within these bounds.
pub const STEP_PART: f64 = 0.1;
/// Least and greatest step, s.
pub const STEPS: [f64; 2] = [1e-3, 1e-2];

/// Position and speed of the link at an instant, rad and rad/s.
pub type State = (f64, f64);

/// Positions at the samples of a run, rad, into `out`, from the first measured one at rest.
pub fn simulate(law: &Law, run: &Run, out: &mut Vec<f64>) {
    follow(law, run, out, |_, _, _| {});
}

/// How a law moves its joint along a run.
pub fn trace(law: &Law, run: &Run) -> Trace {
    let mut tracer = Tracer::new(law, run);
    let mut shown = Vec::new();
    follow(law, run, &mut shown, |span, before, after| tracer.see(span, before, after));
    tracer.finish(run, shown)
}

/// A trace under way: it is told of the steps of a simulation, and keeps the state at rows and halfway between them.
pub struct Tracer {
    trace: Trace,
    per: usize,
    last: State,
}

impl Tracer {
    /// Of a joint with a law, along a run.
    pub fn new(law: &Law, run: &Run) -> Tracer {
        let trace = Trace { offset: law[Param::Offset], ..Trace::default() };
        Tracer { trace, per: run.around.per, last: (run.position[0], 0.0) }
    }

    /// A step: where it lies, in samples, and the link's state before and after it.
    #[inline]
    pub fn see(&mut self, [from, to]: [f64; 2], before: State, after: State) {
        let halves = (2 * self.per) as f64;
        loop {
            let at = self.trace.speed.len() as f64 / halves;
            if at >= to {
                break;
            }
            let part = ((at - from) / (to - from)).clamp(0.0, 1.0);
            if self.trace.speed.len().is_multiple_of(2) {
                self.trace.position.push(before.0 + part * (after.0 - before.0));
            }
            self.trace.speed.push(before.1 + part * (after.1 - before.1));
        }
        self.last = after;
    }

    /// The trace, with what the encoder showed at samples.
    pub fn finish(mut self, run: &Run, shown: Vec<f64>) -> Trace {
        let rows = (run.time.len() - 1) * self.per + 1;
        self.trace.position.resize(rows, self.last.0);
        self.trace.speed.resize(2 * rows - 1, self.last.1);
        self.trace.shown = shown;
        self.trace
    }
}

/// Sine and cosine of a small angle, to 1e-9 within .2 rad.
#[inline]
fn turn(angle: f64) -> (f64, f64) {
    if angle.abs() > 0.2 {
        return angle.sin_cos();
    }
    let square = angle * angle;
    let sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    (sin, 1.0 - 0.5 * square * (1.0 - square / 12.0 * (1.0 - square / 30.0)))
}

/// The weight on a link that the law turned to `angle`, N m.
#[inline]
fn gravity(around: &Around, angle: f64) -> f64 {
    let (sin, cos) = turn(angle - around.position);
    around.gravity * cos + around.slope * sin
}

/// The same with what the others' motion adds.
#[inline]
fn weight(around: &Around, angle: f64) -> f64 {
    gravity(around, angle) + around.coupling
}

/// Simulates; `see` is told of each step where it lies, in samples, and the link's state before and after it.
#[inline]
fn follow(law: &Law, run: &Run, out: &mut Vec<f64>, mut see: impl FnMut([f64; 2], State, State)) {
    out.clear();
    if let Some(shaft) = law.shaft(run.mass) {
        return follow_wound(law, &shaft, run, out, see);
    }
    let (mut q, mut v) = (run.position[0], 0.0);
    let (mut hint, mut restart) = (0, 0);
    let sigma = law[Param::Scale];
    out.push(q);
    for step in run.steps() {
        let Step { sample: k, span, time, length: h, around, .. } = step;
        if span[0] == 0.0 && run.restarts.get(restart) == Some(k) {
            restart += 1;
            (q, v) = run.state(*k);
        }
        let inertia = sigma * around.inertia / h;
        let weight = weight(around, q + 0.5 * h * v - law[Param::Offset]);
        let order = order(law, run, *k, *time, *h, &mut hint);
        let row = law.row(*h, q, v, order, inertia);
        let push = row.push + inertia * v - sigma * weight;
        let end = law.settle(&row, v, row.factor + inertia, push);
        let before = (q, v);
        (q, v) = (Law::move_on(*h, row.end, q, v, end), end);
        see(span.map(|part| *k as f64 + part), before, (q, v));
        if step.is_last {
            out.push(q);
        }
    }
}

/// The same of a joint whose motor and link turn apart: the side that the encoder is on.
fn follow_wound(law: &Law, shaft: &Shaft, run: &Run, out: &mut Vec<f64>, mut see: impl FnMut([f64; 2], State, State)) {
    let sigma = law[Param::Scale];
    let shown = |state: &Wound| if law.link_side { state.link[0] } else { state.motor[0] };
    let at_rest = |k: usize, q: f64| {
        shaft.at_rest(q, law.link_side, |link| sigma * gravity(&run.around.at(k), link - law[Param::Offset]))
    };
    let mut state = at_rest(0, run.position[0]);
    let (mut hint, mut restart) = (0, 0);
    out.push(shown(&state));
    for step in run.steps() {
        let Step { sample: k, span, time, length: h, around, .. } = step;
        if span[0] == 0.0 && run.restarts.get(restart) == Some(k) {
            restart += 1;
            let (q, v) = run.state(*k);
            state = at_rest(*k, q);
            (state.motor[1], state.link[1]) = (v, v);
        }
        let weight = weight(around, state.link[0] + 0.5 * h * state.link[1] - law[Param::Offset]);
        let inertia = sigma * around.inertia / h;
        let order = order(law, run, *k, *time, *h, &mut hint);
        // The servo closes its loop over what its encoder shows; the rotor has its own speed.
        let row = law.row(*h, shown(&state), state.motor[1], order, 0.0);
        let push = inertia * state.link[1] - sigma * weight;
        let before = (state.link[0], state.link[1]);
        let speed = state.motor[1];
        shaft.step(*h, &mut state, &row, inertia, push, |factor, push| law.settle(&row, speed, factor, push));
        let after = (state.link[0], state.link[1]);
        see(span.map(|part| *k as f64 + part), before, after);
        if step.is_last {
            out.push(shown(&state));
        }
    }
}

/// What the drive is told from `t` to `t + h`, in the step behind sample `k`.
#[inline]
pub(crate) fn order(law: &Law, run: &Run, k: usize, t: f64, h: f64, hint: &mut usize) -> Order {
    if !run.on[k] {
        return Order::Off;
    }
    let mean = |held: &Held, hint: &mut usize| held.mean(t - law[Param::Latency], h, hint);
    match (&run.target, &run.delivered) {
        (Some(target), _) => {
            let more = match &run.target_rate {
                Some(rate) if law[Param::Feedforward] != 0.0 => law[Param::Feedforward] * mean(rate, hint),
                _ => 0.0,
            };
            Order::Follow(mean(target, hint), law[Param::Feedback] * run.gain, more)
        }
        (None, Some(delivered)) => Order::Deliver(mean(delivered, hint)),
        (None, None) => Order::Off,
    }
}

/// Weighted error, simulated less measured position, at all samples of runs, rad, into `out`.
pub fn errors(law: &Law, runs: &[Run], out: &mut Vec<f64>) {
    out.clear();
    let mut path = Vec::new();
    for run in runs {
        simulate(law, run, &mut path);
        let rows = run.weight.iter().zip(path.iter().zip(&run.position));
        out.extend(rows.map(|(weight, (simulated, measured))| weight * (simulated - measured)));
    }
}
