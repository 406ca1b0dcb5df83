//! In which regime the gap lies: standstill, reversal, speed, load, acceleration, pose, frequency, time.

use crate::numbers::bootstrap::interval;
use crate::numbers::kernel::{Kernel, apply};
use crate::numbers::quantile::quantile;
use crate::record::band::Band;
use crate::record::rows::{Rows, total};
use crate::record::signals::Signals;
use crate::schema::{Bounds, Regime};
use gapscope_dynamics::Model;

/// Rows this close to a change of direction count as reversal, s.
const REVERSAL: f64 = 0.1;
/// Upper and lower part of a quantity's range that counts as high and low.
const HIGH: f64 = 0.75;
const LOW: f64 = 0.25;
/// Parts into which pose and time are cut; the one with the densest gap is reported.
const PARTS: usize = 4;
/// Bounds of frequency bands as parts of the cut-off.
const BANDS: [f64; 3] = [0.1, 0.35, 1.0];

/// What each regime is decided by, at each row of one joint.
struct Features {
    speed: Vec<f64>,
    to_reversal: Vec<f64>,
    load: Vec<f64>,
    acceleration: Vec<f64>,
    position: Vec<f64>,
    time: Vec<f64>,
}

/// Share of each regime in each joint's squared gap, with intervals. `rows` is the gap `[joint][row]`.
pub fn regimes(model: &Model, signals: &[Signals], band: &Band, standstill: &[f64], rows: &Rows) -> Vec<Regime> {
    let mut all = Vec::new();
    for (j, joint) in model.joints().iter().enumerate() {
        let prismatic = joint.kind == gapscope_dynamics::JointKind::Prismatic;
        let unit = |revolute: &str, prismatic_unit: &str| {
            if prismatic { prismatic_unit.to_owned() } else { revolute.to_owned() }
        };
        let f = features(signals, band, standstill[j], j);
        let mut add =
            |name: &str, quantity: &str, unit: String, low: Option<f64>, high: Option<f64>, inside: &[bool]| {
                if let Some((share, ci95, samples)) = share(band, &rows[j], inside) {
                    let bounds = Bounds { quantity: quantity.into(), unit, interval: [low, high] };
                    all.push(Regime { joint: joint.name.clone(), regime: name.into(), bounds, share, ci95, samples });
                }
            };
        let still: Vec<bool> = f.speed.iter().map(|v| *v < standstill[j]).collect();
        let speed_unit = || unit("rad/s", "m/s");
        add("standstill", "speed", speed_unit(), None, Some(standstill[j]), &still);
        let near: Vec<bool> = f.to_reversal.iter().map(|t| *t <= REVERSAL).collect();
        add("reversal", "time to a change of direction", "s".into(), None, Some(REVERSAL), &near);
        let (low, high) = (quantile(&f.speed, LOW), quantile(&f.speed, HIGH));
        let slow: Vec<bool> = f.speed.iter().map(|v| *v <= low).collect();
        let fast: Vec<bool> = f.speed.iter().map(|v| *v >= high).collect();
        add("low_speed", "speed", speed_unit(), None, Some(low), &slow);
        add("high_speed", "speed", speed_unit(), Some(high), None, &fast);
        for (name, quantity, values, unit) in [
            ("high_load", "nominal torque", &f.load, unit("N m", "N")),
            ("high_acceleration", "acceleration", &f.acceleration, unit("rad/s²", "m/s²")),
        ] {
            let high = quantile(values, HIGH);
            let inside: Vec<bool> = values.iter().map(|v| *v >= high).collect();
            add(name, quantity, unit, Some(high), None, &inside);
        }
        for (name, quantity, values, unit) in
            [("pose", "position", &f.position, unit("rad", "m")), ("time", "time", &f.time, "s".to_owned())]
        {
            if let Some((low, high, inside)) = densest_part(values, &rows[j]) {
                add(name, quantity, unit, Some(low), Some(high), &inside);
            }
        }
        // A band holds as much of the gap as it holds of the motion, unless the gap is special there.
        let effort = centered(signals.iter().enumerate().flat_map(|(e, s)| band.filter(e, &s.tau[j])).collect());
        let expected = frequency_parts(band, &effort);
        for ((low, high, in_band), (_, _, effort_in_band)) in frequency_parts(band, &rows[j]).into_iter().zip(expected)
        {
            let of_effort = share_of_power(band, &effort, &effort_in_band).map_or(0.0, |(share, _)| share);
            if let Some((share, ci95)) = share_of_power(band, &rows[j], &in_band) {
                all.push(Regime {
                    joint: joint.name.clone(),
                    regime: "frequency_band".into(),
                    bounds: Bounds {
                        quantity: "frequency".into(),
                        unit: "Hz".into(),
                        interval: [Some(low), Some(high)],
                    },
                    share,
                    ci95,
                    samples: of_effort,
                });
            }
        }
    }
    all
}

fn features(signals: &[Signals], band: &Band, standstill: f64, j: usize) -> Features {
    let mut f = Features {
        speed: vec![],
        to_reversal: vec![],
        load: vec![],
        acceleration: vec![],
        position: vec![],
        time: vec![],
    };
    for (e, s) in signals.iter().enumerate() {
        let reversals = reversal_times(&s.v[j], s.dt, standstill);
        for row in &band.rows[band.of_episode[e].clone()] {
            let k = row.center;
            let t = k as f64 * s.dt;
            let after = reversals.partition_point(|r| *r < t);
            let gap = |i: usize| reversals.get(i).map_or(f64::INFINITY, |r| (r - t).abs());
            f.to_reversal.push(gap(after).min(after.checked_sub(1).map_or(f64::INFINITY, gap)));
            f.speed.push(s.v[j][k].abs());
            f.load.push(s.nominal[j][k].abs());
            f.acceleration.push(s.a[j][k].abs());
            f.position.push(s.q[j][k]);
            f.time.push(t);
        }
    }
    f
}

