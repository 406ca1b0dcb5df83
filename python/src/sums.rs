//! The first pass over a fleet's logs.

use crate::arrays::log;
use crate::error::Error;
use crate::given::Given;
use crate::model::Model;
use crate::work::work;
use gapscope_diagnosis::Sums as Linear;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

/// Linear sums of logs of one robot; see `gapscope_diagnosis::Sums`.
#[pyclass(module = "gapscope._native")]
pub struct Sums {
    model: gapscope_dynamics::Model,
    sums: Linear,
}

fn refused(error: gapscope_diagnosis::SumsError) -> PyErr {
    Error::new_err(error.to_string())
}

#[pymethods]
impl Sums {
    #[new]
    fn new(model: &Model) -> Sums {
        let model = model.loaded.model.clone();
        Sums { sums: Linear::new(&model), model }
    }

    /// Sums that `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(model: &Model, bytes: &[u8]) -> PyResult<Sums> {
        let model = model.loaded.model.clone();
        Ok(Sums { sums: Linear::from_bytes(&model, bytes).map_err(refused)?, model })
    }

    /// Adds the runs of logs; of each its rank, digest, name and arrays.
    fn add<'py>(&mut self, py: Python<'py>, given: Given<'py>) -> PyResult<Bound<'py, PyList>> {
        let input = given.input()?;
        let (model, mut sums) = (self.model.clone(), Linear::new(&self.model));
        let (sums, runs) = work(py, None, move |_| {
            let episodes = gapscope::input::runs(&input, &model)?;
            let mut runs = Vec::with_capacity(episodes.len());
            for episode in episodes {
                runs.push((sums.add(&model, &episode)?, episode));
            }
            Ok((sums, runs))
        })?;
        // All runs of the logs, or none.
        self.sums.merge(&sums).map_err(refused)?;
        let out = PyList::empty(py);
        for (place, episode) in &runs {
            let arrays: Bound<'py, PyDict> = log(py, episode)?;
            out.append((place.rank, place.digest, &episode.name, arrays))?;
        }
        Ok(out)
    }

    fn merge(&mut self, other: &Sums) -> PyResult<()> {
        self.sums.merge(&other.sums).map_err(refused)
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.sums.to_bytes())
    }

    /// Number of runs.
    #[getter]
    fn episodes(&self) -> u64 {
        self.sums.episodes()
    }

    /// What there is to say where the runs are unlike those of `chosen`.
    fn unlike(&self, py: Python<'_>, chosen: &Sums) -> Vec<String> {
        py.detach(|| self.sums.unlike(&self.model, &chosen.sums))
    }
}
