//! The blend of a corner: the pieces on both sides of it, displaced so that they meet smoothly.
//!
//! Two smooth sides meet in V with unit tangents t₋ before and t₊ after. Each side, up to the length l from V, is displaced by
//! D (q/l)², where q is the distance from the far end of the side, measured in a parameter in which the side is C1 and has
//! speed 1 in V. With
//!
//! ```text
//! D = (t₊ − t₋)/(2/l₋ + 2/l₊)          |D| = l |t₊ − t₋|/4 at equal lengths
//! ```
//!
//! the tangents agree in V + D. The pieces keep their number and their degrees. Points of equal parameter are at most
//! |D| apart, which bounds the deviation both ways, in any number of axes and pieces. Between two lines of equal length
//! the distance of V from the curve is exactly |D|, and both sides are one parabola, with the control points V − l t₋, V,
//! V + l t₊.
//!
//! A rational piece of degree d keeps its degree and weights: each of its control points is displaced by a fraction of D. On the
//! piece from q₀ to q₁ the first step between these fractions is q₀ w₀/w₁, the last is q₁ w_d/w_{d−1}, and those between are
//! interpolated linearly; all are multiplied by 2 (q₁ − q₀)/(d l² A). A is chosen so that the sum of the steps of a side is 1;
//! the slope in V is then 2/(lA). On polynomials A = 1, and the displacement is D (q/l)².
//!
//! # Why a parabola
//! Two quadratics with the polygon A, A + x t₋, B − x t₊, B and the apex at the tolerance leave the ratio r = x/l free; r = 1/2
//! is the parabola above. The table compares the times with r = 1/2, from exact plans of 140 corners between two lines of 10 mm:
//! apex 0.01 mm, turns from 10° to 170° in five directions each, axis accelerations 1000/1000 and 400/1000 mm/s², feeds 50 and
//! 1000 mm/s.
//!
//! | r    | 0.3    | 0.4   | 0.45  | 0.5 | 0.55   | 0.6   | 0.7   |
//! |------|--------|-------|-------|-----|--------|-------|-------|
//! | mean | +2.6 % | +1.1 % | +0.5 % | 0 | −0.01 % | +0.2 % | +0.7 % |
//! | worst | +15.8 % | +7.6 % | +3.6 % | 0 | +1.4 % | +3.0 % | +6.8 % |
//!
//! Two axes with constant accelerations follow a parabola, so both can be at their limits all along. Greater ratios also need
//! longer sides, which short lines do not have.

mod share_lengths;
mod tangent_jump;

pub use share_lengths::share_lengths;
pub use tangent_jump::{Rounding, TangentJump};

use crate::path_piece::{PathPiece, Shape};
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{norm, sub};
use feedplan_geometry::spline::CompositeCurve;

/// The two sides of a corner, each in the order of the path.
#[derive(Default)]
pub struct Sides<const M: usize> {
    pub before: Vec<PathPiece<M>>,
    pub after: Vec<PathPiece<M>>,
    /// The spline pieces of both sides, cut and bent.
    pub made: CompositeCurve<M>,
}

impl<const M: usize> Sides<M> {
    /// The single piece that rounds a corner between two lines: a circle with the lower of both feeds, or a parabola, which needs
    /// equal feeds and tolerances on both sides. None in other cases.
    pub fn between_lines(&self, jump: &TangentJump<M>, rounding: Rounding) -> Option<PathPiece<M>> {
        let ([before], [after]) = (&self.before[..], &self.after[..]) else { return None };
        let (Shape::Conic(first), Shape::Conic(second)) = (&before.shape, &after.shape) else { return None };
        let alike = before.feed == after.feed && before.tolerance == after.tolerance;
        if !(first.is_line() && second.is_line() && (alike || rounding == Rounding::Circle)) {
            return None;
        }
        let weight = match rounding {
            Rounding::Parabola => 1.0,
            Rounding::Circle => jump.half_cosine(),
        };
        let control = [first.control[0], first.control[2], second.control[2]];
        let mut corner = Conic { control, weight, width: first.width + second.width };
        if rounding == Rounding::Circle {
            corner.width = corner.natural_width();
        }
        // The distance of a conic from the corner is 2/(1 + weight) times the distance of the parabola.
        let distance = 2.0 / (1.0 + weight) * norm(&jump.displacement(first.width, second.width));
        Some(PathPiece {
            shape: Shape::Conic(corner),
            last: after.last,
            feed: before.feed.min(after.feed),
            tolerance: before.tolerance.min(after.tolerance),
            deviation: distance + before.deviation.max(after.deviation),
            ..*before
        })
    }

