//! Time stamps of a log: gaps, at which it is split, and jitter.

use crate::episode::Episode;
use crate::robust::{median, quantile};
use crate::table::Table;

/// A step of time is a gap from this many median steps on …
const GAP_STEPS: f64 = 5.0;
/// … if it is at least this long, s.
const GAP_SECONDS: f64 = 0.02;
/// A part with fewer samples is left out.
const SHORTEST: usize = 20;
/// A median step longer than this, s, shows no motion of a robot: stamps in milliseconds begin at 1 s. Such a log is to be left
/// out where its clock is not mended.
pub const LONGEST_STEP: f64 = 0.2;
/// Jitter is worth a word from this share of the step on.
const JITTER: f64 = 0.05;

/// Splits a table at its gaps. Returns the parts that are long enough and what there is to say about the file's time.
pub(crate) fn split(table: Table, name: &str) -> (Vec<Episode>, Vec<String>) {
    let Table { mut episode, rows, mut notes, .. } = table;
    let steps: Vec<f64> = episode.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let dt = median(&mut steps.clone()).unwrap_or(0.0);
    let is_gap = |step: f64| step > GAP_STEPS * dt && step > GAP_SECONDS;
    let gaps: Vec<usize> = (0..steps.len()).filter(|&index| is_gap(steps[index])).collect();
    let bounds: Vec<usize> =
        std::iter::once(0).chain(gaps.iter().map(|gap| gap + 1)).chain(std::iter::once(episode.len())).collect();

    let mut parts = Vec::new();
    let mut short = Vec::new();
    for bound in bounds.windows(2) {
        let (from, to) = (bound[0], bound[1]);
        if to - from < SHORTEST {
            short.push((from, to));
        } else if gaps.is_empty() {
            // A run may be long: it is moved, not copied.
            parts.push(Episode { name: name.to_owned(), ..std::mem::take(&mut episode) });
        } else {
            let part = if parts.is_empty() { name.to_owned() } else { format!("{name}#{}", parts.len() + 1) };
            parts.push(episode.part(from, to, part));
        }
    }
    if !gaps.is_empty() {
        let places: Vec<String> =
            gaps.iter().take(5).map(|&gap| format!("{:.3} s before row {}", steps[gap], rows[gap + 1])).collect();
        let more = if gaps.len() > 5 { format!(" and {} more", gaps.len() - 5) } else { String::new() };
        notes.push(format!(
            "time has {} ({}{more}): read as {}",
            count(gaps.len(), "gap"),
            places.join(", "),
            count(parts.len(), "episode")
        ));
    }
    match short.as_slice() {
        [] => {}
        [(from, to)] if gaps.is_empty() => {
            notes.push(format!("has only {}: left out, at least {SHORTEST} are needed", count(to - from, "sample")))
        }
        _ => {
            let samples: usize = short.iter().map(|(from, to)| to - from).sum();
            notes.push(format!(
                "{} of fewer than {SHORTEST} samples between gaps left out ({} in all)",
                count(short.len(), "part"),
                count(samples, "sample")
            ));
        }
    }
    if !parts.is_empty() {
        notes.extend(steadied(&mut parts).or_else(|| jitter(&steps, dt, &is_gap)));
    }
    (parts, notes)
}

/// Puts parts on the steady clocks by which they were sampled, where their stamps jitter; says so where that is worth a word.
fn steadied(parts: &mut [Episode]) -> Option<String> {
    let mut most: Option<f64> = None;
    for part in parts {
        if let Some(time) = part.steady_time() {
            let off = part.time.iter().zip(&time).map(|(stamp, steady)| (stamp - steady).abs()).fold(0.0, f64::max);
            most = Some(most.unwrap_or(0.0f64).max(off / part.dt()));
            part.time = time;
        }
    }
    most.filter(|most| *most > JITTER).map(|most| {
        format!(
            "time stamps jitter by up to {:.0} % of a step, and the positions are smooth without that: read as sampled at a steady rate",
            100.0 * most
        )
    })
}

