//! MCAP with an index: a topic a channel, each of messages `sensor_msgs/msg/JointState` in CDR.
//!
//! Source: the MCAP format specification, version 0, <https://mcap.dev/spec>. Foxglove, PlotJuggler and rerun know these
//! messages. rerun reads no file without a summary, and of a file only what stands in chunks that the summary names.

use super::Table;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Opcodes of the records that are written.
mod opcode {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0b;
    pub const DATA_END: u8 = 0x0f;
}

/// Instants of one chunk: a reader that looks for an instant reads this much.
const INSTANTS: usize = 1000;

const JOINT_STATE: &str = "\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// Positions are in every message, so that each topic is a whole log; `effort` is the channel's torque.
pub fn write(table: &Table) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    record(&mut out, opcode::HEADER, |body| {
        text(body, "ros2");
        text(body, concat!("gapscope ", env!("CARGO_PKG_VERSION")));
    });
    let (positions, torques): (Vec<_>, Vec<_>) = table.channels.iter().partition(|(name, _)| *name == "position");
    let positions = positions.first().map(|(_, rows)| rows.as_slice()).unwrap_or_default();
    let known = schema_and_channels(torques.iter().map(|(name, _)| *name));
    out.extend(&known);
    let stamps: Vec<u64> = table.time.iter().map(|time| (time.max(0.0) * 1e9).round() as u64).collect();
    let mut chunks = Vec::new();
    for (number, stamps) in stamps.chunks(INSTANTS).enumerate() {
        let mut messages = Vec::new();
        // Of each channel: the stamp of a message, and where in the chunk its record begins.
        let mut index: Vec<Vec<(u64, u64)>> = vec![Vec::new(); torques.len()];
        for (k, &stamp) in stamps.iter().enumerate() {
            let i = number * INSTANTS + k;
            for (id, (_, rows)) in torques.iter().enumerate() {
                index[id].push((stamp, messages.len() as u64));
                record(&mut messages, opcode::MESSAGE, |body| {
                    body.extend((id as u16).to_le_bytes());
                    body.extend((i as u32).to_le_bytes());
                    body.extend(stamp.to_le_bytes());
                    body.extend(stamp.to_le_bytes());
                    let at = |rows: &[Vec<f64>]| rows.iter().map(|row| row[i]).collect::<Vec<f64>>();
                    body.extend(message(stamp, table.joints, &at(positions), &at(rows)));
                });
            }
        }
        chunks.push(chunk(&mut out, stamps, &messages, &index));
    }
    record(&mut out, opcode::DATA_END, |body| body.extend(NO_CHECKSUM));
    let summary = out.len() as u64;
    out.extend(&known);
    record(&mut out, opcode::STATISTICS, |body| {
        body.extend(((stamps.len() * torques.len()) as u64).to_le_bytes());
        body.extend(1u16.to_le_bytes());
        body.extend((torques.len() as u32).to_le_bytes());
        // Attachments, metadata.
        body.extend([0; 8]);
        body.extend((chunks.len() as u32).to_le_bytes());
        let ends = [stamps.first(), stamps.last()].map(|stamp| stamp.copied().unwrap_or(0));
        body.extend(ends.map(u64::to_le_bytes).concat());
        map(body, (0..torques.len()).map(|id| (id as u16, stamps.len() as u64)));
    });
    chunks.iter().for_each(|index| out.extend(index));
    record(&mut out, opcode::FOOTER, |body| {
        body.extend(summary.to_le_bytes());
        // No offsets of the summary's parts.
        body.extend(0u64.to_le_bytes());
        body.extend(NO_CHECKSUM);
    });
    out.extend(MAGIC);
    out
}

/// Readers compare no checksum that is zero.
const NO_CHECKSUM: [u8; 4] = [0; 4];

/// The one schema, and a channel for each name: in the data, and once more in the summary.
fn schema_and_channels<'a>(names: impl Iterator<Item = &'a str>) -> Vec<u8> {
    let mut out = Vec::new();
    record(&mut out, opcode::SCHEMA, |body| {
        body.extend(1u16.to_le_bytes());
        text(body, "sensor_msgs/msg/JointState");
        text(body, "ros2msg");
        text(body, JOINT_STATE);
    });
    for (id, name) in (0u16..).zip(names) {
        record(&mut out, opcode::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(1u16.to_le_bytes());
            text(body, &format!("/{name}"));
            text(body, "cdr");
            // No metadata.
            body.extend(0u32.to_le_bytes());
        });
    }
    out
}

/// Writes messages as a chunk with an index of each channel behind it; returns the record that the summary has of it.
fn chunk(out: &mut Vec<u8>, stamps: &[u64], messages: &[u8], index: &[Vec<(u64, u64)>]) -> Vec<u8> {
    let ends = [stamps.first(), stamps.last()].map(|stamp| stamp.copied().unwrap_or(0));
    let size = messages.len() as u64;
    let begin = out.len() as u64;
    record(out, opcode::CHUNK, |body| {
        body.extend(ends.map(u64::to_le_bytes).concat());
        body.extend(size.to_le_bytes());
        body.extend(NO_CHECKSUM);
        // No compression.
        text(body, "");
        body.extend(size.to_le_bytes());
        body.extend(messages);
    });
    let end = out.len() as u64;
    let mut offsets = Vec::new();
    for (id, of_channel) in (0u16..).zip(index) {
        offsets.push((id, out.len() as u64));
        record(out, opcode::MESSAGE_INDEX, |body| {
            body.extend(id.to_le_bytes());
            body.extend((16 * of_channel.len() as u32).to_le_bytes());
            of_channel.iter().for_each(|(stamp, at)| body.extend([stamp.to_le_bytes(), at.to_le_bytes()].concat()));
        });
    }
    let behind = out.len() as u64 - end;
    let mut told = Vec::new();
    record(&mut told, opcode::CHUNK_INDEX, |body| {
        body.extend(ends.map(u64::to_le_bytes).concat());
        body.extend(begin.to_le_bytes());
        body.extend((end - begin).to_le_bytes());
        map(body, offsets.into_iter());
        body.extend(behind.to_le_bytes());
        text(body, "");
        body.extend(size.to_le_bytes());
        body.extend(size.to_le_bytes());
    });
    told
}

