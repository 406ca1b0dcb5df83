//! What the correction should have been, and a network trained on it.

use crate::error::ResidualError;
use crate::hybrid::On;
use crate::orthogonal::Tangents;
use faer::Mat;
use faer::prelude::Solve;
use gapscope_dynamics::{StepModel, Transitions};
use gapscope_network::{Epoch, Examples, Learner, Real, Trained};

/// Rows (q, v, τ) and the correction that would have made the physics right on each.
///
/// On the next state: x⁺ − f_phys(x, τ). On acceleration: (v⁺ − v⁺_phys)/dt. On torque: the r with which the velocity of
/// f_phys(x, τ + r) is v⁺, by Newton's method with finite differences (one step where the model's v⁺ is affine in τ).
///
/// # Errors
/// Data of another number of joints or another time step, or torques that no torque explains.
pub fn examples(physics: &mut dyn StepModel, seen: &Transitions, on: On) -> Result<Examples, ResidualError> {
    let (n, dt) = (physics.joints(), physics.dt());
    if n != seen.joints {
        return Err(ResidualError::Differs { what: "joints", model: n as f64, data: seen.joints as f64 });
    }
    if (dt - seen.dt).abs() > 1e-6 * dt {
        return Err(ResidualError::Differs { what: "time step in s", model: dt, data: seen.dt });
    }
    let targets = match on {
        On::NextState => seen.one_step_errors(physics),
        On::Acceleration => {
            let errors = seen.one_step_errors(physics);
            errors.chunks_exact(2 * n).flat_map(|e| &e[n..]).map(|e| e / dt).collect()
        }
        On::Torque => torques(physics, seen)?,
    };
    Ok(Examples { inputs: seen.inputs(), targets })
}

fn torques(physics: &mut dyn StepModel, seen: &Transitions) -> Result<Vec<f64>, ResidualError> {
    const ROUNDS: usize = 3;
    let n = seen.joints;
    let mut x = vec![0.0; physics.state_len()];
    let mut out = Vec::with_capacity(seen.tau.len());
    let singular = ResidualError::Singular {
        what: "the torque that explains a step",
        mend: "the model does not answer to every torque (a joint sticks?); use the next state or acceleration instead",
    };
    for (before, tau, next) in seen.rows() {
        let mut velocity = |tau: &[f64]| -> Vec<f64> {
            physics.start(&before[..n], &before[n..], &mut x);
            physics.step(&mut x, tau);
            x[n..2 * n].to_vec()
        };
        let mut guess = tau.to_vec();
        for _ in 0..ROUNDS {
            let at = velocity(&guess);
            let error = Mat::from_fn(n, 1, |i, _| next[n + i] - at[i]);
            let size = error.norm_l2();
            if size <= 1e-12 * (1.0 + next[n..].iter().map(|v| v.abs()).fold(0.0, f64::max)) {
                break;
            }
            let mut slope = Mat::zeros(n, n);
            for j in 0..n {
                let (own, h) = (guess[j], 1e-4 * guess[j].abs().max(1.0));
                guess[j] = own + h;
                let moved = velocity(&guess);
                guess[j] = own;
                (0..n).for_each(|i| slope[(i, j)] = (moved[i] - at[i]) / h);
            }
            let step = slope.partial_piv_lu().solve(&error);
            (0..n).for_each(|j| guess[j] += step[(j, 0)]);
        }
        if guess.iter().any(|g| !g.is_finite()) {
            return Err(singular);
        }
        out.extend(guess.iter().zip(tau).map(|(guess, tau)| guess - tau));
    }
    Ok(out)
}

/// Trains a correction of `physics` on the steps seen. λ is the learner's `penalty`, in units in which each target has
/// standard deviation one.
///
/// With `tangents` (of the targets' rows), only what is orthogonal to them is learned: see [`Tangents`].
///
/// # Errors
/// As [`examples`] and as training, or tangents of another number of rows.
pub fn learn<T: Real>(
    physics: &mut dyn StepModel,
    seen: &Transitions,
    held_out: Option<&Transitions>,
    on: On,
    learner: &Learner,
    tangents: Option<&Tangents>,
    progress: &mut dyn FnMut(&Epoch),
) -> Result<Trained<T>, ResidualError> {
    let n = seen.joints;
    let mut rows = examples(physics, seen, on)?;
    if let Some(tangents) = tangents {
        tangents.project_out(&mut rows.targets)?;
    }
    let held_out = held_out.map(|seen| examples(physics, seen, on)).transpose()?;
    Ok(learner.learn([3 * n, on.outputs(n)], &rows, held_out.as_ref(), progress)?)
}
