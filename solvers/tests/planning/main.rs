//! Planners and bound in one crate, so that their kernels are compiled once for all these tests.

#[macro_use]
#[path = "../support/mod.rs"]
mod support;

mod bound;
mod curves;
mod general;
mod random;