/// Times at which the joint changes direction: between the last sample in motion one way and the first the other way.
fn reversal_times(v: &[f64], dt: f64, standstill: f64) -> Vec<f64> {
    let mut times = Vec::new();
    let mut last: Option<(usize, f64)> = None;
    for (k, &v) in v.iter().enumerate().filter(|(_, v)| v.abs() >= standstill) {
        if let Some((before, sign)) = last
            && sign != v.signum()
        {
            times.push(0.5 * (before + k) as f64 * dt);
        }
        last = Some((k, v.signum()));
    }
    times
}

fn centered(mut x: Vec<f64>) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter_mut().for_each(|x| *x -= mean);
    x
}

/// The part of a quantity's range, of equal parts by count, in which the squared gap is densest.
fn densest_part(values: &[f64], gap: &[f64]) -> Option<(f64, f64, Vec<bool>)> {
    let edges: Vec<f64> = (0..=PARTS).map(|i| quantile(values, i as f64 / PARTS as f64)).collect();
    (0..PARTS)
        .filter(|&i| edges[i] < edges[i + 1])
        .map(|i| {
            let (low, high) = (edges[i], edges[i + 1]);
            let inside: Vec<bool> = values.iter().map(|v| (low..=high).contains(v)).collect();
            let count = inside.iter().filter(|x| **x).count().max(1) as f64;
            let power: f64 = gap.iter().zip(&inside).filter(|(_, x)| **x).map(|(g, _)| g * g).sum();
            (power / count, (low, high, inside))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, part)| part)
}

fn share(band: &Band, gap: &[f64], inside: &[bool]) -> Option<(f64, [f64; 2], f64)> {
    let samples = inside.iter().filter(|x| **x).count() as f64 / inside.len().max(1) as f64;
    let masked: Vec<f64> = gap.iter().zip(inside).map(|(g, inside)| if *inside { g * g } else { 0.0 }).collect();
    let (share, ci95) = ratio(band, &masked, gap)?;
    Some((share, ci95, samples))
}

fn share_of_power(band: &Band, gap: &[f64], part: &[f64]) -> Option<(f64, [f64; 2])> {
    let product: Vec<f64> = gap.iter().zip(part).map(|(g, p)| g * p).collect();
    ratio(band, &product, gap)
}

/// Σ part / Σ gap² over rows, with its interval over blocks.
fn ratio(band: &Band, part: &[f64], gap: &[f64]) -> Option<(f64, [f64; 2])> {
    let mut blocks = vec![vec![0.0; 2]; band.blocks];
    for (i, row) in band.rows.iter().enumerate() {
        blocks[row.block][0] += part[i];
        blocks[row.block][1] += gap[i] * gap[i];
    }
    blocks.retain(|b| b[1] > 0.0);
    // A joint without any gap, or logs without a row, have no regime in which it could lie.
    if blocks.is_empty() {
        return None;
    }
    let of = |sums: &[f64]| (sums[1] > 0.0).then(|| (sums[0] / sums[1]).clamp(0.0, 1.0));
    Some((of(&total(&blocks))?, interval(&blocks, of)?))
}

/// The gap split by frequency: each band with the part of the gap that lies in it. The parts add up to the gap.
fn frequency_parts(band: &Band, gap: &[f64]) -> Vec<(f64, f64, Vec<f64>)> {
    let mut parts = Vec::new();
    let mut below = vec![0.0; gap.len()];
    let mut low = 0.0;
    for edge in BANDS {
        let high = edge * band.cutoff;
        let mut smooth = gap.to_vec();
        if edge < 1.0 {
            for rows in &band.of_episode {
                let Some(step) = row_step(band, rows) else { continue };
                let kernel = Kernel::low_pass(high, step);
                for i in rows.clone() {
                    // Near an end the kernel is cut; it shrinks towards the end rather than leaning over it.
                    let reach = kernel.reach.min(i - rows.start).min(rows.end - 1 - i);
                    let weights = &kernel.value[kernel.reach - reach..=kernel.reach + reach];
                    smooth[i] = apply(weights, gap, i - reach) / weights.iter().sum::<f64>();
                }
            }
        }
        parts.push((low, high, smooth.iter().zip(&below).map(|(s, b)| s - b).collect()));
        (below, low) = (smooth, high);
    }
    parts
}

/// Time between rows, in units in which the cut-off is in Hz: rows come at a fixed number per period.
fn row_step(band: &Band, rows: &std::ops::Range<usize>) -> Option<f64> {
    (rows.len() > 1).then(|| 1.0 / (2.5 * band.cutoff))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_that_stops_and_goes_on_the_same_way_has_no_reversal() {
        let v = [1.0, 0.5, 0.0, 0.0, 0.5, 0.2, 0.0, -0.3, -1.0];
        assert_eq!(reversal_times(&v, 1.0, 0.1), [6.0]);
    }

    #[test]
    fn the_densest_part_is_where_the_gap_is() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let gap: Vec<f64> = values.iter().map(|v| if (30.0..45.0).contains(v) { 1.0 } else { 0.1 }).collect();
        let (low, high, _) = densest_part(&values, &gap).unwrap();
        assert!(low <= 30.0 && high >= 45.0 && high - low < 30.0);
    }
}
