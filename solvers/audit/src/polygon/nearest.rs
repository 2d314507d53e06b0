//! Finds the first or all local minima of the distance of a point from a piece: cuts the piece into nearly straight parts, and
//! solves (C − q)·C' = 0 on each by Newton's method with bisection.

use super::{Local, Polygon};
use crate::number::inner;
use crate::vectors::{distance, length};

/// Greatest depth of halving a piece until its parts are nearly straight: in a sharp turn, the distance from a place that is
/// passed twice falls, rises and falls again. Parts shorter than `SHORT` mm, or than the share `ROUNDING` of the whole, are not
/// halved.
const MOST_HALVINGS: u32 = 30;
const SHORT: f64 = 1e-7;
const ROUNDING: f64 = 1e-12;

/// Cosine of the greatest angle between the steps of a nearly straight part and its chord.
const NEARLY_STRAIGHT: f64 = 0.9;

/// A Newton step below this share of the piece is the last one: the error after it is about its square. Also the distance in mm
/// up to which `q` counts as on the piece.
const CLOSE: f64 = 1e-7;

/// Limit of the steps towards a local minimum; bisection alone needs some 55.
const MOST_STEPS: usize = 100;

impl<const M: usize> Polygon<M> {
    /// Calls `each` with the ends of consecutive, nearly straight parts of [from, 1], until it returns false.
    fn straight_parts(&self, from: f64, each: &mut impl FnMut(f64, f64) -> bool) {
        if from >= 1.0 {
            return;
        }
        let rest = if from > 0.0 { &self.split(from)[1] } else { self };
        rest.straight_halves([from, 1.0], 0, SHORT.max(ROUNDING * rest.way()), each);
    }

    fn straight_halves(
        &self,
        [from, to]: [f64; 2],
        depth: u32,
        short: f64,
        each: &mut impl FnMut(f64, f64) -> bool,
    ) -> bool {
        // NaN and infinite values are not halved further.
        let halves = depth < MOST_HALVINGS && self.way() > short && !self.is_nearly_straight();
        if !halves {
            return each(from, to);
        }
        let [left, right] = self.split(0.5);
        let middle = 0.5 * (from + to);
        left.straight_halves([from, middle], depth + 1, short, each)
            && right.straight_halves([middle, to], depth + 1, short, each)
    }

    fn is_nearly_straight(&self) -> bool {
        if self.degree == 1 {
            return true;
        }
        let chord = self.chord();
        let size = NEARLY_STRAIGHT * length(&chord);
        self.steps[..self.degree].iter().all(|step| inner(step, &chord) >= size * length(step))
    }

    /// (C − q)·C' and |C'|² at t, both up to the same factor. At both ends the direction of motion replaces C', since where C'
    /// vanishes only rounding errors remain of it.
    fn fall(&self, q: &[f64; M], t: f64) -> [f64; 2] {
        let Local { way, slope } = self.local(t);
        let (along, square) = if t <= 0.0 {
            (self.direction(), length(&slope))
        } else if t >= 1.0 {
            (self.end_direction(), length(&slope))
        } else {
            (slope, inner(&slope, &slope))
        };
        let mut fall = 0.0;
        for k in 0..M {
            fall += (self.start[k] - q[k] + way[k]) * along[k];
        }
        [fall, square]
    }

