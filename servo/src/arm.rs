//! The whole arm, simulated freely under its set points: all joints at once, coupled by the model's mass matrix.
//!
//! Each step solves (M/h + D) v⁺ = rhs − friction by sweeps over the joints, each joint with its own law and its own dry
//! friction (projected Gauss–Seidel, as in Moreau's time stepping). Rows are in units of what each drive follows.

use crate::around::{FINE, Trace};
use crate::law::{END, Law, Param, Row};
use crate::prepare::Joint;
use crate::simulate::{State, Tracer, order};
use crate::wind_up::{Shaft, Wound};
use gapscope_dynamics::{Data, Model};
use nalgebra::DMatrix;
use std::ops::Range;

/// Sweeps of a step; they end earlier once no speed changes by more than a part in 10¹⁰ of the fastest.
const SWEEPS: usize = 40;
const SETTLED: f64 = 1e-10;

/// What the encoder of a joint shows whose motor and link turn apart, rad.
fn shown(state: &Wound, law: &Law) -> f64 {
    if law.link_side { state.link[0] } else { state.motor[0] }
}

/// Positions of all joints at the samples of a log, `[joint][sample]`, rad, from the first measured ones at rest. A joint
/// without a law follows its set point perfectly while its motor is on, and is the bare model's while it is off.
///
/// Positions that cannot be, of a law that is no servo's, end the simulation: the rest is NaN.
pub fn simulate_arm(model: &Model, laws: &[Option<Law>], joints: &[Joint], log: usize) -> Vec<Vec<f64>> {
    let samples = joints.first().map_or(0, |joint| joint.runs[log].time.len());
    simulate_span(model, laws, joints, log, 0..samples)
}

/// The same over some samples of a log, from the state that the log shows at the first of them; at rest at the first of all.
pub fn simulate_span(
    model: &Model,
    laws: &[Option<Law>],
    joints: &[Joint],
    log: usize,
    span: Range<usize>,
) -> Vec<Vec<f64>> {
    follow(model, laws, joints, log, span, f64::INFINITY, |_, _, _, _| {})
}

/// How laws move all joints along a log; `None` where a joint has no law, or where the arm flies off.
pub fn trace_arm(model: &Model, laws: &[Option<Law>], joints: &[Joint], log: usize) -> Option<Vec<Option<Trace>>> {
    let own: Vec<Law> = laws.iter().copied().collect::<Option<_>>()?;
    let mut tracers: Vec<Tracer> =
        own.iter().zip(joints).map(|(law, joint)| Tracer::new(law, &joint.runs[log])).collect();
    let samples = joints.first().map_or(0, |joint| joint.runs[log].time.len());
    let path = follow(model, laws, joints, log, 0..samples, FINE, |j, span, before, after| {
        tracers[j].see(span, before, after)
    });
    let sound = path.iter().flatten().all(|q| q.is_finite());
    let finished = tracers.into_iter().zip(joints).zip(path);
    sound.then(|| finished.map(|((tracer, joint), shown)| Some(tracer.finish(&joint.runs[log], shown))).collect())
}

