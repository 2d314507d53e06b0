//! Finds where a condition changes between two numbers, to the last digit, by bisection.

/// The two neighbouring numbers between which the condition changes; it holds at `low` and not at `high`.
pub fn boundary(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> [f64; 2] {
    loop {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            return [low, high];
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_two_lies_between_neighbours() {
        let [low, high] = boundary(1.0, 2.0, |x| x * x < 2.0);
        assert!(low * low < 2.0 && high * high >= 2.0 && high == low.next_up());
    }

    #[test]
    fn neighbours_and_numbers_that_are_none_end_at_once() {
        assert_eq!(
            boundary(1.0, 1.0_f64.next_up(), |_| panic!("nothing lies between")),
            [1.0, 1.0_f64.next_up()]
        );
        assert!(boundary(0.0, f64::NAN, |_| true)[1].is_nan());
    }
}
