//! A piece of any degree, polynomial or rational, by the steps of its control polygon.
//!
//! De Casteljau's algorithm on the steps d_i = P_(i+1) − P_i instead of the points. With the weights w, each level is
//! w_i ← (1 − t) w_i + t w_(i+1), τ_i = t w_(i+1) / (the new w_i), and
//!
//! ```text
//! d_i ← (1 − τ_i) d_i + τ_(i+1) d_(i+1)
//! ```
//!
//! So no digits are lost on short parts of a piece or far from the origin. The steps of the part up to t are the τ_0 d_0 of all
//! levels, and C'(t) = n w_0 w_1 d_0 / w², with d_0 of the last level (Floater 1992).

mod nearest;

use super::vectors::{length, vector_of};

/// Greatest degree.
pub const MOST: usize = 9;

/// A step shorter than this share of the longest step is only rounding.
const STILL: f64 = 1e-10;

/// The piece over t in [0, 1].
#[derive(Clone, Debug)]
pub struct Polygon<const M: usize> {
    pub start: [f64; M],
    pub end: [f64; M],
    degree: usize,
    steps: [[f64; M]; MOST],
    weights: [f64; MOST + 1],
    rational: bool,
}

/// A place of the piece: its vector from the start, and dC/dt.
#[derive(Clone, Copy, Debug)]
pub struct Local<const M: usize> {
    pub way: [f64; M],
    pub slope: [f64; M],
}

impl<const M: usize> Polygon<M> {
    /// From 2 to 10 control points, and as many positive weights or an empty slice.
    pub fn new(points: impl ExactSizeIterator<Item = [f64; M]>, weights: &[f64]) -> Self {
        let degree = (points.len() - 1).min(MOST);
        let (mut start, mut end) = ([0.0; M], [0.0; M]);
        let mut steps = [[0.0; M]; MOST];
        for (i, point) in points.take(degree + 1).enumerate() {
            if i == 0 {
                start = point;
            } else {
                steps[i - 1] = vector_of(|k| point[k] - end[k]);
            }
            end = point;
        }
        let mut own = [1.0; MOST + 1];
        let rational = weights.windows(2).any(|pair| pair[0] != pair[1]);
        if rational {
            for (own, weight) in own.iter_mut().zip(weights) {
                *own = *weight;
            }
        }
        Self { start, end, degree, steps, weights: own, rational }
    }

    pub fn degree(&self) -> usize {
        self.degree
    }

    pub fn is_rational(&self) -> bool {
        self.rational
    }

    /// The vectors from each control point to the next.
    pub fn steps(&self) -> &[[f64; M]] {
        &self.steps[..self.degree]
    }

    pub fn weights(&self) -> &[f64] {
        &self.weights[..=self.degree]
    }

    /// De Casteljau's algorithm at t: calls `level` for each level with its steps and weights, τ of the first step and 1 − τ of
    /// the last one.
    #[inline]
    fn levels(&self, t: f64, level: impl FnMut(&[[f64; M]], &[f64], [f64; 2])) {
        // Most pieces with weights have degree 2, for which filling longer arrays would take longer than the computation.
        match self.degree {
            0..=2 => self.levels_in::<2>(t, level),
            _ => self.levels_in::<MOST>(t, level),
        }
    }

    /// De Casteljau's algorithm at t, in arrays of N steps.
    #[inline]
    fn levels_in<const N: usize>(&self, t: f64, mut level: impl FnMut(&[[f64; M]], &[f64], [f64; 2])) {
        let s = 1.0 - t;
        let mut steps: [[f64; M]; N] = std::array::from_fn(|i| self.steps[i]);
        let (mut weights, mut next) = (self.weights, [1.0; N]);
        let mut tau = [[s, t]; N];
        for count in (1..=self.degree.min(N)).rev() {
            if self.rational {
                for i in 0..count {
                    let (a, b) = (s * weights[i], t * weights[i + 1]);
                    next[i] = a + b;
                    let per = 1.0 / next[i];
                    tau[i] = [a * per, b * per];
                }
            }
            level(&steps[..count], &weights[..=count], [tau[0][1], tau[count - 1][0]]);
            for i in 0..count - 1 {
                for k in 0..M {
                    steps[i][k] = tau[i][0] * steps[i][k] + tau[i + 1][1] * steps[i + 1][k];
                }
            }
            if self.rational {
                weights[..count].copy_from_slice(&next[..count]);
            }
        }
    }