    /// Displaces both sides so that they meet smoothly. Returns the greatest ratio of a piece's new deviation to what was left of
    /// its tolerance; None if a side is empty, or if C' is 0 somewhere.
    pub fn bend(&mut self, jump: &TangentJump<M>) -> Option<f64> {
        let Self { before, after, made } = self;
        if before.is_empty() || after.is_empty() {
            return None;
        }
        let length_before = rescale(before.iter_mut().rev(), true, made)?;
        let length_after = rescale(after.iter_mut(), false, made)?;
        let sum_before = sum_of_steps(before.iter(), length_before, made, true);
        let sum_after = sum_of_steps(after.iter().rev(), length_after, made, false);
        let displacement = jump.displacement(length_before * sum_before, length_after * sum_after);
        // From the far ends to the corner, so that q starts at exactly 0 and ends at exactly the length of the side.
        let before = bend(before.iter_mut(), true, &displacement, length_before, sum_before, made)?;
        let after = bend(after.iter_mut().rev(), false, &displacement, length_after, sum_after, made)?;
        Some(before.max(after))
    }
}

/// The degree of a piece, w₀/w₁ and w_d/w_{d−1}.
struct Ends {
    degree: usize,
    ratio: [f64; 2],
}

impl Ends {
    fn new<const M: usize>(shape: &Shape<M>, made: &CompositeCurve<M>) -> Self {
        match shape {
            Shape::Conic(conic) => Self { degree: 2, ratio: [1.0 / conic.weight; 2] },
            Shape::Spline(spline) => {
                let piece = made.piece(spline.index as usize);
                let (degree, w) = (piece.degree(), piece.weights);
                let ratio =
                    if piece.is_rational() { [w[0] / w[1], w[degree] / w[degree - 1]] } else { [1.0; 2] };
                Self { degree, ratio }
            }
        }
    }

    /// C' times the width of the piece at both ends, as lengths.
    fn speeds<const M: usize>(&self, shape: &Shape<M>, made: &CompositeCurve<M>) -> [f64; 2] {
        let control = match shape {
            Shape::Conic(conic) => &conic.control[..],
            Shape::Spline(spline) => made.piece(spline.index as usize).control,
        };
        let (last, degree) = (self.degree, self.degree as f64);
        let edges = [sub(&control[1], &control[0]), sub(&control[last], &control[last - 1])];
        [degree / self.ratio[0] * norm(&edges[0]), degree / self.ratio[1] * norm(&edges[1])]
    }

    /// The steps between the fractions of D on a piece on which q/l grows from `far` to `near`, before the division by A.
    fn steps(&self, far: f64, near: f64, corner_at_end: bool) -> impl Iterator<Item = f64> {
        let [mut first, mut last] = self.ratio;
        if !corner_at_end {
            (first, last) = (last, first);
        }
        let (first, last) = (first * far, last * near);
        let (degree, factor) = (self.degree, 2.0 * (near - far) / self.degree as f64);
        (0..degree).map(move |i| {
            let t = i as f64 / (degree - 1) as f64;
            factor * (first + t * (last - first))
        })
    }
}

