//! Turns cases of quadratic pieces into problems of the planner, with degree 2 or an elevated one, and plans them.

use feedplan_geometry::quadratic::{lerp, norm, sub};
use feedplan_geometry::spline::bezier::elevate;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{Fault, Problem};
use feedplan_planner::profile::Profile;
use feedplan_planner::Exact as _;

use super::axes::padded;
use super::cases::Case;

/// A problem of one run from rest to rest, without a chord-error limit, with these greatest velocities and accelerations.
pub fn problem<'a, const P: usize>(
    curve: &'a CompositeCurve<P>,
    runs: &'a [usize; 2],
    feed: &'a [f64],
    junction_speed: &'a [f64],
    [velocity, acceleration]: [[f64; P]; 2],
) -> Problem<'a, P> {
    Problem {
        control: &curve.control,
        weight: &curve.weights,
        offset: &curve.offsets,
        width: &curve.width,
        tip: None,
        way: None,
        feed_share: &[],
        runs,
        feed,
        junction_speed,
        max_velocity: [velocity; 2],
        max_acceleration: [acceleration; 2],
        chord_tolerance: f64::INFINITY,
        period: 0.001,
        start_speed: 0.0,
        end_speed: 0.0,
        watch: Watch::default(),
    }
}

/// The curve of a case in P axes; axes that the case does not have rest.
pub struct Elevated<const P: usize> {
    curve: CompositeCurve<P>,
    runs: [usize; 2],
}

impl<const P: usize> Elevated<P> {
    /// The pieces of a case, with `by` added to their degree 2.
    pub fn new<const M: usize>(case: &Case<M>, by: usize) -> Self {
        let mut curve = CompositeCurve::default();
        for piece in &case.pieces {
            let [a, b, c] = piece.control.map(|point| padded(&point, 0.0));
            // A line stays a line.
            let bend = norm(&sub(&b, &lerp(&a, &c, 0.5)));
            if bend <= 1e-15 * (norm(&a) + norm(&c)) {
                curve.push(&[a, c], &[], piece.width);
            } else {
                elevate(&Piece { control: &[a, b, c], weights: &[], width: piece.width }, by, &mut curve);
            }
        }
        Self { curve, runs: [0, case.pieces.len()] }
    }

    /// The problem of the case.
    pub fn problem<'a, const M: usize>(&'a self, case: &'a Case<M>) -> Problem<'a, P> {
        let limits = [case.velocity, case.acceleration].map(|limits| padded(&limits, 1.0));
        Problem {
            chord_tolerance: case.chord_tolerance,
            period: case.period,
            start_speed: case.start_speed,
            end_speed: case.end_speed,
            ..problem(&self.curve, &self.runs, &case.feed, &case.junction, limits)
        }
    }
}

impl<const M: usize> Case<M> {
    pub fn plan(&self) -> Result<Profile, Fault> {
        self.plan_elevated(0)
    }

    /// The plan of the same pieces with an elevated degree.
    pub fn plan_elevated(&self, elevate: usize) -> Result<Profile, Fault> {
        if M <= 3 {
            Elevated::<3>::new(self, elevate).problem(self).fastest()
        } else {
            Elevated::<9>::new(self, elevate).problem(self).fastest()
        }
    }

    pub fn time(&self) -> f64 {
        self.plan().expect("a profile").phases.time()
    }
}
