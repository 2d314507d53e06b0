//! The least time of an axis over a way between two greatest speeds.

use super::DOWN;

/// Not above the time in which an axis that gathers speed by at most `gain` and loses it by at most `loss`, mm/s², and
/// has the greatest velocity squared `v_sq` moves by `way` or more, from at most `first_sq` to at most `last_sq`,
/// velocities squared.
///
/// The way is divided in three: on the first part no motion is faster than the one that gathers speed all along, on
/// the last none than the one that loses it all along, in between none than the greatest velocity. Every division
/// gives a bound, so its rounding does no harm; the one taken is that of the fastest motion.
#[inline(always)]
pub fn least_time(way: f64, first_sq: f64, last_sq: f64, [gain, loss]: [f64; 2], v_sq: f64) -> f64 {
    let (first_sq, last_sq) = (first_sq.min(v_sq), last_sq.min(v_sq));
    // To the peak of a triangle: first² + 2 gain x = last² + 2 loss (way − x).
    let rise = (way * (loss / (gain + loss)) + (last_sq - first_sq) / (2.0 * (gain + loss))).clamp(0.0, way);
    let (up, down) = if first_sq + 2.0 * gain * rise <= v_sq {
        (rise, way - rise)
    } else {
        let up = ((v_sq - first_sq) / (2.0 * gain)).min(way);
        (up, ((v_sq - last_sq) / (2.0 * loss)).min(way - up))
    };
    let ramp = |way: f64, from_sq: f64, a: f64| {
        if way > 0.0 {
            2.0 * way / (from_sq.sqrt() + (from_sq + 2.0 * a * way).sqrt())
        } else {
            0.0
        }
    };
    let level = way - up - down;
    let level = if level > 0.0 { level / v_sq.sqrt() } else { 0.0 };
    (ramp(up, first_sq, gain) + ramp(down, last_sq, loss) + level) * DOWN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_a_trapezoid_and_a_ramp_by_hand() {
        // 1 mm at 1 mm/s² from rest to rest takes 2 s; at 0.5 mm/s at most, 0.25 mm up and down and 0.5 mm level: 2.5 s;
        // from 1 mm/s to 2 mm/s over 1.5 mm: 1 s; the same without an end: 1 s too.
        let near = |time: f64, by_hand: f64| time <= by_hand && time > by_hand * (1.0 - 1e-14);
        assert!(near(least_time(1.0, 0.0, 0.0, [1.0; 2], 1e9), 2.0));
        assert!(near(least_time(1.0, 0.0, 0.0, [1.0; 2], 0.25), 2.5));
        assert!(near(least_time(1.5, 1.0, 4.0, [1.0; 2], 1e9), 1.0));
        assert!(near(least_time(1.5, 1.0, f64::INFINITY, [1.0; 2], 4.0), 1.0));
        assert_eq!(least_time(0.0, 1.0, 1.0, [1.0; 2], 1.0), 0.0);
        // Gathering 3 mm/s² and losing 1: 1.5 mm/s after 0.375 mm in 0.5 s, the last 1.125 mm in 1.5 s.
        assert!(near(least_time(1.5, 0.0, 0.0, [3.0, 1.0], 1e9), 2.0));
    }
}
