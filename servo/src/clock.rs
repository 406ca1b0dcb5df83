//! What stamps of time say of the clock that made them.

use gapscope_datasets::Episode;

/// Stamps that stray from an even raster by less than this part of an interval were counted and not read: half a millisecond of
/// rounding at 30 Hz is 1.5 %, and recorders of servo buses stray by more.
const EVEN: f64 = 0.016;

/// Whether the stamps of a log lie on an even raster.
pub fn is_even(time: &[f64]) -> bool {
    if time.len() < 3 {
        return false;
    }
    let (count, middle) = (time.len() as f64, 0.5 * (time.len() - 1) as f64);
    let mean = time.iter().sum::<f64>() / count;
    let rows = || time.iter().enumerate().map(|(k, t)| (k as f64 - middle, t - mean));
    let step = rows().map(|(k, t)| k * t).sum::<f64>() / rows().map(|(k, _)| k * k).sum::<f64>();
    rows().all(|(k, t)| (t - k * step).abs() <= EVEN * step)
}

/// What to say of logs whose stamps were made from a nominal rate.
pub fn nominal_rate(episodes: &[Episode]) -> Option<String> {
    let even: Vec<&Episode> = episodes.iter().filter(|episode| is_even(&episode.time)).collect();
    let first = even.first()?;
    let of = if even.len() == episodes.len() {
        "all logs".to_owned()
    } else {
        format!("{} of {} logs", even.len(), episodes.len())
    };
    Some(format!(
        "the time stamps of {of} are even ({:.4} Hz): a nominal rate and no clock that was read; jitter of the recorder counts as noise",
        first.rate()
    ))
}

/// Steps of an encoder that a joint goes on by, from before repeated samples to after them, where it does not rest; and how many
/// of them follow each other at most: an arm that starts has rested for longer.
const GOES_ON: f64 = 4.0;
const IN_A_ROW: usize = 3;

/// Which samples repeat the one before in all joints while some joint goes on: readings that the recorder did not get.
pub fn repeats(episode: &Episode) -> Vec<bool> {
    let step = |row: &Vec<f64>| {
        let changes = row.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        changes.filter(|change| *change > 0.0).fold(f64::INFINITY, f64::min)
    };
    let rows: Vec<(&Vec<f64>, f64)> = episode.position.iter().map(|row| (row, step(row))).collect();
    let repeats = |k: usize| rows.iter().all(|(row, _)| row[k] == row[k - 1]);
    let mut lost = vec![false; episode.len()];
    let mut from = 1;
    while from < episode.len() {
        let next = (from..episode.len()).find(|&k| !repeats(k)).unwrap_or(episode.len());
        let goes_on = |(row, step): &(&Vec<f64>, f64)| (row[next] - row[from - 1]).abs() >= GOES_ON * step;
        if (1..=IN_A_ROW).contains(&(next - from)) && next < episode.len() && rows.iter().any(goes_on) {
            lost[from..next].fill(true);
        }
        from = next + 1;
    }
    lost
}

/// Puts the line between the samples around them in the place of samples that were lost.
pub fn bridge(time: &[f64], lost: &[bool], samples: &mut [f64]) {
    let mut last = 0;
    for k in (0..samples.len()).filter(|&k| !lost[k]) {
        for i in last + 1..k {
            let part = (time[i] - time[last]) / (time[k] - time[last]);
            samples[i] = samples[last] + part * (samples[k] - samples[last]);
        }
        last = k;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(stray: f64, rounded: bool) -> Episode {
        let at = |k: usize| (k as f64 + stray * (7.3 * k as f64).sin()) / 30.0;
        let time = (0..300).map(|k| if rounded { (1e3 * at(k)).round() / 1e3 } else { at(k) }).collect();
        Episode { time, ..Episode::default() }
    }

    #[test]
    fn a_nominal_rate_is_said_and_a_clock_that_strays_is_not() {
        for rounded in [false, true] {
            assert!(nominal_rate(&[log(0.0, rounded)]).unwrap().contains("all logs"), "{rounded}");
            assert_eq!(nominal_rate(&[log(0.03, rounded)]), None, "{rounded}");
        }
        assert!(nominal_rate(&[log(0.0, true), log(0.03, true)]).unwrap().contains("1 of 2 logs"));
        assert_eq!(nominal_rate(&[]), None);
    }

    #[test]
    fn lost_samples_lie_on_the_line_between_their_neighbours() {
        let time = [0.0, 0.1, 0.2, 0.4, 0.5];
        let mut samples = [1.0, 3.0, 3.0, 3.0, 11.0];
        bridge(&time, &[false, false, true, true, false], &mut samples);
        assert!(samples.iter().zip([1.0, 3.0, 5.0, 9.0, 11.0]).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn a_lost_reading_is_told_from_a_joint_that_rests() {
        let tick = 1.5e-3;
        let moves: Vec<f64> = (0..50).map(|k: i32| tick * f64::from(k + 4 * (k - 10).max(0))).collect();
        let creeps: Vec<f64> = (0..50).map(|k| tick * f64::from(k / 3)).collect();
        let log = |rows: [&Vec<f64>; 2]| Episode {
            time: (0..50).map(|k| 0.01 * f64::from(k)).collect(),
            position: rows.map(Clone::clone).into(),
            ..Episode::default()
        };
        let lost = |row: &Vec<f64>| {
            let mut row = row.clone();
            row[20] = row[19];
            row
        };
        let at =
            |log: &Episode| repeats(log).iter().enumerate().filter(|(_, is)| **is).map(|(k, _)| k).collect::<Vec<_>>();
        assert_eq!(at(&log([&lost(&moves), &lost(&creeps)])), [20]);
        // Two readings in a row may be lost; an arm that starts has rested for longer.
        let mut two = lost(&moves);
        two[21] = two[19];
        assert_eq!(at(&log([&two, &two])), [20, 21]);
        let starts: Vec<f64> = (0..50).map(|k: i32| tick * f64::from(9 * (k - 25).max(0))).collect();
        assert_eq!(at(&log([&starts, &starts])), [0; 0]);
        // One joint alone that repeats may rest; all that creep rest between the steps of their encoders.
        assert_eq!(at(&log([&lost(&moves), &moves])), [0; 0]);
        assert_eq!(at(&log([&creeps, &creeps])), [0; 0]);
    }
}
