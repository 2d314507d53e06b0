//! The convex problem of a window: its energy, the rows of the tolerance tube, and its coefficients.

use super::rows::Row;
use super::spline::{Form, Pull};

/// A convex problem in the coefficients of a window of intervals.
#[derive(Default)]
pub struct Problem<const D: usize> {
    /// The quadratic part of the energy of every interval, by axis.
    pub energy: Vec<[Form; D]>,
    /// The linear part of the energy of every interval, the pull of its aims, by axis.
    pub pull: Vec<[Pull; D]>,
    pub rows: Vec<Row<D>>,
    /// The number of rows before each interval; the last entry is the number of all rows.
    pub start: Vec<usize>,
    /// The coefficients: the given ones where fixed, elsewhere any start of the iteration.
    pub x: Vec<[f64; D]>,
    pub fixed: Vec<bool>,
    /// The unit of complementarity of every interval (see `interior_point`).
    pub unit: Vec<f64>,
}
