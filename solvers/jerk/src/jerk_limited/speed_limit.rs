//! Computes upper bounds of the speed at each collocation point that follow from all limits, in a few passes along a window.
//!
//! With w = v², the unit vector q' along the path, and q'' = κ N at right angles to it:
//!
//!   acceleration       (q_k'² w)' = 2 q_k' a_k for each axis: bounded by the limits of a_k
//!   jerk across        N · jerk = ±(κ w^(3/2))': its size is at most Σ |N_k| J_k
//!   jerk along         q' · jerk = v̈ − κ² v³, so that v̈ ≥ −Σ |q_k'| J_k = −J, and (v³)'' = 3 v̇²/v + 3 v̈ ≥ −3 J
//!
//! The first two bound the change of w and of κ w^(3/2) from point to point. By the last one v³ plus twice the integral
//! of 3 J is convex: it lies below the lower convex hull of its bounds. Each bound makes the others closer.
//!
//! The relaxation (`relaxed`) lets jerk exceed its limit at a cost of time. With these speeds its bound is closer.

use super::constraints::Constraints;
use super::hermite::COUNT;
use crate::path_problem::MOST_AXES;

/// Number of rounds of all passes.
const ROUNDS: usize = 4;
/// Relative rounding of the sums along a window.
const ROUNDING: f64 = 1e-12;
/// κ w^(3/2) is lowered only if the new bound is below this fraction of the old one: cube roots take long.
const CLOSE: f64 = 1.0 - 1e-6;
/// q'' jumps where it changes by more than this fraction at a station; κ w^(3/2) jumps there as well.
const JUMP: f64 = 1e-6;

struct Point<const N: usize> {
    first: [f64; N],
    /// q_k'² and its inverse.
    square: [[f64; N]; 2],
    normal: [f64; N],
    bend: f64,
    /// Upper bounds of w, of v³, and of v³ plus the integral.
    w: f64,
    cube: f64,
    convex: f64,
    /// Arc length and twice the integral of 3 J, from the start of the window.
    s: f64,
    integral: f64,
}

/// The limits on the changes from a point to the next.
struct Step<const N: usize> {
    /// The greatest changes of q_k'² w, forward and backward.
    energy: [[f64; N]; 2],
    /// The greatest change of κ w^(3/2), and the least κ.
    bending: f64,
    straight: f64,
}

/// Lowers w_max at the collocation points of a window.
pub fn lower(rows: &mut Constraints) {
    match rows.axes() {
        0..=2 => lower_by::<2>(rows),
        3 => lower_by::<3>(rows),
        4 => lower_by::<4>(rows),
        5 => lower_by::<5>(rows),
        6 => lower_by::<6>(rows),
        _ => lower_by::<MOST_AXES>(rows),
    }
}

/// `lower` with arrays for N axes; values beyond the last axis are 0.
fn lower_by<const N: usize>(rows: &mut Constraints) {
    let (mut points, steps) = points::<N>(rows);
    for _ in 0..ROUNDS {
        for (n, step) in steps.iter().enumerate() {
            let (before, after) = points.split_at_mut(n + 1);
            after[0].lower(&before[n], &step.energy[0], step);
        }
        for (n, step) in steps.iter().enumerate().rev() {
            let (before, after) = points.split_at_mut(n + 1);
            before[n].lower(&after[0], &step.energy[1], step);
        }
        convex(&mut points);
    }
    for (n, point) in points.iter().enumerate() {
        rows.lower(n / COUNT, n % COUNT, point.w);
    }
}

impl<const N: usize> Point<N> {
    /// q_k''.
    fn second(&self, k: usize) -> f64 {
        self.normal[k] * self.bend
    }

