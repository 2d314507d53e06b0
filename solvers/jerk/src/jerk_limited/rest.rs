//! The ramp from rest: constant jerk along the path, w = c s^(4/3).

use std::ops::Range;

use super::{Geometry, Limits, Place, SpeedCap};
use feedplan_planner::problem::lesser;

/// Ramps are this part of the length on which constant jerk reaches the acceleration or the speed …
const RAMP: f64 = 1.0 / 90.0;
/// … and at least and at most these parts of the path: the nodes beside a shorter one would have no digits.
const PARTS: [f64; 2] = [SHORTEST, 1.0 / 400.0];
pub const SHORTEST: f64 = 1e-11;
/// Places of a piece under a ramp, even in time: halved at least and at most so often …
const DEPTH: Range<u32> = 4..40;
/// … where the greatest speed between them changes by more than this in logarithm, and they are further apart than this
/// part of their time.
const CHANGE: f64 = 0.05;
const APART: f64 = 1e-5;
/// From rest on, places are taken in so many octaves of time: the way may turn in any length there.
const OCTAVES: i32 = 12;
/// Places between those beside the worst one, and how often they are taken anew.
const PLACES: usize = 16;
const ROUNDS: usize = 2;

/// The length of the ramps of a path, in mm, from its derivatives and its speed cap at the end.
///
/// It is as far as a place on the path can be from the path's end: places have the digits of the whole way, and a ramp is
/// so short that the slope at its node, 4/3 w over its length, shows what the node rounds off.
pub fn length<const M: usize>(limits: &Limits<M>, place: &Place<M>, path: f64) -> f64 {
    let [least, most] = PARTS.map(|part| part * path);
    let along = |limit: &[f64; M]| {
        (0..M).map(|k| limit[k] / place.first[k].abs().max(f64::MIN_POSITIVE)).fold(f64::INFINITY, f64::min)
    };
    let [v, a] = [&limits.velocity, &limits.acceleration].map(|limit| along(&lesser(limit)));
    let (v, j) = (v.min(place.speed_cap), along(&limits.jerk));
    let by_acceleration = a * a * a / (6.0 * j * j);
    let by_speed = (8.0 * v * v * v / j).sqrt() / 6.0;
    let ramp = most.min(RAMP * by_acceleration.min(by_speed));
    path - (path - ramp.max(least))
}

/// The greatest w at the end of the ramp of this length; `end` is 0 at the start of the path and 1 at its end.
pub fn greatest<const M: usize>(
    geometry: &impl Geometry<M>,
    limits: &Limits<M>,
    caps: &[SpeedCap],
    ramp: f64,
    end: usize,
) -> f64 {
    let knots = geometry.knots();
    let total = knots[knots.len() - 1];
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let from_rest = |cap: &SpeedCap| if end == 0 { cap.s } else { total - cap.s };
    let share = |cap: &SpeedCap| if from_rest(cap) - cap.reach < ramp { cap.share } else { 0.0 };
    let calm = 1.0 - caps.iter().map(share).fold(0.0, f64::max);
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
        // By t, where t³ is the distance from rest.
        let at = |t: f64| {
            let x = t * t * t;
            let place = geometry.at(piece, if end == 0 { x } else { total - x });
            // w, w' and √w w'' over c, c and c^(3/2), and w^(3/2), √w w' alike.
            let (w, w1) = (x * t, sign * 4.0 / 3.0 * t);
            let (cubed, crossed, bend) = (x * x, sign * 4.0 / 3.0 * x, 4.0 / 9.0);
            let mut c = 1.0 / (limits.per_speed_sq(&place) * w);
            for k in 0..M {
                let (q1, q2, q3) = (place.first[k], place.second[k], place.third[k]);
                let a = q2 * w + 0.5 * q1 * w1;
                let most = limits.acceleration[usize::from(a < 0.0)][k];
                let j = (q3 * cubed + 1.5 * q2 * crossed + 0.5 * q1 * bend).abs();
                c = c.min(most / a.abs()).min((calm * limits.jerk[k] / j).cbrt().powi(2));
            }
            (t, c)
        };
        let distances = if end == 0 { [start, stop] } else { [total - stop, total - start] };
        let [first, last] = distances.map(f64::cbrt);
        let mut places = vec![at(first)];
        let octaves = if first == 0.0 { -OCTAVES..=0 } else { 0..=0 };
        for octave in octaves {
            let from = places[places.len() - 1];
            halve(&at, [from, at(last * 2f64.powi(octave))], 0, &mut places);
        }
        for _ in 0..=ROUNDS {
            let worst = (0..places.len()).fold(0, |i, j| if places[j].1 < places[i].1 { j } else { i });
            c = c.min(places[worst].1);
            // Between its neighbours it may be less.
            let beside = [worst.saturating_sub(1), (worst + 1).min(places.len() - 1)].map(|i| places[i].0);
            let place = |i: usize| beside[0] + (beside[1] - beside[0]) * i as f64 / PLACES as f64;
            places = (0..=PLACES).map(|i| at(place(i))).collect();
        }
    }
    for cap in caps {
        let x = from_rest(cap);
        if x <= ramp {
            c = c.min(cap.speed * cap.speed / (x * x.cbrt()));
        }
    }
    c * ramp * ramp.cbrt() * (1.0 - 1e-9)
}

