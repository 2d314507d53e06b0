//! The Python module `feedplan._solvers`, one file per kernel: it passes arrays and native objects to kernels.

mod arrays;
mod audit;
mod bound;
mod csv;
mod curve;
mod curve_length;
mod gcode;
mod jerk;
mod joint_audit;
mod kinematics;
mod memory;
mod moves;
mod native;
mod path;
mod plan;
mod problem;
mod profile;
mod sampling;
mod setpoint_audit;
mod views;
mod work;

use pyo3::prelude::*;

/// Calls a generic kernel for 3, 6 or 9 axes, those beyond `count` at rest. An axis at rest does not change results, and
/// three instances of a kernel suffice in place of nine.
macro_rules! with_padded_axes {
    ($count:expr, $m:ident, $call:expr) => {
        match $count {
            1..=3 => {
                const $m: usize = 3;
                $call
            }
            4..=6 => {
                const $m: usize = 6;
                $call
            }
            7..=9 => {
                const $m: usize = 9;
                $call
            }
            count => {
                Err(pyo3::exceptions::PyValueError::new_err(format!("{count} axes: 1 to 9 are supported")))
            }
        }
    };
}
pub(crate) use with_padded_axes;

/// The native module of feedplan.
#[pymodule]
fn _solvers(module: &Bound<'_, PyModule>) -> PyResult<()> {
    feedplan_planner::lower_bound::prepare();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    moves::register(module)?;
    path::register(module)?;
    csv::register(module)?;
    audit::register(module)?;
    sampling::register(module)?;
    curve::register(module)?;
    curve_length::register(module)?;
    problem::register(module)?;
    profile::register(module)?;
    plan::register(module)?;
    jerk::register(module)?;
    bound::register(module)?;
    gcode::register(module)?;
    kinematics::register(module)?;
    joint_audit::register(module)?;
    setpoint_audit::register(module)?;
    Ok(())
}
