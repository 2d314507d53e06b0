//! The weights with which the vertices of bends, away from corners, pull the curve to them, so that bends keep their size.
//!
//! With the least energy alone, the curve would move every bend towards its centre by the whole tolerance, and holes and bosses
//! would come out too small. Therefore the vertices V_i of bends add a term to the energy:
//!
//! ```text
//! ∫ |C'''|² du + Σ (l_i / λ⁶) |C(u_i) − V_i|²
//! ```
//!
//! Here l_i is the mean length of the chords at V_i, and λ the length over which the effect of a vertex fades. Noise with a
//! wavelength below about 2πλ is smoothed out. On a circle of radius r the curve is off by −λ⁶/r⁵; where a bend begins or ends it
//! is off by about λ³/r², which fades as exp(−u/2λ).
//!
//! Vertices of arcs and splines have no noise: there λ is a fixed part of the chord, and the curve is nearly the best
//! approximation. λ is not a fixed part of the interval, because intervals get shorter towards a corner: the weights would change
//! by a factor of four from one interval to the next, and the effect of the corner on the curve would alternate over many of
//! them.
//!
//! Points of a program may have noise. With intervals h = √(6 ε r), the curve is off by at most OFF ε at the end of a bend if
//!
//! ```text
//! λ = h (OFF h / 36 ε)^(1/3)
//! ```
//!
//! Corners and the vertices near them have no such term, so that the curve may use the tolerance on one side.

use super::bezier::{point_and_slope, Control};
use super::polyline::{angle, Hold, Polyline};
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::watch::Watch;

/// A vertex is a corner if the polyline turns by more than this angle, in rad,
const CORNER: f64 = std::f64::consts::FRAC_PI_6;
/// between the places at this distance before and after it, in tolerances. So an arc with a radius below about four tolerances is
/// a corner, and noise far below the tolerance is not.
const VIEW: f64 = 2.0;
/// The curve leaves the polyline at this distance from a corner, in tolerances divided by the angle in rad.
const REACH: f64 = 10.0;
/// λ at vertices of arcs and splines, in chords; an interval on a circle has about six chords.
const EXACT: f64 = 0.18;
/// The least λ there, in intervals.
const LEAST_EXACT: f64 = 0.03;
/// At points of a program: the error of the curve at the ends of bends that sets λ, in tolerances.
const OFF: f64 = 0.2;
/// The least λ there, in intervals.
const LEAST: f64 = 0.1;
/// If an interval has fewer vertices than this, λ is smaller, since the mean of a few vertices smooths little.
const FEW: f64 = 2.0;
/// The greatest λ at all vertices, in intervals.
const MOST: f64 = 0.6;
/// An interval shorter than a chord at one of its vertices is halved if it is farther from that vertex than this, in tolerances.
const MISS: f64 = 0.1;

impl Hold {
    /// l/λ⁶ in mm⁻⁵ at a vertex between two chords, in an interval of length h. At vertices of arcs and splines l is the shorter
    /// chord, because a long line next to an arc has no further vertices.
    pub fn weight(self, chords: [f64; 2], h: f64, tolerance: f64) -> f64 {
        // λ in parts of h.
        let (length, lambda) = match self {
            Self::Free => return 0.0,
            Self::Exact => {
                let length = chords[0].min(chords[1]);
                (length, (EXACT * length / h).clamp(LEAST_EXACT, MOST))
            }
            Self::Point => {
                let length = 0.5 * (chords[0] + chords[1]);
                let end = (OFF * h / (36.0 * tolerance)).cbrt();
                (length, end.min(MOST * (h / (FEW * length)).powi(2)).clamp(LEAST, MOST))
            }
        };
        length * (lambda * h).powi(-6)
    }
}

/// For each interval, whether it is too long to pass near the vertices of bends in it; `foot` has the foot points of all
/// vertices.
pub fn missed<const D: usize>(
    line: &Polyline<D>,
    knots: &[f64],
    pieces: &[Control<D>],
    foot: &[f64],
    watch: Watch,
) -> Vec<bool> {
    let mut missed = vec![false; pieces.len()];
    let mut j = 0;
    for i in (1..line.chords()).filter(|_| line.sized) {
        watch.check_at(i);
        while j + 1 < pieces.len() && knots[j + 1] <= foot[i] {
            j += 1;
        }
        let h = knots[j + 1] - knots[j];
        if line.hold[i] == Hold::Point && line.chord_length(i - 1).max(line.chord_length(i)) > h {
            let (point, _) = point_and_slope(&pieces[j], ((foot[i] - knots[j]) / h).clamp(0.0, 1.0));
            missed[j] |= norm(&sub(&point, &line.vertex[i])) > MISS * line.tolerance_at(i);
        }
    }
    missed
}

impl<const D: usize> Polyline<D> {
    /// Finds the vertices of bends and sets `hold` for them. Chords longer than `long` are lines, and a vertex between two of
    /// them is a corner if the polyline does not bend on at their other ends. `curved` tells which chords stand for arcs or
    /// splines.
    pub fn hold_bends(&mut self, long: f64, curved: impl Fn(usize) -> bool, watch: Watch) {
        let last = self.chords();
        let turn = self.turns_in_view(watch);
        // Vertices within REACH of a corner are free. Where several vertices make up one corner, the sharpest one sets the reach.
        let mut free = vec![false; last + 1];
        let reach = |i: usize| {
            let sharpest = turn[i] >= turn[i - 1].max(turn[i + 1]);
            let reach = if sharpest { REACH * self.tolerance_at(i) / turn[i] } else { 0.0 };
            (turn[i] >= CORNER || self.is_lone(i, long)).then_some(reach)
        };
        let reaches: Vec<Option<f64>> =
            (0..=last).map(|i| if i > 0 && i < last { reach(i) } else { None }).collect();
        let mut end = f64::NEG_INFINITY;
        for i in 1..last {
            if let Some(reach) = reaches[i] {
                end = end.max(self.station[i] + reach);
            }
            free[i] |= self.station[i] <= end;
        }
        let mut start = f64::INFINITY;
        for i in (1..last).rev() {
            if let Some(reach) = reaches[i] {
                start = start.min(self.station[i] - reach);
            }
            free[i] |= self.station[i] >= start;
        }
        for i in (1..last).filter(|&i| !free[i]) {
            self.hold[i] = if curved(i - 1) || curved(i) { Hold::Exact } else { Hold::Point };
        }
    }

