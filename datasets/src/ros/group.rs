//! The messages of one topic about one set of joints: columns over time.

use super::joints::Sample;
use crate::episode::Channel;

/// Header stamps that lie further from the time of recording than this, s, in a way that changes, are worth a word.
const DRIFT: f64 = 0.1;

/// Messages of one topic that name the same joints, in whatever order.
#[derive(Debug, Default)]
pub(super) struct Group {
    /// The joints, sorted.
    pub names: Vec<String>,
    /// For each joint its place in the messages that come with `order_of`.
    order: Vec<usize>,
    order_of: Vec<String>,
    stamps: Vec<i64>,
    logged: Vec<i64>,
    /// Channels, `[joint][message]`; NaN where a message says nothing.
    channels: Vec<(Channel, Vec<Vec<f64>>)>,
}

impl Group {
    /// For messages about these joints.
    pub fn new(mut names: Vec<String>) -> Self {
        names.sort();
        Self { names, ..Self::default() }
    }

    /// Whether messages with these names, in this order, belong to it, as far as the last one tells.
    pub fn is_about(&self, names: &[String]) -> bool {
        self.order_of == names
    }

    /// Takes a message in, recorded at `logged` ns.
    pub fn push(&mut self, sample: Sample, logged: i64) {
        if self.order_of != sample.names {
            let place = |name: &String| sample.names.iter().position(|other| other == name).unwrap_or(0);
            self.order = self.names.iter().map(place).collect();
            self.order_of = sample.names;
        }
        let before = self.stamps.len();
        for (channel, numbers) in sample.channels {
            let at = match self.channels.iter().position(|(known, _)| *known == channel) {
                Some(at) => at,
                None => {
                    self.channels.push((channel, vec![vec![f64::NAN; before]; self.names.len()]));
                    self.channels.len() - 1
                }
            };
            for (column, &place) in self.channels[at].1.iter_mut().zip(&self.order) {
                column.push(numbers.get(place).copied().unwrap_or(f64::NAN));
            }
        }
        self.stamps.push(sample.stamp);
        self.logged.push(logged);
        // Channels of which this message said nothing.
        for column in self.channels.iter_mut().flat_map(|(_, columns)| columns) {
            column.resize(before + 1, f64::NAN);
        }
    }

    /// Whether a channel has a number for every joint, at least once.
    pub fn has(&self, channel: Channel) -> bool {
        self.columns(channel).is_some_and(|columns| columns.iter().all(|column| column.iter().any(|x| !x.is_nan())))
    }

    /// A channel, `[joint][message]`.
    pub fn columns(&self, channel: Channel) -> Option<&[Vec<f64>]> {
        self.channels.iter().find(|(known, _)| *known == channel).map(|(_, columns)| columns.as_slice())
    }

    /// The channels that there are.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        self.channels.iter().map(|(channel, _)| *channel)
    }

    /// Number of messages.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// The time of each message, ns, sorted and without repeats, and the place of each in the columns.
    pub fn times(&self, notes: &mut Vec<String>) -> Vec<(i64, usize)> {
        let stamped =
            self.stamps.iter().any(|stamp| *stamp != 0) && self.stamps.iter().min() != self.stamps.iter().max();
        let back = self.stamps.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let sound = stamped && 20 * back <= self.stamps.len();
        if self.len() > 1 && !sound {
            notes.push(if stamped {
                format!("header stamps run backwards {back} times: the time of recording is taken")
            } else {
                "messages carry no header stamps: the time of recording is taken".to_owned()
            });
        }
        if sound {
            let late: Vec<i64> =
                self.logged.iter().zip(&self.stamps).map(|(log, stamp)| log.saturating_sub(*stamp)).collect();
            let spread =
                late.iter().max().zip(late.iter().min()).map_or(0, |(most, least)| most.saturating_sub(*least));
            let spread = spread as f64 * 1e-9;
            if spread > DRIFT {
                notes.push(format!(
                    "messages were recorded between {:.3} s and {:.3} s after their header stamps: the stamps are taken",
                    late.iter().min().map_or(0.0, |ns| *ns as f64 * 1e-9),
                    late.iter().max().map_or(0.0, |ns| *ns as f64 * 1e-9)
                ));
            }
        }
        let times = if sound || self.len() < 2 { &self.stamps } else { &self.logged };
        let mut sorted: Vec<(i64, usize)> = times.iter().copied().enumerate().map(|(at, time)| (time, at)).collect();
        sorted.sort();
        let before = sorted.len();
        sorted.dedup_by_key(|(time, _)| *time);
        if sorted.len() < before {
            notes.push(format!("{} messages have the stamp of another: left out", before - sorted.len()));
        }
        sorted
    }
}
