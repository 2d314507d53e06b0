//! The motion along the measure of a phase, and the inverse of a displacement as a function of time.

/// Limit of the rounds of Newton's method and bisection.
const MAX_ROUNDS: u32 = 200;

/// Time from the start of the phase in s; and speed, acceleration and jerk along its measure.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    pub t: f64,
    pub v: f64,
    pub a: f64,
    pub j: f64,
}

/// The time in [0, `most`] at which a displacement that grows with time reaches `done`, by Newton's method from a guess, with
/// bisection where a step leaves the bracket. `way` gives the displacement and its slope; a step of at most `tolerance` is the
/// last one.
pub fn time_of_way(way: impl Fn(f64) -> [f64; 2], done: f64, [guess, most]: [f64; 2], tolerance: f64) -> f64 {
    let (mut low, mut high, mut t) = (0.0, most, guess);
    for _ in 0..MAX_ROUNDS {
        let [here, slope] = way(t);
        if here > done {
            high = t;
        } else {
            low = t;
        }
        let next = t - (here - done) / slope;
        let next = if low <= next && next <= high { next } else { 0.5 * (low + high) };
        let last = (next - t).abs() <= tolerance || low >= high;
        t = next;
        if last {
            break;
        }
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_from_rest_is_done_at_the_root_of_its_time() {
        // 1 mm at 8 mm/s²: after half a second, from a guess at rest, where the slope is 0, and from guesses beyond it.
        for guess in [0.0, 0.6, 2.0] {
            let t = time_of_way(|t| [4.0 * t * t, 8.0 * t], 1.0, [guess, 2.0], 0.0);
            assert!((t - 0.5).abs() <= 1e-15, "{t} from {guess}");
        }
    }

    #[test]
    fn a_way_that_is_not_done_within_the_time_ends_with_it() {
        assert_eq!(time_of_way(|t| [t, 1.0], 3.0, [1.0, 2.0], 0.0), 2.0);
    }
}
