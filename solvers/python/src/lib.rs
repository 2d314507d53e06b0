//! The Python module `feedplan._solvers`: arrays in, arrays out, one submodule file per kernel.

mod arrays;
mod audit;
mod bound;
mod fit;
mod gcode;
mod jerk;
mod path;
mod plan;
mod problem;
mod sampling;
mod spline;
mod text;
mod work;

use pyo3::prelude::*;

/// Calls a generic kernel for at most 3 or at most 6 axes, those beyond `count` at rest: an axis that rests changes
/// no result, and two instances of a kernel are built where six would be.
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
            count => {
                Err(pyo3::exceptions::PyValueError::new_err(format!("{count} axes: 1 to 6 are supported")))
            }
        }
    };
}
pub(crate) use with_padded_axes;

/// The same for paths and curves, of at most 9 axes: joints beside a tool direction.
macro_rules! with_path_axes {
    ($count:expr, $m:ident, $call:expr) => {
        match $count {
            7..=9 => {
                const $m: usize = 9;
                $call
            }
            0 | 10.. => {
                Err(pyo3::exceptions::PyValueError::new_err(format!("{} axes: 1 to 9 are supported", $count)))
            }
            count => with_padded_axes!(count, $m, $call),
        }
    };
}
pub(crate) use with_path_axes;

/// The native module of feedplan.
#[pymodule]
fn _solvers(module: &Bound<'_, PyModule>) -> PyResult<()> {
    feedplan_planner::bound::prepare();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    fit::register(module)?;
    path::register(module)?;
    text::register(module)?;
    audit::register(module)?;
    sampling::register(module)?;
    spline::register(module)?;
    plan::register(module)?;
    jerk::register(module)?;
    bound::register(module)?;
    gcode::register(module)?;
    Ok(())
}
