//! The Python module `feedplan._solvers`, one file per kernel: it passes arrays and native objects to kernels.

mod arrays;
mod audit;
mod axes;
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
pub mod _solvers {
    use super::*;

    #[pymodule_export]
    use super::{
        audit::audit_plan,
        csv::csv_rows,
        curve::Curve,
        curve_length::CurveLength,
        gcode::read_gcode,
        jerk::{path_segments, plan_jerk_limited, plan_s_curve, profile_of_sections},
        joint_audit::audit_joints,
        kinematics::{joint_derivatives, joint_enclosures, joint_interpolants, joint_path, joint_positions},
        moves::Moves,
        path::build_path,
        plan::{feed_between, look_ahead, lower_bound, plan_bang_bang},
        problem::{PlanError, Problem},
        profile::Profile,
        reduce::{buckets, thin},
        sampling::PySampler,
        setpoint_audit::SetpointAudit,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        feedplan_planner::lower_bound::prepare();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
