//! `gapscope._native`: what of the Python package is Rust. The package's own modules in `package/gapscope` make of it what
//! users see: objects that read well, pickle and plot.

mod arrays;
mod commands;
mod effects;
mod error;
mod export;
mod given;
mod model;
mod network;
mod sums;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::commands::{diagnose, evaluate, generate, inspect, rollout, sentences, train};
    #[pymodule_export]
    use super::effects::effects;
    #[pymodule_export]
    use super::export::export;
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::network::Network;
    #[pymodule_export]
    use super::sums::Sums;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        module.add("Error", py.get_type::<super::error::Error>())?;
        module.add("LogError", py.get_type::<super::error::LogError>())?;
        module.add("RobotError", py.get_type::<super::error::RobotError>())?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
