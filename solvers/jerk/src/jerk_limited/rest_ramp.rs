//! Computes the ramp from rest, or to rest, as a function of the distance s [mm] from rest: constant jerk along the path, w = c
//! s^(4/3), or, where the path turns back, constant acceleration c/2, w = c s. The length of the ramp follows from the
//! derivatives and limits at the end of the path, the greatest c from all points of the ramp.

use feedplan_geometry::elementary::Elementary;
use std::ops::Range;

use crate::path_problem::{Geometry, Limits, PathPoint, SpeedCap, SHORTEST};
use feedplan_planner::problem::lesser;

/// The length of a ramp, as a fraction of the length on which constant jerk reaches the limit of acceleration or of speed,
/// whichever is shorter.
const RAMP: f64 = 1.0 / 90.0;
/// The least and the greatest length of a ramp, as fractions of the path's length: the rounding of s would spoil a shorter ramp.
const PARTS: [f64; 2] = [SHORTEST, 1.0 / 400.0];
/// On each piece under a ramp, the range of t (see `LEAST_TIME`) is halved recursively, to depths in this range …
const DEPTH: Range<u32> = 4..40;
/// … while the second difference of ln c exceeds `CHANGE` and the points are further apart than the fraction `APART` of t.
const CHANGE: f64 = 0.05;
const APART: f64 = 1e-5;
/// The fraction of the limit of jerk that a ramp of constant acceleration may use: the rest is left for changes of the
/// acceleration.
const USED: f64 = 0.75;
/// The least t at which a point is evaluated. t is the cube root of the distance from rest in mm, proportional to the time at
/// constant jerk.
const LEAST_TIME: f64 = 1e-30;
/// On the piece that begins at rest, points are laid out separately in each of this many octaves of t: the path may turn within
/// any length there.
const OCTAVES: i32 = 12;
/// Steps between the two neighbours of the worst point, and rounds of this refinement.
const SAMPLES: usize = 16;
const ROUNDS: usize = 4;

/// The length of a ramp, and the power of s to which w is proportional on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// In mm; 0 for no ramp.
    pub length: f64,
    pub power: f64,
}

impl Ramp {
    /// The power at constant jerk.
    pub const JERK: f64 = 4.0 / 3.0;
    /// The power at constant acceleration.
    pub const ACCELERATION: f64 = 1.0;

    /// The slope w' at the ramp's end, divided by w there, in 1/mm.
    pub fn slope(&self) -> f64 {
        self.power / self.length
    }

    /// The ramp's time multiplied by the speed at its end, in mm.
    pub fn way(&self) -> f64 {
        self.length / (1.0 - 0.5 * self.power)
    }
}

/// The length of a ramp, in mm, from the derivatives and the speed cap at the end of the path and the path's length.
///
/// The length is rounded to a distance that the arc length of the ramp's station can express: the slope there is w' = power ·
/// w/length, so that a rounded station would not fit the slope.
pub fn length<const M: usize>(limits: &Limits<M>, point: &PathPoint<M>, path: f64) -> f64 {
    let [least, most] = PARTS.map(|part| part * path);
    let along = |limit: &[f64; M]| {
        (0..M).map(|k| limit[k] / point.first[k].abs().max(f64::MIN_POSITIVE)).fold(f64::INFINITY, f64::min)
    };
    let [v, a] = [&limits.velocity, &limits.acceleration].map(|limit| along(&lesser(limit)));
    let (v, j) = (v.min(point.speed_cap), along(&limits.jerk));
    let by_acceleration = a * a * a / (6.0 * j * j);
    let by_speed = (8.0 * v * v * v / j).sqrt() / 6.0;
    let ramp = most.min(RAMP * by_acceleration.min(by_speed));
    path - (path - ramp.max(least))
}

