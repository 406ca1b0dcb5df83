//! What a single sampled signal looks like: noise, steps, spikes, and its course over windows.

use crate::robust::{quantile, rms, robust_sigma};

/// Length of the windows over which motion is looked at, s; at least [`WINDOW_SAMPLES`].
const WINDOW_SECONDS: f64 = 0.05;
const WINDOW_SAMPLES: usize = 6;

/// What a joint's position in one log looks like.
#[derive(Debug, Clone)]
pub(crate) struct Traits {
    /// Least and greatest value.
    pub low: f64,
    pub high: f64,
    /// Standard deviation of the noise from sample to sample.
    pub noise: f64,
    /// Encoder step, where the values lie on a coarse raster.
    pub step: Option<f64>,
    /// Samples that stand alone as spikes, each with what it is off the cubic through its neighbours.
    pub glitches: Vec<(usize, f64)>,
    /// Samples at which the angle jumps by about a full turn.
    pub wraps: Vec<usize>,
    /// The signal without single spikes: the median of each sample and its neighbours.
    pub smooth: Vec<f64>,
    /// Root mean square of the speed over windows.
    pub speed: f64,
    /// Number of samples of a window.
    pub window: usize,
}

impl Traits {
    pub fn of(time: &[f64], value: &[f64], dt: f64) -> Self {
        let smooth = without_spikes(value);
        let (low, high) = range(&smooth);
        let errors = prediction_errors(time, value);
        // The prediction from four neighbours adds 34/36 of their variance to the sample's own.
        let noise = trimmed_rms(&errors) / (1.0_f64 + 34.0 / 36.0).sqrt();
        let step = raster(value);
        let window = window(dt, value.len());
        let speeds: Vec<f64> = (0..value.len().saturating_sub(window))
            .step_by((window / 2).max(1))
            .map(|k| (smooth[k + window] - smooth[k]) / (time[k + window] - time[k]))
            .collect();
        let speed = rms(&speeds);
        let glitches = glitches(&errors, value, step.unwrap_or(0.0), high - low);
        let wraps = (1..value.len())
            .filter(|&k| {
                let glitch = glitches.iter().any(|&(glitch, _)| glitch == k || glitch + 1 == k);
                (value[k] - value[k - 1]).abs() > 5.5 && !glitch
            })
            .collect();
        Self { low, high, noise, step, glitches, wraps, smooth, speed, window }
    }

    /// Whether the joint moves by clearly more than its noise and its encoder step.
    pub fn moves(&self) -> bool {
        self.high - self.low > (10.0 * self.noise).max(6.0 * self.step.unwrap_or(0.0)).max(1e-4)
    }
}

/// Samples in a window.
pub(super) fn window(dt: f64, count: usize) -> usize {
    let samples = if dt > 0.0 { (WINDOW_SECONDS / dt).round() as usize } else { 0 };
    samples.max(WINDOW_SAMPLES).min((count / 4).max(1))
}

fn without_spikes(value: &[f64]) -> Vec<f64> {
    let mut smooth = value.to_vec();
    for k in 1..value.len().saturating_sub(1) {
        let (a, b, c) = (value[k - 1], value[k], value[k + 1]);
        smooth[k] = a.min(b).max(a.max(b).min(c));
    }
    smooth
}