/// What there is to say about the steps between the gaps.
fn jitter(steps: &[f64], dt: f64, is_gap: &dyn Fn(f64) -> bool) -> Option<String> {
    let kept = || steps.iter().copied().filter(|&step| !is_gap(step));
    let mut deviations: Vec<f64> = kept().map(|step| (step - dt).abs()).collect();
    let usual = quantile(&mut deviations, 0.95)? / dt;
    let worst = quantile(&mut deviations, 1.0)? / dt;
    let long = kept().filter(|step| *step > 1.5 * dt).count();
    if usual > JITTER {
        return Some(format!(
            "time jitters: steps differ from their median, {:.4} ms, by up to {:.0} % in 95 % of the samples and {:.0} % at most; log at a steady rate, or stamp samples where they are taken",
            dt * 1e3,
            100.0 * usual,
            100.0 * worst
        ));
    }
    (long > 0).then(|| {
        format!(
            "{} longer than 1.5 times the median, {:.4} ms: samples may have been lost there",
            count_are(long, "step of time is", "steps of time are"),
            dt * 1e3
        )
    })
}

fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

fn count_are(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(time: Vec<f64>) -> Table {
        let rows = (0..time.len() as u32).map(|index| index + 2).collect();
        let zeros = vec![vec![0.0; time.len()]];
        let episode =
            Episode { joints: vec!["a".into()], position: zeros.clone(), effort: zeros, time, ..Episode::default() };
        Table { label: String::new(), episode, rows, notes: Vec::new() }
    }

    fn even(count: usize, from: f64) -> Vec<f64> {
        (0..count).map(|index| from + 0.01 * index as f64).collect()
    }

    #[test]
    fn a_steady_log_has_nothing_to_say() {
        let (parts, notes) = split(table(even(100, 1e3)), "run.csv");
        assert_eq!((parts.len(), parts[0].name.as_str()), (1, "run.csv"));
        assert!(notes.is_empty(), "{notes:?}");
    }

    #[test]
    fn a_gap_splits_and_is_told_with_its_row() {
        let time = [even(100, 0.0), even(50, 7.0), even(3, 9.0)].concat();
        let (parts, notes) = split(table(time), "run.csv");
        assert_eq!(
            parts.iter().map(|part| (part.name.as_str(), part.len())).collect::<Vec<_>>(),
            [("run.csv", 100), ("run.csv#2", 50)]
        );
        assert!(
            notes[0].contains("2 gaps") && notes[0].contains("row 102") && notes[0].contains("2 episodes"),
            "{notes:?}"
        );
        assert!(notes[1].contains("1 part of fewer than 20"), "{notes:?}");
    }

    #[test]
    fn a_short_step_is_no_gap() {
        // Six median steps of 1 ms, but only 6 ms long.
        let mut time: Vec<f64> = (0..100).map(|index| 1e-3 * f64::from(index)).collect();
        time.iter_mut().skip(50).for_each(|time| *time += 6e-3);
        let (parts, notes) = split(table(time), "run.csv");
        assert_eq!(parts.len(), 1);
        assert!(notes[0].contains("lost"), "{notes:?}");
    }

    #[test]
    fn stamps_that_jitter_about_a_steady_clock_are_put_on_it_and_that_is_told() {
        let stamps: Vec<f64> =
            even(400, 0.0).into_iter().enumerate().map(|(k, t)| t + 0.002 * f64::from(u8::from(k % 7 == 3))).collect();
        let mut table = table(stamps);
        table.episode.position = vec![even(400, 0.0).iter().map(|t| (2.0 * t).sin()).collect()];
        let (parts, notes) = split(table, "run.csv");
        assert!(notes.len() == 1 && notes[0].contains("jitter by up to 1") && notes[0].contains("steady"), "{notes:?}");
        let steps: Vec<f64> = parts[0].time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(steps.iter().all(|step| (step - 0.01).abs() < 1e-5), "{steps:?}");
    }

    #[test]
    fn jitter_a_short_log_and_another_unit_are_told() {
        let time = (0..100).map(|index| 0.01 * f64::from(index) + if index % 2 == 0 { 0.0 } else { 1e-3 }).collect();
        assert!(split(table(time), "a").1[0].contains("jitters"));
        let (parts, notes) = split(table(even(7, 0.0)), "a");
        assert!(parts.is_empty() && notes[0].contains("only 7 samples"), "{notes:?}");
        // A clock in another unit is a fault, and one that stays as it is the caller's to leave out.
        let (parts, notes) = split(table((0..100).map(f64::from).collect()), "a");
        assert!(parts.len() == 1 && notes.is_empty(), "{notes:?}");
    }
}
