//! No in-place method allocates, nor does a step: counted by the allocator.
#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use gapscope_dynamics::{Adaptive, Data, Discrete, Integrator, LANES, LaneData, StepModel};
use glam::DVec3;
use nalgebra::DMatrix;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promise.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[track_caller]
fn assert_allocates_nothing(call: impl FnOnce()) {
    let before = COUNT.with(Cell::get);
    call();
    assert_eq!(COUNT.with(Cell::get) - before, 0, "allocations");
}

#[test]
fn the_count_counts() {
    let before = COUNT.with(Cell::get);
    let held = std::hint::black_box(vec![1.0]);
    assert!(COUNT.with(Cell::get) > before);
    drop(held);
}

#[test]
fn in_place_methods_allocate_nothing() {
    let mut draw = common::Draw::new(5);
    let model = draw.tree(9);
    let n = model.dof();
    let mut data = Data::new(&model);
    let (q, v, a) = (draw.numbers(n, 3.0), draw.numbers(n, 3.0), draw.numbers(n, 3.0));
    let mut out = vec![0.0; n];
    let mut square = DMatrix::zeros(n, n);
    let mut jacobian = DMatrix::zeros(6, n);
    let mut regressor = DMatrix::zeros(n, 10 * n);
    assert_allocates_nothing(|| model.inverse_dynamics(&mut data, &q, &v, &a, &mut out));
    assert_allocates_nothing(|| model.gravity_torque(&mut data, &q, &mut out));
    assert_allocates_nothing(|| model.bias(&mut data, &q, &v, &mut out));
    assert_allocates_nothing(|| model.forward_dynamics(&mut data, &q, &v, &a, &mut out));
    assert_allocates_nothing(|| model.mass_matrix(&mut data, &q, &mut square));
    assert_allocates_nothing(|| model.coriolis_matrix(&mut data, &q, &v, &mut square));
    let [mut one, mut two, mut three] = std::array::from_fn(|_| DMatrix::zeros(n, n));
    assert_allocates_nothing(|| model.inverse_dynamics_derivatives(&mut data, &q, &v, &a, &mut one, &mut two));
    assert_allocates_nothing(|| {
        model.forward_dynamics_derivatives(&mut data, &q, &v, &a, &mut out, &mut one, &mut two, &mut three);
    });
    assert_allocates_nothing(|| model.forward_kinematics(&mut data, &q));
    assert_allocates_nothing(|| model.jacobian(&mut data, &q, n - 1, DVec3::X, &mut jacobian));
    assert_allocates_nothing(|| {
        model.kinetic_energy(&mut data, &q, &v);
    });
    assert_allocates_nothing(|| {
        model.potential_energy(&mut data, &q);
    });
    assert_allocates_nothing(|| model.regressor(&mut data, &q, &v, &a, &mut regressor));

    let mut lanes = LaneData::new(&model);
    let rows = vec![[0.3; LANES]; n];
    let mut out = rows.clone();
    assert_allocates_nothing(|| model.inverse_dynamics_lanes(&mut lanes, &rows, &rows, &rows, &mut out));
    assert_allocates_nothing(|| model.forward_dynamics_lanes(&mut lanes, &rows, &rows, &rows, &mut out));
}

#[test]
fn steps_allocate_nothing() {
    let mut draw = common::Draw::new(6);
    let model = draw.tree(7);
    let n = model.dof();
    let (q, v, tau) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0), draw.numbers(n, 1.0));
    for integrator in [Integrator::ExplicitEuler, Integrator::SemiImplicitEuler, Integrator::Rk4] {
        let mut steps = Discrete::new(model.clone(), 1e-3, integrator);
        let mut x = vec![0.0; steps.state_len()];
        let mut batch = vec![0.1; 11 * 2 * n];
        let torques = vec![0.1; 11 * n];
        let (mut by_state, mut by_torque) = (DMatrix::zeros(2 * n, 2 * n), DMatrix::zeros(2 * n, n));
        assert_allocates_nothing(|| {
            steps.start(&q, &v, &mut x);
            steps.step(&mut x, &tau);
            steps.step_batch(&mut batch, &torques);
            steps.jacobian(&x, &tau, &mut by_state, &mut by_torque);
        });
    }
    let mut steps = Adaptive::new(model, 1e-3, 1e-8);
    let mut x = vec![0.0; steps.state_len()];
    assert_allocates_nothing(|| {
        steps.start(&q, &v, &mut x);
        steps.step(&mut x, &tau);
    });
}
