//! Times the algorithms on one state at a time, in the manner of `pinocchio/driver.cpp`: run by `pinocchio/run.py`.
//!
//! `peer URDF STATES` prints one line an algorithm: name, nanoseconds a call (median of the repeats), and a sum of all
//! its results.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gapscope_dynamics::{Data, Discrete, Integrator, LANES, LaneData, Model, StepModel};
use nalgebra::DMatrix;
use std::hint::black_box;
use std::time::Instant;

struct State {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    tau: Vec<f64>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, urdf, states] = arguments.as_slice() else { panic!("usage: peer URDF STATES") };
    let xml = std::fs::read_to_string(urdf).expect("the URDF");
    let model = Model::from_urdf(&xml).expect("a valid URDF").model;
    let states = read_states(&std::fs::read_to_string(states).expect("the states"), model.dof());
    let n = model.dof();
    let mut data = Data::new(&model);
    let mut out = vec![0.0; n];

    report(&states, "inverse_dynamics", |s| {
        model.inverse_dynamics(&mut data, &s.q, &s.v, &s.a, &mut out);
        black_box(&out).iter().sum()
    });
    report(&states, "forward_dynamics", |s| {
        model.forward_dynamics(&mut data, &s.q, &s.v, &s.tau, &mut out);
        black_box(&out).iter().sum()
    });
    let mut mass = DMatrix::zeros(n, n);
    report(&states, "mass_matrix", |s| {
        model.mass_matrix(&mut data, &s.q, &mut mass);
        black_box(&mass);
        mass[(0, 0)]
    });
    let mut regressor = DMatrix::zeros(n, 10 * n);
    report(&states, "regressor", |s| {
        model.regressor(&mut data, &s.q, &s.v, &s.a, &mut regressor);
        black_box(&regressor);
        regressor[(0, 0)]
    });
    let mut steps = Discrete::new(model.clone(), 1e-3, Integrator::SemiImplicitEuler);
    let mut x = vec![0.0; 2 * n];
    report(&states, "step", |s| {
        steps.start(&s.q, &s.v, &mut x);
        steps.step(&mut x, &s.tau);
        black_box(&x)[0]
    });

    // Eight states at once: time a state.
    let blocks: Vec<[Vec<[f64; LANES]>; 4]> = states.chunks_exact(LANES).map(|block| lanes(block, n)).collect();
    let mut data = LaneData::new(&model);
    let mut out = vec![[0.0; LANES]; n];
    let time = median(blocks.len(), |s| {
        let [q, v, a, _] = &blocks[s];
        model.inverse_dynamics_lanes(&mut data, q, v, a, &mut out);
        black_box(&out);
    });
    println!("inverse_dynamics_lanes {:.3} 0", time / LANES as f64);
    let time = median(blocks.len(), |s| {
        let [q, v, _, tau] = &blocks[s];
        model.forward_dynamics_lanes(&mut data, q, v, tau, &mut out);
        black_box(&out);
    });
    println!("forward_dynamics_lanes {:.3} 0", time / LANES as f64);
}

fn report(states: &[State], name: &str, mut call: impl FnMut(&State) -> f64) {
    let sum: f64 = states.iter().map(&mut call).sum();
    let time = median(states.len(), |s| {
        black_box(call(&states[s]));
    });
    println!("{name} {time:.3} {sum:e}");
}

/// Median nanoseconds of one call, over repeats of as many passes through all states as the C++ driver makes.
fn median(states: usize, mut call: impl FnMut(usize)) -> f64 {
    let rounds = (2_000 / states).max(1);
    let mut times: Vec<f64> = (0..101)
        .map(|_| {
            let start = Instant::now();
            for _ in 0..rounds {
                for s in 0..states {
                    call(s);
                }
            }
            start.elapsed().as_nanos() as f64 / (rounds * states) as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn read_states(text: &str, n: usize) -> Vec<State> {
    let mut numbers = text.split_ascii_whitespace();
    let count: usize = numbers.next().expect("a count").parse().expect("a count");
    let mut take = || -> Vec<f64> { (0..n).map(|_| numbers.next().unwrap().parse().unwrap()).collect() };
    (0..count).map(|_| State { q: take(), v: take(), a: take(), tau: take() }).collect()
}

fn lanes(block: &[State], n: usize) -> [Vec<[f64; LANES]>; 4] {
    let mut out = [const { Vec::new() }; 4];
    for (part, out) in out.iter_mut().enumerate() {
        for i in 0..n {
            let mut row = [0.0; LANES];
            for (lane, state) in row.iter_mut().zip(block) {
                *lane = [&state.q, &state.v, &state.a, &state.tau][part][i];
            }
            out.push(row);
        }
    }
    out
}
