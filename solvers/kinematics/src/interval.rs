//! The elementary functions of intervals, and sums of products with a single rounding bound.
//!
//! An undefined result, such as the angle of a box that contains the origin, is the whole line.

use std::f64::consts::TAU;

use super::number::Number;
use super::tolerance::{ELEMENTARY_ULPS, STRAIGHT};
use feedplan_geometry::interval::{greater, Interval};
use feedplan_geometry::tolerance::UNDERFLOW;

/// π/180 and 180/π, between neighbouring floating-point numbers.
const RADIAN: Interval = Interval { lo: 0.017453292519943295, hi: 0.0174532925199433 };
const DEGREE: Interval = Interval { lo: 57.295779513082316, hi: 57.29577951308232 };

impl Number for Interval {
    #[inline]
    fn exactly(value: f64) -> Self {
        Interval::exactly(value)
    }

    #[inline]
    fn square(self) -> Self {
        Interval::square(self)
    }

    #[inline]
    fn sqrt(self) -> Self {
        Interval::sqrt(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        let ((sine_lo, cosine_lo), (sine_hi, cosine_hi)) = (self.lo.sin_cos(), self.hi.sin_cos());
        (wave(self, 0.25, sine_lo, sine_hi), wave(self, 0.0, cosine_lo, cosine_hi))
    }

    /// The angle at the origin of all points of the box x × y, continuous over the box.
    ///
    /// The angle of the middle of the box is in (−π, π]; the ends may be outside that range. The angles of a box without the
    /// origin span less than π, from one of its corners to another.
    fn atan2(y: Self, x: Self) -> Self {
        if x.lo <= 0.0 && x.hi >= 0.0 && y.lo <= 0.0 && y.hi >= 0.0 {
            return Interval::WHOLE;
        }
        let centre = y.middle().atan2(x.middle());
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in [(x.lo, y.lo), (x.lo, y.hi), (x.hi, y.lo), (x.hi, y.hi)] {
            let corner = b.atan2(a) - centre;
            let corner = corner - TAU * (corner / TAU).round();
            if corner.is_nan() || corner.abs() > STRAIGHT {
                return Interval::WHOLE;
            }
            (least, most) = (least.min(corner), most.max(corner));
        }
        let slack = ELEMENTARY_ULPS * f64::EPSILON * TAU;
        Interval::rounded(centre + least - slack, centre + most + slack, 1.0, 0.0)
    }

    fn radians(self) -> Self {
        self * RADIAN
    }

    fn degrees(self) -> Self {
        self * DEGREE
    }

    /// Uses one rounding bound for the whole sum: n products and their sum in any order have an error of at most n u Σ|products|
    /// to first order, u = ε/2 (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.1); twice that covers the
    /// higher orders.
    fn dot(pairs: impl Iterator<Item = (Self, Self)>) -> Self {
        let (mut lo, mut hi, mut size, mut sum, mut terms) = (0.0, 0.0, 0.0, 0.0, 2.0);
        for (a, b) in pairs {
            let (least, most, all) = a.products(b);
            lo += least;
            hi += most;
            size += greater(least.abs(), most.abs());
            sum += all;
            terms += 1.0;
        }
        if sum.is_nan() {
            return Interval::WHOLE;
        }
        let pad = terms * f64::EPSILON * size + terms * UNDERFLOW;
        Interval::rounded(lo - pad, hi + pad, 1.0, 0.0)
    }
}

/// The range on an interval of a sine wave with its crests at `crest` plus whole turns; its values at both ends are known.
fn wave(angle: Interval, crest: f64, at_lo: f64, at_hi: f64) -> Interval {
    if !angle.is_bounded() {
        return Interval { lo: -1.0, hi: 1.0 };
    }
    let found = Interval::rounded(at_lo.min(at_hi), at_lo.max(at_hi), ELEMENTARY_ULPS, UNDERFLOW);
    // The angles in turns, widened by more than their rounding: a crest that is counted by mistake only makes the result wider.
    let [first, last] = [angle.lo, angle.hi].map(|end| end / TAU - crest);
    let slack = 4.0 * f64::EPSILON * (1.0 + first.abs().max(last.abs()));
    let (first, last) = (first - slack, last + slack);
    let has_crest = last.floor() >= first.ceil();
    let has_trough = (last + 0.5).floor() >= (first + 0.5).ceil();
    Interval {
        lo: if has_trough { -1.0 } else { found.lo.max(-1.0) },
        hi: if has_crest { 1.0 } else { found.hi.min(1.0) },
    }
}
