//! The library that Python loads. It is linked from the crate `python` and the kernels. Cargo begins to compile a crate that is
//! linked only when all its dependencies are compiled; as a crate of its own it lets `python` be compiled beside the kernels.

pub use feedplan_python::_solvers;
