//! Computes the least time of an axis over a distance, from the greatest speeds at both ends.

use super::DOWN;

/// A lower bound of the time [s] in which an axis moves by `distance` [mm] or more, from a velocity squared of at
/// most `first_sq` to one of at most `last_sq`. It speeds up by at most `gain` and slows down by at most `loss`
/// [mm/s²]; `v_sq` is the square of its velocity limit.
///
/// The distance is divided in three. On the first part no motion is faster than full acceleration, on the last part none is
/// faster than full braking, and between them none is faster than the velocity limit. Every division gives a valid bound, so its
/// rounding does no harm; the division used is that of the fastest motion.
#[inline]
pub fn least_time(distance: f64, first_sq: f64, last_sq: f64, [gain, loss]: [f64; 2], v_sq: f64) -> f64 {
    let (first_sq, last_sq) = (first_sq.min(v_sq), last_sq.min(v_sq));
    // To the peak of a triangle: first² + 2 gain x = last² + 2 loss (distance − x).
    let rise = (distance * (loss / (gain + loss)) + (last_sq - first_sq) / (2.0 * (gain + loss)))
        .clamp(0.0, distance);
    let (up, down) = if first_sq + 2.0 * gain * rise <= v_sq {
        (rise, distance - rise)
    } else {
        let up = ((v_sq - first_sq) / (2.0 * gain)).min(distance);
        (up, ((v_sq - last_sq) / (2.0 * loss)).min(distance - up))
    };
    let ramp = |distance: f64, from_sq: f64, a: f64| {
        if distance > 0.0 {
            2.0 * distance / (from_sq.sqrt() + (from_sq + 2.0 * a * distance).sqrt())
        } else {
            0.0
        }
    };
    let cruise = distance - up - down;
    let cruise = if cruise > 0.0 { cruise / v_sq.sqrt() } else { 0.0 };
    (ramp(up, first_sq, gain) + ramp(down, last_sq, loss) + cruise) * DOWN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_a_trapezoid_and_a_ramp_by_hand() {
        // 1 mm at 1 mm/s² from rest to rest takes 2 s; at 0.5 mm/s at most, 0.25 mm up and down and 0.5 mm cruise:
        // 2.5 s. From 1 mm/s to 2 mm/s over 1.5 mm takes 1 s, also without an end speed.
        let near = |time: f64, by_hand: f64| time <= by_hand && time > by_hand * (1.0 - 1e-14);
        assert!(near(least_time(1.0, 0.0, 0.0, [1.0; 2], 1e9), 2.0));
        assert!(near(least_time(1.0, 0.0, 0.0, [1.0; 2], 0.25), 2.5));
        assert!(near(least_time(1.5, 1.0, 4.0, [1.0; 2], 1e9), 1.0));
        assert!(near(least_time(1.5, 1.0, f64::INFINITY, [1.0; 2], 4.0), 1.0));
        assert_eq!(least_time(0.0, 1.0, 1.0, [1.0; 2], 1.0), 0.0);
        // Speeding up at 3 mm/s² and braking at 1: 1.5 mm/s after 0.375 mm in 0.5 s, the last 1.125 mm in 1.5 s.
        assert!(near(least_time(1.5, 0.0, 0.0, [3.0, 1.0], 1e9), 2.0));
    }
}