/// Simulates by steps of at most `longest` s; `see` is told of each step of each joint: where it lies, in samples, and the link's state before and after it.
fn follow(
    model: &Model,
    laws: &[Option<Law>],
    joints: &[Joint],
    log: usize,
    span: Range<usize>,
    longest: f64,
    mut see: impl FnMut(usize, [f64; 2], State, State),
) -> Vec<Vec<f64>> {
    let n = model.dof();
    if span.is_empty() {
        return vec![Vec::new(); n];
    }
    let time = &joints[0].runs[log].time;
    let first = span.start;
    let start: Vec<(f64, f64)> = joints
        .iter()
        .map(|joint| if first == 0 { (joint.runs[log].position[0], 0.0) } else { joint.runs[log].state(first) })
        .collect();
    let mut data = Data::new(model);
    let mut mass = DMatrix::zeros(n, n);
    let bare = {
        let mut law = Law::default();
        law[Param::Scale] = 1.0;
        law
    };
    let mut q: Vec<f64> = start.iter().map(|start| start.0).collect();
    let mut v: Vec<f64> = start.iter().map(|start| start.1).collect();
    let mut path: Vec<Vec<f64>> = q.iter().map(|&q| vec![q]).collect();
    let [mut turned, mut bias, mut end, mut push, mut factor, mut ends] = std::array::from_fn(|_| vec![0.0; n]);
    let mut hints = vec![0; n];
    let shafts: Vec<Option<Shaft>> =
        (0..n).map(|j| laws[j].and_then(|law| law.shaft(joints[j].runs[log].mass))).collect();
    // Of joints whose motor and link turn apart, q and v are the link's.
    let mut wound: Vec<Option<Wound>> = vec![None; n];
    let offset = |j: usize| laws[j].map_or(0.0, |law| law[Param::Offset]);
    for j in 0..n {
        let (Some(shaft), Some(law)) = (&shafts[j], &laws[j]) else { continue };
        let hangs = |link: f64| {
            let pose: Vec<f64> = (0..n).map(|i| if i == j { link } else { q[i] } - offset(i)).collect();
            let mut weight = vec![0.0; n];
            model.gravity_torque(&mut Data::new(model), &pose, &mut weight);
            law[Param::Scale] * weight[j]
        };
        let mut state = shaft.at_rest(q[j], law.link_side, hangs);
        (state.motor[1], state.link[1]) = (v[j], v[j]);
        q[j] = state.link[0];
        wound[j] = Some(state);
    }
    let mut next = wound.clone();
    let mut rows: Vec<Option<Row>> = vec![None; n];
    let step = joints.iter().map(|joint| joint.runs[log].step).fold(longest, f64::min);
    for k in first..span.end - 1 {
        let dt = time[k + 1] - time[k];
        let parts = (dt / step - 1e-6).ceil().max(1.0);
        let h = dt / parts;
        for part in 0..parts as usize {
            let t = time[k] + part as f64 * h;
            for j in 0..n {
                turned[j] = q[j] - offset(j);
            }
            model.mass_matrix(&mut data, &turned, &mut mass);
            model.bias(&mut data, &turned, &v, &mut bias);
            for j in 0..n {
                let run = &joints[j].runs[log];
                let law = laws[j].unwrap_or(bare);
                let order = order(&law, run, k, t, h, &mut hints[j]);
                let sigma = law[Param::Scale];
                let carried: f64 = (0..n).map(|i| mass[(j, i)] * v[i]).sum();
                if let Some(state) = &wound[j] {
                    let row = law.row(h, shown(state, &law), state.motor[1], order, 0.0);
                    rows[j] = Some(row);
                    push[j] = sigma * (carried / h - bias[j]);
                    factor[j] = sigma * mass[(j, j)] / h;
                    (end[j], ends[j]) = (v[j], END);
                    continue;
                }
                let row = law.row(h, q[j], v[j], order, sigma * mass[(j, j)] / h);
                ends[j] = row.end;
                push[j] = row.push + sigma * (carried / h - bias[j]);
                factor[j] = row.factor + sigma * mass[(j, j)] / h;
                rows[j] = Some(row);
                end[j] = v[j];
                if laws[j].is_none()
                    && run.on[k]
                    && let Some(target) = &run.target
                {
                    // Perfect tracking: at the next sample the joint stands at the set point of that sample.
                    end[j] = (target.at(k + 1) - q[j]) / (time[k + 1] - t);
                    factor[j] = f64::NAN;
                }
            }
            for _ in 0..SWEEPS {
                let mut change = 0.0_f64;
                for j in (0..n).filter(|&j| !factor[j].is_nan()) {
                    let law = laws[j].unwrap_or(bare);
                    let others: f64 = (0..n).filter(|&i| i != j).map(|i| mass[(j, i)] * end[i]).sum();
                    let rest = push[j] - law[Param::Scale] * others / h;
                    let speed = match (&shafts[j], &wound[j], &rows[j]) {
                        (Some(shaft), Some(state), Some(row)) => {
                            let mut there = *state;
                            let motor = state.motor[1];
                            shaft.step(h, &mut there, row, factor[j], rest, |factor, push| {
                                law.settle(row, motor, factor, push)
                            });
                            next[j] = Some(there);
                            there.link[1]
                        }
                        (_, _, Some(row)) => law.settle(row, v[j], factor[j], rest),
                        _ => end[j],
                    };
                    change = change.max((speed - end[j]).abs());
                    end[j] = speed;
                }
                let fastest = end.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                if change <= SETTLED * fastest {
                    break;
                }
            }
            wound.copy_from_slice(&next);
            for j in 0..n {
                let before = (q[j], v[j]);
                q[j] =
                    if factor[j].is_nan() { q[j] + h * end[j] } else { Law::move_on(h, ends[j], q[j], v[j], end[j]) };
                v[j] = end[j];
                see(j, [part, part + 1].map(|part| k as f64 + part as f64 / parts), before, (q[j], v[j]));
            }
        }
        let sound = q.iter().all(|q| q.is_finite() && q.abs() < 1e6);
        for j in 0..n {
            let shown = wound[j].as_ref().zip(laws[j]).map_or(q[j], |(state, law)| shown(state, &law));
            path[j].push(if sound { shown } else { f64::NAN });
        }
        if !sound {
            path.iter_mut().for_each(|row| row.resize(span.len(), f64::NAN));
            break;
        }
    }
    path
}
