//! Limits that differ for positive and negative values, scaled by the mean of both: one scale factor for both signs keeps the
//! scaled value smooth where its sign changes.

use feedplan_planner::problem::Both;

/// The two limits of an axis, scaled by their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sides {
    /// 1/mean of both limits.
    pub per_mean: f64,
    /// The limits of positive and of negative values, divided by the mean: 1 where both are the same.
    pub most: [f64; 2],
    /// 1/`most`.
    pub per_most: [f64; 2],
}

impl Sides {
    /// The scaled limits of each axis.
    pub fn of<const M: usize>(limits: &Both<M>) -> [Self; M] {
        std::array::from_fn(|k| {
            let mean = 0.5 * (limits[0][k] + limits[1][k]);
            let most = [0, 1].map(|sign| limits[sign][k] / mean);
            Self { per_mean: 1.0 / mean, most, per_most: most.map(|most| 1.0 / most) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_limits_by_hand() {
        let [one, other] = Sides::of(&[[3.0, 7.0], [1.0, 7.0]]);
        assert_eq!(one, Sides { per_mean: 0.5, most: [1.5, 0.5], per_most: [1.0 / 1.5, 2.0] });
        assert_eq!((other.per_mean, other.most), (1.0 / 7.0, [1.0; 2]));
    }
}
