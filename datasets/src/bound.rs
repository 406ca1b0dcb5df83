//! A bounded part of however many logs: what a diagnosis takes in, chosen while the logs are read one run at a time.

use crate::episode::Episode;
use crate::options::Bound;
use crate::time_stamps::LONGEST_STEP;
use gapscope_dynamics::Finding;
use std::collections::BTreeMap;

/// Runs longer than this are cut into stretches of about this length where they do not all fit, s. Motions that excite a robot
/// last some ten seconds.
const STRETCH: f64 = 20.0;

/// What a finding about all logs together is about.
pub const ALL_LOGS: &str = "the logs";

/// Golden section: its multiples spread evenly over the unit interval, however many there are.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Runs that were read, or stretches of them, within a bound.
///
/// Which stretches stay is decided by ranks that depend on nothing but a stretch's place: those of the lowest rank. So files
/// may be read in any order, each with a keeper of its own, and the last choice is the same.
pub(crate) struct Keeper {
    bound: Option<Bound>,
    held: Vec<Held>,
    /// Whether runs are cut, as they do not all fit.
    cuts: bool,
    /// Digest of every run that was seen, with its place and name.
    seen: BTreeMap<u64, (Place, String)>,
    stretches: BTreeMap<usize, u64>,
    size: Size,
    all: Size,
    findings: Vec<Finding>,
}

/// File and run of the file.
type Place = (usize, usize);

struct Held {
    place: Place,
    /// Samples of the run before it.
    from: usize,
    rank: f64,
    episode: Episode,
}

/// How much there is.
#[derive(Debug, Clone, Copy, Default)]
struct Size {
    seconds: f64,
    numbers: f64,
}

impl Size {
    fn of(episode: &Episode) -> Size {
        Size { seconds: seconds(episode), numbers: (episode.len() * episode.joint_count()) as f64 }
    }

    fn plus(self, other: Size, sign: f64) -> Size {
        Size { seconds: self.seconds + sign * other.seconds, numbers: self.numbers + sign * other.numbers }
    }

    fn exceeds(self, bound: Bound) -> bool {
        self.seconds > bound.seconds || self.numbers > bound.numbers
    }
}

impl Keeper {
    pub fn new(bound: Option<Bound>) -> Keeper {
        Keeper {
            bound,
            held: Vec::new(),
            cuts: false,
            seen: BTreeMap::new(),
            stretches: BTreeMap::new(),
            size: Size::default(),
            all: Size::default(),
            findings: Vec::new(),
        }
    }

    /// Takes in a run of a file, unless the same samples were read before.
    pub fn add(&mut self, file: usize, episode: Episode) {
        let place = (file, self.seen.values().filter(|((of, _), _)| *of == file).count());
        if self.is_new(episode.motion_digest(), place, &episode.name) {
            self.all = self.all.plus(Size::of(&episode), 1.0);
            self.take(place, episode);
        }
    }

    /// Takes in what another keeper kept of other files.
    pub fn merge(&mut self, other: Keeper) {
        self.findings.extend(other.findings);
        self.all = self.all.plus(other.all, 1.0);
        let mut doubled = Vec::new();
        for (digest, (place, name)) in other.seen {
            if !self.is_new(digest, place, &name) {
                doubled.push(place);
            }
        }
        if other.cuts {
            self.begin_to_cut();
        }
        for held in other.held.into_iter().filter(|held| !doubled.contains(&held.place)) {
            if other.cuts {
                self.hold(held);
            } else {
                self.take(held.place, held.episode);
            }
        }
    }

    /// The runs, in their order, and what there is to say about the choice.
    pub fn finish(mut self) -> (Vec<Episode>, Vec<Finding>) {
        self.held.sort_by_key(|held| (held.place, held.from));
        if let Some(bound) = self.bound.filter(|_| self.cuts) {
            self.findings.push(Finding::new(
                ALL_LOGS,
                format!(
                    "hold {:.0} s, of which {:.0} s are taken, in {} stretches spread evenly over them: a diagnosis takes {:.0} s at most, and {:.1} million samples of all joints. To choose by yourself, give fewer logs, or --episodes",
                    self.all.seconds,
                    self.size.seconds,
                    self.held.len(),
                    bound.seconds,
                    bound.numbers / 1e6
                ),
            ));
        }
        (self.held.into_iter().map(|held| held.episode).collect(), self.findings)
    }

    fn is_new(&mut self, digest: u64, place: Place, name: &str) -> bool {
        if let Some((_, earlier)) = self.seen.get(&digest) {
            let message =
                format!("holds the same samples as {earlier}: left out, for it would be held out against itself");
            self.findings.push(Finding::new(name, message));
            return false;
        }
        self.seen.insert(digest, (place, name.to_owned()));
        true
    }

    fn take(&mut self, place: Place, episode: Episode) {
        if self.cuts {
            return self.cut(place, episode);
        }
        self.size = self.size.plus(Size::of(&episode), 1.0);
        self.held.push(Held { place, from: 0, rank: 0.0, episode });
        if self.bound.is_some_and(|bound| self.size.exceeds(bound)) {
            self.begin_to_cut();
        }
    }

    fn begin_to_cut(&mut self) {
        if !self.cuts {
            self.cuts = true;
            self.size = Size::default();
            // Stretches are numbered in the order of the runs.
            for held in std::mem::take(&mut self.held) {
                self.cut(held.place, held.episode);
            }
        }
    }

