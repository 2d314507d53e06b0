//! Native kernels of feedplan. Every kernel takes slices and returns vectors; it knows no file and no Python.
//! `python` alone binds them (feature `python`). Lengths are millimetres, times seconds.

pub mod arc;
pub mod arc_kind;
pub mod arc_length;
pub mod audit;
pub mod bang_bang;
pub mod bang_bang_quadratic;
pub mod bernstein;
pub mod bound;
pub mod by_length;
pub mod conic;
pub mod corner;
pub mod curvature_jumps;
pub mod feed;
pub mod fit;
pub mod follow;
pub mod gcode;
pub mod jerk_arcs;
pub mod jerk_limited;
pub mod jerk_limited_path;
mod lanes;
pub mod limit_curve;
pub mod look_ahead;
pub mod motion;
pub mod newton;
pub mod path_builder;
pub mod path_dynamics;
mod planning;
pub mod polynomial;
pub mod quadratic;
pub mod s_curve;
pub mod s_curve_path;
pub mod sampling;
pub mod sarfraz;
pub mod smooth_fit;
pub mod spline;
pub mod stretches;
pub mod text;
pub mod watch;

#[cfg(feature = "python")]
mod python;

#[cfg(test)]
mod tests {
    use proptest::test_runner::{Config, RngSeed};

    #[test]
    fn property_tests_draw_the_same_cases_in_every_run() {
        let config = Config::default();
        assert_ne!(
            config.rng_seed,
            RngSeed::Random,
            ".cargo/config.toml gives a seed: run cargo in the project"
        );
        assert!(config.failure_persistence.is_none());
    }
}