/// Gives the pieces of a side, taken from the corner outwards, widths with which the side is C1 and has speed 1 at the corner.
/// Returns the sum of the widths; None if C' is 0 at an end of a piece.
fn rescale<'a, const M: usize>(
    side: impl Iterator<Item = &'a mut PathPiece<M>>,
    corner_at_end: bool,
    made: &CompositeCurve<M>,
) -> Option<f64> {
    let (mut speed, mut length) = (1.0, 0.0);
    for PathPiece { shape, .. } in side {
        let [start, end] = Ends::new(shape, made).speeds(shape, made);
        let (near, far) = if corner_at_end { (end, start) } else { (start, end) };
        let width = near / speed;
        match shape {
            Shape::Conic(conic) => conic.width = width,
            Shape::Spline(spline) => spline.width = width,
        }
        speed = far / width;
        length += width;
        if !(width > 0.0 && speed > 0.0 && width.is_finite() && speed.is_finite()) {
            return None;
        }
    }
    Some(length)
}

/// The sum A of the steps of a side, taken from the far end to the corner.
fn sum_of_steps<'a, const M: usize>(
    side: impl Iterator<Item = &'a PathPiece<M>>,
    length: f64,
    made: &CompositeCurve<M>,
    corner_at_end: bool,
) -> f64 {
    let (mut far, mut sum) = (0.0, 0.0);
    for piece in side {
        let near = far + piece.shape.width() / length;
        sum += Ends::new(&piece.shape, made).steps(far, near, corner_at_end).sum::<f64>();
        far = near;
    }
    sum
}

/// Displaces the pieces of a side, taken from the far end to the corner. Returns the greatest ratio of a piece's new deviation to
/// what was left of its tolerance.
fn bend<'a, const M: usize>(
    side: impl ExactSizeIterator<Item = &'a mut PathPiece<M>>,
    corner_at_end: bool,
    displacement: &[f64; M],
    length: f64,
    sum: f64,
    made: &mut CompositeCurve<M>,
) -> Option<f64> {
    let distance = norm(displacement);
    let (mut far, mut reached, mut excess, count) = (0.0, 0.0, 0.0f64, side.len());
    for (i, piece) in side.enumerate() {
        let near = if i + 1 == count { 1.0 } else { far + piece.shape.width() / length };
        let ends = Ends::new(&piece.shape, made);
        let control = match &mut piece.shape {
            Shape::Conic(conic) => &mut conic.control[..],
            Shape::Spline(spline) => made.control_mut(spline.index as usize),
        };
        let mut fraction = reached;
        let displace = |point: &mut [f64; M], fraction: f64| {
            for k in 0..M {
                point[k] += fraction * displacement[k];
            }
        };
        let at = |i: usize| if corner_at_end { i } else { ends.degree - i };
        displace(&mut control[at(0)], fraction);
        for (i, step) in (1..).zip(ends.steps(far, near, corner_at_end)) {
            fraction += step / sum;
            // Both sides meet in V + D exactly.
            let exact = i == ends.degree && near == 1.0;
            fraction = if exact { 1.0 } else { fraction };
            displace(&mut control[at(i)], fraction);
        }
        if let Shape::Spline(spline) = &mut piece.shape {
            *spline = spline.bent(made)?;
        }
        let deviation = fraction * distance;
        excess = excess.max(deviation / (piece.tolerance - piece.deviation));
        piece.deviation += deviation;
        (far, reached) = (near, fraction);
    }
    Some(excess)
}

#[cfg(test)]
mod tests {
    use super::*;
    use feedplan_geometry::quadratic::{dot, sub, Quadratic};
    use feedplan_geometry::spline::bezier::derivatives;
    use feedplan_geometry::spline::Piece;

    fn conic<const M: usize>(piece: &PathPiece<M>) -> &Conic<M> {
        piece.shape.conic().unwrap()
    }

    /// C and C' at a share of the width.
    fn at<const M: usize>(conic: &Conic<M>, share: f64) -> [[f64; M]; 2] {
        let weights = [1.0, conic.weight, 1.0];
        let piece = Piece { control: &conic.control, weights: &weights, width: conic.width };
        let [point, tangent, ..] = derivatives(&piece, share * conic.width);
        [point, tangent]
    }

