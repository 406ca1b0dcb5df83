//! A robot's rigid-body model on arrays.

use crate::arrays::Rows;
use crate::error::exception;
use crate::work::pool;
use gapscope::robot::{self, Description};
use gapscope_dynamics::{Data, JointKind, Loaded};
use nalgebra::DMatrix;
use numpy::{PyArray1, PyArrayDyn};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use rayon::prelude::*;
use std::path::PathBuf;

/// Rows that one thread takes at a time; fewer are not worth a second thread (7 joints: some 0.3 ms of inverse dynamics).
const BLOCK: usize = 512;

/// Rigid-body dynamics of a robot, from a URDF, xacro or MJCF file, the text of one, or a `mujoco.MjSpec`.
///
/// Arrays have the n joints along their last axis, in the order of `joints`, and any axes before it: one state (n,), a batch
/// (m, n). SI units: rad, rad/s, rad/s² and N m; m, m/s, m/s² and N for a prismatic joint. World is the base frame. float64
/// arrays that lie contiguous are read in place, others are converted. The interpreter's lock is let go.
///
/// Args:
///     robot: path of the description, its XML text, or an object with `to_xml()` such as `mujoco.MjSpec`.
///     lock: joints held still at position zero, as if they were fixed.
///     path: where a text came from; files that an MJCF includes are looked for beside it.
///
/// Raises:
///     RobotError: a description that breaks a rule. Error: a file that cannot be read.
#[pyclass(module = "gapscope", frozen)]
pub struct Model {
    pub loaded: Loaded,
    text: String,
    lock: Vec<String>,
    path: PathBuf,
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (robot, lock=Vec::new(), path=None))]
    fn new(robot: &Bound<'_, PyAny>, lock: Vec<String>, path: Option<PathBuf>) -> PyResult<Model> {
        let text = if robot.hasattr("to_xml")? {
            Some(robot.call_method0("to_xml")?.extract()?)
        } else {
            robot
                .extract::<String>()
                .ok()
                .filter(|text| text.trim_start_matches('\u{feff}').trim_start().starts_with('<'))
        };
        let (description, path) = match text {
            Some(text) => (Description::of(text), path.unwrap_or_else(|| PathBuf::from("the robot description"))),
            None => {
                let path: PathBuf = robot.extract()?;
                (robot::read(&path, &[]).map_err(exception)?, path)
            }
        };
        let loaded = description.model(&path, &lock).map_err(exception)?;
        Ok(Model { loaded, text: description.text().to_owned(), lock, path })
    }

    /// The robot's name.
    #[getter]
    fn name(&self) -> &str {
        self.loaded.model.name()
    }

    /// Names of the joints that move, in the order of every array's last axis.
    #[getter]
    fn joints(&self) -> Vec<&str> {
        self.loaded.model.joints().iter().map(|joint| joint.name.as_str()).collect()
    }

    /// Number of joints n.
    #[getter]
    fn dof(&self) -> usize {
        self.loaded.model.dof()
    }

    /// The robot description, xacro expanded.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// Joints that are held still.
    #[getter]
    fn locked(&self) -> &[String] {
        &self.lock
    }

    /// Where the description was read from; empty where it was given as a text.
    #[getter]
    fn path(&self) -> Option<String> {
        self.path.is_file().then(|| self.path.display().to_string())
    }

    /// What was odd about the description, and what was passed over.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.loaded.findings.iter().map(ToString::to_string).collect()
    }

    /// Limits by name (`lower`, `upper`, `velocity`, `effort`), each of shape (n,); NaN where there is none.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let limits = PyDict::new(py);
        let joints = || self.loaded.model.joints().iter().map(|joint| &joint.limits);
        let array = |limit: Vec<Option<f64>>| {
            PyArray1::from_vec(py, limit.into_iter().map(|limit| limit.unwrap_or(f64::NAN)).collect())
        };
        limits.set_item("lower", array(joints().map(|limits| limits.lower).collect()))?;
        limits.set_item("upper", array(joints().map(|limits| limits.upper).collect()))?;
        limits.set_item("velocity", array(joints().map(|limits| limits.velocity).collect()))?;
        limits.set_item("effort", array(joints().map(|limits| limits.effort).collect()))?;
        Ok(limits)
    }

    /// The inertial parameters of all links, (10n,): mass (kg), first moment (kg m), and inertia about the link frame’s origin
    /// as xx, xy, yy, xz, yz, zz (kg m²), link by link in the order of `joints`. `regressor(q, v, a) @ parameters` is the
    /// inverse dynamics of a robot without rotors.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let of = |joint: &gapscope_dynamics::Joint| joint.inertia.parameters().to_vec();
        PyArray1::from_vec(py, self.loaded.model.joints().iter().flat_map(of).collect())
    }

    /// Torques (..., n) that give the accelerations `a` at positions `q` and velocities `v`, each (..., n).
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.each(py, [("q", q), ("v", v), ("a", a)], &[self.dof()], |data, [q, v, a], tau| {
            self.loaded.model.inverse_dynamics(data, q, v, a, tau);
        })
    }

    /// Accelerations (..., n) under the torques `tau` at positions `q` and velocities `v`, each (..., n).
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.each(py, [("q", q), ("v", v), ("tau", tau)], &[self.dof()], |data, [q, v, tau], a| {
            self.loaded.model.forward_dynamics(data, q, v, tau, a);
        })
    }

    /// Mass matrices (..., n, n) at positions `q` (..., n), rotor inertias on the diagonal; kg m².
    fn mass_matrix<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.dof();
        self.each(py, [("q", q)], &[n, n], |data, [q], out| {
            let mut mass = DMatrix::zeros(n, n);
            self.loaded.model.mass_matrix(data, q, &mut mass);
            out.copy_from_slice(mass.as_slice());
        })
    }

    /// Torques (..., n) of gravity at positions `q` (..., n).
    fn gravity<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.each(py, [("q", q)], &[self.dof()], |data, [q], tau| self.loaded.model.gravity_torque(data, q, tau))
    }

    /// Torques (..., n) at zero acceleration, C(q, v) v + g(q): `inverse_dynamics` is `mass_matrix @ a + bias`.
    fn bias<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.each(py, [("q", q), ("v", v)], &[self.dof()], |data, [q, v], tau| self.loaded.model.bias(data, q, v, tau))
    }

    /// Regressors (..., n, 10n): torques as a linear map of `parameters`.
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.dof();
        self.each(py, [("q", q), ("v", v), ("a", a)], &[n, 10 * n], |data, [q, v, a], out| {
            let mut regressor = DMatrix::zeros(n, 10 * n);
            self.loaded.model.regressor(data, q, v, a, &mut regressor);
            // NumPy's rows lie together, nalgebra's columns.
            out.copy_from_slice(regressor.transpose().as_slice());
        })
    }

    fn __repr__(&self) -> String {
        let kind = |kind: JointKind| if kind == JointKind::Prismatic { "prismatic" } else { "revolute" };
        let joints: Vec<String> =
            self.loaded.model.joints().iter().map(|joint| format!("{} ({})", joint.name, kind(joint.kind))).collect();
        format!("Model {}: {}", self.name(), joints.join(", "))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyAny>)> {
        let given = (self.text.clone(), self.lock.clone(), self.path.clone());
        Ok((py.get_type::<Model>(), given.into_bound_py_any(py)?))
    }
}

