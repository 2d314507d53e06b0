//! How far the rates of a phase are from the straight lines between places of it, from bounds of the derivatives of its piece and of
//! its speed.
//!
//! On an interval of length h a function is off the straight line between its ends by no more than h²/8 times its greatest second
//! derivative. With g = |C'| and T = C'/g all derivatives by u follow from the bounds of those of C: T·T' = 0, so g' = T·C'',
//! gT' = C'' − g'T, and so on, each by the ones before; then K = T'/g, dK/ds = K'/g.

use super::speed_by_length::{Bounds, Pace, SpeedByLength};

/// How far, at most, velocity, acceleration, jerk and dT/ds between two places are as vectors from the straight line between
/// those of the two, and the greatest speed along the path.
#[derive(Clone, Copy, Debug)]
pub struct Bulge {
    pub rates: [f64; 3],
    pub curvature: f64,
    pub most_speed: f64,
}

/// What is known of places of a phase.
pub struct Known<'a> {
    /// The longest interval of u from one to the next.
    pub interval: f64,
    /// The least and the greatest |C'| at them.
    pub slopes: [f64; 2],
    /// The greatest lengths of the second and the third derivative by the length.
    pub second: f64,
    pub third: f64,
    /// The motion along the path at the first and the last one, in the order of travel, and the way between.
    pub paces: [&'a Pace; 2],
    pub way: f64,
}

/// Of the longest interval between places, on a piece with these bounds of the second to the fifth derivative; nothing where |C'|
/// has no bound.
pub fn bulge([m2, m3, m4, m5]: [f64; 4], speed: &SpeedByLength, known: &Known) -> Option<Bulge> {
    let h = known.interval;
    let g = known.slopes[0] - 0.5 * m2 * h;
    if g.is_nan() || g <= 0.0 {
        return None;
    }
    let per = 1.0 / g;
    let t1 = m2 * per;
    let t2 = (m3 + 3.0 * m2 * t1) * per;
    let g2 = m3 + m2 * t1;
    let t3 = (m4 + 4.0 * m2 * t2 + (2.0 * m3 + 3.0 * g2) * t1) * per;
    let g3 = m4 + m2 * t2 + 2.0 * m3 * t1;
    let t4 = (m5 + 5.0 * m2 * t3 + (3.0 * m3 + 6.0 * g2) * t2 + (3.0 * m4 + 4.0 * g3) * t1) * per;
    let r1 = t1 * per;
    let r2 = (2.0 * m2 * r1 + g2 * per) * per;
    let r3 = (3.0 * (m2 * r2 + g2 * r1) + g3 * per) * per;
    let (direction, inverse) = (Bounds([1.0, t1, t2]), Bounds([per, r1, r2]));
    let mut bend = Bounds([t1, t2, t3]).times(inverse);
    let third = t4 * per + 3.0 * (t3 * r1 + t2 * r2) + t1 * r3;
    let mut change = Bounds([bend.0[1], bend.0[2], third]).times(inverse);
    let eighth = 0.125 * h * h;
    let curvature = eighth * bend.0[2];
    bend.0[0] = bend.0[0].min(known.second + curvature);
    change.0[0] = change.0[0].min(known.third + eighth * change.0[2]);
    let steepest = known.slopes[1] + 0.5 * m2 * h;
    let [v, a, j] = speed.bounds(known.paces, known.way).map(|by_length| by_length.at(steepest, m2));
    let square = v.times(v);
    let bulge = |of: Bounds| eighth * of.0[2];
    Some(Bulge {
        rates: [
            bulge(direction.times(v)),
            bulge(direction.times(a)) + bulge(bend.times(square)),
            bulge(direction.times(j))
                + 3.0 * bulge(bend.times(v.times(a)))
                + bulge(change.times(square.times(v))),
        ],
        curvature,
        most_speed: v.0[0],
    })
}
