//! The part of long logs that a search goes by: it takes hundreds of fits, and a fit takes as long as its logs.

use crate::around::Motion;
use crate::prepare::Joint;
use crate::run::Run;

/// Time that a search goes by, s: two motions of half a minute each show what a joint has. Parameters are those of all logs.
const EXCERPT: f64 = 80.0;
/// Length of a piece, s: long against what a servo remembers of its start.
const PIECE: f64 = 5.0;
/// A piece in which a joint moves less than this part of its speed over all logs says next to nothing of it.
const STILL: f64 = 0.1;

/// A piece of a log: the run and its first and last sample.
#[derive(Debug, Clone, Copy)]
struct Piece {
    run: usize,
    samples: [usize; 2],
}

/// The joint with pieces of its runs, spread evenly over those in which it moves; `None` where the runs are short.
pub fn of_joint(joint: &Joint) -> Option<Joint> {
    let pieces = spread(joint, |piece| moves(joint, piece))?;
    let runs = pieces.iter().map(|piece| joint.runs[piece.run].part(piece.samples)).collect();
    Some(Joint { runs, ..joint.clone() })
}

/// Works on all joints of an arm and how it moved: on the same pieces of all runs, each a log of its own, spread evenly over
/// those in which any joint moves; on the joints themselves where the logs are short.
pub fn with_arm<T>(joints: &mut [Joint], motions: &[Motion], work: impl FnOnce(&mut [Joint], &[Motion]) -> T) -> T {
    let first = joints.first();
    let Some(pieces) = first.and_then(|first| spread(first, |piece| joints.iter().any(|joint| moves(joint, piece))))
    else {
        return work(joints, motions);
    };
    let of = |joint: &Joint| {
        let part = |(log, piece): (usize, &Piece)| Run { log, ..joint.runs[piece.run].part(piece.samples) };
        Joint { runs: pieces.iter().enumerate().map(part).collect(), ..joint.clone() }
    };
    let motions: Vec<Motion> = pieces.iter().map(|piece| motions[piece.run].part(piece.samples)).collect();
    work(&mut joints.iter().map(of).collect::<Vec<_>>(), &motions)
}

/// Pieces of the runs of a joint, spread evenly over those that are wanted.
fn spread(joint: &Joint, is_wanted: impl Fn(Piece) -> bool) -> Option<Vec<Piece>> {
    let duration = |run: &Run| run.time.last().zip(run.time.first()).map_or(0.0, |(end, start)| end - start);
    if joint.runs.iter().map(duration).sum::<f64>() <= EXCERPT + PIECE {
        return None;
    }
    let all: Vec<Piece> = joint.runs.iter().enumerate().flat_map(|(run, of)| pieces(run, of)).collect();
    let wanted: Vec<Piece> = all.iter().copied().filter(|piece| is_wanted(*piece)).collect();
    // Where nothing moves, all of it is as good.
    let from = if wanted.is_empty() { all } else { wanted };
    let count = ((EXCERPT / PIECE) as usize).min(from.len());
    Some((0..count).map(|i| from[i * from.len() / count]).collect())
}

/// A run cut into pieces. Of a run that is shorter than one, nothing.
fn pieces(run: usize, of: &Run) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut from = 0;
    for k in 1..of.time.len() {
        if of.time[k] - of.time[from] >= PIECE {
            pieces.push(Piece { run, samples: [from, k] });
            from = k;
        }
    }
    pieces
}

/// Whether a joint moves in a piece.
fn moves(joint: &Joint, piece: Piece) -> bool {
    let ([from, to], run) = (piece.samples, &joint.runs[piece.run]);
    let squares: f64 = run.position[from..=to].windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    let speed = (squares * (to - from) as f64).sqrt() / (run.time[to] - run.time[from]);
    speed > STILL * joint.sizes.speed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{Around, Held, Signal, Steps, Surroundings};

    /// A joint at 50 Hz that moves in the second half of each of some runs of so many seconds.
    fn joint(runs: usize, seconds: usize) -> Joint {
        let count = 50 * seconds + 1;
        let time: Vec<f64> = (0..count).map(|k| 0.02 * k as f64).collect();
        let position: Vec<f64> = time.iter().map(|t| 0.4 * (t - 0.5 * seconds as f64).max(0.0).sin()).collect();
        let run = |log| Run {
            target: Some(Held::new(&time, &position)),
            target_rate: None,
            delivered: None,
            restarts: vec![],
            position: position.clone(),
            on: vec![true; count],
            gain: 1.0,
            own_gain: None,
            seen_feedback: None,
            around: Surroundings::new(2, vec![Around { inertia: 0.01, ..Around::default() }; 2 * count - 1]),
            mass: 0.01,
            weight: vec![1.0; count],
            stale: vec![false; count],
            is_counted: false,
            strays: 0.0,
            time: time.clone(),
            step: 5e-3,
            steps: Steps::default(),
            log,
        };
        Joint { runs: (0..runs).map(run).collect(), ..Joint::blank(Signal::Command) }
    }

    #[test]
    fn a_search_goes_by_pieces_of_all_long_logs_in_which_the_joint_moves() {
        let long = joint(3, 120);
        let part = of_joint(&long).unwrap();
        assert_eq!(part.runs.len(), 16);
        for run in &part.runs {
            let length = run.time[run.time.len() - 1] - run.time[0];
            assert!((length - PIECE).abs() < 0.03 && run.time[0] >= 59.0, "{length} from {}", run.time[0]);
            assert_eq!((run.restarts.as_slice(), run.around.rows.len()), (&[0][..], 2 * run.time.len() - 1));
        }
        assert_eq!((0..3).map(|log| part.runs.iter().filter(|run| run.log == log).count()).max(), Some(6));
        assert!(of_joint(&joint(3, 25)).is_none());
    }
}