    /// The minimum between `a`, where the distance falls, and `b`, where it does not: Newton steps as on a straight piece, and
    /// bisection where they leave the bracket or do not shrink.
    fn minimum(&self, q: &[f64; M], mut a: f64, mut b: f64) -> f64 {
        let mut t = a;
        let mut last = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let [fall, square] = self.fall(q, t);
            if fall < 0.0 {
                a = t;
            } else {
                b = t;
            }
            let newton = t - fall / square;
            let step = (newton - t).abs();
            if newton >= a && newton <= b && step < 0.5 * last {
                last = step;
                // Where `q` is off the piece, the steps shrink only by a constant factor.
                if step <= CLOSE * CLOSE || (step <= CLOSE && distance(q, &self.at(newton)) <= CLOSE) {
                    return newton;
                }
                t = newton;
            } else {
                last = f64::INFINITY;
                t = 0.5 * (a + b);
                if t <= a || t >= b {
                    break;
                }
            }
        }
        t
    }

    /// The first local minimum of the distance from `q` at or after `from`, and whether the distance still falls at the end.
    pub fn first_minimum(&self, q: &[f64; M], from: f64) -> (f64, bool) {
        if self.fall(q, from)[0] >= 0.0 {
            return (from, false);
        }
        let mut found = (1.0, true);
        self.straight_parts(from, &mut |a, b| {
            if self.fall(q, b)[0] >= 0.0 {
                found = (self.minimum(q, a, b), false);
            }
            found.1
        });
        found
    }

    /// Calls `found` with `from`, with the local minima of the distance from `q` after it, and with the end.
    ///
    /// It finds all minima that matter for a `q` beside the curve. A `q` beyond the centres of curvature can have several minima
    /// on one nearly straight part, of which one is found: then the distance may be too great, but never too small.
    pub fn all_minima(&self, q: &[f64; M], from: f64, found: &mut impl FnMut(f64)) {
        found(from);
        let mut falls = self.fall(q, from)[0] < 0.0;
        self.straight_parts(from, &mut |a, b| {
            let falls_on = self.fall(q, b)[0] < 0.0;
            if falls && !falls_on {
                found(self.minimum(q, a, b));
            }
            falls = falls_on;
            true
        });
        found(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_place_before_a_sharp_turn_is_found_before_it() {
        // x = (t − 1/3)², with a y that keeps it from standing still.
        let piece = Polygon::new([[1.0 / 9.0, 0.0], [-2.0 / 9.0, 5e-7], [4.0 / 9.0, 1e-6]].into_iter(), &[]);
        for before in [1e-3, 7e-3, 0.1] {
            let q = piece.at(1.0 / 3.0 - before);
            let (t, falls_on) = piece.first_minimum(&q, 0.1);
            assert!(!falls_on && (t - (1.0 / 3.0 - before)).abs() < 1e-6, "{before}: {t}");
        }
    }

    #[test]
    fn what_is_not_a_number_ends_the_search() {
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            let piece = Polygon::new([[0.0, 0.0], [bad, 3.0], [4.0, -2.0], [5.0, -bad]].into_iter(), &[]);
            let mut found = 0;
            piece.all_minima(&[1.0, 1.0], 0.0, &mut |_| found += 1);
            assert!(found < 100, "{bad}: {found}");
        }
    }

    #[test]
    fn from_a_start_at_rest_the_next_place_is_ahead() {
        // Rounding may leave a first step back.
        for step in [0.0, -1e-16] {
            let piece = Polygon::new([[0.0, 0.0], [step, 0.0], [1.0, 0.0], [3.0, 0.0]].into_iter(), &[]);
            for x in [1e-9, 0.01, 2.0] {
                let (t, falls_on) = piece.first_minimum(&[x, 0.0], 0.0);
                assert!(!falls_on && (piece.at(t)[0] - x).abs() < 1e-13, "{x}: {t}");
                let mut nearest = f64::INFINITY;
                piece.all_minima(&[x, 0.0], 0.0, &mut |t| nearest = nearest.min((piece.at(t)[0] - x).abs()));
                assert!(nearest < 1e-13, "{x}: {nearest}");
            }
            assert_eq!(piece.first_minimum(&[-1.0, 0.0], 0.0), (0.0, false));
            let back = piece.reversed();
            let (t, falls_on) = back.first_minimum(&[1e-9, 0.0], 0.9);
            assert!(!falls_on && (1.0 - 1e-4..1.0).contains(&t), "{t}");
        }
    }

    proptest! {
        #[test]
        fn no_place_is_nearer_than_the_nearest_minimum_beside_the_curve(
            c in prop::array::uniform10(-2.0..2.0_f64),
            w in prop::array::uniform5(0.1..10.0_f64),
            off in prop::array::uniform2(-0.05..0.05_f64),
            t in 0.0..1.0_f64,
            rational: bool,
        ) {
            let points: [[f64; 2]; 5] = std::array::from_fn(|i| [c[2 * i], c[2 * i + 1]]);
            let polygon = Polygon::new(points.into_iter(), if rational { &w } else { &[] });
            let on = polygon.at(t);
            let q = [on[0] + off[0], on[1] + off[1]];
            let dense =
                (0..=4000).map(|i| distance(&q, &polygon.at(f64::from(i) / 4000.0))).fold(f64::INFINITY, f64::min);
            let mut nearest = f64::INFINITY;
            polygon.all_minima(&q, 0.0, &mut |t| nearest = nearest.min(distance(&q, &polygon.at(t))));
            prop_assert!(nearest <= dense + 1e-9);
        }
    }
}
