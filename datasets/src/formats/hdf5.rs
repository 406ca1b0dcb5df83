//! HDF5 in the layout of ALOHA: `/observations/qpos`, `qvel`, `effort` and `/action`, or arrays of other usual names.

use super::{Each, LogReader, Request, Run};
use crate::arrays::{self, Array, MOST_NUMBERS};
use crate::error::{LogError, LogErrorKind};
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions};
use std::path::PathBuf;

/// An HDF5 file: one run.
pub(super) struct Hdf5(pub PathBuf);

/// How deep groups are looked into.
const DEEPEST: usize = 4;
/// Rate of ALOHA's recordings, which have no time, Hz.
const ALOHA: f64 = 50.0;

impl LogReader for Hdf5 {
    fn runs(&self, request: &Request, each: Each) -> Result<(), LogError> {
        let options =
            OpenOptions::default().with_max_read_bytes(8 * MOST_NUMBERS as usize).with_chunk_cache_bytes(16 << 20);
        let file = Hdf5File::open_with_options(&self.0, options).map_err(|error| damaged(&error))?;
        let mut held = Vec::new();
        let root = file.root_group().map_err(|error| damaged(&error))?;
        gather(&root, "", 0, &mut held)?;
        let aloha = held.iter().any(|array| array.name == "observations.qpos");
        each(Run::Columns(arrays::recording(held, aloha.then_some(ALOHA), request)?))
    }
}

/// Adds the arrays of a group, and of those in it.
fn gather(group: &Group, path: &str, depth: usize, held: &mut Vec<Array>) -> Result<(), LogError> {
    let (groups, datasets) = group.members().map_err(|error| damaged(&error))?;
    for dataset in datasets {
        let name = if path.is_empty() { dataset.name().to_owned() } else { format!("{path}.{}", dataset.name()) };
        // Images have more axes.
        if dataset.shape().len() > 2 || held.len() > 1000 {
            continue;
        }
        match numbers(&dataset) {
            None => {
                if let Ok(texts) = dataset.read_strings() {
                    held.push(Array::texts(name, texts));
                }
            }
            Some(values) => {
                let values = values.map_err(|error| damaged(&error).column(&name))?;
                let shape = dataset.shape().iter().map(|length| usize::try_from(*length).unwrap_or(0)).collect();
                held.push(Array::numbers(name, shape, values));
            }
        }
    }
    for inner in groups.iter().filter(|_| depth < DEEPEST) {
        let name = if path.is_empty() { inner.name().to_owned() } else { format!("{path}.{}", inner.name()) };
        gather(inner, &name, depth + 1, held)?;
    }
    Ok(())
}

/// The numbers of a dataset; `None` where it holds something else.
fn numbers(dataset: &Dataset) -> Option<Result<Vec<f64>, hdf5_reader::error::Error>> {
    macro_rules! all {
        ($kind:ty) => {
            dataset.read_array::<$kind>().map(|array| array.iter().map(|x| *x as f64).collect())
        };
    }
    Some(match dataset.dtype() {
        Datatype::FloatingPoint { size: 8, .. } => all!(f64),
        Datatype::FloatingPoint { size: 4, .. } => all!(f32),
        Datatype::FixedPoint { size: 8, signed: true, .. } => all!(i64),
        Datatype::FixedPoint { size: 8, signed: false, .. } => all!(u64),
        Datatype::FixedPoint { size: 4, signed: true, .. } => all!(i32),
        Datatype::FixedPoint { size: 4, signed: false, .. } => all!(u32),
        Datatype::FixedPoint { size: 2, signed: true, .. } => all!(i16),
        Datatype::FixedPoint { size: 2, signed: false, .. } => all!(u16),
        Datatype::FixedPoint { size: 1, signed: true, .. } => all!(i8),
        Datatype::FixedPoint { size: 1, signed: false, .. } => all!(u8),
        _ => return None,
    })
}

fn damaged(error: &hdf5_reader::error::Error) -> LogError {
    LogError::new(LogErrorKind::CannotRead, format!("the HDF5 file cannot be read: {error}"))
        .hint("Copy the file again from its source, or export the run as .npz")
}