/// Appends places, and the greatest c there, from the last of them to the end of a range.
fn halve(at: &impl Fn(f64) -> (f64, f64), [a, b]: [(f64, f64); 2], depth: u32, places: &mut Vec<(f64, f64)>) {
    let middle = at(0.5 * (a.0 + b.0));
    let changes = (middle.1 * middle.1 / (a.1 * b.1)).ln().abs() > CHANGE && b.0 - a.0 > APART * b.0;
    if depth < DEPTH.start || (changes && depth < DEPTH.end) {
        halve(at, [a, middle], depth + 1, places);
        halve(at, [middle, b], depth + 1, places);
    } else {
        places.extend([middle, b]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Arc {
        curvature: f64,
    }

    impl Geometry<2> for Arc {
        fn knots(&self) -> &[f64] {
            &[0.0, 100.0]
        }

        fn at(&self, _: usize, s: f64) -> Place<2> {
            let k = self.curvature;
            let (y, x) = (k * s).sin_cos();
            let (first, second) = ([x, y], [-k * y, k * x]);
            Place { first, second, third: [-k * k * x, -k * k * y], speed_cap: f64::INFINITY }
        }
    }

    const LIMITS: Limits<2> =
        Limits { velocity: [[100.0; 2]; 2], acceleration: [[1000.0; 2]; 2], jerk: [50_000.0; 2] };

    #[test]
    fn on_a_line_jerk_is_used_fully() {
        // s = J t³/6 and v = J t²/2: v = (9 J s²/2)^(1/3).
        let w = greatest(&Arc { curvature: 0.0 }, &LIMITS, &[], 0.01, 0);
        let expected = (4.5 * 50_000.0 * 1e-4f64).powf(2.0 / 3.0);
        assert!((w / expected - 1.0).abs() < 1e-6, "{w} and {expected}");
        assert_eq!(w, greatest(&Arc { curvature: 0.0 }, &LIMITS, &[], 0.01, 1));
    }

    /// A turn of this length at the start of a line, by the angle arctan(s/length).
    struct Turn(f64);

    impl Geometry<2> for Turn {
        fn knots(&self) -> &[f64] {
            &[0.0, 100.0]
        }

        fn at(&self, _: usize, s: f64) -> Place<2> {
            let (x, per) = (s / self.0, 1.0 / self.0);
            let (sin, cos) = x.atan().sin_cos();
            let (k, dk) = (per * cos * cos, -2.0 * per * per * x * cos.powi(4));
            let (first, second) = ([cos, sin], [-k * sin, k * cos]);
            let third = [-dk * sin - k * k * cos, dk * cos - k * k * sin];
            Place { first, second, third, speed_cap: f64::INFINITY }
        }
    }

    #[test]
    fn a_turn_of_any_length_beside_the_rest_lowers_the_ramp_as_much() {
        // Lengths of turn and way scale alike, and the jerk of a ramp depends on their ratio alone.
        let line = greatest(&Arc { curvature: 0.0 }, &LIMITS, &[], 0.01, 0);
        for i in 0..80 {
            let length = 1e-3 * 10f64.powf(-0.1 * i as f64);
            let ramp = greatest(&Turn(length), &LIMITS, &[], 0.01, 0) / line;
            assert!((ramp - 0.5).abs() < 0.02, "{ramp} beside a turn of {length} mm");
        }
    }

    #[test]
    fn curvature_and_caps_lower_the_ramp() {
        let line = greatest(&Arc { curvature: 0.0 }, &LIMITS, &[], 0.01, 0);
        let arc = greatest(&Arc { curvature: 100.0 }, &LIMITS, &[], 0.01, 0);
        assert!(arc < line, "{arc} and {line}");
        let cap = [SpeedCap::new(0.01, 0.5)];
        let capped = greatest(&Arc { curvature: 0.0 }, &LIMITS, &cap, 0.01, 0);
        assert!((capped - 0.25).abs() < 1e-6, "{capped}");
    }

    /// A place on a line along the first axis.
    fn line(speed_cap: f64) -> Place<2> {
        Place { first: [1.0, 0.0], second: [0.0; 2], third: [0.0; 2], speed_cap }
    }

    #[test]
    fn ramps_are_short_on_the_scale_of_the_limits_and_of_the_path() {
        // A³/(6 J²) = 1/15 mm is the shorter way to a limit.
        assert!((length(&LIMITS, &line(f64::INFINITY), 100.0) - 1.0 / 15.0 / 90.0).abs() < 1e-12);
        assert!((length(&LIMITS, &line(f64::INFINITY), 0.1) - 0.1 / 400.0).abs() < 1e-16);
        // Constant jerk reaches 0.01 mm/s on √(8 · 1e-6/50000)/6 mm.
        let slow = length(&LIMITS, &line(0.01), 100.0) * 90.0 * 6.0;
        assert!((slow / (8e-6f64 / 50_000.0).sqrt() - 1.0).abs() < 1e-6);
        let jerk = Limits { jerk: [1e12; 2], ..LIMITS };
        assert!((length(&jerk, &line(f64::INFINITY), 0.1) - 1e-12).abs() < 1e-16);
    }

    #[test]
    fn a_ramp_is_as_long_as_its_node_is_from_the_end_of_the_path() {
        for i in 0..60 {
            let path = 10f64.powf(0.1 * i as f64);
            let ramp = length(&LIMITS, &line(f64::INFINITY), path);
            let node = path - ramp;
            assert_eq!(path - node, ramp, "on {path} mm");
        }
    }
}
