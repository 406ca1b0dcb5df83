//! One joint, simulated freely under what it was told, the others moving as they were measured.

use crate::law::{Law, Order, Param};
use crate::run::{Held, Run};
use crate::wind_up::{Shaft, Wound};

/// Step of the integrator, s: this part of the servo's own time constant, within these bounds.
pub const STEP_PART: f64 = 0.08;
/// Least and greatest step, s.
pub const STEPS: [f64; 2] = [1e-3, 1e-2];

/// Positions at the samples of a run, rad, into `out`, from the first measured one at rest.
pub fn simulate(law: &Law, run: &Run, out: &mut Vec<f64>) {
    out.clear();
    let count = run.time.len();
    if let Some(shaft) = law.shaft(run.mass) {
        return simulate_wound(law, &shaft, run, out);
    }
    let (mut q, mut v, mut load) = (run.position[0], 0.0, 0.0);
    let (mut hint, mut restart) = (0, 0);
    let sigma = law[Param::Scale];
    let gain = law[Param::Feedback] * run.gain;
    let latency = law[Param::Latency];
    out.push(q);
    for k in 0..count - 1 {
        if run.restarts.get(restart) == Some(&k) {
            restart += 1;
            (q, v) = run.state(k);
        }
        let dt = run.time[k + 1] - run.time[k];
        let parts = (dt / run.step - 1e-6).ceil().max(1.0);
        let h = dt / parts;
        let around = &run.around;
        let apart = q - run.position[k] - law[Param::Offset];
        let (sin, cos) = apart.sin_cos();
        // Gravity where the joint is, and its slope, for all of the step.
        let gravity = around.gravity[k] * cos + around.slope[k] * sin;
        let slope = around.slope[k] * cos - around.gravity[k] * sin;
        let q_start = q;
        // What the others' motion adds to gravity within the step: the same angle, the surroundings of the next sample.
        let next = {
            let apart = q - run.position[k + 1] - law[Param::Offset];
            let (sin, cos) = apart.sin_cos();
            around.gravity[k + 1] * cos + around.slope[k + 1] * sin
        };
        for part in 0..parts as usize {
            let t = run.time[k] + part as f64 * h;
            let along = (part as f64 + 0.5) / parts;
            let inertia = sigma * (around.inertia[k] + along * (around.inertia[k + 1] - around.inertia[k])) / h;
            let coupling = around.coupling[k] + along * (around.coupling[k + 1] - around.coupling[k]);
            let weight = gravity + along * (next - gravity) + slope * (q + 0.5 * h * v - q_start);
            let order = order(run, k, t, h, latency, gain, &mut hint);
            let row = law.row(h, q, v, order, load);
            let push = row.push + inertia * v - sigma * (weight + coupling);
            let end = law.settle(row.factor + inertia, push, row.bound, row.delivered);
            load = row.torque;
            q = Law::move_on(h, q, v, end);
            v = end;
        }
        out.push(q);
    }
}

/// The same of a joint whose motor and link turn apart: the side that the encoder is on.
fn simulate_wound(law: &Law, shaft: &Shaft, run: &Run, out: &mut Vec<f64>) {
    let around = &run.around;
    let sigma = law[Param::Scale];
    let (gain, latency) = (law[Param::Feedback] * run.gain, law[Param::Latency]);
    let shown = |state: &Wound| if law.link_side { state.link[0] } else { state.motor[0] };
    let mut state = shaft.at_rest(run.position[0], sigma * around.gravity[0], law.link_side);
    let (mut hint, mut restart, mut load) = (0, 0, 0.0);
    out.push(shown(&state));
    for k in 0..run.time.len() - 1 {
        if run.restarts.get(restart) == Some(&k) {
            restart += 1;
            let (q, v) = run.state(k);
            state = shaft.at_rest(q, sigma * around.gravity[k], law.link_side);
            (state.motor[1], state.link[1]) = (v, v);
        }
        let dt = run.time[k + 1] - run.time[k];
        let parts = (dt / run.step - 1e-6).ceil().max(1.0);
        let h = dt / parts;
        for part in 0..parts as usize {
            let along = (part as f64 + 0.5) / parts;
            let between = |row: &[f64]| row[k] + along * (row[k + 1] - row[k]);
            let middle = state.link[0] + 0.5 * h * state.link[1] - law[Param::Offset];
            let (sin, cos) = (middle - between(&run.position)).sin_cos();
            let weight = between(&around.gravity) * cos + between(&around.slope) * sin + between(&around.coupling);
            let inertia = sigma * between(&around.inertia) / h;
            let order = order(run, k, run.time[k] + part as f64 * h, h, latency, gain, &mut hint);
            // The servo closes its loop over what its encoder shows; the rotor has its own speed.
            let row = law.row(h, shown(&state), state.motor[1], order, load);
            let push = inertia * state.link[1] - sigma * weight;
            shaft.step(h, &mut state, &row, inertia, push, |factor, push| {
                law.settle(factor, push, row.bound, row.delivered)
            });
            load = row.torque;
        }
        out.push(shown(&state));
    }
}

/// What the drive is told from `t` to `t + h`, in the step behind sample `k`.
#[inline]
fn order(run: &Run, k: usize, t: f64, h: f64, latency: f64, gain: f64, hint: &mut usize) -> Order {
    if !run.on[k] {
        return Order::Off;
    }
    let mean = |held: &Held, hint: &mut usize| held.mean(t - latency, h, hint);
    match (&run.target, &run.delivered) {
        (Some(target), _) => Order::Follow(mean(target, hint), gain),
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
