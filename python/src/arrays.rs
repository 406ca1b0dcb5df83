//! Arrays in and out.

use crate::error::Error;
use gapscope_datasets::{Channel, Episode};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Arrays of one shape (..., n), contiguous float64.
pub struct Rows<'py, const K: usize> {
    arrays: [PyReadonlyArrayDyn<'py, f64>; K],
    /// The axes before n.
    pub outer: Vec<usize>,
}

impl<'py, const K: usize> Rows<'py, K> {
    /// Array-likes by name, read in place where they lie contiguous in float64 already.
    ///
    /// # Errors
    /// What NumPy cannot make an array of numbers; another length than n; shapes that differ.
    pub fn read(py: Python<'py>, n: usize, inputs: [(&str, &Bound<'py, PyAny>); K]) -> PyResult<Rows<'py, K>> {
        let make = py.import("numpy")?.getattr("ascontiguousarray")?;
        let mut arrays: Vec<PyReadonlyArrayDyn<'py, f64>> = Vec::with_capacity(K);
        for (name, input) in inputs {
            let array: PyReadonlyArrayDyn<'py, f64> = make.call1((input, "float64"))?.extract()?;
            let shape = array.shape();
            if shape.last() != Some(&n) {
                return Err(Error::new_err(format!(
                    "`{name}` has shape {shape:?}, expected {n} along its last axis, one for each joint"
                )));
            }
            if let Some(first) = arrays.first().filter(|first| first.shape() != shape) {
                let (expected, first) = (first.shape(), inputs[0].0);
                return Err(Error::new_err(format!(
                    "`{name}` has shape {shape:?}, expected {expected:?} as `{first}`"
                )));
            }
            arrays.push(array);
        }
        let outer = arrays.first().map_or_else(Vec::new, |array| array.shape()[..array.ndim() - 1].to_vec());
        let arrays = arrays.try_into().map_err(|_| Error::new_err("another number of arrays than was asked for"))?;
        Ok(Rows { arrays, outer })
    }

    /// The numbers of each, last axis fastest.
    ///
    /// # Errors
    /// None: they lie contiguous.
    pub fn slices(&self) -> PyResult<[&[f64]; K]> {
        let mut slices: [&[f64]; K] = [&[]; K];
        for (slice, array) in slices.iter_mut().zip(&self.arrays) {
            *slice = array.as_slice()?;
        }
        Ok(slices)
    }

    /// Numbers as an array with the outer axes of these, and `inner` after them.
    ///
    /// # Errors
    /// Another count of numbers.
    pub fn shaped(&self, py: Python<'py>, numbers: Vec<f64>, inner: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        PyArray1::from_vec(py, numbers).reshape([&self.outer[..], inner].concat())
    }
}

/// Joint-major rows as an array (samples, joints).
///
/// # Errors
/// Rows of other lengths.
pub fn table<'py>(py: Python<'py>, rows: &[Vec<f64>], samples: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let all: Vec<f64> = (0..samples).flat_map(|k| rows.iter().map(move |row| row[k])).collect();
    PyArray1::from_vec(py, all).reshape([samples, rows.len()])
}

/// A log as arrays: `joints`, `time` (T,), and each quantity (T, n).
///
/// # Errors
/// None that a log can cause.
pub fn log<'py>(py: Python<'py>, episode: &Episode) -> PyResult<Bound<'py, PyDict>> {
    let log = PyDict::new(py);
    log.set_item("joints", &episode.joints)?;
    log.set_item("time", PyArray1::from_slice(py, &episode.time))?;
    for channel in Channel::ALL {
        if let Some(rows) = episode.channel(channel) {
            log.set_item(channel.name(), table(py, rows, episode.len())?)?;
        }
    }
    Ok(log)
}
