//! What logs are like by themselves: rate, gaps, jitter, steps, and what each joint does in them.

use crate::check::Traits;
use crate::episode::{Channel, Episode};
use crate::error::{LogError, LogErrorKind};
use crate::formats;
use crate::options::ReadOptions;
use crate::robust::quantile;
use serde::Serialize;
use std::path::Path;

/// One log as it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogTraits {
    /// Name of the log; parts that a gap in time split off are logs of their own.
    pub name: String,
    /// Number of samples.
    pub samples: usize,
    /// From the first sample to the last, s.
    pub duration: f64,
    /// Rate by the median step of time, Hz.
    pub rate: f64,
    /// Deviation of a step of time from the median, relative: that of 95 % of the steps.
    pub jitter: f64,
    /// Longest step of time, s.
    pub longest_step: f64,
    /// Channels that it has.
    pub channels: Vec<String>,
    /// Its joints.
    pub joints: Vec<JointTraits>,
}

/// A joint in one log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointTraits {
    /// Name of the joint.
    pub name: String,
    /// Whether it moves by more than its noise and its encoder's step.
    pub moves: bool,
    /// Least and greatest position, rad or m.
    pub position: [f64; 2],
    /// Root mean square of its speed, rad/s or m/s.
    pub speed: f64,
    /// Standard deviation of the position's noise from sample to sample, rad or m.
    pub noise: f64,
    /// Step of the encoder, rad or m, where positions lie on a coarse raster.
    pub step: Option<f64>,
    /// Single samples that jump.
    pub glitches: usize,
    /// Least and greatest effort, N m or N, where the log holds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effort: Option<[f64; 2]>,
    /// Share of the samples whose effort repeats the one before, where the log holds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effort_held: Option<f64>,
}

/// What logs are like.
pub fn inspect(episodes: &[Episode]) -> Vec<LogTraits> {
    episodes.iter().map(log).collect()
}

fn log(episode: &Episode) -> LogTraits {
    let dt = episode.dt();
    let steps: Vec<f64> = episode.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut off: Vec<f64> = steps.iter().map(|step| (step - dt).abs() / dt.max(1e-300)).collect();
    let joint = |(j, name): (usize, &String)| {
        let traits = Traits::of(&episode.time, &episode.position[j], dt);
        let effort = episode.effort.get(j).filter(|row| row.iter().all(|effort| effort.is_finite()));
        let repeats = |row: &Vec<f64>| row.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let range = |row: &Vec<f64>| {
            row.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)])
        };
        JointTraits {
            name: name.clone(),
            moves: traits.moves(),
            position: [traits.low, traits.high],
            speed: traits.speed,
            noise: traits.noise,
            step: traits.step,
            glitches: traits.glitches.len(),
            effort: effort.map(range),
            effort_held: effort.map(|row| repeats(row) as f64 / row.len().saturating_sub(1).max(1) as f64),
        }
    };
    let has = |channel: &Channel| episode.channel(*channel).is_some_and(|samples| !samples.is_empty());
    LogTraits {
        name: episode.name.clone(),
        samples: episode.len(),
        duration: episode.duration(),
        rate: episode.rate(),
        jitter: quantile(&mut off, 0.95).unwrap_or(0.0),
        longest_step: steps.iter().copied().fold(0.0, f64::max),
        channels: Channel::ALL.iter().filter(|channel| has(channel)).map(|channel| channel.name().to_owned()).collect(),
        joints: episode.joints.iter().enumerate().map(joint).collect(),
    }
}

/// The joints whose position a log carries, in its order: by their names, or by number where it has none.
///
/// # Errors
/// A file that cannot be read, or in which no column is known to be a position.
pub fn joints_of(path: &Path, options: &ReadOptions) -> Result<Vec<String>, LogError> {
    let positions = |columns: &[(String, Vec<f64>)]| -> Vec<String> {
        let start = format!("{}.", Channel::Position.name());
        columns.iter().filter_map(|(name, _)| name.trim().strip_prefix(&start).map(str::to_owned)).collect()
    };
    let seen = formats::look(path, options, true)?;
    let mut names = positions(&seen.columns);
    if names.is_empty() {
        names = formats::look(path, options, false).map(|seen| positions(&seen.columns)).unwrap_or_default();
    }
    if names.is_empty() {
        return Err(LogError::new(LogErrorKind::MissingColumn, "no column is named position.<joint>")
            .file(path.display().to_string())
            .hint("Name the robot with --model: its joints are looked for, and --suggest-map writes a map"));
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_told_as_it_is() {
        let time: Vec<f64> = (0..500).map(|k| 0.004 * f64::from(k)).collect();
        let position = vec![time.iter().map(|t| (3.0 * t).sin()).collect()];
        let episode =
            Episode { joints: vec!["a".into()], time, position, effort: vec![vec![2.0; 500]], ..Episode::default() };
        let told = &inspect(&[episode])[0];
        assert!((told.rate - 250.0).abs() < 1e-6 && told.jitter < 1e-6 && told.samples == 500);
        assert!(
            told.joints[0].moves
                && told.joints[0].effort == Some([2.0, 2.0])
                && told.joints[0].effort_held == Some(1.0)
        );
        assert_eq!(told.channels, ["position", "effort"]);
    }

    #[test]
    fn joints_are_read_from_the_header() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("run.csv");
        std::fs::write(&file, "# made by hand\ntime,position.b,position.a,effort.a\n0,1,2,3\n").unwrap();
        assert_eq!(joints_of(&file, &ReadOptions::default()).unwrap(), ["b", "a"]);
        std::fs::write(&file, "time,q\n0,1\n").unwrap();
        assert!(joints_of(&file, &ReadOptions::default()).unwrap_err().to_string().contains("--model"));
    }
}
