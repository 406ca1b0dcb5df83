//! When something outside pushed: stretches of time in which the torque leaves what any law of the robot gives.

use crate::band::Band;
use crate::gap::Rows;
use crate::signals::Signals;

/// A row stands out if the rest, over the spread of the calm half of all rows, has this root mean square over the joints.
const STANDS_OUT: f64 = 5.0;
/// First quartile of the size of a standard normal number.
const QUARTER: f64 = 0.3186;
/// Stretches closer than this are one, and shorter ones none, s.
const SHORTEST: f64 = 0.12;
/// What stands out for longer than this part of the logs is no incident.
const AT_MOST: f64 = 0.6;
/// A push begins and ends where the rest crosses this part of its height in the stretch: the filter has spread it evenly.
const EDGE: f64 = 0.5;

/// The stretches of every episode, s since its start, from what is left of the torque at the rows of the band.
pub fn stretches(signals: &[Signals], band: &Band, rest: &Rows) -> Vec<Vec<[f64; 2]>> {
    let spread: Vec<f64> = rest
        .iter()
        .map(|row| {
            let mut size: Vec<f64> = row.iter().map(|r| r.abs()).collect();
            size.sort_by(f64::total_cmp);
            size.get(size.len() / 4).copied().unwrap_or(0.0) / QUARTER
        })
        .collect();
    let used: Vec<usize> = (0..rest.len()).filter(|&j| spread[j] > 0.0).collect();
    let height: Vec<f64> = (0..band.rows.len())
        .map(|i| {
            let square: f64 = used.iter().map(|&j| (rest[j][i] / spread[j]).powi(2)).sum();
            (square / used.len().max(1) as f64).sqrt()
        })
        .collect();
    let outside = height.iter().filter(|h| **h > STANDS_OUT).count();
    if outside as f64 > AT_MOST * height.len() as f64 {
        return vec![Vec::new(); signals.len()];
    }
    signals
        .iter()
        .zip(&band.of_episode)
        .map(|(s, rows)| {
            let time = |i: usize| s.first as f64 * s.raw.dt + band.rows[i].center as f64 * s.dt;
            let mut found: Vec<[usize; 2]> = Vec::new();
            for i in rows.clone().filter(|&i| height[i] > STANDS_OUT) {
                match found.last_mut() {
                    Some(last) if time(i) - time(last[1]) < SHORTEST => last[1] = i,
                    _ => found.push([i, i]),
                }
            }
            found
                .into_iter()
                .filter_map(|[first, last]| {
                    let mut sorted = height[first..=last].to_vec();
                    sorted.sort_by(f64::total_cmp);
                    let level = EDGE * sorted[sorted.len() / 2];
                    let cross = |outer: usize, inner: usize| {
                        let (a, b) = (height[outer], height[inner]);
                        let part = if b > a { ((level - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
                        time(outer) + part * (time(inner) - time(outer))
                    };
                    let begin = (first..=last).find(|&i| height[i] >= level).unwrap_or(first);
                    let end = (first..=last).rev().find(|&i| height[i] >= level).unwrap_or(last);
                    let from = if begin > rows.start { cross(begin - 1, begin) } else { 0.0 };
                    let to = if end + 1 < rows.end { cross(end + 1, end) } else { time(end) };
                    (to - from > SHORTEST).then_some([from, to])
                })
                .collect()
        })
        .collect()
}
