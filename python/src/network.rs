//! Networks that step a robot: a residual on its own model, or one alone.

use crate::arrays::Rows;
use crate::error::exception;
use crate::model::Model;
use gapscope::cli::Kind;
use gapscope::learned;
use gapscope_dynamics::StepModel;
use gapscope_effects::Plant;
use gapscope_network::Net;
use gapscope_pure::Pure;
use gapscope_residual::Hybrid;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A network as `gapscope train` leaves it in a folder.
#[pyclass(module = "gapscope._native", frozen)]
pub struct Network {
    stepper: Stepper,
}

enum Stepper {
    Residual(Box<Hybrid<Plant, Net<f32>>>),
    Pure(Box<Pure<Net<f32>>>),
}

#[pymethods]
impl Network {
    /// Reads the network of a folder, of kind `residual` or `pure`, for this robot.
    #[new]
    fn new(kind: &str, folder: PathBuf, model: &Model) -> PyResult<Network> {
        let robot = &model.loaded.model;
        let stepper = if kind == Kind::Pure.name() {
            learned::pure(&folder, robot).map(|pure| Stepper::Pure(Box::new(pure)))
        } else {
            learned::residual(&folder, robot).map(|hybrid| Stepper::Residual(Box::new(hybrid)))
        };
        Ok(Network { stepper: stepper.map_err(exception)? })
    }

    /// Time of a step, s.
    #[getter]
    fn dt(&self) -> f64 {
        match &self.stepper {
            Stepper::Residual(hybrid) => hybrid.dt(),
            Stepper::Pure(pure) => pure.dt(),
        }
    }

    /// The states one step later, (..., 2n): positions, then velocities; of a residual by physics alone where `learned` is off.
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        learned: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let stepper = &self.stepper;
        let n = match stepper {
            Stepper::Residual(hybrid) => hybrid.joints(),
            Stepper::Pure(pure) => pure.joints(),
        };
        let rows = Rows::read(py, n, [("q", q), ("v", v), ("tau", tau)])?;
        let [q, v, tau] = rows.slices()?;
        let next = py.detach(move || match stepper {
            Stepper::Residual(hybrid) if learned => stepped(&mut *hybrid.clone(), [q, v, tau]),
            Stepper::Residual(hybrid) => stepped(&mut hybrid.physics().clone(), [q, v, tau]),
            Stepper::Pure(pure) => stepped(&mut *pure.clone(), [q, v, tau]),
        });
        rows.shaped(py, next, &[2 * n])
    }
}

/// Each state one step later.
fn stepped(model: &mut impl StepModel, [q, v, tau]: [&[f64]; 3]) -> Vec<f64> {
    let n = model.joints();
    let mut x = vec![0.0; model.state_len()];
    let mut next = Vec::with_capacity(2 * q.len());
    for ((q, v), tau) in q.chunks_exact(n).zip(v.chunks_exact(n)).zip(tau.chunks_exact(n)) {
        model.start(q, v, &mut x);
        model.step(&mut x, tau);
        next.extend_from_slice(&x[..2 * n]);
    }
    next
}
