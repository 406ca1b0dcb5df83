//! Errors as exceptions, with the sentences of the command line.

use gapscope_datasets::LogError as Log;
use gapscope_dynamics::{MjcfError, ModelError, UrdfError};
use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;

create_exception!(gapscope, Error, PyValueError, "What stands in the way, in a sentence that names cause and mend.");
create_exception!(gapscope, LogError, Error, "A log that cannot be read or breaks a rule: names log, place and mend.");
create_exception!(gapscope, RobotError, Error, "A robot description that cannot be used: names file, place and mend.");

/// The exception for an error, told by what is at its root.
pub fn exception(error: anyhow::Error) -> PyErr {
    let text = format!("{error:#}");
    if error.chain().any(|cause| cause.is::<Log>()) {
        LogError::new_err(text)
    } else if error.chain().any(|cause| cause.is::<UrdfError>() || cause.is::<MjcfError>() || cause.is::<ModelError>())
    {
        RobotError::new_err(text)
    } else {
        Error::new_err(text)
    }
}