    /// Holds the stretches of a run that rank low enough.
    fn cut(&mut self, place: Place, episode: Episode) {
        let parts = (seconds(&episode) / STRETCH).round().max(1.0) as usize;
        let length = episode.len().div_ceil(parts);
        for part in 0..parts {
            let (from, to) = (part * length, ((part + 1) * length).min(episode.len()));
            let number = self.stretches.entry(place.0).or_default();
            let rank = (reversed(*number) + GOLDEN * place.0 as f64).fract();
            *number += 1;
            if from >= to {
                continue;
            }
            let name = if parts == 1 {
                episode.name.clone()
            } else {
                format!("{}@{:.0}s", episode.name, episode.time[from] - episode.time[0])
            };
            self.hold(Held { place, from, rank, episode: episode.part(from, to, name) });
        }
    }

    /// Holds a stretch, and lets go those of the highest rank as long as there are too many.
    fn hold(&mut self, held: Held) {
        self.size = self.size.plus(Size::of(&held.episode), 1.0);
        self.held.push(held);
        while self.held.len() > 1 && self.bound.is_some_and(|bound| self.size.exceeds(bound)) {
            let key = |held: &Held| (held.rank, held.place, held.from);
            let last = (0..self.held.len()).max_by(|&a, &b| {
                let (a, b) = (key(&self.held[a]), key(&self.held[b]));
                a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2)))
            });
            let Some(last) = last else { return };
            let gone = self.held.swap_remove(last);
            self.size = self.size.plus(Size::of(&gone.episode), -1.0);
        }
    }
}

/// Length of a run, s. A clock that is no clock of seconds is mended later: until then it is taken for one of ms, or of µs.
fn seconds(episode: &Episode) -> f64 {
    let step = episode.dt();
    let mut unit = 1.0;
    while step * unit > LONGEST_STEP {
        unit *= 1e-3;
    }
    episode.duration() * unit
}

/// The bits of a number reversed, as a fraction: 0, 1/2, 1/4, 3/4, …. Those of the lowest ranks are spread evenly.
fn reversed(number: u64) -> f64 {
    number.reverse_bits() as f64 / 2f64.powi(64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::Channel;

    fn run(name: &str, seconds: usize) -> Episode {
        let time: Vec<f64> = (0..seconds * 100).map(|k| 0.01 * k as f64).collect();
        let position = vec![time.iter().map(|t| (t + name.len() as f64).sin()).collect()];
        Episode {
            name: name.into(),
            joints: vec!["a".into()],
            effort: position.clone(),
            position,
            time,
            ..Episode::default()
        }
    }

    fn bound(seconds: f64) -> Option<Bound> {
        Some(Bound { seconds, numbers: f64::INFINITY })
    }

    fn starts(keeper: Keeper) -> Vec<String> {
        keeper.finish().0.into_iter().map(|episode| episode.name).collect()
    }

    #[test]
    fn what_fits_stays_whole_and_nothing_is_said() {
        let mut keeper = Keeper::new(bound(100.0));
        keeper.add(0, run("a", 60));
        keeper.add(1, run("bb", 30));
        let (episodes, findings) = keeper.finish();
        assert_eq!(episodes, [run("a", 60), run("bb", 30)]);
        assert!(findings.is_empty(), "{findings:?}");
    }

    #[test]
    fn a_long_run_is_taken_in_stretches_spread_over_it() {
        let mut keeper = Keeper::new(bound(100.0));
        keeper.add(0, run("a", 1600));
        let (episodes, findings) = keeper.finish();
        let seconds: f64 = episodes.iter().map(Episode::duration).sum();
        let names: Vec<&str> = episodes.iter().map(|episode| episode.name.as_str()).collect();
        assert!((80.0..=100.0).contains(&seconds), "{seconds}");
        assert_eq!(names, ["a@0s", "a@320s", "a@640s", "a@960s", "a@1280s"]);
        assert!(findings[0].to_string().contains("1600 s, of which 100 s"), "{findings:?}");
        assert!(episodes[1].channel(Channel::Effort).is_some_and(|rows| rows[0].len() == episodes[1].len()));
    }

    #[test]
    fn a_clock_in_milliseconds_makes_no_log_longer() {
        let mut log = run("a", 60);
        log.time.iter_mut().for_each(|time| *time *= 1e3);
        let mut keeper = Keeper::new(bound(100.0));
        keeper.add(0, log.clone());
        assert_eq!(keeper.finish().0, [log]);
    }

    #[test]
    fn files_may_be_read_apart() {
        let mut one = Keeper::new(bound(100.0));
        let mut merged = Keeper::new(bound(100.0));
        for file in 0..40 {
            let mut own = Keeper::new(bound(100.0));
            for part in 0..3 {
                let episode = run(&"x".repeat(1 + 3 * file + part), 15 + 40 * (file % 5));
                one.add(file, episode.clone());
                own.add(file, episode);
            }
            merged.merge(own);
        }
        let (one, merged) = (starts(one), starts(merged));
        assert!(one.len() >= 3 && one == merged, "{one:?} {merged:?}");
    }

    #[test]
    fn the_same_samples_count_once() {
        let mut keeper = Keeper::new(None);
        keeper.add(0, run("a", 10));
        keeper.add(0, Episode { name: "b".into(), ..run("a", 10) });
        let mut other = Keeper::new(None);
        other.add(1, Episode { name: "c".into(), ..run("a", 10) });
        keeper.merge(other);
        let (episodes, findings) = keeper.finish();
        assert_eq!((episodes.len(), findings.len()), (1, 2));
        assert!(findings[1].to_string().contains("same samples as a"), "{findings:?}");
    }
}
