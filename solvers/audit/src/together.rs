//! The columns of a path at eight places of a piece at once, in the vectors of the processor: its axes, or joints by their formula.
//!
//! The numbers are those of one place after the other, bit for bit. Pieces with weights are not looked at so.

use std::rc::Rc;

use crate::curve::Curve;
use crate::joints::formula::Argument;
use crate::joints::path::Piece;
use crate::number::{Lanes, Number};
use crate::station::{Roundings, Station, STILL};

/// What is at some places of a piece; `room` has the results of a formula.
pub struct Together<'a, const M: usize> {
    pub curve: Rc<Curve<M>>,
    pub joints: Option<Rc<Piece<'a, M>>>,
    /// What the axes count in the length of the path, where that is not 1.
    pub scale: Option<[f64; M]>,
    /// The greatest second derivative of the columns by u, of joints about; infinite where it is not known.
    pub bend: f64,
}

impl<const M: usize> Together<'_, M> {
    /// The ways to `q`, and the slopes.
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

    /// Derivative of the length of the path by u.
    #[inline(always)]
    pub fn speed<T: Number>(&self, u: T) -> T {
        self.curve.polynomial_speed(u, self.scale.as_ref())
    }

    /// Where the derivative of the length is not greater the piece has no direction; joints have rates everywhere.
    pub fn still(&self) -> f64 {
        match self.joints {
            Some(_) => f64::NEG_INFINITY,
            None => STILL * self.curve.size_lengths()[0],
        }
    }

    /// The stations, whether or not the piece has a direction there, and what of them may be rounding.
    #[inline(always)]
    pub fn rounded_station<T: Argument<Kept = Lanes>>(
        &self,
        u: T,
        room: &mut [Lanes],
    ) -> (Station<M, T>, Roundings<M, T>) {
        if let Some(joints) = &self.joints {
            return joints.rounded_stations(u, &self.curve.polynomial_jet(u), room);
        }
        let derivatives = self.curve.polynomial_derivatives(u);
        let station = Station::anywhere(u, &derivatives);
        let roundings = Roundings::new(&self.curve, &station, &derivatives);
        (station, roundings)
    }
}
