//! A rigorous bound of the distance between one step of the spline and its chords, both ways, by convex hulls.
//!
//! The curve is cut at a foot point of each vertex, in order, and at the knot.
//!
//! * From curve to polygon: the distance to a segment is convex, so each part of the curve is at most as far from its chord
//!   as the farthest of its three control points.
//! * From polygon to curve: the part starts within |C(x_k) − P_k| of one end of the chord and ends within |C(x_{k+1}) − P_{k+1}|
//!   of the other, so by continuity each point of the chord is within the greatest of these and the part's bound.
//!
//! A part whose bound exceeds the tolerance is halved, which makes the bound sharper.

use feedplan_geometry::quadratic::{dot, lerp, sub, Segment};

/// The component of C' along the step is at least this fraction of its mean, so that C' neither vanishes nor turns back.
const PROGRESS: f64 = 0.1;
/// The greatest number of halvings of a part. Each one makes the excess of the bound four times smaller.
const HALVINGS: u32 = 3;

/// The spline between two adjacent features: C on [0, h], two quadratics that meet at h/2.
#[derive(Clone, Copy, Debug)]
pub struct Step<const M: usize> {
    pub start: [f64; M],
    pub end: [f64; M],
    pub width: f64,
    /// C' at 0, h/2 and h, linear between.
    pub tangent: [[f64; M]; 3],
}

/// The bound of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepBound {
    /// The bound on each of the two halves, in mm.
    pub deviation: [f64; 2],
    /// The chord at the knot.
    pub knot_chord: usize,
    /// The worst place that is out of tolerance.
    pub defect: Option<Defect>,
}

/// Why a step is out of tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// This point is too far from the curve.
    Point(usize),
    /// The curve is too far from this chord.
    Chord(usize),
    /// C' turns away from the direction of the step.
    Direction,
}

/// One of the two quadratics of a step, in powers about its feature: C(x) = origin + slope y + bend y², y = x − shift.
struct Half<const M: usize> {
    origin: [f64; M],
    slope: [f64; M],
    bend: [f64; M],
    shift: f64,
}

impl<const M: usize> Half<M> {
    #[inline(always)]
    fn point(&self, x: f64) -> [f64; M] {
        let y = x - self.shift;
        std::array::from_fn(|k| self.origin[k] + y * (self.slope[k] + y * self.bend[k]))
    }

    /// The middle control point of the part on [a, b].
    #[inline(always)]
    fn control(&self, a: f64, b: f64) -> [f64; M] {
        let (a, b) = (a - self.shift, b - self.shift);
        let (mean, product) = (0.5 * (a + b), a * b);
        std::array::from_fn(|k| self.origin[k] + mean * self.slope[k] + product * self.bend[k])
    }
}

impl<const M: usize> Step<M> {
    /// C at the knot, as the mean of its values from both sides.
    pub fn knot(&self) -> [f64; M] {
        let [m0, s, m1] = &self.tangent;
        let quarter = 0.25 * self.width;
        std::array::from_fn(|k| {
            0.5 * ((self.start[k] + quarter * (m0[k] + s[k])) + (self.end[k] - quarter * (m1[k] + s[k])))
        })
    }

    fn halves(&self) -> [Half<M>; 2] {
        let [m0, s, m1] = &self.tangent;
        [
            Half {
                origin: self.start,
                slope: *m0,
                bend: std::array::from_fn(|k| (s[k] - m0[k]) / self.width),
                shift: 0.0,
            },
            Half {
                origin: self.end,
                slope: *m1,
                bend: std::array::from_fn(|k| (m1[k] - s[k]) / self.width),
                shift: self.width,
            },
        ]
    }

