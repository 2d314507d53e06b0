//! One setpoint of a stream, and where it is on the path of its plan.

use super::nearest::Place;
use super::station::Rounded;
use super::PLACE_TOLERANCE;

/// One setpoint.
#[derive(Clone, Copy, Debug)]
pub struct Row<const M: usize> {
    pub t: f64,
    pub q: [f64; M],
    pub velocity: Option<[f64; M]>,
    pub acceleration: Option<[f64; M]>,
    pub line: i32,
    /// Its place on the path, where there is a path.
    pub nearest: Nearest<M>,
}

impl<const M: usize> Row<M> {
    pub fn is_finite(&self) -> bool {
        // 0 times what is not finite is no number.
        let nothing = |of: &[f64; M]| of.iter().fold(0.0, |sum, number| sum + 0.0 * number);
        let recorded = |of: &Option<[f64; M]>| of.as_ref().map_or(0.0, nothing);
        0.0 * self.t + nothing(&self.q) + recorded(&self.velocity) + recorded(&self.acceleration) == 0.0
    }
}

/// Where a setpoint is.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<const M: usize> {
    pub place: Place,
    /// How far u went to it from the place of the setpoint before, and how far it goes to the next one if that step changes as this one.
    pub step: f64,
    pub next_step: f64,
    /// Greatest coordinate of the piece that the search began on, in mm, and the greatest second derivative by u of the tool's path on
    /// that of the place, in 1/mm.
    pub magnitude: f64,
    pub bend: f64,
    /// Distance from the path, and along it from where the profile is at that time, in mm.
    pub off: f64,
    pub late: f64,
    /// How much of `late` is allowed, in mm.
    pub allowed: f64,
    /// Of the profile there; not a number where that is not known.
    pub velocity: Rounded<M>,
    /// How far a recorded acceleration is from the profile's.
    pub acceleration_off: [f64; M],
}

impl<const M: usize> Default for Nearest<M> {
    fn default() -> Self {
        Self {
            place: Place { piece: 0, u: 0.0 },
            step: 0.0,
            next_step: 0.0,
            magnitude: 0.0,
            bend: f64::INFINITY,
            off: 0.0,
            late: 0.0,
            allowed: PLACE_TOLERANCE,
            velocity: Rounded { value: [f64::NAN; M], rounding: [0.0; M] },
            acceleration_off: [0.0; M],
        }
    }
}

impl<const M: usize> Nearest<M> {
    /// Whether the setpoint is on the path, where the profile is at its time.
    pub fn is_good(&self) -> bool {
        self.off <= PLACE_TOLERANCE && self.late <= self.allowed
    }
}
