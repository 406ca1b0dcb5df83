//! One continuous run of one robot.

use crate::robust::median;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A quantity that a log carries for each joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Measured joint position, rad or m.
    Position,
    /// Measured joint velocity, rad/s or m/s.
    Velocity,
    /// Torque of the drive, joint side of the gear, before losses, N m or N; held until the next sample.
    Effort,
    /// Position reference of the servo, rad or m.
    Command,
    /// Torque measured on the link side of the gear, N m or N.
    EffortLink,
    /// Drive temperature, °C.
    Temperature,
    /// Known external effort, positive in the joint's direction, added to `effort`, N m or N.
    Disturbance,
    /// Motor current where the torque constant is not known, A.
    Current,
    /// Voltage at the motor, duty times supply, V.
    Voltage,
    /// 1 where the motor is on, 0 where it is off.
    Enabled,
}

impl Channel {
    /// All channels, in the order in which they are written.
    pub const ALL: [Channel; 10] = [
        Channel::Position,
        Channel::Velocity,
        Channel::Effort,
        Channel::Command,
        Channel::EffortLink,
        Channel::Temperature,
        Channel::Disturbance,
        Channel::Current,
        Channel::Voltage,
        Channel::Enabled,
    ];

    /// Name in a column header, before the dot.
    pub fn name(self) -> &'static str {
        match self {
            Channel::Position => "position",
            Channel::Velocity => "velocity",
            Channel::Effort => "effort",
            Channel::Command => "command",
            Channel::EffortLink => "effort_link",
            Channel::Temperature => "temperature",
            Channel::Disturbance => "disturbance",
            Channel::Current => "current",
            Channel::Voltage => "voltage",
            Channel::Enabled => "enabled",
        }
    }

    /// The channel of this name.
    pub fn from_name(name: &str) -> Option<Channel> {
        Channel::ALL.into_iter().find(|channel| channel.name() == name)
    }

    /// Whether every log must carry it for every joint; of effort, unless logs without it are asked for.
    pub fn is_needed(self) -> bool {
        matches!(self, Channel::Position | Channel::Effort)
    }

    /// Whether it can stand in for the effort of a joint.
    pub fn drives(self) -> bool {
        matches!(self, Channel::Effort | Channel::Current | Channel::Voltage | Channel::Command)
    }

    /// Whether an empty cell means that the quantity is not known there, in logs that may lack the effort.
    pub(crate) fn may_be_unknown(self) -> bool {
        matches!(self, Channel::Command | Channel::Current | Channel::Voltage)
    }
}

/// Samples of one channel, joint-major: `[joint][sample]`.
pub type Samples = Vec<Vec<f64>>;

/// A continuous run of one robot, as logged. All channels are joint-major, `[n][T]`, joints in model order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Episode {
    /// File name; parts of a file that was split at a gap in time carry `#2`, `#3`, … behind it.
    pub name: String,
    /// Names of the joints, in model order.
    pub joints: Vec<String>,
    /// Time stamps, s, strictly increasing, any origin.
    pub time: Vec<f64>,
    /// Whether the stamps are taken at their word, though they may jitter where the samples were taken at a steady rate.
    pub stamps_kept: bool,
    /// Measured position, rad or m.
    pub position: Samples,
    /// Measured velocity, rad/s or m/s.
    pub velocity: Option<Samples>,
    /// Torque of the drive, N m or N, held from each sample to the next. Without rows where no joint's is known; NaN for
    /// joints whose is not.
    pub effort: Samples,
    /// Position reference of the servo, rad or m. NaN where it is not known, in logs that may lack the effort.
    pub command: Option<Samples>,
    /// Torque on the link side of the gear, N m or N.
    pub effort_link: Option<Samples>,
    /// Drive temperature, °C.
    pub temperature: Option<Samples>,
    /// Known external effort, added to `effort`, N m or N.
    pub disturbance: Option<Samples>,
    /// Joints whose effort tells nothing, by index: it was not recorded, or what stands there is no torque.
    pub effort_unknown: Vec<usize>,
    /// Motor current, A; NaN where it is not known.
    pub current: Option<Samples>,
    /// Voltage at the motor, V; NaN where it is not known.
    pub voltage: Option<Samples>,
    /// 1 where the motor is on, 0 where it is off; NaN for joints of which the log does not say.
    pub enabled: Option<Samples>,
}

impl Episode {
    /// A digest of the samples of time and position: the same log under another name has the same.
    pub fn motion_digest(&self) -> u64 {
        let mut digest = DefaultHasher::new();
        for row in std::iter::once(&self.time).chain(&self.position) {
            row.iter().for_each(|x| x.to_bits().hash(&mut digest));
        }
        digest.finish()
    }