    /// The angle at every vertex between the places VIEW tolerances before and after it, in rad; 0 at the ends.
    fn turns_in_view(&self, watch: Watch) -> Vec<f64> {
        let last = self.chords();
        let mut turns = vec![0.0; last + 1];
        let (mut a, mut b) = (0, 0);
        for i in 1..last {
            watch.check_at(i);
            let view = VIEW * self.tolerance_at(i);
            let (low, high) =
                ((self.station[i] - view).max(0.0), (self.station[i] + view).min(self.length()));
            // Where the tolerance changes, the places may move back.
            while a > 0 && self.station[a] > low {
                a -= 1;
            }
            while self.station[a + 1] < low {
                a += 1;
            }
            b = b.max(i);
            while b > i && self.station[b] > high {
                b -= 1;
            }
            while b + 1 < last && self.station[b + 1] < high {
                b += 1;
            }
            let back = sub(&self.vertex[i], &self.point(a, low));
            turns[i] = angle(&back, &sub(&self.point(b, high), &self.vertex[i]));
        }
        turns
    }

    /// Whether vertex i lies between two long chords, at whose other ends the polyline does not bend in the same direction.
    fn is_lone(&self, i: usize, long: f64) -> bool {
        if self.chord_length(i - 1) <= long || self.chord_length(i) <= long {
            return false;
        }
        let change = |k: usize| sub(&self.direction[k], &self.direction[k - 1]);
        let bends_on = |k: usize| {
            k > 0 && k < self.chords() && self.turn(k) < CORNER && dot(&change(i), &change(k)) > 0.0
        };
        !bends_on(i - 1) && !bends_on(i + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hold of every vertex.
    fn held(points: Vec<[f64; 2]>, tolerance: f64) -> Vec<Hold> {
        let chords = points.len() - 1;
        let mut line = Polyline::new(points, vec![tolerance; chords]);
        line.hold_bends(5.0, |_| false, Watch::default());
        line.hold
    }

    fn circle(radius: f64, turn: f64, count: usize) -> Vec<[f64; 2]> {
        (0..=count).map(|i| (turn * i as f64).sin_cos()).map(|(y, x)| [radius * x, radius * y]).collect()
    }

    #[test]
    fn vertices_of_a_bend_are_held_and_those_of_corners_are_free() {
        let all = held(circle(2.0, 0.1, 30), 0.1);
        assert!(
            all[0] == Hold::Free && all[30] == Hold::Free && all[1..30].iter().all(|h| *h == Hold::Point)
        );
        // An arc whose radius is the tolerance is a corner. On a larger one, 29 degrees a vertex is a bend, 31 degrees are
        // corners.
        assert!(held(circle(0.1, 0.1, 30), 0.1).iter().all(|h| *h == Hold::Free));
        assert!(held(circle(20.0, 0.506, 6), 0.1)[1..6].iter().all(|h| *h == Hold::Point));
        assert!(held(circle(20.0, 0.541, 6), 0.1).iter().all(|h| *h == Hold::Free));
    }

    #[test]
    fn a_corner_frees_as_much_on_both_sides_as_the_curve_needs_to_go_around() {
        // A right angle at (10, 0), points 0.1 apart: the reach 10 · 0.1 / (π/2) = 0.64 covers six points on each side.
        let side = |i: usize| 0.1 * i as f64;
        let points =
            (0..=200).map(|i| if i <= 100 { [side(i), 0.0] } else { [10.0, side(i - 100)] }).collect();
        let held = held(points, 0.1);
        let free: Vec<usize> = (1..200).filter(|&i| held[i] == Hold::Free).collect();
        assert_eq!(free, (94..=106).collect::<Vec<_>>());
    }

    #[test]
    fn a_slight_corner_between_long_lines_is_free_and_a_polygon_of_them_is_a_bend() {
        let bent = held(vec![[0.0, 0.0], [20.0, 0.0], [40.0, 4.0]], 0.1);
        assert_eq!(bent[1], Hold::Free);
        assert!(held(circle(100.0, 0.2, 10), 0.1)[1..10].iter().all(|h| *h == Hold::Point));
    }

    #[test]
    fn a_point_draws_less_than_an_arc_and_neither_depends_on_the_unit() {
        for (h, tolerance) in [(0.6, 0.1), (3.0, 0.1), (0.05, 0.001)] {
            let weight = |hold: Hold, unit: f64| hold.weight([0.1 * h / unit; 2], h / unit, tolerance / unit);
            let [point, exact] = [Hold::Point, Hold::Exact].map(|hold| weight(hold, 1.0));
            assert!(exact >= point && point > 0.0 && weight(Hold::Free, 1.0) == 0.0);
            let inch = weight(Hold::Point, 25.4) / 25.4f64.powi(5);
            assert!((inch / point - 1.0).abs() < 1e-9);
        }
    }
}