    fn jump_between<const M: usize>(before: Conic<M>, after: Conic<M>) -> TangentJump<M> {
        TangentJump::new(&Shape::Conic(before), &Shape::Conic(after)).unwrap()
    }

    #[test]
    fn a_right_angle_becomes_the_parabola_whose_apex_is_at_the_tolerance() {
        let before = Conic::line([0.0, 0.0], [10.0, 0.0]);
        let after = Conic::line([10.0, 0.0], [10.0, 10.0]);
        let jump = jump_between(before, after);
        assert_eq!(jump.change, [-1.0, 1.0]);
        let length = jump.length_within(0.1, Rounding::Parabola);
        assert!((length - 0.2 * 2f64.sqrt()).abs() < 1e-15);
        let sides = Sides {
            before: vec![PathPiece::from(before.part(10.0 - length, 10.0))],
            after: vec![PathPiece::from(after.part(0.0, length))],
            made: CompositeCurve::default(),
        };
        let corner = sides.between_lines(&jump, Rounding::Parabola).unwrap();
        let parabola = *conic(&corner);
        assert_eq!(parabola.control, [[10.0 - length, 0.0], [10.0, 0.0], [10.0, length]]);
        let [apex, _] = at(&parabola, 0.5);
        assert!(
            (norm(&sub(&apex, &[10.0, 0.0])) - 0.1).abs() < 1e-15 && (corner.deviation - 0.1).abs() < 1e-15
        );
        // Bending the two sides gives the same curve in two pieces.
        let mut sides = sides;
        assert!((sides.bend(&jump).unwrap() - 0.1).abs() < 1e-14);
        let bent = conic(&sides.before[0]);
        assert!(norm(&sub(&bent.control[2], &apex)) < 2e-15);
        let half = parabola.part(0.0, length);
        assert!(norm(&sub(&at(bent, 0.3)[0], &at(&half, 0.3)[0])) < 2e-15);
    }

    #[test]
    fn a_right_angle_becomes_the_circle_whose_middle_is_at_the_tolerance() {
        // Radius 0.1/(√2 − 1), which is also the length on both sides.
        let before = Conic::line([0.0, 0.0], [10.0, 0.0]);
        let after = Conic::line([10.0, 0.0], [10.0, 10.0]);
        let jump = jump_between(before, after);
        let radius = jump.length_within(0.1, Rounding::Circle);
        assert!((radius - 0.1 / (2f64.sqrt() - 1.0)).abs() < 1e-15);
        let mut sides = Sides {
            before: vec![PathPiece::from(before.part(10.0 - radius, 10.0))],
            after: vec![PathPiece::from(after.part(0.0, radius))],
            made: CompositeCurve::default(),
        };
        sides.after[0].feed = 3.0;
        let corner = sides.between_lines(&jump, Rounding::Circle).unwrap();
        assert!((corner.deviation - 0.1).abs() < 1e-15 && corner.feed == 3.0);
        let arc = *conic(&corner);
        for i in 0..=8 {
            let [point, _] = at(&arc, i as f64 / 8.0);
            let spoke = sub(&point, &[10.0 - radius, radius]);
            assert!((norm(&spoke) - radius).abs() < 1e-14, "{i}");
        }
        let [middle, _] = at(&arc, 0.5);
        assert!((norm(&sub(&middle, &[10.0, 0.0])) - 0.1).abs() < 1e-14);
        // The parabola needs equal feeds.
        assert!(sides.between_lines(&jump, Rounding::Parabola).is_none());
    }

