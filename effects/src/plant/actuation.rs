//! From the logged effort to the delivered one: delay, lag, gain, bias and saturation, in this order.

/// The actuation chain of a plant.
#[derive(Debug, Clone)]
pub struct Actuation {
    /// Delay D in s.
    pub delay: f64,
    /// Time constant T of the lag in s; 0 where there is none.
    pub lag: f64,
    /// Per joint.
    pub gain: Vec<f64>,
    /// Per joint, N m (N).
    pub bias: Vec<f64>,
    /// Per joint, N m (N); infinite where there is none.
    pub limit: Vec<f64>,
}

impl Actuation {
    pub(super) fn ideal(joints: usize) -> Actuation {
        Actuation {
            delay: 0.0,
            lag: 0.0,
            gain: vec![1.0; joints],
            bias: vec![0.0; joints],
            limit: vec![f64::INFINITY; joints],
        }
    }

    /// The delay in steps of `dt`: whole steps, and the fraction of a step beyond them.
    pub(super) fn steps(&self, dt: f64) -> (usize, f64) {
        let steps = self.delay / dt;
        let whole = (steps + 1e-9).floor();
        let fraction = steps - whole;
        (whole as usize, if fraction < 1e-9 { 0.0 } else { fraction })
    }

    /// Past efforts per joint that the delay needs.
    pub(super) fn past(&self, dt: f64) -> usize {
        let (whole, fraction) = self.steps(dt);
        whole + usize::from(fraction > 0.0)
    }

    /// Fills the hidden state as if `tau` had been there for ever.
    pub(super) fn start(tau: &[f64], history: &mut [f64], lagged: &mut [f64]) {
        for past in history.chunks_exact_mut(tau.len()) {
            past.copy_from_slice(tau);
        }
        if !lagged.is_empty() {
            lagged.copy_from_slice(tau);
        }
    }

    /// Mean effort delivered over a step of `dt` under the logged effort `tau`, written to `delivered`; moves the hidden state on.
    ///
    /// `history` holds past efforts, latest first, n each; `lagged` the lag's output (n), empty without a lag.
    /// The delayed effort is piecewise constant, with one jump inside the step where the delay is no whole number of
    /// steps; the lag's response to it, u̇ = (in − u)/T, and the mean over the step are exact.
    pub(super) fn deliver(&self, dt: f64, tau: &[f64], history: &mut [f64], lagged: &mut [f64], delivered: &mut [f64]) {
        let n = tau.len();
        let (whole, fraction) = self.steps(dt);
        for j in 0..n {
            let before = |steps: usize| if steps == 0 { tau[j] } else { history[(steps - 1) * n + j] };
            let late = before(whole);
            let mut mean = late;
            if fraction > 0.0 {
                mean += fraction * (before(whole + 1) - late);
            }
            if let Some(u) = lagged.get_mut(j) {
                mean = 0.0;
                let early = if fraction > 0.0 { before(whole + 1) } else { late };
                for (effort, part) in [(early, fraction), (late, 1.0 - fraction)] {
                    let settled = -(-part * dt / self.lag).exp_m1();
                    mean += effort * part + (*u - effort) * settled * self.lag / dt;
                    *u += (effort - *u) * settled;
                }
            }
            delivered[j] = self.at_joint(j, mean);
        }
        if !history.is_empty() {
            let kept = history.len() - n;
            history.copy_within(..kept, n);
            history[..n].copy_from_slice(tau);
        }
    }

    /// Gain, bias and saturation of one joint.
    pub(super) fn at_joint(&self, j: usize, effort: f64) -> f64 {
        (self.gain[j] * effort + self.bias[j]).clamp(-self.limit[j], self.limit[j])
    }

    /// ∂[`Actuation::at_joint`]/∂effort: the gain, and zero where the effort is clipped.
    pub(super) fn slope(&self, j: usize, effort: f64) -> f64 {
        let free = (self.gain[j] * effort + self.bias[j]).abs() < self.limit[j];
        if free { self.gain[j] } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const DT: f64 = 0.002;

    /// The efforts delivered for logged ones of one joint.
    fn run(actuation: &Actuation, efforts: &[f64]) -> Vec<f64> {
        let mut history = vec![0.0; actuation.past(DT)];
        let mut lagged = vec![0.0; usize::from(actuation.lag > 0.0)];
        Actuation::start(&efforts[..1], &mut history, &mut lagged);
        let mut out = [0.0];
        efforts
            .iter()
            .map(|&e| {
                actuation.deliver(DT, &[e], &mut history, &mut lagged, &mut out);
                out[0]
            })
            .collect()
    }

    fn efforts() -> Vec<f64> {
        (0..50).map(|k| (0.3 * f64::from(k)).sin() + 0.1 * f64::from(k % 7)).collect()
    }

    #[test]
    fn a_delay_of_whole_samples_shifts_the_efforts() {
        let (tau, k) = (efforts(), 3);
        let out = run(&Actuation { delay: k as f64 * DT, ..Actuation::ideal(1) }, &tau);
        assert_eq!(out[k..], tau[..tau.len() - k]);
        assert!(out[..k].iter().all(|o| *o == tau[0]));
    }

    #[test]
    fn a_fraction_of_a_sample_is_the_mean_of_the_two_holds() {
        let (tau, f) = (efforts(), 0.3);
        let out = run(&Actuation { delay: (2.0 + f) * DT, ..Actuation::ideal(1) }, &tau);
        for k in 3..tau.len() {
            assert_relative_eq!(out[k], f * tau[k - 3] + (1.0 - f) * tau[k - 2], epsilon = 1e-12);
        }
    }

    #[test]
    fn the_step_response_of_the_lag_is_exact() {
        let lag = 0.005;
        let delay = 1.4 * DT;
        let mut tau = vec![1.0; 40];
        tau[0] = 0.0;
        let out = run(&Actuation { lag, delay, ..Actuation::ideal(1) }, &tau);
        // ∫ of the response to a step that arrives at DT + delay.
        let area = |t: f64| {
            let t = (t - DT - delay).max(0.0);
            t - lag * (1.0 - (-t / lag).exp())
        };
        for (k, o) in out.iter().enumerate() {
            let t = k as f64 * DT;
            assert_relative_eq!(*o, (area(t + DT) - area(t)) / DT, epsilon = 1e-12);
        }
    }

    #[test]
    fn gain_and_bias_come_before_saturation() {
        let actuation = Actuation { gain: vec![2.0], bias: vec![0.5], limit: vec![3.0], ..Actuation::ideal(1) };
        assert_eq!(run(&actuation, &[1.0, 2.0, -2.0]), [2.5, 3.0, -3.0]);
    }
}
