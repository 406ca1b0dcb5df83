//! MCAP with ROS 2 messages (mcap.dev/spec, version 0), chunk by chunk.

use super::{Each, LogReader, Request, Run};
use crate::error::{LogError, LogErrorKind};
use crate::ros::Topics;
use crate::rows::ALLOW;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::PathBuf;

/// An MCAP file.
pub(super) struct Mcap(pub PathBuf);

/// Most bytes of a record, and of a chunk when unpacked. Writers make chunks of a few MB.
const MOST_BYTES: u64 = 1 << 30;

pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

impl LogReader for Mcap {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let mut topics = Topics::default();
        let notes = read(&self.0, request, &mut topics)?;
        let mut recording = topics.recording(request)?;
        recording.notes.extend(notes);
        each(Run::Columns(recording))
    }
}

/// Reads the messages of a file into `topics`; what there is to say about the file.
pub(super) fn read(path: &PathBuf, request: &Request, topics: &mut Topics) -> Result<Vec<String>, LogError> {
    let file = File::open(path).map_err(|error| super::cannot_read(&error))?;
    let mut file = BufReader::with_capacity(1 << 16, file);
    let mut magic = [0; 8];
    file.read_exact(&mut magic).map_err(|_| cut())?;
    if magic != MAGIC {
        return Err(damaged("it does not begin as an MCAP file does"));
    }
    let mut bag = Bag { request, topics, schemas: BTreeMap::new(), channels: BTreeMap::new() };
    let mut record = Vec::new();
    loop {
        match next_record(&mut file, &mut record) {
            Ok(Some(15)) => return Ok(Vec::new()),
            Ok(Some(op)) => bag.record(op, &record, true)?,
            Ok(None) if request.options.allow_truncated => {
                return Ok(vec!["the file ends early: read up to its last whole chunk".to_owned()]);
            }
            Ok(None) => return Err(cut()),
            Err(error) => return Err(error),
        }
    }
}

/// Reads a record into `record`; its kind, or `None` at the end of the file.
fn next_record(file: &mut impl Read, record: &mut Vec<u8>) -> Result<Option<u8>, LogError> {
    let mut head = [0; 9];
    if file.read_exact(&mut head).is_err() {
        return Ok(None);
    }
    let length = u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]);
    if length > MOST_BYTES {
        return Err(damaged(&format!("a record says that it is {length} bytes long")));
    }
    record.clear();
    let read = file.take(length).read_to_end(record).map_err(|error| super::cannot_read(&error))?;
    Ok((read as u64 == length).then_some(head[0]))
}

struct Bag<'a, 'b> {
    request: &'a Request<'b>,
    topics: &'a mut Topics,
    /// Name, encoding and text of each message type.
    schemas: BTreeMap<u16, (String, String, String)>,
    /// Topic of each channel, where it is read.
    channels: BTreeMap<u16, Option<String>>,
}

impl Bag<'_, '_> {
    fn record(&mut self, op: u8, record: &[u8], outer: bool) -> Result<(), LogError> {
        let mut fields = Fields(record);
        match op {
            3 => {
                let id = fields.u16()?;
                let (name, encoding) = (fields.text()?, fields.text()?);
                let length = fields.u32()? as usize;
                let text = String::from_utf8_lossy(fields.bytes(length)?).into_owned();
                self.schemas.insert(id, (name, encoding, text));
            }
            4 => {
                let (id, schema) = (fields.u16()?, fields.u16()?);
                let (topic, encoding) = (fields.text()?, fields.text()?);
                let (kind, form, text) = self.schemas.get(&schema).cloned().unwrap_or_default();
                if encoding == "ros1" {
                    return Err(super::ros1());
                }
                let definition = (form == "ros2msg").then_some(text.as_str());
                let read = encoding == "cdr" && self.topics.declare(&topic, &kind, definition, self.request);
                if encoding != "cdr" {
                    self.topics.pass_over(&topic, &format!("{kind}, encoded as {encoding}"));
                }
                self.channels.insert(id, read.then_some(topic));
            }
            5 => {
                let channel = fields.u16()?;
                fields.bytes(4)?;
                let logged = i64::try_from(fields.u64()?).unwrap_or(i64::MAX);
                fields.bytes(8)?;
                match self.channels.get(&channel) {
                    Some(Some(topic)) => self.topics.message(topic, logged, fields.0)?,
                    Some(None) => {}
                    None => return Err(damaged("a message belongs to a channel that the file does not describe")),
                }
            }
            6 if outer => {
                fields.bytes(16)?;
                let size = fields.u64()?;
                fields.bytes(4)?;
                let compression = fields.text()?;
                let length = usize::try_from(fields.u64()?).map_err(|_| damaged("a chunk is too long"))?;
                let packed = fields.bytes(length)?;
                if size > MOST_BYTES {
                    return Err(damaged(&format!("a chunk says that it unpacks to {size} bytes")));
                }
                let unpacked = unpack(&compression, packed, size)?;
                let mut chunk = unpacked.as_deref().unwrap_or(packed);
                let mut inner = Vec::new();
                while !chunk.is_empty() {
                    let op =
                        next_record(&mut chunk, &mut inner)?.ok_or_else(|| damaged("a chunk ends within a record"))?;
                    self.record(op, &inner, false)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Unpacks a chunk of `size` bytes; `None` where it is not packed.
fn unpack(compression: &str, packed: &[u8], size: u64) -> Result<Option<Vec<u8>>, LogError> {
    let mut out = Vec::new();
    let broken = || damaged(&format!("a chunk packed by {compression} cannot be unpacked"));
    match compression {
        "" => return Ok(None),
        "zstd" => {
            let stream = ruzstd::decoding::StreamingDecoder::new(packed).map_err(|_| broken())?;
            stream.take(size + 1).read_to_end(&mut out).map_err(|_| broken())?;
        }
        "lz4" => {
            lz4_flex::frame::FrameDecoder::new(packed).take(size + 1).read_to_end(&mut out).map_err(|_| broken())?;
        }
        other => {
            return Err(LogError::new(LogErrorKind::UnknownContainer, format!("chunks are packed by {other:?}"))
                .hint("Pack them by zstd or lz4: `mcap compress`"));
        }
    }
    if out.len() as u64 != size { Err(broken()) } else { Ok(Some(out)) }
}

/// Fields of a record, one after another.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, length: usize) -> Result<&'a [u8], LogError> {
        let (taken, rest) = self.0.split_at_checked(length).ok_or_else(|| damaged("a record ends early"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn u16(&mut self) -> Result<u16, LogError> {
        Ok(self.bytes(2)?.iter().rev().fold(0, |sum, byte| sum << 8 | u16::from(*byte)))
    }

    fn u32(&mut self) -> Result<u32, LogError> {
        Ok(self.bytes(4)?.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte)))
    }

    fn u64(&mut self) -> Result<u64, LogError> {
        Ok(self.bytes(8)?.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
    }

    fn text(&mut self) -> Result<String, LogError> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.bytes(length)?).into_owned())
    }
}

fn cut() -> LogError {
    LogError::new(LogErrorKind::Truncated, "the MCAP file ends early, as if the recorder was stopped").hint(ALLOW)
}

fn damaged(what: &str) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("the MCAP file is damaged: {what}"))
        .hint("Copy the file again from its source, or try `mcap recover`")
}
