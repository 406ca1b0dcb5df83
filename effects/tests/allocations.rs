//! A plant's step and residual allocate nothing, whatever effects it has: counted by the allocator.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{Draw, one_of_each, robot, rubbing};
use gapscope_dynamics::StepModel;
use gapscope_effects::Plant;
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

fn allocations(call: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    call();
    COUNT.with(Cell::get) - before
}

#[test]
fn the_count_counts() {
    assert!(allocations(|| drop(std::hint::black_box(vec![1.0]))) > 0);
}

#[test]
fn step_and_residual_allocate_nothing() {
    let mut draw = Draw::new(5);
    let tree = draw.tree(9);
    for model in [robot("arm7"), rubbing(&mut draw, &tree)] {
        let n = model.dof();
        let all = one_of_each(&mut draw, &model);
        let sets: Vec<Vec<_>> = all.iter().map(|e| vec![e.clone()]).chain([vec![], all.clone()]).collect();
        for effects in sets {
            let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
            let (q, v, a) = (draw.numbers(n, 1.0), draw.numbers(n, 1.0), draw.numbers(n, 1.0));
            let (tau, still) = (draw.numbers(n, 5.0), vec![0.1; n]);
            let (mut rest, standing) = (vec![0.0; n], vec![0.0; n]);
            let mut x = vec![0.0; plant.state_len()];
            let kinds: Vec<_> = effects.iter().map(|e| e.kind()).collect();
            let on_residual = allocations(|| plant.residual(&q, &v, &a, &tau, &still, &mut rest));
            assert_eq!(on_residual, 0, "residual with {kinds:?}");
            let on_steps = allocations(|| {
                // In motion, and at rest where friction sticks.
                for v in [&v, &standing] {
                    plant.start(&q, v, &mut x);
                    plant.step(&mut x, &tau);
                    plant.step(&mut x, &tau);
                }
            });
            assert_eq!(on_steps, 0, "steps with {kinds:?}");
        }
    }
}
