//! What the Python side passes of robot and logs, as the command line's arguments.

use gapscope::cli::Input;
use gapscope::input::Reading;
use gapscope_datasets::Arrays;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

/// One run in memory: its name, its joints where it names them, and named arrays of float64, last axis fastest.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Run<'py> {
    name: String,
    joints: Vec<String>,
    arrays: Vec<(String, PyReadonlyArrayDyn<'py, f64>)>,
}

impl Run<'_> {
    /// A copy of its numbers.
    fn arrays(self) -> PyResult<Arrays> {
        let mut arrays = Vec::with_capacity(self.arrays.len());
        for (name, array) in self.arrays {
            arrays.push((name, array.shape().to_vec(), array.as_slice()?.to_vec()));
        }
        Ok(Arrays { name: self.name, joints: self.joints, arrays })
    }
}

/// Robot, logs and how to read them; the names are those of the options of the command line.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Given<'py> {
    robot: PathBuf,
    logs: Vec<PathBuf>,
    runs: Vec<Run<'py>>,
    map: Vec<String>,
    map_file: Option<PathBuf>,
    topic: Vec<String>,
    episodes: Option<String>,
    calibration: Option<PathBuf>,
    xacro_args: Vec<String>,
    lock: Vec<String>,
    allow_truncated: bool,
    skip_bad_logs: bool,
    as_logged: bool,
    said: Vec<String>,
}

impl Given<'_> {
    /// The same as arguments. The numbers of runs in memory are copied, once: the work goes on without the interpreter.
    ///
    /// # Errors
    /// An array that is not contiguous.
    pub fn input(self) -> PyResult<Input> {
        let arrays = self.runs.into_iter().map(Run::arrays).collect::<PyResult<Vec<Arrays>>>()?;
        let names = || arrays.iter().map(|run| PathBuf::from(&run.name)).collect();
        let logs = if arrays.is_empty() { self.logs } else { names() };
        Ok(Input {
            robot: self.robot,
            logs,
            reading: Reading { map: self.map, map_file: self.map_file, xacro_args: self.xacro_args, lock: self.lock },
            topic: self.topic,
            episodes: self.episodes,
            calibration: self.calibration,
            allow_truncated: self.allow_truncated,
            skip_bad_logs: self.skip_bad_logs,
            as_logged: self.as_logged,
            arrays,
            said: self.said,
        })
    }
}