/// A number for each channel, behind the length of all in bytes.
fn map(out: &mut Vec<u8>, of_channels: impl ExactSizeIterator<Item = (u16, u64)>) {
    out.extend((10 * of_channels.len() as u32).to_le_bytes());
    for (id, number) in of_channels {
        out.extend(id.to_le_bytes());
        out.extend(number.to_le_bytes());
    }
}

fn record(out: &mut Vec<u8>, opcode: u8, write: impl FnOnce(&mut Vec<u8>)) {
    let mut body = Vec::new();
    write(&mut body);
    out.push(opcode);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
}

fn text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// A message in little-endian CDR: numbers stand at multiples of their size behind the four bytes of the encoding.
fn message(stamp: u64, names: &[String], position: &[f64], effort: &[f64]) -> Vec<u8> {
    let mut body = Vec::new();
    let align = |body: &mut Vec<u8>, size: usize| body.resize(body.len().next_multiple_of(size), 0);
    let word = |body: &mut Vec<u8>, value: u32| {
        align(body, 4);
        body.extend(value.to_le_bytes());
    };
    let string = |body: &mut Vec<u8>, text: &str| {
        word(body, text.len() as u32 + 1);
        body.extend(text.as_bytes());
        body.push(0);
    };
    let numbers = |body: &mut Vec<u8>, values: &[f64]| {
        word(body, values.len() as u32);
        if !values.is_empty() {
            align(body, 8);
        }
        values.iter().for_each(|value| body.extend(value.to_le_bytes()));
    };
    word(&mut body, (stamp / 1_000_000_000) as u32);
    word(&mut body, (stamp % 1_000_000_000) as u32);
    string(&mut body, "");
    word(&mut body, names.len() as u32);
    names.iter().for_each(|name| string(&mut body, name));
    numbers(&mut body, position);
    numbers(&mut body, &[]);
    numbers(&mut body, effort);
    [&[0, 1, 0, 0][..], &body].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(bytes: &[u8], at: usize) -> usize {
        usize::try_from(u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())).unwrap()
    }

    /// Opcode, and first byte, of each record from one byte to another.
    fn records(bytes: &[u8], from: usize, to: usize) -> Vec<(u8, usize)> {
        let mut found = Vec::new();
        let mut at = from;
        while at < to {
            found.push((bytes[at], at));
            at += 9 + number(bytes, at + 1);
        }
        assert_eq!(at, to);
        found
    }

    #[test]
    fn the_summary_leads_to_every_message() {
        let joints = ["a".to_owned(), "b".to_owned()];
        let count = 2 * INSTANTS + 7;
        let time: Vec<f64> = (0..count).map(|k| 0.01 * k as f64).collect();
        let rows = |scale: f64| vec![vec![scale; count]; 2];
        let channels = vec![("position", rows(1.0)), ("effort", rows(2.0)), ("nominal", rows(3.0))];
        let bytes = write(&Table { joints: &joints, time: &time, channels });
        let footer = bytes.len() - MAGIC.len() - 29;
        assert_eq!(bytes[footer], opcode::FOOTER);
        let summary = records(&bytes, number(&bytes, footer + 9), footer);
        let of = |opcode: u8| summary.iter().filter(move |(own, _)| *own == opcode).map(|(_, at)| at + 9);
        assert_eq!(
            (of(opcode::SCHEMA).count(), of(opcode::CHANNEL).count(), of(opcode::CHUNK_INDEX).count()),
            (1, 2, 3)
        );
        assert_eq!(number(&bytes, of(opcode::STATISTICS).next().unwrap()), 2 * count);
        let mut seen = 0;
        for told in of(opcode::CHUNK_INDEX) {
            let (first, last, chunk) = (number(&bytes, told), number(&bytes, told + 8), number(&bytes, told + 16));
            assert_eq!(bytes[chunk], opcode::CHUNK);
            assert_eq!(number(&bytes, told + 24), 9 + number(&bytes, chunk + 1));
            // Behind two stamps, a size, a checksum, no compression and the size once more.
            let messages = chunk + 9 + 16 + 8 + 4 + 4 + 8;
            for channel in 0..2 {
                let entry = told + 32 + 4 + 10 * channel;
                let index = number(&bytes, entry + 2);
                assert_eq!((bytes[index], bytes[index + 9]), (opcode::MESSAGE_INDEX, channel as u8));
                let length = u32::from_le_bytes(bytes[index + 11..index + 15].try_into().unwrap()) as usize;
                for at in (index + 15..index + 15 + length).step_by(16) {
                    let message = messages + number(&bytes, at + 8);
                    assert_eq!((bytes[message], bytes[message + 9]), (opcode::MESSAGE, channel as u8));
                    let stamp = number(&bytes, message + 15);
                    assert_eq!(stamp, number(&bytes, at));
                    assert!((first..=last).contains(&stamp));
                    seen += 1;
                }
            }
        }
        assert_eq!(seen, 2 * count);
    }
}
