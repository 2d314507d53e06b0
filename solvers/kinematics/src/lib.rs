//! Machines whose joints follow the tool's tip: q = K(P), with K as a recorded list of operations.
//!
//! The list is evaluated on numbers and on intervals, each as Taylor series in a path's parameter: positions, exact
//! derivatives at points, proven bounds over pieces. From these: the joints along a whole path with the places that
//! they cannot pass, and polynomials that stand in for their motion with a proven distance from it.

pub mod accuracy;
pub mod expression;
pub mod interval;
pub mod joint_interpolants;
pub mod number;
pub mod path_derivatives;
pub mod series;
pub mod singularities;
pub mod tip;