    /// The place at t.
    #[inline]
    pub fn local(&self, t: f64) -> Local<M> {
        let (mut way, mut slope) = ([0.0; M], [0.0; M]);
        let degree = self.degree as f64;
        self.levels(t, |steps, weights, [first, _]| {
            for k in 0..M {
                way[k] += first * steps[0][k];
            }
            if steps.len() == 1 {
                let weight = (1.0 - t) * weights[0] + t * weights[1];
                let scale =
                    if self.rational { degree * weights[0] * weights[1] / (weight * weight) } else { degree };
                for k in 0..M {
                    slope[k] = scale * steps[0][k];
                }
            }
        });
        Local { way, slope }
    }

    /// C(t).
    pub fn at(&self, t: f64) -> [f64; M] {
        if t >= 1.0 {
            return self.end;
        }
        let way = self.local(t).way;
        std::array::from_fn(|k| self.start[k] + way[k])
    }

    /// The part from the start to t, and the part from t to the end.
    pub fn split(&self, t: f64) -> [Self; 2] {
        let (mut left, mut right) = (self.clone(), self.clone());
        let degree = self.degree;
        let s = 1.0 - t;
        self.levels(t, |steps, weights, [first, last]| {
            let count = steps.len();
            left.steps[degree - count] = steps[0].map(|step| first * step);
            right.steps[count - 1] = steps[count - 1].map(|step| last * step);
            left.weights[degree - count + 1] = s * weights[0] + t * weights[1];
            right.weights[count - 1] = s * weights[count - 1] + t * weights[count];
        });
        let middle = self.at(t);
        (left.end, right.start) = (middle, middle);
        [left, right]
    }

    /// The part of the piece that begins at t = `from` and is `share` long in t.
    pub fn part(&self, from: f64, share: f64) -> Self {
        let mut rest = if from > 0.0 { self.split(from)[1].clone() } else { self.clone() };
        let length = share / (1.0 - from);
        if length < 1.0 {
            return rest.split(length)[0].clone();
        }
        // For a very short part at the end, rounding may make `length` exceed 1: the steps are scaled, so that its length is as
        // requested.
        for step in &mut rest.steps[..self.degree] {
            *step = step.map(|value| value * length);
        }
        rest
    }

    /// The same piece from its end to its start.
    pub fn reversed(&self) -> Self {
        let mut other = self.clone();
        (other.start, other.end) = (self.end, self.start);
        for i in 0..self.degree {
            other.steps[i] = self.steps[self.degree - 1 - i].map(|step| -step);
        }
        for i in 0..=self.degree {
            other.weights[i] = self.weights[self.degree - i];
        }
        other
    }

    /// Factor by which rounding errors of the control points are amplified in dC/dt.
    pub fn slope_scale(&self) -> f64 {
        let weights = &self.weights[..=self.degree];
        let most = weights.iter().fold(0.0_f64, |most, w| most.max(*w));
        let least = weights.iter().fold(f64::INFINITY, |least, w| least.min(*w));
        let degree = self.degree as f64;
        degree * f64::max(1.0, 0.5 * degree) * most / least
    }

    /// Unit vector of the direction of motion at the start, also where C' = 0 there.
    pub fn direction(&self) -> [f64; M] {
        first_direction(self.steps[..self.degree].iter())
    }

    /// Unit vector of the direction of motion at the end, also where C' = 0 there.
    pub fn end_direction(&self) -> [f64; M] {
        first_direction(self.steps[..self.degree].iter().rev())
    }

    /// Greatest coordinate of the two ends.
    pub fn magnitude(&self) -> f64 {
        self.start.iter().chain(&self.end).fold(0.0, |most, q| q.abs().max(most))
    }

    /// Least and greatest position of an axis on the piece, found among equally spaced places and refined by ternary search.
    pub fn extremes(&self, axis: usize) -> [f64; 2] {
        let count = 8 * self.degree;
        let place = |i: usize| i as f64 / count as f64;
        let values: Vec<f64> = (0..=count).map(|i| self.at(place(i))[axis]).collect();
        [-1.0, 1.0].map(|sign: f64| {
            let better = |a: &usize, b: &usize| (sign * values[*a]).total_cmp(&(sign * values[*b]));
            let best = (0..=count).max_by(better).unwrap_or(0);
            let (mut a, mut b) = (place(best.saturating_sub(1)), place((best + 1).min(count)));
            for _ in 0..60 {
                let third = (b - a) / 3.0;
                let [left, right] = [a + third, b - third].map(|t| sign * self.at(t)[axis]);
                if left < right {
                    a += third;
                } else {
                    b -= third;
                }
            }
            let inside = self.at(0.5 * (a + b))[axis];
            if sign * inside > sign * values[best] {
                inside
            } else {
                values[best]
            }
        })
    }

