//! The lengths of blends that share the pieces between their corners.

/// The length of each blend on either side of its corner, from the length that each has a use for, and the lengths
/// between one corner and the next. Corners that are not rounded have a use for 0.
///
/// A blend gets half of what is between it and its neighbour, or what the neighbour has no use for. What a blend cannot
/// have on one side of its corner it has no use for on the other; two more rounds hand that on.
pub fn share_lengths(wanted: &[f64], span: &[f64]) -> Vec<f64> {
    const ROUNDS: usize = 3;
    let grant = |span: f64, other: f64| (0.5 * span).max(span - other);
    let shared = |limit: &[f64]| -> Vec<f64> {
        (0..wanted.len())
            .map(|k| {
                let mut length = wanted[k];
                if k > 0 {
                    length = length.min(grant(span[k - 1], limit[k - 1]));
                }
                if k < span.len() {
                    length = length.min(grant(span[k], limit[k + 1]));
                }
                length
            })
            .collect()
    };
    let mut length = shared(wanted);
    for _ in 1..ROUNDS {
        // The others have at least `length`, so none can get more than what that leaves.
        let limit = shared(&length);
        length = shared(&limit);
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blends_share_a_length_by_halves_or_take_what_the_other_leaves() {
        assert_eq!(share_lengths(&[0.0, 9.0, 9.0, 0.0], &[5.0, 4.0, 5.0]), [0.0, 2.0, 2.0, 0.0]);
        assert_eq!(share_lengths(&[0.0, 9.0, 1.0, 0.0], &[5.0, 4.0, 5.0]), [0.0, 3.0, 1.0, 0.0]);
        assert_eq!(share_lengths(&[0.0, 9.0, 0.0], &[5.0, 7.0]), [0.0, 5.0, 0.0]);
        // The first blend is limited by its short side; the second gets the rest.
        let shared = share_lengths(&[0.0, 9.0, 9.0, 0.0], &[0.25, 4.0, 9.0]);
        assert_eq!(shared, [0.0, 0.25, 3.75, 0.0]);
    }

    #[test]
    fn shared_lengths_never_overlap() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for _ in 0..2000 {
            let span: Vec<f64> = (0..12).map(|_| random().powi(3)).collect();
            let mut wanted: Vec<f64> = (0..13).map(|_| 2.0 * random().powi(3)).collect();
            wanted[0] = 0.0;
            wanted[12] = 0.0;
            let length = share_lengths(&wanted, &span);
            for k in 0..12 {
                assert!(length[k] + length[k + 1] <= span[k] * (1.0 + 1e-15) && length[k] <= wanted[k]);
                // None has less than its half unless its other side limits it.
                let left = if k > 0 { 0.5 * span[k - 1] } else { f64::INFINITY };
                assert!(length[k] >= wanted[k].min(0.5 * span[k]).min(left));
            }
        }
    }
}
