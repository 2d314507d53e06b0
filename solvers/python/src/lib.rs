//! The Python module `feedplan._solvers`, one file per kernel: it passes arrays and native objects to kernels.

mod arrays;
mod audit;
mod axes;
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
mod reduce;
mod sampling;
mod setpoint_audit;
mod views;
mod work;

use pyo3::prelude::*;

/// The native module of feedplan.
#[pymodule]
mod _solvers {
    use super::*;

    #[pymodule_export]
    use audit::audit_plan;
    #[pymodule_export]
    use bound::lower_bound;
    #[pymodule_export]
    use csv::csv_rows;
    #[pymodule_export]
    use curve::Curve;
    #[pymodule_export]
    use curve_length::CurveLength;
    #[pymodule_export]
    use gcode::read_gcode;
    #[pymodule_export]
    use jerk::{path_segments, plan_jerk_limited, plan_s_curve, profile_of_sections};
    #[pymodule_export]
    use joint_audit::audit_joints;
    #[pymodule_export]
    use kinematics::{joint_derivatives, joint_enclosures, joint_interpolants, joint_path, joint_positions};
    #[pymodule_export]
    use moves::Moves;
    #[pymodule_export]
    use path::build_path;
    #[pymodule_export]
    use plan::{feed_between, look_ahead, plan_bang_bang};
    #[pymodule_export]
    use problem::{PlanError, Problem};
    #[pymodule_export]
    use profile::Profile;
    #[pymodule_export]
    use reduce::{buckets, thin};
    #[pymodule_export]
    use sampling::PySampler;
    #[pymodule_export]
    use setpoint_audit::SetpointAudit;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        feedplan_planner::lower_bound::prepare();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
