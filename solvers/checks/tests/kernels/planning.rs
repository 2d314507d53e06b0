//! Planners and bound on random paths.

mod bound;
mod curves;
mod general;
mod random;
