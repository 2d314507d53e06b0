//! Limits that differ for positive and negative values, scaled by their mean: one factor scales values of both signs,
//! so that the scaled value stays smooth where its sign changes.

use feedplan_planner::problem::Both;

/// Limits of each axis, scaled by the mean of its two limits.
#[derive(Clone, Copy, Debug)]
pub struct Sides<const M: usize> {
    /// 1/mean of both limits.
    pub per_mean: [f64; M],
    /// The limits of positive and of negative values over the mean: 1 where both are the same.
    pub most: [[f64; 2]; M],
    /// 1/`most`.
    pub per_most: [[f64; 2]; M],
}

impl<const M: usize> Sides<M> {
    pub fn new(limits: &Both<M>) -> Self {
        let mean: [f64; M] = std::array::from_fn(|k| 0.5 * (limits[0][k] + limits[1][k]));
        let most: [[f64; 2]; M] = std::array::from_fn(|k| [0, 1].map(|sign| limits[sign][k] / mean[k]));
        Self {
            per_mean: mean.map(|mean| 1.0 / mean),
            most,
            per_most: most.map(|both| both.map(|most| 1.0 / most)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_limits_by_hand() {
        let sides = Sides::new(&[[3.0, 7.0], [1.0, 7.0]]);
        assert_eq!(sides.per_mean, [0.5, 1.0 / 7.0]);
        assert_eq!(sides.most, [[1.5, 0.5], [1.0, 1.0]]);
        assert_eq!(sides.per_most, [[1.0 / 1.5, 2.0], [1.0, 1.0]]);
    }
}
