//! Tests of the planners and of the lower bound on random paths.

mod bound;
mod curves;
mod general;
mod random;
