//! Bounds how far velocity, acceleration and jerk on a phase are from the straight lines between their values at two places, by
//! bounds of the derivatives of the piece and of the speed.
//!
//! On an interval of length h a function is off the straight line between its ends by no more than h²/8 times its greatest second
//! derivative. With g = |C'| and T = C'/g all derivatives by u follow from the bounds of those of C: T·T' = 0, so g' = T·C'',
//! gT' = C'' − g'T, and so on, each by the ones before; then K = T'/g, dK/ds = K'/g.

use super::number::Number;
use super::speed_by_length::Bounds;

/// Bounds between two places: how far velocity, acceleration, jerk and dT/ds are, as vectors, from the straight line between
/// their values at the two; and the greatest speed along the path.
#[derive(Clone, Copy, Debug)]
pub struct Bulge<T> {
    pub rates: [T; 3],
    pub curvature: T,
    pub most_speed: T,
    /// A lower bound of |C'|. If it is not positive, the other bounds do not hold.
    pub slope: T,
}

impl<T: Number> Bulge<T> {
    /// If no bounds are known: all are infinite. `like` only gives the type of number.
    #[inline(always)]
    pub fn unknown(like: T) -> Self {
        let any = like.filled(f64::INFINITY);
        Self { rates: [any; 3], curvature: any, most_speed: any, slope: any }
    }
}

/// What is known at some places of a phase.
pub struct Known<T> {
    /// The longest interval of u between two neighbouring places.
    pub interval: T,
    /// The least and the greatest |C'| at the places.
    pub slopes: [T; 2],
    /// The greatest lengths of the second and the third derivative by the length at the places.
    pub second: T,
    pub third: T,
    /// Bounds of the motion along the path by the length; see `SpeedByLength::bounds`.
    pub paces: [Bounds<T>; 3],
}

/// The bounds on the longest interval, on a piece with these bounds of the second to the fifth derivative by u.
#[inline(always)]
pub fn bulge<T: Number>([m2, m3, m4, m5]: [T; 4], known: &Known<T>) -> Bulge<T> {
    let h = known.interval;
    let slope = known.slopes[0] - h * (m2 * 0.5);
    let one = h.filled(1.0);
    let per = one / slope;
    let t1 = per * m2;
    let t2 = (t1 * (m2 * 3.0) + m3) * per;
    let g2 = t1 * m2 + m3;
    let t3 = (t2 * (m2 * 4.0) + (g2 * 3.0 + m3 * 2.0) * t1 + m4) * per;
    let g3 = t2 * m2 + t1 * (m3 * 2.0) + m4;
    let t4 = (t3 * (m2 * 5.0) + (g2 * 6.0 + m3 * 3.0) * t2 + (g3 * 4.0 + m4 * 3.0) * t1 + m5) * per;
    let r1 = t1 * per;
    let r2 = (r1 * (m2 * 2.0) + g2 * per) * per;
    let r3 = ((r2 * m2 + g2 * r1) * 3.0 + g3 * per) * per;
    let (direction, inverse) = (Bounds([one, t1, t2]), Bounds([per, r1, r2]));
    let mut bend = Bounds([t1, t2, t3]).times(inverse);
    let third = t4 * per + (t3 * r1 + t2 * r2) * 3.0 + t1 * r3;
    let mut change = Bounds([bend.0[1], bend.0[2], third]).times(inverse);
    let eighth = h * h * 0.125;
    let curvature = eighth * bend.0[2];
    bend.0[0] = bend.0[0].smaller(known.second + curvature);
    change.0[0] = change.0[0].smaller(known.third + eighth * change.0[2]);
    let steepest = known.slopes[1] + h * (m2 * 0.5);
    let [v, a, j] = known.paces;
    let (v, a, j) = (v.at(steepest, m2), a.at(steepest, m2), j.at(steepest, m2));
    let square = v.times(v);
    let bulge = |of: Bounds<T>| eighth * of.0[2];
    Bulge {
        rates: [
            bulge(direction.times(v)),
            bulge(direction.times(a)) + bulge(bend.times(square)),
            bulge(direction.times(j))
                + bulge(bend.times(v.times(a))) * 3.0
                + bulge(change.times(square.times(v))),
        ],
        curvature,
        most_speed: v.0[0],
        slope,
    }
}