/// The greatest w in mm²/s² that the limits allow at the end of a ramp; `end` is 0 at the start of the path and 1 at its end.
pub fn greatest<const M: usize>(
    geometry: &dyn Geometry<M>,
    limits: &Limits<M>,
    caps: &[SpeedCap],
    Ramp { length: ramp, power }: Ramp,
    end: usize,
) -> f64 {
    let knots = geometry.knots();
    let total = knots[knots.len() - 1];
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let from_rest = |cap: &SpeedCap| if end == 0 { cap.s } else { total - cap.s };
    let share = |cap: &SpeedCap| if from_rest(cap) - cap.reach < ramp { cap.share } else { 0.0 };
    let mut jerk_part = 1.0 - caps.iter().map(share).fold(0.0, f64::max);
    if power == Ramp::ACCELERATION {
        jerk_part *= USED;
    }
    let mut c = f64::INFINITY;
    for piece in 0..knots.len() - 1 {
        let (start, stop) = if end == 0 {
            (knots[piece], knots[piece + 1].min(ramp))
        } else {
            (knots[piece].max(total - ramp), knots[piece + 1])
        };
        if start >= stop {
            continue;
        }
        // The greatest c at a point with t, the cube root of the distance from rest.
        let at = |t: f64| {
            let t = t.max(LEAST_TIME);
            let x = t * t * t;
            let point = geometry.at(piece, if end == 0 { x } else { total - x });
            // w/c, w'/c; then w^(3/2), √w w' and √w w'', all over c^(3/2).
            let w = if power == Ramp::JERK { t * x } else { x };
            let w1 = sign * power * w / x;
            let cubed = w * w.sqrt();
            let crossed = sign * power * cubed / x;
            let bend = power * (power - 1.0) * cubed / (x * x);
            let mut c = 1.0 / (limits.per_speed_sq(&point) * w);
            for k in 0..M {
                let (q1, q2, q3) = (point.first[k], point.second[k], point.third[k]);
                let a = q2 * w + 0.5 * q1 * w1;
                let most = limits.acceleration[usize::from(a < 0.0)][k];
                let j = (q3 * cubed + 1.5 * q2 * crossed + 0.5 * q1 * bend).abs();
                c = c.min(most / a.abs()).min((jerk_part * limits.jerk[k] / j).cbrt().powi(2));
            }
            (t, c)
        };
        let distances = if end == 0 { [start, stop] } else { [total - stop, total - start] };
        let [first, last] = distances.map(f64::cbrt);
        let mut points = vec![at(first)];
        let octaves = if first == 0.0 { -OCTAVES..=0 } else { 0..=0 };
        for octave in octaves {
            let from = points[points.len() - 1];
            halve(&at, [from, at(last * 2f64.powi(octave))], 0, &mut points);
        }
        for _ in 0..=ROUNDS {
            let worst = (0..points.len()).fold(0, |i, j| if points[j].1 < points[i].1 { j } else { i });
            c = c.min(points[worst].1);
            // c may be less between the worst point and its neighbours.
            let beside = [worst.saturating_sub(1), (worst + 1).min(points.len() - 1)].map(|i| points[i].0);
            let point = |i: usize| beside[0] + (beside[1] - beside[0]) * i as f64 / SAMPLES as f64;
            points = (0..=SAMPLES).map(|i| at(point(i))).collect();
        }
    }
    for cap in caps {
        let x = from_rest(cap);
        if x <= ramp {
            c = c.min(cap.speed * cap.speed / x.power(power));
        }
    }
    c * ramp.power(power) * (1.0 - 1e-9)
}

