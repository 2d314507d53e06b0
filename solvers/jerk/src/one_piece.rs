//! A path of one piece, for tests.

use feedplan_planner::problem::Problem;

/// A polynomial piece of this width, from rest to rest at 100 mm/s and 10 m/s² at most for each axis.
pub fn one_piece<'a, const M: usize>(
    control: &'a [[f64; M]],
    offset: &'a [usize; 2],
    width: &'a [f64; 1],
) -> Problem<'a, M> {
    Problem {
        control,
        weight: &[],
        offset,
        width,
        tip: None,
        way: None,
        feed_share: &[],
        runs: &[0, 1],
        feed: &[100.0],
        junction_speed: &[0.0, 0.0],
        max_velocity: [[100.0; M]; 2],
        max_acceleration: [[1e4; M]; 2],
        chord_tolerance: f64::INFINITY,
        period: 0.001,
        start_speed: 0.0,
        end_speed: 0.0,
        watch: Default::default(),
    }
}
