//! Laws outside the catalogue against mechanics: power of a drag, a stiff swing as a point mass, places that add up.

use crate::support::motion;
use gapscope_dynamics::{Data, Model, robots};
use gapscope_effects::{Candidate, Column, Kind, Range};
use glam::DVec3;
use nalgebra::DMatrix;

const DT: f64 = 1e-3;
const SAMPLES: usize = 1500;

/// A smooth motion of every joint, from rest.
struct Run {
    model: Model,
    q: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    a: Vec<Vec<f64>>,
    still: Vec<f64>,
}

impl Run {
    fn new() -> Run {
        let model = robots::model("arm6").unwrap().unwrap().model;
        let n = model.dof();
        let signal = |of: &dyn Fn(f64, f64) -> f64| -> Vec<Vec<f64>> {
            (0..n).map(|j| (0..SAMPLES).map(|k| of(3.0 + 0.7 * j as f64, DT * k as f64)).collect()).collect()
        };
        let q = signal(&|w, t| 0.4 * (1.0 - (w * t).cos()));
        let v = signal(&|w, t| 0.4 * w * (w * t).sin());
        let a = signal(&|w, t| 0.4 * w * w * (w * t).cos());
        Run { model, q, v, a, still: vec![1e-9; n] }
    }

    fn columns(&self, candidate: &Candidate) -> Vec<Column> {
        let Run { model, q, v, a, still } = self;
        candidate.columns(&motion(model, [q, v, a, v, v], DT, still))
    }

    /// Jacobian of a link's centre of mass, 3 × n, at a sample.
    fn jacobian(&self, link: usize, k: usize) -> DMatrix<f64> {
        let n = self.model.dof();
        let q: Vec<f64> = self.q.iter().map(|q| q[k]).collect();
        let center = self.model.joints()[link].inertia.center_of_mass().unwrap();
        let mut jacobian = DMatrix::zeros(6, n);
        self.model.jacobian(&mut Data::new(&self.model), &q, link, center, &mut jacobian);
        jacobian.rows(0, 3).into_owned()
    }

    fn velocity(&self, link: usize, k: usize) -> DVec3 {
        let jacobian = self.jacobian(link, k);
        let along = |i: usize| (0..self.v.len()).map(|j| jacobian[(i, j)] * self.v[j][k]).sum();
        DVec3::new(along(0), along(1), along(2))
    }
}

#[test]
fn a_drag_takes_the_cube_of_the_speed_in_power() {
    let run = Run::new();
    for link in 0..6 {
        let columns = run.columns(&Candidate::new(Kind::LinkDrag, vec![link]));
        for k in (100..SAMPLES).step_by(200) {
            let power: f64 = columns[0].rows.iter().map(|(j, torque)| torque[k] * run.v[*j][k]).sum();
            let speed = run.velocity(link, k).length();
            assert!((power - speed.powi(3)).abs() < 1e-9 * (1.0 + speed.powi(3)), "{link}: {power} {speed}");
        }
    }
}

#[test]
fn a_drag_in_a_joint_is_a_power_of_its_speed() {
    let run = Run::new();
    for power in [2.0, 3.0] {
        let drag = Candidate { shape: power, ..Candidate::new(Kind::JointDrag, vec![2]) };
        let columns = run.columns(&drag);
        let (joint, torque) = &columns[0].rows[0];
        assert_eq!(*joint, 2);
        for (torque, v) in torque.iter().zip(&run.v[2]) {
            assert!((torque - v.signum() * v.abs().powf(power)).abs() < 1e-12);
        }
    }
}

#[test]
fn a_mass_on_a_stiff_spring_is_carried_along() {
    let run = Run::new();
    let swing = Candidate { shape: 60.0, ..Candidate::new(Kind::Swing, vec![5]) };
    let columns = run.columns(&swing);
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    // The spring rings at first; then its force is mass by acceleration.
    for k in (700..SAMPLES - 1).step_by(40) {
        let acceleration = (run.velocity(5, k + 1) - run.velocity(5, k - 1)) / (2.0 * DT);
        let jacobian = run.jacobian(5, k);
        for (j, torque) in &columns[0].rows {
            let carried: f64 = (0..3).map(|i| jacobian[(i, *j)] * acceleration[i]).sum();
            worst = worst.max((torque[k] - carried).abs());
            largest = largest.max(carried.abs());
        }
    }
    assert!(worst < 0.02 * largest, "{worst} of {largest}");
}

/// The torque of a spring that stiffens is the slope of its energy, k x²/2 + h x⁴/4 − t x: what it takes on the way out it gives back.
#[test]
fn a_spring_that_stiffens_has_an_energy() {
    let run = Run::new();
    let (at, coefficients) = (0.3, [1.5, 4.0, 0.7]);
    let spring = Candidate { shape: at, ..Candidate::new(Kind::NonlinearSpring, vec![2]) };
    let columns = run.columns(&spring);
    let torque = |k: usize| coefficients.iter().zip(&columns).map(|(c, column)| c * column.rows[0].1[k]).sum::<f64>();
    let energy = |k: usize| {
        let x = run.q[2][k] - at;
        coefficients[0] * x.powi(2) / 2.0 + coefficients[1] * x.powi(4) / 4.0 - coefficients[2] * x
    };
    for k in (10..SAMPLES - 10).step_by(50) {
        let power = (energy(k + 1) - energy(k - 1)) / (2.0 * DT);
        assert!((power - torque(k) * run.v[2][k]).abs() < 1e-4, "{k}");
    }
    assert!(columns[1].at_least == 0.0 && columns[0].at_least < 0.0, "it stiffens, wherever it begins to");
    let range = Range { speed: 1.0, least: -1.0, span: 2.0, torque: 1.0, duration: 1.0 };
    let ranges = vec![range; run.model.dof()];
    let of_joint = |c: &&Candidate| c.kind == Kind::NonlinearSpring && c.joints == [2];
    let all = Candidate::outside(&run.model, &ranges);
    let shapes: Vec<f64> = all.iter().filter(of_joint).map(|c| c.shape).collect();
    assert_eq!(shapes, [-0.5, -0.25, 0.0, 0.25, 0.5]);
}

#[test]
fn rubs_and_catches_at_every_place_are_friction_and_a_bias() {
    let run = Run::new();
    let range = Range { speed: 2.0, least: 0.0, span: 0.8, torque: 1.0, duration: 1.0 };
    let sum = |kind: Kind| -> Vec<f64> {
        let mut sum = vec![0.0; SAMPLES];
        for place in Candidate::scanned(kind, 1, &range) {
            let columns = run.columns(&place);
            sum.iter_mut().zip(&columns[0].rows[0].1).for_each(|(sum, x)| *sum += x);
        }
        sum
    };
    for ((rub, caught), v) in sum(Kind::Rub).iter().zip(sum(Kind::Catch)).zip(&run.v[1]).skip(1) {
        assert!((rub - v.signum()).abs() < 1e-9 && (caught + 1.0).abs() < 1e-9);
    }
    let still = Range { span: f64::INFINITY, ..range };
    assert!(Candidate::scanned(Kind::Rub, 1, &still).len() <= 1, "no range, no grid");
}