    /// The bound of the distance, both ways, between the step and the chords from point `a` at its start to point `b` at its end.
    pub fn certify(
        &self,
        points: &[[f64; M]],
        along: &[f64],
        a: usize,
        b: usize,
        tolerance: f64,
    ) -> StepBound {
        let chord = sub(&self.end, &self.start);
        let least = PROGRESS * dot(&chord, &chord) / self.width;
        // The negation also catches NaN.
        if !(least > 0.0 && self.tangent.iter().all(|tangent| dot(tangent, &chord) >= least)) {
            return StepBound {
                deviation: [f64::INFINITY; 2],
                knot_chord: a,
                defect: Some(Defect::Direction),
            };
        }
        let halves = self.halves();
        let (middle, tolerance_sq) = (0.5 * self.width, tolerance * tolerance);
        let scale = self.width / (along[b] - along[a]);
        let (mut worst, mut defect) = (tolerance_sq, None);
        let mut bound_sq = [0.0_f64; 2];
        let mut knot_chord = None;
        let gap_sq = |p: &[f64; M], q: &[f64; M]| {
            let gap = sub(p, q);
            dot(&gap, &gap)
        };
        let (mut x, mut off_sq) = (0.0, gap_sq(&self.start, &points[a]));
        for k in a..b {
            let (next, next_off_sq) = match k + 1 == b {
                true => (self.width, gap_sq(&self.end, &points[b])),
                false => {
                    self.foot(&halves, &points[k + 1], scale * (along[k + 1] - along[a]), x, tolerance_sq)
                }
            };
            if next_off_sq > worst {
                (worst, defect) = (next_off_sq, Some(Defect::Point(k + 1)));
            }
            let segment = Segment::new(&points[k], &points[k + 1]);
            let before = usize::from(x >= middle);
            if knot_chord.is_none() && next >= middle {
                knot_chord = Some(k);
            }
            let part_sq = if before == 1 || next <= middle {
                let half = &halves[before];
                let part = part_bound_sq(half, x, next, &segment, tolerance_sq);
                bound_sq[before] = bound_sq[before].max(part).max(off_sq).max(next_off_sq);
                part
            } else {
                let at_knot = segment.distance_sq(&halves[0].point(middle));
                let left = part_bound_sq(&halves[0], x, middle, &segment, tolerance_sq).max(at_knot);
                let right = part_bound_sq(&halves[1], middle, next, &segment, tolerance_sq).max(at_knot);
                bound_sq[0] = bound_sq[0].max(left).max(off_sq);
                bound_sq[1] = bound_sq[1].max(right).max(next_off_sq);
                left.max(right)
            };
            if part_sq > worst {
                (worst, defect) = (part_sq, Some(Defect::Chord(k)));
            }
            (x, off_sq) = (next, next_off_sq);
        }
        StepBound {
            deviation: [bound_sq[0].sqrt(), bound_sq[1].sqrt()],
            knot_chord: knot_chord.unwrap_or(b - 1),
            defect,
        }
    }

    /// A parameter not before `from` where the curve is near `p`, by Newton's method from `guess` until the squared distance is
    /// at most `enough_sq`; and that squared distance.
    #[inline(always)]
    fn foot(&self, halves: &[Half<M>; 2], p: &[f64; M], guess: f64, from: f64, enough_sq: f64) -> (f64, f64) {
        let middle = 0.5 * self.width;
        let mut x = guess.max(from);
        for _ in 0..4 {
            let half = &halves[usize::from(x >= middle)];
            let y = x - half.shift;
            let tangent: [f64; M] = std::array::from_fn(|k| half.slope[k] + 2.0 * y * half.bend[k]);
            let rest = sub(p, &half.point(x));
            let next = (x + dot(&rest, &tangent) / dot(&tangent, &tangent)).clamp(from, self.width);
            let same = (next >= middle) == (x >= middle);
            let d = next - x;
            x = next;
            if same {
                let off: [f64; M] = std::array::from_fn(|k| rest[k] - d * (tangent[k] + d * half.bend[k]));
                let off_sq = dot(&off, &off);
                if off_sq <= enough_sq {
                    return (x, off_sq);
                }
            }
        }
        let off = sub(p, &halves[usize::from(x >= middle)].point(x));
        (x, dot(&off, &off))
    }
}

/// Bound of the squared distance from the part on [x0, x1] to the segment; the distances of its two end points are not included.
#[inline(always)]
fn part_bound_sq<const M: usize>(
    half: &Half<M>,
    x0: f64,
    x1: f64,
    segment: &Segment<M>,
    enough_sq: f64,
) -> f64 {
    let middle = half.control(x0, x1);
    let bound_sq = segment.distance_sq(&middle);
    if bound_sq <= enough_sq {
        return bound_sq;
    }
    sharpen(segment, &half.point(x0), &middle, &half.point(x1), enough_sq, HALVINGS - 1)
}

