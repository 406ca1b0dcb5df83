//! How far a diagnosis is: a bar on standard error where that is a terminal, nothing elsewhere.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Part of the time at which each stage of a diagnosis begins: the mean over EMPS, where the choice takes most, and the demo,
/// where the signatures do.
const BEGINS: [(&str, f64); 8] = [
    ("signatures of every effect", 0.04),
    ("choosing effects", 0.16),
    ("rivals", 0.83),
    ("held-out rollouts", 0.85),
    ("networks", 0.87),
    ("intervals", 0.91),
    ("next experiment", 0.92),
    ("done", 0.95),
];
/// The stage that takes turns with the choice: the part that the diagnosis tells of its first and last turn, and the parts of
/// the time.
const REFINING: (&str, [f64; 2], [f64; 2]) = ("refining effects", [0.30, 0.55], [0.18, 0.83]);
/// Nothing is said of the time left before this part of the work and this time are over.
const KNOWN: (f64, Duration) = (0.05, Duration::from_secs(2));
/// How often the time left is told anew.
const TICK: Duration = Duration::from_millis(500);

/// The bar.
pub struct Progress {
    bar: ProgressBar,
    start: Instant,
    /// How long the whole will take, ms; 0 where nothing tells yet.
    total: Arc<AtomicU64>,
}

impl Progress {
    /// A bar, or where `quiet` none.
    pub fn new(quiet: bool) -> Progress {
        let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
        let (start, total) = (Instant::now(), Arc::new(AtomicU64::new(0)));
        let known = Arc::clone(&total);
        let left = move |state: &ProgressState, out: &mut dyn Write| {
            let elapsed = start.elapsed();
            // Of a stage that takes longer than was told nothing is stored: the bar itself tells.
            let told = match known.load(Ordering::Relaxed) {
                0 => whole(state.pos() as f64 / 1000.0, elapsed),
                told => told,
            };
            // A line that cannot be written is none.
            let _ = out.write_str(&in_words(told, elapsed));
        };
        // The message is cut where the terminal ends: a second line would stay behind.
        if let Ok(style) = ProgressStyle::with_template("{bar:24} {percent:>3} %  {left}{wide_msg}") {
            bar.set_style(style.with_key("left", left));
        }
        if !bar.is_hidden() {
            bar.enable_steady_tick(TICK);
        }
        Progress { bar, start, total }
    }

    /// Never goes back: a stage that is entered again, where the search takes turns, leaves the bar where it is.
    pub fn stage(&self, stage: &str, part: f64) {
        let share = share(stage, part);
        let forward = (1000.0 * share) as u64 > self.bar.position();
        if forward {
            self.bar.set_position((1000.0 * share) as u64);
            self.total.store(whole(share, self.start.elapsed()), Ordering::Relaxed);
        }
        self.bar.set_message(stage.to_owned());
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Part of the time that is over where a stage begins; of a stage that nobody measured, the part of the work.
fn share(stage: &str, part: f64) -> f64 {
    let (refining, [first, last], [from, to]) = REFINING;
    let known = BEGINS.iter().find(|(name, _)| *name == stage).map(|(_, share)| *share);
    let turns = || (stage == refining).then(|| from + (to - from) * ((part - first) / (last - first)).clamp(0.0, 1.0));
    known.or_else(turns).unwrap_or(part).clamp(0.0, 1.0)
}

/// How long the whole takes of which this part is over, ms; 0 as long as nothing tells.
fn whole(share: f64, elapsed: Duration) -> u64 {
    if share >= KNOWN.0 && elapsed >= KNOWN.1 { (elapsed.as_millis() as f64 / share) as u64 } else { 0 }
}

/// `about 40 s left  `; nothing as long as nothing tells.
fn in_words(total: u64, elapsed: Duration) -> String {
    let left = Duration::from_millis(total).saturating_sub(elapsed).as_secs();
    match left {
        _ if total == 0 => String::new(),
        0..5 => "a few seconds left  ".into(),
        5..90 => format!("about {left} s left  "),
        _ => format!("about {} min left  ", (left + 30) / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_follow_each_other_in_time() {
        let told = [
            ("reading signals", 0.0),
            ("signatures of every effect", 0.05),
            ("choosing effects", 0.2),
            ("refining effects", 0.3),
            ("refining effects", 0.38),
            ("rivals", 0.55),
            ("held-out rollouts", 0.7),
            ("networks", 0.8),
            ("intervals", 0.85),
            ("next experiment", 0.95),
            ("done", 1.0),
        ];
        let shares: Vec<f64> = told.iter().map(|(stage, part)| share(stage, *part)).collect();
        assert!(shares.windows(2).all(|pair| pair[0] < pair[1]), "{shares:?}");
        assert_eq!(share("what drives each joint", 0.1), 0.1);
    }

    #[test]
    fn a_bar_never_goes_back() {
        let progress = Progress::new(true);
        progress.stage("rivals", 0.55);
        let there = progress.bar.position();
        progress.stage("choosing effects", 0.2);
        assert_eq!(progress.bar.position(), there);
    }

    #[test]
    fn time_left_is_told_once_it_is_known() {
        let told = |total: u64, elapsed: u64| in_words(total, Duration::from_secs(elapsed));
        assert_eq!(told(0, 10), "");
        assert_eq!(whole(0.5, Duration::from_secs(1)), 0);
        assert_eq!(whole(0.8, Duration::from_secs(8)), 10_000);
        assert_eq!(told(60_000, 20), "about 40 s left  ");
        assert_eq!(told(60_000, 70), "a few seconds left  ");
        assert_eq!(told(600_000, 60), "about 9 min left  ");
    }
}
