//! MCAP without chunks: a topic a channel, each of messages `sensor_msgs/msg/JointState` in CDR.
//!
//! Source: the MCAP format specification, version 0, <https://mcap.dev/spec>. Foxglove, PlotJuggler and rerun know these
//! messages.

use super::Table;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Opcodes of the records that are written.
mod opcode {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const DATA_END: u8 = 0x0f;
}

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
    record(&mut out, opcode::SCHEMA, |body| {
        body.extend(1u16.to_le_bytes());
        text(body, "sensor_msgs/msg/JointState");
        text(body, "ros2msg");
        text(body, JOINT_STATE);
    });
    let (positions, torques): (Vec<_>, Vec<_>) = table.channels.iter().partition(|(name, _)| *name == "position");
    let positions = positions.first().map(|(_, rows)| rows.as_slice()).unwrap_or_default();
    for (id, (name, _)) in (0u16..).zip(&torques) {
        record(&mut out, opcode::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(1u16.to_le_bytes());
            text(body, &format!("/{name}"));
            text(body, "cdr");
            // No metadata.
            body.extend(0u32.to_le_bytes());
        });
    }
    for (i, time) in table.time.iter().enumerate() {
        let stamp = (time.max(0.0) * 1e9).round() as u64;
        for (id, (_, rows)) in (0u16..).zip(&torques) {
            record(&mut out, opcode::MESSAGE, |body| {
                body.extend(id.to_le_bytes());
                body.extend((i as u32).to_le_bytes());
                body.extend(stamp.to_le_bytes());
                body.extend(stamp.to_le_bytes());
                let at = |rows: &[Vec<f64>]| rows.iter().map(|row| row[i]).collect::<Vec<f64>>();
                body.extend(message(stamp, table.joints, &at(positions), &at(rows)));
            });
        }
    }
    // No checksum, no summary.
    record(&mut out, opcode::DATA_END, |body| body.extend(0u32.to_le_bytes()));
    record(&mut out, opcode::FOOTER, |body| body.extend([0; 20]));
    out.extend(MAGIC);
    out
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
