//! What stamps of time say of the clock that made them.

use gapscope_datasets::Episode;

/// Stamps that stray from an even raster by less than this part of an interval were counted and not read: half a millisecond of
/// rounding at 30 Hz is 1.5 %, and recorders of servo buses stray by more.
const EVEN: f64 = 0.016;

/// Whether the stamps of a log lie on an even raster.
fn is_even(time: &[f64]) -> bool {
    let [first, .., last] = time else { return false };
    let step = (last - first) / (time.len() - 1) as f64;
    time.iter().enumerate().all(|(k, t)| (t - first - k as f64 * step).abs() <= EVEN * step)
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
}