#[cold]
#[inline(never)]
fn sharpen<const M: usize>(
    segment: &Segment<M>,
    a: &[f64; M],
    b: &[f64; M],
    c: &[f64; M],
    enough_sq: f64,
    halvings: u32,
) -> f64 {
    let (left, right) = (lerp(a, b, 0.5), lerp(b, c, 0.5));
    let middle = lerp(&left, &right, 0.5);
    let side = |a: &[f64; M], b: &[f64; M], c: &[f64; M]| {
        let bound_sq = segment.distance_sq(b);
        match bound_sq <= enough_sq || halvings == 0 {
            true => bound_sq,
            false => sharpen(segment, a, b, c, enough_sq, halvings - 1),
        }
    };
    segment.distance_sq(&middle).max(side(a, &left, &middle)).max(side(&middle, &right, c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::spline::{interpolate, EndCondition};
    use feedplan_geometry::quadratic::norm;
    use proptest::prelude::*;

    /// The step on [0, 1] from (0, 0) to (1, 0) that leaves and arrives at the given slopes.
    fn step(start: f64, end: f64) -> Step<2> {
        let features = [[0.0, 0.0], [1.0, 0.0]];
        let spline =
            interpolate(&features, EndCondition::Tangent([1.0, start]), EndCondition::Tangent([1.0, end]));
        Step {
            start: features[0],
            end: features[1],
            width: spline.step[0],
            tangent: [spline.tangent[0], spline.slope[0], spline.tangent[1]],
        }
    }

    /// Greatest distance from dense points of the curve to the chords, and from dense points of the chords to
    /// the curve.
    fn sampled(step: &Step<2>, points: &[[f64; 2]]) -> (f64, f64) {
        let halves = step.halves();
        let curve: Vec<[f64; 2]> = (0..=4000)
            .map(|i| halves[usize::from(i >= 2000)].point(step.width * i as f64 / 4000.0))
            .collect();
        let to_chords = |p: &[f64; 2]| {
            points.windows(2).map(|c| Segment::new(&c[0], &c[1]).distance_sq(p)).fold(f64::INFINITY, f64::min)
        };
        let to_curve = |p: &[f64; 2]| curve.iter().map(|c| norm(&sub(p, c))).fold(f64::INFINITY, f64::min);
        let chords = points.windows(2).flat_map(|c| (0..=20).map(|i| lerp(&c[0], &c[1], i as f64 / 20.0)));
        (
            curve.iter().map(to_chords).fold(0.0, f64::max).sqrt(),
            chords.map(|p| to_curve(&p)).fold(0.0, f64::max),
        )
    }

    #[test]
    fn a_straight_step_is_as_far_from_a_bump_as_the_bump_is_high() {
        let points = [[0.0, 0.0], [0.5, 0.1], [1.0, 0.0]];
        let along = [0.0, 0.51, 1.02];
        let verdict = step(0.0, 0.0).certify(&points, &along, 0, 2, 0.2);
        assert_eq!(verdict.defect, None);
        for deviation in verdict.deviation {
            assert!((deviation - 0.1).abs() < 1e-9, "{deviation}");
        }
        assert_eq!(step(0.0, 0.0).certify(&points, &along, 0, 2, 0.09).defect, Some(Defect::Point(1)));
    }

    #[test]
    fn a_bulge_over_a_chord_is_the_fault_of_the_chord() {
        // The bulge of slopes ±0.4 over a chord of 1 is 0.1.
        let arch = step(0.4, -0.4);
        let (points, along) = ([[0.0, 0.0], [1.0, 0.0]], [0.0, 1.0]);
        assert!((arch.knot()[1] - 0.1).abs() < 1e-15);
        let verdict = arch.certify(&points, &along, 0, 1, 0.101);
        assert_eq!(verdict.defect, None);
        assert!(verdict.deviation[0] >= 0.1 - 1e-15 && verdict.deviation[0] <= 0.101);
        assert_eq!(arch.certify(&points, &along, 0, 1, 0.099).defect, Some(Defect::Chord(0)));
    }

    #[test]
    fn a_step_that_starts_backwards_is_refused() {
        let mut back = step(0.0, 0.0);
        back.tangent[0] = [-0.2, 0.0];
        assert_eq!(
            back.certify(&[[0.0, 0.0], [1.0, 0.0]], &[0.0, 1.0], 0, 1, 10.0).defect,
            Some(Defect::Direction)
        );
        back.tangent[0] = [f64::NAN, 0.0];
        assert_eq!(
            back.certify(&[[0.0, 0.0], [1.0, 0.0]], &[0.0, 1.0], 0, 1, 10.0).defect,
            Some(Defect::Direction)
        );
    }

    proptest! {
        #[test]
        fn the_bound_holds_both_ways(
            slopes in (-1.0..1.0, -1.0..1.0),
            inner in proptest::collection::vec((0.02..0.98, -0.2..0.2), 0..8),
        ) {
            let step = step(slopes.0, slopes.1);
            let mut inner: Vec<(f64, f64)> = inner;
            inner.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut points = vec![[0.0, 0.0]];
            points.extend(inner.iter().map(|&(x, y)| [x, y]));
            points.push([1.0, 0.0]);
            let mut along = vec![0.0];
            for pair in points.windows(2) {
                along.push(along[along.len() - 1] + norm(&sub(&pair[1], &pair[0])));
            }
            let last = points.len() - 1;
            let verdict = step.certify(&points, &along, 0, last, 0.05);
            let bound = verdict.deviation[0].max(verdict.deviation[1]);
            let (curve, chords) = sampled(&step, &points);
            prop_assert!(curve <= bound + 1e-12, "{curve} {bound}");
            prop_assert!(chords <= bound + 1e-6, "{chords} {bound}");
            prop_assert_eq!(verdict.defect.is_none(), bound <= 0.05 + 1e-15);
        }
    }
}
