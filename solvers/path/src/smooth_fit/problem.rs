//! The convex problem of a window: its energy, the rows of the tolerance tube, and its coefficients.

use super::rows::Row;
use super::spline::{Form, Pull};

/// A convex problem in the coefficients of a window of intervals.
#[derive(Default)]
pub struct Problem<const D: usize> {
    /// The forms of the energy of every interval, by axis.
    pub energy: Vec<[Form; D]>,
    /// The pull of its aims in every interval, by axis.
    pub pull: Vec<[Pull; D]>,
    pub rows: Vec<Row<D>>,
    /// The number of rows before each interval, and all of them.
    pub start: Vec<usize>,
    /// The coefficients: as given where fixed, any start elsewhere.
    pub x: Vec<[f64; D]>,
    pub fixed: Vec<bool>,
    /// The unit of complementarity of every interval.
    pub unit: Vec<f64>,
}