pub(super) fn range(value: &[f64]) -> (f64, f64) {
    value.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

/// Each sample less what the cubic through its two neighbours on each side says; zero at the ends.
pub(crate) fn prediction_errors(time: &[f64], value: &[f64]) -> Vec<f64> {
    let mut errors = vec![0.0; value.len()];
    for k in 2..value.len().saturating_sub(2) {
        let at = [k - 2, k - 1, k + 1, k + 2];
        let x = at.map(|i| time[i] - time[k]);
        let mut predicted = 0.0;
        for i in 0..4 {
            let mut weight = 1.0;
            for j in 0..4 {
                if i != j {
                    weight *= x[j] / (x[j] - x[i]);
                }
            }
            predicted += weight * value[at[i]];
        }
        errors[k] = value[k] - predicted;
    }
    errors
}

/// Standard deviation of a normal signal with the same root mean square of all but the largest twentieth.
pub(crate) fn trimmed_rms(values: &[f64]) -> f64 {
    let mut magnitudes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
    let Some(limit) = quantile(&mut magnitudes, 0.95) else {
        return 0.0;
    };
    magnitudes.retain(|&magnitude| magnitude <= limit);
    // Cutting a normal distribution at 1.96 leaves 0.871 of its deviation.
    rms(&magnitudes) / 0.871
}

/// Isolated spikes: a sample far off the cubic through its neighbours, which in turn are off theirs by the share that
/// a spike there leaves (−2/3 of it). Each with what it is off.
fn glitches(errors: &[f64], value: &[f64], step: f64, range: f64) -> Vec<(usize, f64)> {
    const NEAR: usize = 40;
    let floor = (4.0 * step).max(1e-4 * range).max(12.0 * robust_sigma(errors));
    let mut found = Vec::new();
    for k in 3..errors.len().saturating_sub(3) {
        let spike = errors[k].abs();
        if spike <= floor || spike == 0.0 {
            continue;
        }
        let left = -errors[k - 1] / errors[k];
        let right = -errors[k + 1] / errors[k];
        let alone = (0.4..0.95).contains(&left) && (0.4..0.95).contains(&right);
        let sides = (k.saturating_sub(NEAR)..k - 2).chain(k + 3..(k + NEAR).min(errors.len()));
        let around: Vec<f64> = sides.map(|i| errors[i]).collect();
        // A value between its neighbours may only be late.
        let (low, high) = (value[k - 1].min(value[k + 1]), value[k - 1].max(value[k + 1]));
        let outside = (low - value[k]).max(value[k] - high);
        if alone && spike > 12.0 * robust_sigma(&around) && spike > 3.0 * trimmed_rms(&around) && outside > 0.3 * spike
        {
            found.push((k, errors[k]));
        }
    }
    found
}

/// The step of a raster on which the values lie, where they do and it is coarse enough for many samples to share a value.
pub(super) fn raster(value: &[f64]) -> Option<f64> {
    const MOST: usize = 6000;
    let stride = value.len().div_ceil(MOST).max(1);
    let mut sorted: Vec<f64> = value.iter().copied().step_by(stride).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    let tiny = 1e-9 * (last - first).max(first.abs()).max(last.abs());
    let mut gaps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|&gap| gap > tiny).collect();
    if gaps.len() < 4 || 10 * gaps.len() > 7 * sorted.len() {
        return None;
    }
    let step = quantile(&mut gaps, 0.05)?;
    let multiple = |gap: f64| (gap / step).round().max(1.0);
    let on = gaps.iter().filter(|&&gap| (gap / step - multiple(gap)).abs() < 0.03 * multiple(gap).min(5.0)).count();
    if 10 * on < 9 * gaps.len() {
        return None;
    }
    let (sum, count) = gaps
        .iter()
        .filter(|&&gap| multiple(gap) < 20.0)
        .fold((0.0, 0.0), |(sum, count), &gap| (sum + gap, count + multiple(gap)));
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..count).map(|k| 0.002 * k as f64).collect();
        let noise = |k: usize| {
            1e-5 * ((k as u32).wrapping_mul(2_654_435_761).wrapping_mul(k as u32 | 1) as f64 / 4_294_967_296.0 - 0.5)
        };
        let value = time.iter().enumerate().map(|(k, t)| (3.0 * t).sin() + noise(k)).collect();
        (time, value)
    }

    #[test]
    fn noise_is_measured_and_a_smooth_wave_has_no_glitch() {
        let (time, value) = wave(3000);
        let traits = Traits::of(&time, &value, 0.002);
        assert!((traits.noise / (1e-5 / 12f64.sqrt()) - 1.0).abs() < 0.2, "{}", traits.noise);
        assert!(traits.glitches.is_empty() && traits.wraps.is_empty() && traits.step.is_none());
        assert!((traits.speed - 3.0 / 2f64.sqrt()).abs() < 0.1);
        assert!(traits.moves());
    }

    #[test]
    fn spikes_are_found_one_by_one() {
        let (time, mut value) = wave(3000);
        for k in [100, 1500, 1700] {
            value[k] += 0.01;
        }
        value[2500] = 0.0;
        let traits = Traits::of(&time, &value, 0.002);
        let places: Vec<usize> = traits.glitches.iter().map(|(k, _)| *k).collect();
        assert_eq!(places, [100, 1500, 1700, 2500]);
        assert!((traits.smooth[1500] - value[1499]).abs() < 0.01);
    }

    #[test]
    fn an_encoder_step_is_measured() {
        let (time, value) = wave(3000);
        let count = 0.000383;
        let value: Vec<f64> = value.iter().map(|x| (x / count).round() * count).collect();
        let traits = Traits::of(&time, &value, 0.002);
        assert!((traits.step.unwrap() - count).abs() < 1e-6 * count.sqrt(), "{:?}", traits.step);
        assert!(traits.glitches.is_empty(), "{:?}", traits.glitches);
    }

    #[test]
    fn a_full_turn_is_a_wrap() {
        let (time, mut value) = wave(1000);
        value[600..].iter_mut().for_each(|x| *x -= std::f64::consts::TAU);
        assert_eq!(Traits::of(&time, &value, 0.002).wraps, [600]);
    }
}
