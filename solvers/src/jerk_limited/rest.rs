//! The ramp from rest: constant jerk along the path, w = c s^(4/3).

use super::{Geometry, Limits, SpeedCap};

/// Ramps are this part of the length on which constant jerk reaches the acceleration or the speed …
const RAMP: f64 = 1.0 / 90.0;
/// … and at most this part of the path.
const PART: f64 = 1.0 / 400.0;
/// Samples of a piece of the path under a ramp.
const SAMPLES: usize = 32;

/// The length of the ramps of a path, in mm, from |q'| of its axes at the end.
pub fn length<const M: usize>(limits: &Limits<M>, first: &[f64; M], path: f64) -> f64 {
    let mut least = PART * path;
    for k in 0..M {
        let q = first[k].abs().max(f64::MIN_POSITIVE);
        let (v, a, j) = (limits.velocity[k] / q, limits.acceleration[k] / q, limits.jerk[k] / q);
        let by_acceleration = a * a * a / (6.0 * j * j);
        let by_speed = (8.0 * v * v * v / j).sqrt() / 6.0;
        least = least.min(RAMP * by_acceleration.min(by_speed));
    }
    least
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
        for i in 0..=SAMPLES {
            let s = start + (stop - start) * i as f64 / SAMPLES as f64;
            let place = geometry.at(piece, s);
            let x = if end == 0 { s } else { total - s };
            let root = x.cbrt();
            // w, w' and √w w'' over c, c and c^(3/2), and w^(3/2), √w w' alike.
            let (w, w1) = (x * root, sign * 4.0 / 3.0 * root);
            let (cubed, crossed, bend) = (x * x, sign * 4.0 / 3.0 * x, 4.0 / 9.0);
            c = c.min(1.0 / (limits.per_speed_sq(&place) * w));
            for k in 0..M {
                let (q1, q2, q3) = (place.first[k], place.second[k], place.third[k]);
                let a = (q2 * w + 0.5 * q1 * w1).abs();
                let j = (q3 * cubed + 1.5 * q2 * crossed + 0.5 * q1 * bend).abs();
                c = c.min(limits.acceleration[k] / a).min((limits.jerk[k] / j).cbrt().powi(2));
            }
        }
    }
    for cap in caps {
        let x = if end == 0 { cap.s } else { total - cap.s };
        if x <= ramp {
            c = c.min(cap.speed * cap.speed / (x * x.cbrt()));
        }
    }
    c * ramp * ramp.cbrt() * (1.0 - 1e-9)
}