    /// The vector from the start to the end.
    pub fn chord(&self) -> [f64; M] {
        let mut chord = [0.0; M];
        for step in &self.steps[..self.degree] {
            for k in 0..M {
                chord[k] += step[k];
            }
        }
        chord
    }

    /// The length of the control polygon.
    pub fn way(&self) -> f64 {
        self.steps[..self.degree].iter().map(length).sum()
    }
}

/// Unit vector of the first step that is more than rounding; 0 if there is none.
fn first_direction<'a, const M: usize>(mut steps: impl Iterator<Item = &'a [f64; M]> + Clone) -> [f64; M] {
    let longest = steps.clone().map(length).fold(0.0, f64::max);
    let step = steps.find(|step| length(step) > STILL * longest);
    step.map_or([0.0; M], |step| {
        let length = length(step);
        step.map(|d| d / length)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::distance;

    /// A quarter of a circle of radius 10 about (1000, 0).
    fn quarter() -> Polygon<2> {
        let points = [[1010.0, 0.0], [1010.0, 10.0], [1000.0, 10.0]];
        Polygon::new(points.into_iter(), &[1.0, 0.5_f64.sqrt(), 1.0])
    }

    fn cubic() -> Polygon<2> {
        Polygon::new([[0.0, 0.0], [1.0, 3.0], [4.0, -2.0], [5.0, 1.0]].into_iter(), &[])
    }

    #[test]
    fn a_rational_quarter_is_a_circle_everywhere() {
        let quarter = quarter();
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let [x, y] = quarter.at(t);
            assert!(((x - 1000.0).hypot(y) - 10.0).abs() < 3e-13, "t = {t}");
            let slope = quarter.local(t).slope;
            assert!(((x - 1000.0) * slope[0] + y * slope[1]).abs() < 1e-10);
        }
    }

    #[test]
    fn slopes_are_difference_quotients_and_parts_are_the_piece() {
        for polygon in [quarter(), cubic()] {
            for t in [0.1, 0.5, 0.83] {
                let (before, after) = (polygon.at(t - 1e-6), polygon.at(t + 1e-6));
                let slope = polygon.local(t).slope;
                for k in 0..2 {
                    assert!((slope[k] - (after[k] - before[k]) / 2e-6).abs() < 1e-6);
                }
                let part = polygon.part(0.3, 0.4);
                assert!(distance(&part.at(t), &polygon.at(0.3 + 0.4 * t)) < 1e-12);
                let back = part.reversed();
                assert!(distance(&back.at(1.0 - t), &part.at(t)) < 1e-12);
            }
        }
    }

    #[test]
    fn a_sliver_at_the_end_is_as_long_as_was_asked() {
        for polygon in [quarter(), cubic()] {
            let (from, share) = (1.0 - 6e-11, 6.00001e-11);
            let slope = polygon.part(from, share).local(1.0).slope;
            let whole = polygon.local(1.0).slope;
            for k in 0..2 {
                assert!((slope[k] / share - whole[k]).abs() < 1e-8, "{slope:?} {whole:?}");
            }
        }
    }

    #[test]
    fn the_extremes_of_an_axis_lie_inside() {
        // y of the cubic: 9t − 24t² + 16t³ turns at 1/4 and 3/4.
        let [least, most] = cubic().extremes(1);
        assert!((most - 1.0).abs() < 1e-12 && least.abs() < 1e-12);
        assert_eq!(quarter().extremes(0), [1000.0, 1010.0]);
    }

    #[test]
    fn a_piece_that_starts_at_rest_has_the_direction_of_its_first_motion() {
        let polygon = Polygon::new([[1.0, 1.0], [1.0, 1.0], [4.0, 5.0]].into_iter(), &[]);
        assert_eq!(polygon.direction(), [0.6, 0.8]);
    }
}
