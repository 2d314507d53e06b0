//! Stretches between corners, shared by them.

/// Lengths of corners that share the stretches between them, from what each `need`s; `stretch[k]` lies between
/// corners k and k + 1, and corners that are not rounded need 0.
///
/// Each corner gets half of a stretch, or what the other does not need. What a corner cannot have on its other
/// side it does not need here either; two more rounds hand that on.
pub fn share_lengths(need: &[f64], stretch: &[f64]) -> Vec<f64> {
    const ROUNDS: usize = 3;
    let grant = |stretch: f64, other: f64| (0.5 * stretch).max(stretch - other);
    let shared = |limit: &[f64]| -> Vec<f64> {
        (0..need.len())
            .map(|k| {
                let mut length = need[k];
                if k > 0 {
                    length = length.min(grant(stretch[k - 1], limit[k - 1]));
                }
                if k < stretch.len() {
                    length = length.min(grant(stretch[k], limit[k + 1]));
                }
                length
            })
            .collect()
    };
    let mut limit = need.to_vec();
    let mut length = shared(&limit);
    for _ in 1..ROUNDS {
        // The others have at least `length`, so no corner can get more than what that leaves.
        limit = shared(&length);
        length = shared(&limit);
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_share_a_stretch_by_halves_or_take_what_the_other_leaves() {
        assert_eq!(share_lengths(&[0.0, 9.0, 9.0, 0.0], &[5.0, 4.0, 5.0]), [0.0, 2.0, 2.0, 0.0]);
        assert_eq!(share_lengths(&[0.0, 9.0, 1.0, 0.0], &[5.0, 4.0, 5.0]), [0.0, 3.0, 1.0, 0.0]);
        assert_eq!(share_lengths(&[0.0, 9.0, 0.0], &[5.0, 7.0]), [0.0, 5.0, 0.0]);
        // The first corner is held by its short side, the second gets the rest.
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
            let stretch: Vec<f64> = (0..12).map(|_| random().powi(3)).collect();
            let mut need: Vec<f64> = (0..13).map(|_| 2.0 * random().powi(3)).collect();
            need[0] = 0.0;
            need[12] = 0.0;
            let length = share_lengths(&need, &stretch);
            for k in 0..12 {
                assert!(length[k] + length[k + 1] <= stretch[k] * (1.0 + 1e-15) && length[k] <= need[k]);
                // Nobody has less than its half without being held elsewhere.
                let left = if k > 0 { 0.5 * stretch[k - 1] } else { f64::INFINITY };
                assert!(length[k] >= need[k].min(0.5 * stretch[k]).min(left));
            }
        }
    }
}
