//! Computes the lengths of blends from the greatest lengths that they can use and the lengths between their corners.

/// The length of each blend on either side of its corner, in mm.
///
/// `wanted` is the greatest length that each blend can use (0 where the corner is not rounded), `span[k]` the length between
/// corner k and corner k + 1. A blend gets half of a span, or what the blend at the other end cannot use, whichever is more. A
/// blend has the same length on both sides; if one side is short, its neighbour on the other side gets the rest in two more
/// rounds.
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
        // Each blend gets at least `length`, so its neighbours get at most the rest.
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
                // Each blend gets half of the shorter span beside it, unless it wants less.
                let left = if k > 0 { 0.5 * span[k - 1] } else { f64::INFINITY };
                assert!(length[k] >= wanted[k].min(0.5 * span[k]).min(left));
            }
        }
    }
}