/// Appends points (t, greatest c) after a, up to b, by halving the range between them.
fn halve(at: &impl Fn(f64) -> (f64, f64), [a, b]: [(f64, f64); 2], depth: u32, points: &mut Vec<(f64, f64)>) {
    let middle = at(0.5 * (a.0 + b.0));
    let changes = (middle.1 * middle.1 / (a.1 * b.1)).natural_log().abs() > CHANGE && b.0 - a.0 > APART * b.0;
    if depth < DEPTH.start || (changes && depth < DEPTH.end) {
        halve(at, [a, middle], depth + 1, points);
        halve(at, [middle, b], depth + 1, points);
    } else {
        points.extend([middle, b]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Circle {
        curvature: f64,
    }

    impl Geometry<2> for Circle {
        fn knots(&self) -> &[f64] {
            &[0.0, 100.0]
        }

        fn at(&self, _: usize, s: f64) -> PathPoint<2> {
            let k = self.curvature;
            let (y, x) = (k * s).sin_cos();
            let (first, second) = ([x, y], [-k * y, k * x]);
            PathPoint { first, second, third: [-k * k * x, -k * k * y], speed_cap: f64::INFINITY }
        }
    }

    const LIMITS: Limits<2> =
        Limits { velocity: [[100.0; 2]; 2], acceleration: [[1000.0; 2]; 2], jerk: [50_000.0; 2] };

    const RAMP_OF_JERK: Ramp = Ramp { length: 0.01, power: Ramp::JERK };

    #[test]
    fn on_a_line_of_constant_acceleration_that_is_used_fully() {
        let ramp = Ramp { power: Ramp::ACCELERATION, ..RAMP_OF_JERK };
        let w = greatest(&Circle { curvature: 0.0 }, &LIMITS, &[], ramp, 0);
        assert!((w / (2.0 * 1000.0 * 0.01) - 1.0).abs() < 1e-8, "{w}");
        // 2 s/v.
        assert_eq!((ramp.way(), ramp.slope()), (0.02, 100.0));
        // On a circle there is also jerk across the path: 3/2 q'' √w w' = 3 v a/radius.
        let circle = greatest(&Circle { curvature: 10.0 }, &LIMITS, &[], ramp, 1);
        assert!(circle < w, "{circle} and {w}");
    }

    #[test]
    fn on_a_line_jerk_is_used_fully() {
        // s = J t³/6 and v = J t²/2: v = (9 J s²/2)^(1/3).
        let w = greatest(&Circle { curvature: 0.0 }, &LIMITS, &[], RAMP_OF_JERK, 0);
        let expected = (4.5 * 50_000.0 * 1e-4f64).powf(2.0 / 3.0);
        assert!((w / expected - 1.0).abs() < 1e-6, "{w} and {expected}");
        assert_eq!(w, greatest(&Circle { curvature: 0.0 }, &LIMITS, &[], RAMP_OF_JERK, 1));
    }

    /// A line that turns at its start within this length, by the angle arctan(s/length).
    struct Turn(f64);

    impl Geometry<2> for Turn {
        fn knots(&self) -> &[f64] {
            &[0.0, 100.0]
        }

        fn at(&self, _: usize, s: f64) -> PathPoint<2> {
            let (x, per) = (s / self.0, 1.0 / self.0);
            let (sin, cos) = x.atan().sin_cos();
            let (k, dk) = (per * cos * cos, -2.0 * per * per * x * cos.powi(4));
            let (first, second) = ([cos, sin], [-k * sin, k * cos]);
            let third = [-dk * sin - k * k * cos, dk * cos - k * k * sin];
            PathPoint { first, second, third, speed_cap: f64::INFINITY }
        }
    }

    #[test]
    fn a_turn_of_any_length_lowers_the_ramp_alike() {
        // The jerk of a ramp depends only on the ratio of the lengths of turn and ramp.
        let line = greatest(&Circle { curvature: 0.0 }, &LIMITS, &[], RAMP_OF_JERK, 0);
        for i in 0..80 {
            let length = 1e-3 * 10f64.powf(-0.1 * i as f64);
            let ramp = greatest(&Turn(length), &LIMITS, &[], RAMP_OF_JERK, 0) / line;
            assert!((ramp - 0.5).abs() < 0.02, "{ramp} beside a turn of {length} mm");
        }
    }

    #[test]
    fn curvature_and_caps_lower_the_ramp() {
        let line = greatest(&Circle { curvature: 0.0 }, &LIMITS, &[], RAMP_OF_JERK, 0);
        let circle = greatest(&Circle { curvature: 100.0 }, &LIMITS, &[], RAMP_OF_JERK, 0);
        assert!(circle < line, "{circle} and {line}");
        let cap = [SpeedCap::new(0.01, 0.5)];
        let capped = greatest(&Circle { curvature: 0.0 }, &LIMITS, &cap, RAMP_OF_JERK, 0);
        assert!((capped - 0.25).abs() < 1e-6, "{capped}");
    }

    /// A point on a line along the first axis.
    fn line(speed_cap: f64) -> PathPoint<2> {
        PathPoint { first: [1.0, 0.0], second: [0.0; 2], third: [0.0; 2], speed_cap }
    }

    #[test]
    fn ramps_are_short_on_the_scale_of_the_limits_and_of_the_path() {
        // A³/(6 J²) = 1/15 mm is the shorter length to a limit.
        assert!((length(&LIMITS, &line(f64::INFINITY), 100.0) - 1.0 / 15.0 / 90.0).abs() < 1e-12);
        assert!((length(&LIMITS, &line(f64::INFINITY), 0.1) - 0.1 / 400.0).abs() < 1e-16);
        // Constant jerk reaches 0.01 mm/s within √(8 · 1e-6/50000)/6 mm.
        let slow = length(&LIMITS, &line(0.01), 100.0) * 90.0 * 6.0;
        assert!((slow / (8e-6f64 / 50_000.0).sqrt() - 1.0).abs() < 1e-6);
        let jerk = Limits { jerk: [1e12; 2], ..LIMITS };
        assert!((length(&jerk, &line(f64::INFINITY), 0.1) - 1e-12).abs() < 1e-16);
    }

    #[test]
    fn a_ramp_is_as_long_as_its_station_is_from_the_end_of_the_path() {
        for i in 0..60 {
            let path = 10f64.powf(0.1 * i as f64);
            let ramp = length(&LIMITS, &line(f64::INFINITY), path);
            let station = path - ramp;
            assert_eq!(path - station, ramp, "on {path} mm");
        }
    }
}
