//! What the rest of the arm does to each joint along a log.

use crate::run::Surroundings;
use gapscope_datasets::Episode;
use gapscope_dynamics::{Data, JointKind, Model};
use nalgebra::DMatrix;

/// Half of the time over which position is smoothed to speed and acceleration, s: encoders of hobby servos are coarse, and
/// what is made of it here, the torque by the motion of other joints, is small beside gravity.
const SMOOTHING: f64 = 0.06;

/// Speed and acceleration at each sample: the parabola that fits the samples around it best.
pub fn derivatives(time: &[f64], position: &[f64]) -> (Vec<f64>, Vec<f64>) {
    (0..time.len()).map(|k| parabola(time, position, k)).map(|c| (c[1], c[2])).unzip()
}

/// Position and speed at one sample, by the same parabola.
pub fn state(time: &[f64], position: &[f64], k: usize) -> (f64, f64) {
    let [q, v, _] = parabola(time, position, k);
    (q, v)
}

/// Position, speed and acceleration at a sample.
fn parabola(time: &[f64], position: &[f64], k: usize) -> [f64; 3] {
    let count = time.len();
    let dt = (time[count - 1] - time[0]) / (count - 1) as f64;
    let half = ((SMOOTHING / dt).round() as usize).max(2);
    let unit = half as f64 * dt;
    let (from, to) = (k.saturating_sub(half), (k + half + 1).min(count));
    // Least squares of 1, t, t² about the sample.
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for i in from..to {
        let t = (time[i] - time[k]) / unit;
        let row = nalgebra::Vector3::new(1.0, t, t * t);
        normal += row * row.transpose();
        right += row * position[i];
    }
    let fitted = normal.lu().solve(&right);
    fitted.map_or([position[k], 0.0, 0.0], |c| [c[0], c[1] / unit, 2.0 * c[2] / (unit * unit)])
}

/// The surroundings of each joint of a model along a log.
pub fn surroundings(model: &Model, episode: &Episode) -> Vec<Surroundings> {
    let (n, count) = (model.dof(), episode.len());
    let moves: Vec<(Vec<f64>, Vec<f64>)> = episode.position.iter().map(|q| derivatives(&episode.time, q)).collect();
    let mut around = vec![Surroundings::default(); n];
    let mut data = Data::new(model);
    let mut mass = DMatrix::zeros(n, n);
    let [mut q, mut v, mut a, mut gravity, mut tau, mut turned] = std::array::from_fn(|_| vec![0.0; n]);
    for k in 0..count {
        for j in 0..n {
            q[j] = episode.position[j][k];
            (v[j], a[j]) = (moves[j].0[k], moves[j].1[k]);
        }
        model.mass_matrix(&mut data, &q, &mut mass);
        model.gravity_torque(&mut data, &q, &mut gravity);
        model.inverse_dynamics(&mut data, &q, &v, &a, &mut tau);
        for (j, around) in around.iter_mut().enumerate() {
            around.inertia.push(mass[(j, j)]);
            around.gravity.push(gravity[j]);
            around.coupling.push(tau[j] - gravity[j] - mass[(j, j)] * a[j]);
            let slope = if model.joints()[j].kind == JointKind::Prismatic {
                0.0
            } else {
                // Gravity is a sine of the joint's own angle: a quarter of a turn on stands its derivative.
                let measured = q[j];
                q[j] += std::f64::consts::FRAC_PI_2;
                model.gravity_torque(&mut data, &q, &mut turned);
                q[j] = measured;
                turned[j]
            };
            around.slope.push(slope);
        }
    }
    around
}

#[cfg(test)]
mod tests {
    use super::*;
    use gapscope_dynamics::robots;

    #[test]
    fn gravity_is_a_sine_of_the_joints_own_angle() {
        let model = Model::from_urdf(robots::arm7()).unwrap().model;
        let n = model.dof();
        let q: Vec<f64> = (0..n).map(|j| 0.3 * j as f64 - 0.7).collect();
        let time = vec![0.0, 0.01, 0.02, 0.03, 0.04];
        let episode = Episode { time, position: q.iter().map(|&q| vec![q; 5]).collect(), ..Episode::default() };
        let around = surroundings(&model, &episode);
        let mut data = Data::new(&model);
        let mut gravity = vec![0.0; n];
        for j in 0..n {
            let mut there = q.clone();
            there[j] += 0.4;
            model.gravity_torque(&mut data, &there, &mut gravity);
            let told = around[j].gravity[2] * 0.4_f64.cos() + around[j].slope[2] * 0.4_f64.sin();
            assert!((told - gravity[j]).abs() < 1e-9, "{told} {}", gravity[j]);
            assert!(around[j].coupling[2].abs() < 1e-9);
        }
    }

    #[test]
    fn a_parabola_is_differentiated_exactly() {
        let time: Vec<f64> = (0..50).map(|k| 0.02 * f64::from(k)).collect();
        let position: Vec<f64> = time.iter().map(|t| 1.0 - 2.0 * t + 1.5 * t * t).collect();
        let (v, a) = derivatives(&time, &position);
        for k in 0..50 {
            assert!((v[k] - (-2.0 + 3.0 * time[k])).abs() < 1e-9 && (a[k] - 3.0).abs() < 1e-7);
        }
    }
}