    #[test]
    fn bent_sides_of_several_pieces_are_smooth_and_as_near_as_they_say() {
        // Two sides in space that meet in a corner; each is smooth in itself, with changing parameter speeds.
        let curve =
            |a: [f64; 3], b: [f64; 3], c: [f64; 3]| Conic::from(Quadratic { control: [a, b, c], width: 0.7 });
        let before = [
            curve([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.5, 0.1]),
            curve([2.0, 0.5, 0.1], [4.0, 1.5, 0.3], [5.0, 3.0, 0.0]),
        ];
        let after = [
            curve([5.0, 3.0, 0.0], [4.5, 3.0, 1.0], [4.0, 3.5, 2.0]),
            curve([4.0, 3.5, 2.0], [3.75, 3.75, 2.5], [3.0, 4.0, 3.0]),
        ];
        assert_bends_smoothly(before, after);
    }

    #[test]
    fn bent_circles_stay_conics_and_are_as_near_as_they_say() {
        // Two arcs of one circle of radius 1, then two arcs of a circle of radius 2 that starts at a right angle to it.
        let arc = |centre: [f64; 2], radius: f64, from: f64, to: f64| {
            let at = |angle: f64, r: f64| [centre[0] + r * angle.cos(), centre[1] + r * angle.sin()];
            let half = 0.5 * (to - from);
            let control = [at(from, radius), at(from + half, radius / half.cos()), at(to, radius)];
            let mut conic = Conic { control, weight: half.cos(), width: 1.0 };
            conic.width = conic.natural_width();
            conic
        };
        let before = [arc([0.0, 0.0], 1.0, -1.5, -0.4), arc([0.0, 0.0], 1.0, -0.4, 0.0)];
        let after = [arc([1.0, -2.0], 2.0, 1.5f64.atan2(0.0), 1.0), arc([1.0, -2.0], 2.0, 1.0, -0.5)];
        assert_bends_smoothly(before, after);
        // A line and an arc.
        let lines = [Conic::line([0.0, 1.0], [0.5, 0.5]), Conic::line([0.5, 0.5], [1.0, 0.0])];
        assert_bends_smoothly(lines, after);
    }

    fn assert_bends_smoothly<const M: usize>(before: [Conic<M>; 2], after: [Conic<M>; 2]) {
        let jump = jump_between(before[1], after[0]);
        let mut sides = Sides {
            before: before.map(PathPiece::from).to_vec(),
            after: after.map(PathPiece::from).to_vec(),
            made: CompositeCurve::default(),
        };
        let excess = sides.bend(&jump).unwrap();
        let all: Vec<_> = sides.before.iter().chain(&sides.after).collect();
        let pieces: Vec<Conic<M>> = all.iter().map(|piece| *conic(piece)).collect();
        assert_eq!(pieces[0].control[0], before[0].control[0]);
        assert_eq!(pieces[3].control[2], after[1].control[2]);
        assert_eq!(excess, all[1].deviation);
        for pair in pieces.windows(2) {
            assert!(norm(&sub(&pair[0].control[2], &pair[1].control[0])) < 1e-15);
            let (out, into) = (at(&pair[0], 1.0)[1], at(&pair[1], 0.0)[1]);
            assert!(norm(&sub(&out, &into)) < 1e-12, "{out:?} {into:?}");
        }
        // At the far end the direction is that of the side.
        let (bent, straight) = (at(&pieces[0], 0.0)[1], at(&before[0], 0.0)[1]);
        let cosine = dot(&bent, &straight) / (norm(&bent) * norm(&straight));
        assert!((cosine - 1.0).abs() < 1e-14);
        for ((bent, piece), straight) in pieces.iter().zip(&all).zip(before.iter().chain(&after)) {
            assert_eq!(bent.weight, straight.weight);
            for i in 0..=20 {
                let share = i as f64 / 20.0;
                let (a, b) = (at(bent, share)[0], at(straight, share)[0]);
                assert!(norm(&sub(&a, &b)) <= piece.deviation + 1e-14);
            }
        }
        let moved = sub(&pieces[1].control[2], &before[1].control[2]);
        assert!((norm(&moved) - all[1].deviation).abs() < 1e-14, "{moved:?} {}", all[1].deviation);
        assert!(dot(&moved, &jump.change) > 0.0);
    }
}
