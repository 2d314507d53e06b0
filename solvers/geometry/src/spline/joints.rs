//! How neighbouring pieces of a curve meet: with a gap, with a corner, with one tangent and a jump of |C'|, or with equal
//! derivatives to some order.

use super::bezier::derivatives;
use super::{CompositeCurve, Piece};
use crate::quadratic::{norm, sub};
use crate::tolerance::ROUNDING;
use crate::watch::Watch;

/// What holds where two pieces meet; each kind implies those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Continuity {
    /// The ends are apart.
    Gap = 0,
    /// The ends meet, the direction of motion breaks (C0).
    Corner = 1,
    /// The direction agrees, the derivative jumps (G1).
    Tangent = 2,
    /// C' agrees.
    C1 = 3,
    /// C'' agrees.
    C2 = 4,
    /// C''' agrees.
    C3 = 5,
}

/// Differences up to which two pieces agree.
#[derive(Clone, Copy, Debug)]
pub struct JointTolerance {
    /// Distance in mm.
    pub gap: f64,
    /// Angle between directions in rad.
    pub angle: f64,
    /// Difference of derivatives, as a fraction of those that pieces of this extent and width can have.
    pub derivative: f64,
}

/// How piece `piece` and the next one meet.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    pub piece: usize,
    pub kind: Continuity,
    /// Distance of the ends in mm.
    pub gap: f64,
    /// Angle between the directions of motion before and after, in rad; 0 next to a piece of length zero.
    pub turn: f64,
    /// |C'| before and after; 0 in a cusp.
    pub speed: [f64; 2],
}

/// The joints between neighbours, and with `closed` the one from the last piece to the first.
pub fn joints<const M: usize>(
    curve: &CompositeCurve<M>,
    closed: bool,
    tolerance: &JointTolerance,
    watch: Watch,
) -> Vec<Joint> {
    let count = curve.len();
    (0..count - usize::from(!closed && count > 0))
        .map(|i| {
            watch.each(count).count(i);
            joint(i, &curve.piece(i), &curve.piece((i + 1) % count), tolerance)
        })
        .collect()
}

fn joint<const M: usize>(
    piece: usize,
    before: &Piece<M>,
    after: &Piece<M>,
    tolerance: &JointTolerance,
) -> Joint {
    let (a, b) = (derivatives(before, before.width), derivatives(after, 0.0));
    let gap = norm(&sub(&a[0], &b[0]));
    let unit = |edge: [f64; M]| edge.map(|value| value / norm(&edge));
    let turn = match (before.edge(true).map(unit), after.edge(false).map(unit)) {
        // Kahan's form loses no digits at small angles and at reversals.
        (Some(p), Some(q)) => {
            let sum: [f64; M] = std::array::from_fn(|k| p[k] + q[k]);
            2.0 * norm(&sub(&p, &q)).atan2(norm(&sum))
        }
        _ => 0.0,
    };
    let mut kind = Continuity::C3;
    for (order, lower) in [(3, Continuity::C2), (2, Continuity::C1), (1, Continuity::Tangent)] {
        let allowed = scale(before, true, order, tolerance) + scale(after, false, order, tolerance);
        if norm(&sub(&a[order], &b[order])) > allowed {
            kind = lower;
        }
    }
    if turn > tolerance.angle {
        kind = Continuity::Corner;
    }
    if gap > tolerance.gap {
        kind = Continuity::Gap;
    }
    Joint { piece, kind, gap, turn, speed: [norm(&a[1]), norm(&b[1])] }
}

/// The allowed difference of a derivative: the tolerance times the greatest derivative of a piece of this extent and width,
/// and the rounding of its control points.
fn scale<const M: usize>(piece: &Piece<M>, at_end: bool, order: usize, tolerance: &JointTolerance) -> f64 {
    let (extent, coordinate) = piece.extent();
    let d = piece.degree();
    let mut factor = 1.0;
    for i in 0..order {
        factor *= 2.0 * d.saturating_sub(i).max(1) as f64 / piece.width;
    }
    if piece.is_rational() {
        let near = |i: usize| piece.weights[if at_end { d - i } else { i }];
        let most = (0..=order.min(d)).map(near).fold(0.0, f64::max);
        factor *= (most / near(0)).powi(order as i32);
    }
    factor * (tolerance.derivative * extent + ROUNDING * coordinate)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: JointTolerance = JointTolerance { gap: 1e-6, angle: 1e-6, derivative: 1e-9 };

    fn kinds(pieces: &[(&[[f64; 2]], f64)]) -> Vec<Continuity> {
        let mut curve = CompositeCurve::default();
        for (control, width) in pieces {
            curve.push(control, &[], *width);
        }
        joints(&curve, false, &TOLERANCE, Watch::default()).into_iter().map(|joint| joint.kind).collect()
    }

    #[test]
    fn lines_meet_in_every_way_that_lines_can() {
        let line: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 0.0]];
        assert_eq!(kinds(&[(line, 1.0), (&[[1.0, 0.1], [2.0, 0.1]], 1.0)]), [Continuity::Gap]);
        assert_eq!(kinds(&[(line, 1.0), (&[[1.0, 0.0], [1.0, 1.0]], 1.0)]), [Continuity::Corner]);
        assert_eq!(kinds(&[(line, 1.0), (&[[1.0, 0.0], [2.0, 0.0]], 2.0)]), [Continuity::Tangent]);
        assert_eq!(kinds(&[(line, 1.0), (&[[1.0, 0.0], [3.0, 0.0]], 2.0)]), [Continuity::C3]);
    }

    #[test]
    fn a_line_into_a_parabola_is_c1_and_into_a_cubic_c2() {
        let line: &[[f64; 2]] = &[[-1.0, 0.0], [0.0, 0.0]];
        assert_eq!(kinds(&[(line, 1.0), (&[[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]], 1.0)]), [Continuity::C1]);
        let third = 1.0 / 3.0;
        let cubic: &[[f64; 2]] = &[[0.0, 0.0], [third, 0.0], [2.0 * third, 0.0], [1.0, 1.0]];
        assert_eq!(kinds(&[(line, 1.0), (cubic, 1.0)]), [Continuity::C2]);
    }

    #[test]
    fn a_turn_is_measured_in_rad_also_where_the_speed_is_zero() {
        let mut curve = CompositeCurve::default();
        curve.push(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]], &[], 1.0);
        curve.push(&[[1.0, 0.0], [1.0, 0.0], [1.0, 1.0]], &[], 1.0);
        let joint = joints(&curve, false, &TOLERANCE, Watch::default())[0];
        assert_eq!((joint.kind, joint.speed), (Continuity::Corner, [0.0, 0.0]));
        assert!((joint.turn - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }
}