impl Model {
    /// `f(data, inputs of one state, its part of the output)` for every state; the output has `inner` as its last axes.
    fn each<'py, const K: usize>(
        &self,
        py: Python<'py>,
        inputs: [(&str, &Bound<'py, PyAny>); K],
        inner: &[usize],
        f: impl Fn(&mut Data, [&[f64]; K], &mut [f64]) + Sync,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.dof();
        let rows = Rows::read(py, n, inputs)?;
        let slices = rows.slices()?;
        let (count, width) = (rows.outer.iter().product::<usize>(), inner.iter().product::<usize>());
        let model = &self.loaded.model;
        let block = |first: usize, out: &mut [f64]| {
            let mut data = Data::new(model);
            for (row, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
                let at = (first + row) * n;
                f(&mut data, slices.map(|slice| &slice[at..at + n]), out);
            }
        };
        let pool = if count > BLOCK { Some(pool()?) } else { None };
        let out = py.detach(|| {
            let mut out = vec![0.0; count * width];
            match pool {
                Some(pool) => pool.install(|| {
                    let blocks = out.par_chunks_mut(BLOCK * width.max(1)).enumerate();
                    blocks.for_each(|(at, out)| block(at * BLOCK, out));
                }),
                None => block(0, &mut out),
            }
            out
        });
        rows.shaped(py, out, inner)
    }
}
