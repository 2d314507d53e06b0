//! Computes the columns of a path, its axes or joints by their formula, at eight places of a piece at once, in the vectors of the
//! processor.
//!
//! The results equal those that are computed at one place after the other, bit for bit. Rational pieces are computed at one place after
//! the other only.

use std::rc::Rc;

use fearless_simd::{f64x8, SimdBase};

use crate::curve::Curve;
use crate::joints::formula::Argument;
use crate::joints::path::Piece;
use crate::number::{in_wide_vectors, Lanes, Number};
use crate::station::{Roundings, Station, STILL};

/// A piece without weights, with what its columns are computed from. `room` of its functions is memory for the results of a formula.
pub struct Together<'a, const M: usize> {
    pub curve: Rc<Curve<M>>,
    pub joints: Option<Rc<Piece<'a, M>>>,
    /// The factor of each axis in the length of the path; None if all are 1.
    pub scale: Option<[f64; M]>,
    /// A bound on the second derivative of the columns by u, for joints an estimate; infinite if it is not known.
    pub bend: f64,
}

impl<const M: usize> Together<'_, M> {
    /// The differences from the columns at u to `q`, and the slopes of the columns.
    #[inline(always)]
    pub fn toward<T: Argument<Kept = Lanes>>(&self, u: T, q: &[T; M], room: &mut [Lanes]) -> [[T; M]; 2] {
        let tip = self.curve.polynomial_place(u);
        let Some(joints) = &self.joints else {
            let [point, slope] = tip;
            let mut away = point;
            for k in 0..M {
                away[k] = q[k] - point[k];
            }
            return [away, slope];
        };
        let [position, slope] = joints.position_and_slope(&tip, room);
        [joints.way(&position, q), slope]
    }

    /// Fills in the stations, also where the piece has no direction.
    pub fn stations(&self, u: &Lanes, room: &mut [Lanes], found: &mut Station<M, Lanes>) {
        in_wide_vectors!(simd => *found = self.station(f64x8::from_slice(simd, u), room).kept());
    }

    #[inline(always)]
    fn station<T: Argument<Kept = Lanes>>(&self, u: T, room: &mut [Lanes]) -> Station<M, T> {
        match &self.joints {
            Some(joints) => joints.station(u, &self.curve.polynomial_jet(u), room),
            None => Station::anywhere(u, &self.curve.polynomial_derivatives(u)),
        }
    }

    /// Derivative of the length of the path by u.
    #[inline(always)]
    pub fn speed<T: Number>(&self, u: T) -> T {
        self.curve.polynomial_speed(u, self.scale.as_ref())
    }

    /// The piece has no direction where the derivative of its length is at most this. The derivatives of joints are known everywhere.
    pub fn still(&self) -> f64 {
        match self.joints {
            Some(_) => f64::NEG_INFINITY,
            None => STILL * self.curve.size_length(),
        }
    }

    /// The stations, also where the piece has no direction, and bounds of their rounding errors.
    #[inline(always)]
    pub fn rounded_station<T: Argument<Kept = Lanes>>(
        &self,
        u: T,
        room: &mut [Lanes],
    ) -> (Station<M, T>, Roundings<M, T>) {
        if let Some(joints) = &self.joints {
            return joints.rounded_stations(u, room);
        }
        let derivatives = self.curve.polynomial_derivatives(u);
        let station = Station::anywhere(u, &derivatives);
        let roundings = Roundings::new(&self.curve, &station, &derivatives);
        (station, roundings)
    }
}