    /// Lowers w to what can be reached from the neighbouring point `from`. An axis that does not move sets no limit: w.min(NaN) =
    /// w.
    fn lower(&mut self, from: &Self, energy: &[f64; N], step: &Step<N>) {
        let mut w = self.w;
        if self.s == from.s {
            // At a knot q' differs by rounding, at a corner by more: the speed is the same on both sides.
            w = w.min(from.w);
        } else {
            for (k, energy) in energy.iter().enumerate() {
                w = w.min((from.square[0][k] * from.w + energy) * self.square[1][k]);
            }
        }
        if w < self.w {
            (self.w, self.cube) = (w, w * w.sqrt());
        }
        let bent = (from.bend * from.cube).min(step.straight * from.cube.max(self.cube)) + step.bending;
        if bent < CLOSE * self.bend * self.cube {
            self.lower_to(bent / self.bend);
        }
    }

    /// Lowers the bound of v³ to `cube`, and that of w accordingly.
    fn lower_to(&mut self, cube: f64) {
        (self.w, self.cube) = (cube.cbrt().powi(2), cube);
    }
}

fn points<const N: usize>(rows: &Constraints) -> (Vec<Point<N>>, Vec<Step<N>>) {
    let mut jerk = [0.0; N];
    let mut acceleration = [[0.0; 2]; N];
    for (k, (per_jerk, limit)) in rows.per_jerk.iter().zip(&rows.acceleration).enumerate() {
        (jerk[k], acceleration[k]) = (1.0 / per_jerk, limit.most.map(|most| most / limit.per_mean));
    }
    let most = |k: usize, side: bool| acceleration[k][usize::from(side)];
    let along = |direction: &[f64; N]| (0..N).map(|k| direction[k].abs() * jerk[k]).sum::<f64>();
    let mut points: Vec<Point<N>> = Vec::with_capacity(COUNT * rows.count());
    let mut steps = Vec::with_capacity(COUNT * rows.count());
    let mut slope = 0.0;
    for n in 0..rows.count() {
        for p in 0..COUNT {
            let (mut first, mut second) = ([0.0; N], [0.0; N]);
            for axis in 0..rows.axes() {
                [first[axis], second[axis], _] = rows.derivatives(n, p, axis);
            }
            let bend = length(&second);
            let normal = second.map(|second: f64| second / bend.max(f64::MIN_POSITIVE));
            let across: f64 = (0..N).map(|k| normal[k].abs() * most(k, normal[k] < 0.0)).sum();
            let w = (1.0 / rows.speed(n, p)).min(across / bend);
            let square = first.map(|first| first * first);
            let square = [square, square.map(|square| 1.0 / square)];
            let cube = w * w.sqrt();
            let mut next = Point { first, square, normal, bend, w, cube, convex: 0.0, s: 0.0, integral: 0.0 };
            if let Some(last) = points.last() {
                let h = if p == 0 { 0.0 } else { rows.h(n) / 3.0 };
                let mean = mean_direction(last, &next, h);
                let change = 3.0 * along(&mean) * h;
                next.s = last.s + h;
                next.integral = last.integral + h * (slope + 0.5 * change);
                slope += change;
                steps.push(step(last, &next, h, &mean, &along, length(&jerk), &most));
            }
            points.push(next);
        }
    }
    (points, steps)
}

