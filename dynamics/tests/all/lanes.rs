//! Eight states at once give what each gives alone.

use crate::common;

use common::{Draw, assert_close, trees};
use gapscope_dynamics::{Data, LANES, LaneData};

fn rows(draw: &mut Draw, n: usize, reach: f64) -> Vec<[f64; LANES]> {
    (0..n).map(|_| draw.numbers(LANES, reach).try_into().unwrap()).collect()
}

fn lane(rows: &[[f64; LANES]], k: usize) -> Vec<f64> {
    rows.iter().map(|row| row[k]).collect()
}

#[test]
fn lanes_agree_with_single_states() {
    for (model, mut draw) in trees() {
        let n = model.dof();
        let (mut data, mut lanes) = (Data::new(&model), LaneData::new(&model));
        let (q, v, a) = (rows(&mut draw, n, 3.0), rows(&mut draw, n, 3.0), rows(&mut draw, n, 10.0));
        let (mut tau, mut back) = (vec![[0.0; LANES]; n], vec![[0.0; LANES]; n]);
        model.inverse_dynamics_lanes(&mut lanes, &q, &v, &a, &mut tau);
        model.forward_dynamics_lanes(&mut lanes, &q, &v, &tau, &mut back);
        for k in 0..LANES {
            let mut one = vec![0.0; n];
            model.inverse_dynamics(&mut data, &lane(&q, k), &lane(&v, k), &lane(&a, k), &mut one);
            assert_close(&one, &lane(&tau, k), 1e-13);
            model.forward_dynamics(&mut data, &lane(&q, k), &lane(&v, k), &lane(&tau, k), &mut one);
            assert_close(&one, &lane(&back, k), 1e-10);
            assert_close(&lane(&a, k), &lane(&back, k), 1e-9);
        }
    }
}
