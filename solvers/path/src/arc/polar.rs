//! An arc of a program, and its polar form about its centre.

use crate::tolerance;
use feedplan_geometry::quadratic::{norm, sub};
use std::f64::consts::{PI, TAU};

/// The greatest number of pieces; an arc that needs more is refused, since it would fill the memory.
pub const MAX_PIECES: f64 = 1e7;
/// An arc whose radius changes per rad by more than this times itself is refused: it runs along a radius.
const STEEPEST: f64 = 1e6;

/// An arc in the plane of two axes. All other axes are linear in the angle; so is the radius, if start and end differ in their
/// distance from the centre.
#[derive(Clone, Copy, Debug)]
pub struct Arc<const M: usize> {
    pub start: [f64; M],
    pub end: [f64; M],
    /// Centre in the coordinates of `plane`.
    pub centre: [f64; 2],
    /// The two axes of the plane; a positive sweep turns from the first to the second.
    pub plane: [usize; 2],
    /// Signed sweep in rad, full turns included.
    pub sweep: f64,
}

/// Why an arc cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArcError {
    /// Start or end lies in the centre, the arc runs along a radius, or a number is not finite.
    Radius,
    /// The sweep is zero or does not lead from the start to the end.
    Sweep,
    /// The turns take more than MAX_PIECES pieces.
    Turns,
}

/// The polar form of an arc about its centre.
pub struct Polar {
    /// Unit vector from the centre to the start.
    pub direction: [f64; 2],
    pub radius: f64,
    /// Change of the radius per rad of |sweep|, in mm.
    pub growth: f64,
    /// Travel of all other axes together per rad of |sweep|, in mm.
    pub pitch: f64,
    pub sweep: f64,
}

/// The sweep from one radius vector to another, with as many turns as the programmed one; None if both differ by too much.
pub fn sweep_to(from: &[f64; 2], to: &[f64; 2], programmed: f64) -> Option<f64> {
    let turn = (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
    let correction = (turn - programmed + PI).rem_euclid(TAU) - PI;
    let sweep = programmed + correction;
    (correction.abs() <= tolerance::SWEEP && sweep * programmed > 0.0).then_some(sweep)
}

impl Polar {
    pub fn new<const M: usize>(arc: &Arc<M>) -> Result<Self, ArcError> {
        let [x, y] = arc.plane;
        let from = [arc.start[x] - arc.centre[0], arc.start[y] - arc.centre[1]];
        let to = [arc.end[x] - arc.centre[0], arc.end[y] - arc.centre[1]];
        let (radius, end_radius) = (norm(&from), norm(&to));
        let finite = arc.start.iter().chain(&arc.end).all(|value| value.is_finite());
        if !(finite && radius > 0.0 && end_radius > 0.0 && end_radius.is_finite() && radius.is_finite()) {
            return Err(ArcError::Radius);
        }
        let sweep = sweep_to(&from, &to, arc.sweep).ok_or(ArcError::Sweep)?;
        let mut other = sub(&arc.end, &arc.start);
        other[x] = 0.0;
        other[y] = 0.0;
        let growth = (end_radius - radius) / sweep.abs();
        let pitch = norm(&other) / sweep.abs();
        if !(growth.abs() <= STEEPEST * radius.min(end_radius) && pitch.is_finite()) {
            return Err(ArcError::Radius);
        }
        Ok(Self { direction: [from[0] / radius, from[1] / radius], radius, growth, pitch, sweep })
    }
}