fn step<const N: usize>(
    last: &Point<N>,
    next: &Point<N>,
    h: f64,
    mean: &[f64; N],
    along: &impl Fn(&[f64; N]) -> f64,
    all: f64,
    most: &impl Fn(usize, bool) -> f64,
) -> Step<N> {
    let energy = [false, true].map(|back| {
        std::array::from_fn(|k| {
            // An acceleration against the axis is negative; on the way backward the signs change.
            let against = last.first[k] + next.first[k] < 0.0;
            2.0 * h * mean[k] * most(k, against != back)
        })
    });
    let bends = [last, next].map(|point| point.normal.map(|part| part * point.bend));
    let apart = difference(&bends[0], &bends[1]);
    if h == 0.0 {
        let jumps = length(&apart) > JUMP * (last.bend + next.bend);
        let bending = if jumps { f64::INFINITY } else { 0.0 };
        return Step { energy, bending, straight: f64::INFINITY };
    }
    // On an arc of N between the points, Σ |N_k| J_k exceeds the greater of its values at the ends by at most the factor 1/cos of
    // half the arc's angle.
    let turn = length(&difference(&last.normal, &next.normal));
    let steep = along(&last.normal).max(along(&next.normal)) * (1.0 + turn * turn / 6.0);
    // The least |q''| where q'' changes evenly.
    let back: f64 = (0..N).map(|k| -bends[0][k] * apart[k]).sum();
    let part = (back / length(&apart).powi(2).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let straight = length::<N>(&std::array::from_fn(|k| bends[0][k] + part * apart[k]));
    Step { energy, bending: h * if turn < 1.0 { steep.min(all) } else { all }, straight }
}

/// An upper bound of the mean of |q_k'| between two points, h mm apart: by the trapezoidal rule on an arc, or by the cubic with
/// the same q'' at both points.
fn mean_direction<const N: usize>(last: &Point<N>, next: &Point<N>, h: f64) -> [f64; N] {
    // On an arc of the angle 2 φ the mean of a component exceeds the mean of its ends by at most the factor tan φ/φ; 1 + chord²/8
    // is greater than that for chords up to 1.
    let chord = length(&difference(&last.first, &next.first));
    let arc = 1.0 + chord * chord / 8.0;
    std::array::from_fn(|k| {
        let (a, b) = (last.first[k], next.first[k]);
        let ends = 0.5 * (a.abs() + b.abs());
        // Where q_k' changes its sign, |q_k'| is convex and has no bulge.
        let bulge = if a * b > 0.0 { (last.second(k) - next.second(k)) * a.signum() * h / 12.0 } else { 0.0 };
        (arc * ends).max(ends + bulge)
    })
}

/// Lowers w to the lower convex hull of v³ plus the integral over the arc length.
fn convex<const N: usize>(points: &mut [Point<N>]) {
    let mut hull: Vec<usize> = vec![];
    for n in 0..points.len() {
        points[n].convex = points[n].cube + points[n].integral;
        let above = |a: usize, b: usize| {
            let [a, b, c] = [&points[a], &points[b], &points[n]];
            (b.convex - a.convex) * (c.s - a.s) >= (c.convex - a.convex) * (b.s - a.s)
        };
        while hull.len() > 1 && above(hull[hull.len() - 2], hull[hull.len() - 1]) {
            hull.pop();
        }
        hull.push(n);
    }
    for pair in hull.windows(2) {
        let [(s, convex), (end, last)] = [pair[0], pair[1]].map(|n| (points[n].s, points[n].convex));
        for point in &mut points[pair[0] + 1..pair[1]] {
            let most = convex + (last - convex) * (point.s - s) / (end - s);
            // Where the difference is only rounding of the sums, the bound of a low speed stays as it is.
            if most < (1.0 - ROUNDING) * point.convex {
                point.lower_to((most - point.integral).max(0.0));
            }
        }
    }
}

fn length<const N: usize>(vector: &[f64; N]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn difference<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|k| b[k] - a[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path_problem::{Geometry, Limits, PathPoint};

    /// A plane curve with the curvature c s, where s is the arc length from the middle of the curve.
    struct Clothoid(f64);

    impl Geometry<2> for Clothoid {
        fn knots(&self) -> &[f64] {
            &[0.0, 2.0]
        }

        fn at(&self, _: usize, s: f64) -> PathPoint<2> {
            let (c, s) = (self.0, s - 1.0);
            let (sin, cos) = (0.5 * c * s * s).sin_cos();
            let (bend, more) = (c * s, c * c * s * s);
            PathPoint {
                first: [cos, sin],
                second: [-bend * sin, bend * cos],
                third: [-c * sin - more * cos, c * cos - more * sin],
                speed_cap: 100.0,
            }
        }
    }

    /// The lowered w_max at the starts of 40 intervals on 2 mm; `cap` is the speed cap in mm/s at a station.
    fn lowered(c: f64, acceleration: f64, cap: impl Fn(usize) -> f64) -> Vec<f64> {
        let limits =
            Limits { velocity: [[1e3; 2]; 2], acceleration: [[acceleration; 2]; 2], jerk: [50_000.0; 2] };
        let stations: Vec<f64> = (0..=40).map(|n| 0.05 * n as f64).collect();
        let mut rows = Constraints::new(&limits, &[true; 2]);
        rows.sample(&Clothoid(c), &limits, &stations, &[0; 40], &[1.0; 40], cap);
        lower(&mut rows);
        (0..rows.count()).map(|n| 1.0 / rows.speed(n, 0)).collect()
    }

    /// Two lines along the second axis; the first one moves the first axis by rounding.
    struct Rounded;

    impl Geometry<2> for Rounded {
        fn knots(&self) -> &[f64] {
            &[0.0, 1.0, 2.0]
        }

        fn at(&self, piece: usize, _: f64) -> PathPoint<2> {
            let first = [if piece == 0 { 1e-15 } else { 0.0 }, 1.0];
            PathPoint { first, second: [0.0; 2], third: [0.0; 2], speed_cap: 100.0 }
        }
    }

    #[test]
    fn rounding_at_a_knot_is_no_limit() {
        let limits = Limits { velocity: [[1e3; 2]; 2], acceleration: [[1e3; 2]; 2], jerk: [50_000.0; 2] };
        let stations = [0.0, 0.5, 1.0, 1.5, 2.0];
        let mut rows = Constraints::new(&limits, &[true; 2]);
        rows.sample(&Rounded, &limits, &stations, &[0, 0, 1, 1], &[1.0; 4], |_| f64::INFINITY);
        lower(&mut rows);
        for n in 0..rows.count() {
            assert!((0..COUNT).all(|p| (1e4 * rows.speed(n, p) - 1.0).abs() < 1e-9));
        }
    }

    #[test]
    fn a_curvature_that_rises_evenly_limits_the_speed_by_hand() {
        // κ w^(3/2) = c |s| w^(3/2) is at most J |s| where the path goes along one axis: v ≤ (J/c)^(1/3).
        let w = lowered(0.4, 1e9, |_| f64::INFINITY);
        let by_hand = (50_000.0f64 / 0.4).powf(2.0 / 3.0);
        for n in [16, 19, 22, 24] {
            assert!(w[n] >= by_hand * (1.0 - 1e-9) && w[n] < 1.02 * by_hand, "{} and {by_hand}", w[n]);
        }
    }

    #[test]
    fn acceleration_is_lost_within_the_limit_of_jerk() {
        // From v³ = 1 at stations 0.8 mm apart, v³ rises by 3/2 J d² at most half-way, with d = 0.4 mm.
        let w = lowered(0.0, 1e9, |station| if station == 10 || station == 26 { 1.0 } else { f64::INFINITY });
        let by_hand = 1.0 + 1.5 * 50_000.0 * 0.16;
        assert!((w[18].powf(1.5) / by_hand - 1.0).abs() < 1e-6, "{} and {by_hand}", w[18].powf(1.5));
        assert!((w[10] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn speed_is_gained_within_the_limit_of_acceleration() {
        // w' = 2 A along an axis.
        let w = lowered(0.0, 100.0, |station| if station == 10 { 1.0 } else { f64::INFINITY });
        for n in [0, 9, 11, 30] {
            let by_hand = 1.0 + 200.0 * 0.05 * (n as f64 - 10.0).abs();
            assert!((w[n] / by_hand - 1.0).abs() < 1e-9, "{} and {by_hand}", w[n]);
        }
    }
}
