//! Native kernels of feedplan. Every kernel takes slices and returns vectors; it knows no file and no Python.
//! `python` alone binds them (feature `python`). Lengths are millimetres, times seconds.

pub mod audit;
pub mod quadratic;

#[cfg(feature = "python")]
mod python;
