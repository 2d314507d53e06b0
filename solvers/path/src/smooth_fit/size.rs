//! The greatest length h of an interval of the spline at each place of the polyline, and the knots that follow from it.
//!
//! ```text
//! h(u)  the largest w with w · angle(V − P(u − w), P(u + w) − V) ≤ C ε, w growing by 1.5
//! ```
//!
//! V is a vertex and P(u) the polyline. Over the length of an interval the polyline therefore deviates from a straight line by no
//! more than a few tolerances, and noise below the tolerance does not shorten intervals. Neighbouring intervals differ little:
//! |h'| ≤ GRADE.

use super::polyline::{is_within, Polyline};
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::quadratic::sub;

/// C: the turn over an interval times its length, in tolerances.
const TURN: f64 = 6.0;
/// The greatest |h'|.
const GRADE: f64 = 0.25;
/// The least h, in tolerances, however sharp the turn.
const LEAST: f64 = 0.5;
const GROWTH: f64 = 1.5;
/// The greatest interval, in parts of the length above which a chord is long.
const GREATEST: f64 = 0.8;
/// The greatest interval in a long chord, in parts of that chord: enough intervals lie in its middle to make it straight.
const SHARE: f64 = 0.05;
/// The least number of intervals of a run.
const FEWEST: usize = 4;

/// The knots of a run from 0 to its length; chords longer than `long` have several intervals.
pub fn knots<const D: usize>(line: &Polyline<D>, long: f64) -> Vec<f64> {
    let greatest = GREATEST * long;
    let h = sizes(line, greatest);
    let grades: Vec<Grade> = (0..line.chords())
        .map(|i| {
            let length = line.chord_length(i);
            let most = if length > long { SHARE * length } else { greatest };
            Grade::new(length, [h[i], h[i + 1]].map(|h| h.min(most)), most)
        })
        .collect();
    let total: f64 = grades.iter().map(Grade::total).sum();
    let count = (total.ceil() as usize).max(FEWEST);
    let mut knots = Vec::with_capacity(count + 1);
    let (mut chord, mut before) = (0, 0.0);
    knots.push(0.0);
    for k in 1..count {
        let aim = total * k as f64 / count as f64;
        while chord + 1 < grades.len() && before + grades[chord].total() < aim {
            before += grades[chord].total();
            chord += 1;
        }
        knots.push(line.station[chord] + grades[chord].place(aim - before));
    }
    knots.push(line.length());
    // Where coordinates are large compared with the tolerance, rounding may make neighbouring knots equal.
    knots.dedup_by(|b, a| *b <= *a);
    knots
}

/// h along a chord and the integral of 1/h: h rises with slope GRADE, is constant at its peak and falls with slope GRADE.
struct Grade {
    length: f64,
    start: f64,
    end: f64,
    peak: f64,
    /// The integral of 1/h over each of these three parts.
    parts: [f64; 3],
}

impl Grade {
    fn new(length: f64, [start, end]: [f64; 2], most: f64) -> Self {
        let crossing = 0.5 * (start + end + GRADE * length);
        let peak = crossing.min(most).max(start).max(end);
        let flat = (length - (peak - start) / GRADE - (peak - end) / GRADE).max(0.0);
        let parts = [(peak / start).natural_log() / GRADE, flat / peak, (peak / end).natural_log() / GRADE];
        Self { length, start, end, peak, parts }
    }

    fn total(&self) -> f64 {
        self.parts.iter().sum()
    }

    /// The distance from the start of the chord at which the integral of 1/h reaches `value`.
    fn place(&self, value: f64) -> f64 {
        let [rise, flat, _] = self.parts;
        let s = if value <= rise {
            self.start * (GRADE * value).exponential_less_1() / GRADE
        } else if value <= rise + flat {
            (self.peak - self.start) / GRADE + (value - rise) * self.peak
        } else {
            self.length - self.end * (GRADE * (self.total() - value)).exponential_less_1() / GRADE
        };
        s.clamp(0.0, self.length)
    }
}

/// h at every vertex.
fn sizes<const D: usize>(line: &Polyline<D>, greatest: f64) -> Vec<f64> {
    let count = line.vertex.len();
    let epsilon: Vec<f64> = (0..count).map(|i| line.tolerance_at(i)).collect();
    let least = epsilon.iter().fold(f64::INFINITY, |a: f64, &b| a.min(b));
    let mut h: Vec<f64> = epsilon.iter().map(|&e| (LEAST * e).min(greatest)).collect();
    let mut open: Vec<u32> = (1..count as u32 - 1).collect();
    let mut w = LEAST * least * GROWTH;
    // The polyline does not turn at its ends.
    (h[0], h[count - 1]) = (greatest, greatest);
    while !open.is_empty() && w < GROWTH * greatest {
        let (mut a, mut b) = (0, 0);
        open.retain(|&vertex| {
            let i = vertex as usize;
            let (low, high) = ((line.station[i] - w).max(0.0), (line.station[i] + w).min(line.length()));
            while line.station[a + 1] < low {
                a += 1;
            }
            while b + 1 < line.chords() && line.station[b + 1] < high {
                b += 1;
            }
            let back = sub(&line.vertex[i], &line.point(a, low));
            let ahead = sub(&line.point(b, high), &line.vertex[i]);
            let straight = is_within(&back, &ahead, TURN * epsilon[i] / w);
            if straight {
                h[i] = h[i].max(w.min(greatest));
            }
            straight
        });
        w *= GROWTH;
    }
    for i in 1..count {
        h[i] = h[i].min(h[i - 1] + GRADE * line.chord_length(i - 1));
    }
    for i in (0..count - 1).rev() {
        h[i] = h[i].min(h[i + 1] + GRADE * line.chord_length(i));
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_90_degrees_has_short_intervals_and_a_line_long_ones() {
        let elbow = Polyline::new(vec![[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]], vec![0.1; 2]);
        let h = sizes(&elbow, 4.0);
        // 0.05 · 1.5⁵ = 0.380 ≤ 6 · 0.1 / (π/2) = 0.382
        assert!((h[1] - 0.05 * 1.5f64.powi(5)).abs() < 1e-12);
        assert_eq!((h[0], h[2]), (4.0, 4.0));
        let knots = knots(&elbow, 5.0);
        assert!(knots.windows(2).all(|pair| pair[1] > pair[0] && pair[1] - pair[0] < 1.1));
        assert_eq!((knots[0], knots[knots.len() - 1]), (0.0, 40.0));
        assert!(knots.len() > 40 && knots.len() < 50, "{}", knots.len());
    }

    #[test]
    fn noise_below_the_tolerance_does_not_shorten_intervals() {
        let points = (0..400).map(|i| [0.1 * i as f64, if i % 2 == 0 { 0.0 } else { 0.01 }]).collect();
        let h = sizes(&Polyline::new(points, vec![0.1; 399]), 4.0);
        assert!(h.iter().all(|&h| h > 2.0), "{h:?}");
    }
}
