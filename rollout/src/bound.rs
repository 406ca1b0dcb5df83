//! How far a rollout's error can grow, from one-step errors and Jacobians.
//!
//! With y the measured trajectory, x the rollout from x_0 = y_0, d_k = F(y_k, τ_k) − y_{k+1} the one-step error, δ_k = ‖d_k‖
//! and J̄_k = ∫₀¹ ∂F/∂x(y_k + s e_k) ds, the error e = x − y obeys e_{k+1} = J̄_k e_k + d_k exactly. With L ≥ ‖J̄_k‖ and
//! δ ≥ δ_k it follows by induction that
//!
//! ‖e_k‖ ≤ Σ_i ‖J̄_{k−1} … J̄_{i+1}‖ δ_i ≤ Σ_i ‖J̄_{k−1}‖ … ‖J̄_{i+1}‖ δ_i ≤ δ (L^k − 1)/(L − 1).

use crate::growth::Quantiles;
use crate::norm::Norm;
use gapscope_dynamics::StepModel;
use nalgebra::DMatrix;

/// Nodes on [0, 1] and weights of Gauss and Legendre's rule, exact for polynomials of degree five.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// δ (L^k − 1)/(L − 1) for k = `steps`; k δ for L = 1. Without loss of digits near L = 1.
pub fn geometric(delta: f64, lipschitz: f64, steps: usize) -> f64 {
    let (excess, k) = (lipschitz - 1.0, steps as f64);
    if excess.abs() * k < 1e-12 || excess == 0.0 {
        delta * k
    } else if lipschitz <= 0.0 {
        // 0⁰ is one: without memory, the last error alone is left.
        delta * (lipschitz.powi(steps as i32) - 1.0) / excess
    } else {
        delta * (k * excess.ln_1p()).exp_m1() / excess
    }
}

/// The error of one rollout and its bounds after each of some numbers of steps, in one norm.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Steps.
    pub horizons: Vec<usize>,
    /// ‖e_k‖.
    pub truth: Vec<f64>,
    /// Σ_i ‖J̄_{k−1} … J̄_{i+1}‖ δ_i: products of local Jacobians.
    pub tight: Vec<f64>,
    /// Σ_i ‖J̄_{k−1}‖ … ‖J̄_{i+1}‖ δ_i: products of their norms.
    pub local: Vec<f64>,
    /// δ (L^k − 1)/(L − 1).
    pub loose: Vec<f64>,
    /// One-step errors δ_k of all steps.
    pub delta: Vec<f64>,
    /// L: the largest norm of all Jacobians met between trajectory and rollout.
    pub lipschitz: f64,
    /// Largest logarithmic norm of (J̄_k − 1)/dt, 1/s: the fastest growth of an error at any instant.
    pub logarithmic: f64,
}

impl Bounds {
    /// Quantiles of δ.
    pub fn delta_quantiles(&self) -> Quantiles {
        Quantiles::of(self.delta.clone())
    }
}

/// Error and bounds of the rollout from `states[0]` under `efforts[k]`, held from `states[k]` to `states[k + 1]`.
/// `None` where the rollout leaves the finite numbers, where the model has hidden state, or without a step.
///
/// The integral in J̄ is Gauss and Legendre's rule of three nodes: exact to the sixth order in ‖e‖, and kinks (dry
/// friction at rest) between trajectory and rollout are smeared.
///
/// # Panics
/// If a state is not of length 2n or an effort not of length n.
pub fn bounds(
    model: &mut impl StepModel,
    states: &[Vec<f64>],
    efforts: &[Vec<f64>],
    horizons: &[usize],
    norm: &Norm,
) -> Option<Bounds> {
    let len = 2 * model.joints();
    let steps = efforts.len().min(states.len().saturating_sub(1));
    if model.state_len() != len || steps == 0 {
        return None;
    }
    let (mut by_state, mut by_torque) = (DMatrix::zeros(len, len), DMatrix::zeros(len, model.joints()));
    let [mut means, mut delta, mut truth] = [(); 3].map(|()| Vec::with_capacity(steps));
    let mut jacobians = Vec::with_capacity(steps);
    let mut lipschitz = 0f64;
    let mut x = states[0].clone();
    for k in 0..steps {
        let mut mean = DMatrix::zeros(len, len);
        for (node, weight) in GAUSS {
            let point: Vec<f64> = states[k].iter().zip(&x).map(|(y, x)| y + node * (x - y)).collect();
            model.jacobian(&point, &efforts[k], &mut by_state, &mut by_torque);
            lipschitz = lipschitz.max(norm.of_matrix(&by_state));
            mean += weight * &by_state;
        }
        means.push(norm.of_matrix(&mean));
        jacobians.push(mean);
        let mut one_step = states[k].clone();
        model.step(&mut one_step, &efforts[k]);
        delta.push(distance(norm, &one_step, &states[k + 1]));
        model.step(&mut x, &efforts[k]);
        truth.push(distance(norm, &x, &states[k + 1]));
    }
    if !lipschitz.is_finite() || truth.iter().any(|e| !e.is_finite()) {
        return None;
    }
    let identity = DMatrix::identity(len, len);
    let dt = model.dt();
    let logarithmic = jacobians.iter().map(|j| norm.logarithmic(&((j - &identity) / dt)));
    let logarithmic = logarithmic.fold(f64::NEG_INFINITY, f64::max);
    let horizons: Vec<usize> = horizons.iter().copied().filter(|&k| k > 0 && k <= steps).collect();
    let most = delta.iter().copied().fold(0.0, f64::max);
    let mut bounds = Bounds {
        truth: horizons.iter().map(|&k| truth[k - 1]).collect(),
        loose: horizons.iter().map(|&k| geometric(most, lipschitz, k)).collect(),
        tight: Vec::new(),
        local: Vec::new(),
        horizons,
        delta,
        lipschitz,
        logarithmic,
    };
    for &k in &bounds.horizons {
        let (mut product, mut norms) = (identity.clone(), 1.0);
        let (mut tight, mut local) = (0.0, 0.0);
        for i in (0..k).rev() {
            tight += norm.of_matrix(&product) * bounds.delta[i];
            local += norms * bounds.delta[i];
            product *= &jacobians[i];
            norms *= means[i];
        }
        bounds.tight.push(tight);
        bounds.local.push(local);
    }
    Some(bounds)
}

fn distance(norm: &Norm, a: &[f64], b: &[f64]) -> f64 {
    norm.of(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}
