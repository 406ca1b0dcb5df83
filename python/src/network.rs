//! A residual network on the robot's own model.

use crate::error::exception;
use crate::model::{Model, rows};
use gapscope_dynamics::StepModel;
use gapscope_effects::Plant;
use gapscope_network::Net;
use gapscope_residual::Hybrid;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Physics with a trained residual, as `gapscope train residual` leaves it in a folder.
#[pyclass(module = "gapscope._native", frozen)]
pub struct Network {
    hybrid: Hybrid<Plant, Net<f32>>,
}

#[pymethods]
impl Network {
    /// Reads the network of a folder, for this robot.
    #[new]
    fn new(folder: PathBuf, model: &Model) -> PyResult<Network> {
        Ok(Network { hybrid: gapscope::learned::residual(&folder, &model.loaded.model).map_err(exception)? })
    }

    /// Time of a step, s.
    #[getter]
    fn dt(&self) -> f64 {
        self.hybrid.dt()
    }

    /// The states one step later, (..., 2n): positions, then velocities; by physics alone where `learned` is off.
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        learned: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.hybrid.joints();
        let (inputs, mut shape) = rows(py, n, [("q", q), ("v", v), ("tau", tau)])?;
        let [q, v, tau] = [inputs[0].as_slice()?, inputs[1].as_slice()?, inputs[2].as_slice()?];
        let hybrid = &self.hybrid;
        let next = py.detach(move || {
            let (mut hybrid, mut physics) = (hybrid.clone(), hybrid.physics().clone());
            let mut x = vec![0.0; hybrid.state_len()];
            let mut next = Vec::with_capacity(2 * q.len());
            for ((q, v), tau) in q.chunks_exact(n).zip(v.chunks_exact(n)).zip(tau.chunks_exact(n)) {
                hybrid.start(q, v, &mut x);
                if learned {
                    hybrid.step(&mut x, tau)
                } else {
                    physics.step(&mut x, tau)
                }
                next.extend_from_slice(&x[..2 * n]);
            }
            next
        });
        shape.push(2 * n);
        PyArray1::from_vec(py, next).reshape(shape)
    }
}