    /// Number of samples T.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether it has no sample.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Number of joints n.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Time from the first sample to the last, s.
    pub fn duration(&self) -> f64 {
        match (self.time.first(), self.time.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Sampling interval: the median step of time, s; 0 with fewer than two samples.
    pub fn dt(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        median(&mut steps).unwrap_or(0.0)
    }

    /// Sampling rate, 1/dt, Hz; 0 with fewer than two samples.
    pub fn rate(&self) -> f64 {
        let dt = self.dt();
        if dt > 0.0 { 1.0 / dt } else { 0.0 }
    }

    /// Whether the log holds the effort of every joint.
    pub fn has_effort(&self) -> bool {
        self.effort.len() == self.joints.len() && self.effort.iter().all(|row| row.iter().all(|e| e.is_finite()))
    }

    /// The samples of a channel, where the log has it.
    pub fn channel(&self, channel: Channel) -> Option<&Samples> {
        match channel {
            Channel::Position => Some(&self.position),
            Channel::Velocity => self.velocity.as_ref(),
            Channel::Effort => (!self.effort.is_empty()).then_some(&self.effort),
            Channel::Command => self.command.as_ref(),
            Channel::EffortLink => self.effort_link.as_ref(),
            Channel::Temperature => self.temperature.as_ref(),
            Channel::Disturbance => self.disturbance.as_ref(),
            Channel::Current => self.current.as_ref(),
            Channel::Voltage => self.voltage.as_ref(),
            Channel::Enabled => self.enabled.as_ref(),
        }
    }

    pub(crate) fn set_channel(&mut self, channel: Channel, samples: Samples) {
        match channel {
            Channel::Position => self.position = samples,
            Channel::Velocity => self.velocity = Some(samples),
            Channel::Effort => self.effort = samples,
            Channel::Command => self.command = Some(samples),
            Channel::EffortLink => self.effort_link = Some(samples),
            Channel::Temperature => self.temperature = Some(samples),
            Channel::Disturbance => self.disturbance = Some(samples),
            Channel::Current => self.current = Some(samples),
            Channel::Voltage => self.voltage = Some(samples),
            Channel::Enabled => self.enabled = Some(samples),
        }
    }

    /// The samples `from..to` as an episode of its own, with another name. Bounds beyond the end are cut.
    pub fn part(&self, from: usize, to: usize, name: impl Into<String>) -> Episode {
        let to = to.min(self.len());
        let from = from.min(to);
        let mut part = Episode {
            name: name.into(),
            joints: self.joints.clone(),
            time: self.time[from..to].to_vec(),
            stamps_kept: self.stamps_kept,
            effort_unknown: self.effort_unknown.clone(),
            ..Episode::default()
        };
        for channel in Channel::ALL {
            if let Some(samples) = self.channel(channel) {
                let cut = samples.iter().map(|row| row.get(from..to).unwrap_or_default().to_vec()).collect();
                part.set_channel(channel, cut);
            }
        }
        part
    }

    /// Leaves out the samples that are not `kept`.
    pub(crate) fn keep_samples(&mut self, kept: &[bool]) {
        let keep = |row: &mut Vec<f64>| {
            let mut flags = kept.iter();
            row.retain(|_| flags.next().is_none_or(|&kept| kept));
        };
        keep(&mut self.time);
        for channel in Channel::ALL {
            if let Some(mut samples) = self.channel(channel).cloned() {
                samples.iter_mut().for_each(keep);
                self.set_channel(channel, samples);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn episode() -> Episode {
        Episode {
            name: "run.csv".into(),
            joints: vec!["a".into()],
            time: vec![5.0, 5.1, 5.2, 5.4],
            position: vec![vec![0.0, 1.0, 2.0, 3.0]],
            effort: vec![vec![4.0; 4]],
            velocity: Some(vec![vec![9.0, 8.0, 7.0, 6.0]]),
            ..Episode::default()
        }
    }

    #[test]
    fn length_duration_and_rate() {
        let episode = episode();
        assert_eq!(episode.len(), 4);
        assert!((episode.duration() - 0.4).abs() < 1e-12);
        assert!((episode.rate() - 10.0).abs() < 1e-9);
        let empty = Episode::default();
        assert!(empty.is_empty());
        assert_eq!((empty.duration(), empty.dt(), empty.rate()), (0.0, 0.0, 0.0));
    }

    #[test]
    fn a_part_holds_the_same_samples() {
        let part = episode().part(1, 3, "run.csv#2");
        assert_eq!(part.time, [5.1, 5.2]);
        assert_eq!(part.position, [[1.0, 2.0]]);
        assert_eq!(part.velocity, Some(vec![vec![8.0, 7.0]]));
        assert_eq!(part.command, None);
        assert_eq!(part.name, "run.csv#2");
        assert!(episode().part(9, 3, "").is_empty());
    }

    #[test]
    fn names_of_channels_lead_back_to_them() {
        for channel in Channel::ALL {
            assert_eq!(Channel::from_name(channel.name()), Some(channel));
        }
        assert_eq!(Channel::from_name("torque"), None);
    }
}
