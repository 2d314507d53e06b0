//! A case of quadratic pieces as a problem of the planner, with their degree or an elevated one, and its plan.

use feedplan_geometry::quadratic::{lerp, norm, sub};
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{Fault, Problem};
use feedplan_planner::profile::Profile;
use feedplan_planner::Exact as _;

use super::axes::padded;
use super::cases::Case;

/// The arrays of such a problem in P axes; axes that the case does not have rest.
pub struct Elevated<const P: usize> {
    control: Vec<[f64; P]>,
    offset: Vec<usize>,
    width: Vec<f64>,
    runs: [usize; 2],
}

impl<const P: usize> Elevated<P> {
    /// The pieces of a case, with `elevate` added to their degree 2.
    pub fn new<const M: usize>(case: &Case<M>, elevate: usize) -> Self {
        let mut control = vec![];
        let mut offset = vec![0];
        for piece in &case.pieces {
            let [a, b, c] = piece.control;
            // A line stays a line.
            let bend = norm(&sub(&b, &lerp(&a, &c, 0.5)));
            let straight = bend <= 1e-15 * (norm(&a) + norm(&c));
            let mut points = if straight { vec![a, c] } else { vec![a, b, c] };
            for _ in 0..if straight { 0 } else { elevate } {
                let n = points.len() as f64;
                let mut higher = vec![points[0]];
                for i in 1..points.len() {
                    let t = i as f64 / n;
                    higher.push(std::array::from_fn(|k| t * points[i - 1][k] + (1.0 - t) * points[i][k]));
                }
                higher.push(points[points.len() - 1]);
                points = higher;
            }
            control.extend(points.iter().map(|point| padded(point, 0.0)));
            offset.push(control.len());
        }
        let width = case.pieces.iter().map(|piece| piece.width).collect();
        Self { control, offset, width, runs: [0, case.pieces.len()] }
    }

    /// The problem of the case.
    pub fn problem<'a, const M: usize>(&'a self, case: &'a Case<M>) -> Problem<'a, P> {
        Problem {
            control: &self.control,
            weight: &[],
            offset: &self.offset,
            width: &self.width,
            tip: None,
            way: None,
            feed_share: &[],
            runs: &self.runs,
            feed: &case.feed,
            junction_speed: &case.junction,
            max_velocity: [padded(&case.velocity, 1.0); 2],
            max_acceleration: [padded(&case.acceleration, 1.0); 2],
            chord_tolerance: case.chord_tolerance,
            period: case.period,
            start_speed: case.start_speed,
            end_speed: case.end_speed,
            watch: Watch::default(),
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
            Elevated::<6>::new(self, elevate).problem(self).fastest()
        }
    }

    pub fn time(&self) -> f64 {
        self.plan().expect("a profile").phases.time()
    }
}
