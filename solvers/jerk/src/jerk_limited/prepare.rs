//! What a plan begins with: a checked problem, its nodes and a first plan that holds all limits.

use rayon::prelude::*;

use super::baseline;
use super::between::Between;
use super::grid::Grid;
use super::interior_point::Bound;
use super::rest;
use super::rows::Rows;
use super::stretch::Stretch;
use super::survey::{survey, Slopes};
use super::{Effort, End, Fault, Geometry, Limits, Problem};
use feedplan_geometry::watch::Watch;

/// Intervals sampled at a time.
const CHUNK: usize = 1024;
/// Rounds of lowering the first plan where it exceeds a limit.
const ROUNDS: usize = 12;
/// The share of the work of a plan that it is to prepare it.
pub const PREPARING: f64 = 0.1;

/// A problem on its grid.
pub struct Prepared<'a, G, const M: usize> {
    pub problem: &'a Problem<'a, G, M>,
    pub grid: Grid,
    pub bounds: [Bound; 2],
    /// A valid plan (w_0, w'_0, w_1, …).
    pub x: Vec<f64>,
    /// The time of a stop from the greatest speed, in s.
    pub stop_time: f64,
    watch: Watch<'a>,
}

impl<'a, G: Geometry<M>, const M: usize> Prepared<'a, G, M> {
    pub fn new(problem: &'a Problem<'a, G, M>, effort: &Effort<'a>) -> Result<Self, Fault> {
        check(problem)?;
        let knots = problem.geometry.knots();
        let total = knots[knots.len() - 1];
        let limits = &problem.limits;
        let bounds = bounds(problem);
        let watch = effort.watch.part(PREPARING);
        let span = |end: usize| match bounds[end] {
            Bound::Rest { ramp, .. } => ramp,
            Bound::Fixed { .. } => 0.0,
        };
        let (stations, slopes) =
            survey(problem.geometry, limits, problem.caps, [span(0), total - span(1)], &bounds, watch)?;
        let grid = Grid::new(&stations, slopes, problem.caps, &bounds, effort.resolution);
        watch.check();
        let mut prepared = Self { problem, grid, bounds, x: vec![], stop_time: 0.0, watch };
        prepared.begin(slopes)?;
        Ok(prepared)
    }

    /// The first plan.
    fn begin(&mut self, slopes: Slopes) -> Result<(), Fault> {
        let limits = &self.problem.limits;
        let mut caps =
            self.each(|rows, n, _| rows.intervals[n].envelope_cap(limits, slopes.k), f64::INFINITY);
        let fastest = caps.iter().copied().fold(0.0, f64::max).powf(2.0 / 3.0);
        self.stop_time = slopes.stop_time(fastest);
        let mut worst = f64::INFINITY;
        for _ in 0..ROUNDS {
            self.watch.check();
            self.x = baseline::smooth(&self.grid.nodes, &caps, slopes, &self.bounds);
            let used = self.each(|rows, n, x| baseline::used(rows, x, n), 0.0);
            worst = used.iter().copied().fold(0.0, f64::max);
            if worst <= baseline::USE {
                return Ok(());
            }
            for n in 0..used.len() {
                if used[n] > baseline::USE {
                    let r = self.x[2 * n].max(self.x[2 * n + 2]).powf(0.75);
                    caps[n] = caps[n].min(2.0 * r) * baseline::factor(used[n]);
                }
            }
        }
        let scale = baseline::USE / worst;
        if scale == 0.0 || self.bounds.iter().any(|bound| matches!(bound, Bound::Fixed { .. })) {
            return Err(Fault::NoPlan { s: self.grid.nodes[0] });
        }
        self.x.iter_mut().for_each(|x| *x *= scale);
        Ok(())
    }

    /// f(rows of some intervals, index in them, x at their nodes) of every interval.
    fn each(&self, f: impl Fn(&Rows<M>, usize, &[f64]) -> f64 + Sync, fill: f64) -> Vec<f64> {
        let mut out = vec![fill; self.grid.pieces.len()];
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
            self.watch.check();
            let first = chunk * CHUNK;
            let rows = self.grid.rows(self.problem, first..first + out.len());
            let x = self.x.get(2 * first..2 * (first + out.len() + 1)).unwrap_or(&[]);
            for (n, out) in out.iter_mut().enumerate() {
                *out = f(&rows, n, x);
            }
        });
        out
    }

    /// The limits on a range of intervals.
    pub fn stretch(&self, range: std::ops::Range<usize>) -> Stretch<M> {
        let rows = self.grid.rows(self.problem, range.clone());
        let nodes = &self.grid.nodes[range.start..=range.end];
        let pieces = &self.grid.pieces[range];
        let between = Between::sample(self.problem.geometry, &self.problem.limits, nodes, pieces, &rows);
        Stretch { rows, between }
    }
}

/// What is known at the ends of a path.
pub fn bounds<G: Geometry<M>, const M: usize>(problem: &Problem<G, M>) -> [Bound; 2] {
    let knots = problem.geometry.knots();
    let (pieces, limits) = (knots.len() - 1, &problem.limits);
    let total = knots[pieces];
    std::array::from_fn(|end| match problem.ends[end] {
        End::Moving { speed, acceleration } => Bound::Fixed { w: speed * speed, slope: 2.0 * acceleration },
        End::Rest => {
            let (piece, s) = if end == 0 { (0, 0.0) } else { (pieces - 1, total) };
            let ramp = rest::length(limits, &problem.geometry.at(piece, s), total);
            let greatest = rest::greatest(problem.geometry, limits, problem.caps, ramp, end);
            Bound::Rest { ramp, greatest }
        }
    })
}

/// Whether numbers rise, each above the one before.
fn rising(numbers: impl Iterator<Item = f64> + Clone) -> bool {
    numbers.clone().zip(numbers.skip(1)).all(|(a, b)| a < b)
}

/// The problem's numbers once.
fn check<G: Geometry<M>, const M: usize>(problem: &Problem<G, M>) -> Result<(), Fault> {
    let wrong = |what: String| Err(Fault::Input(what));
    let knots = problem.geometry.knots();
    if knots.len() < 2 || knots[0] != 0.0 || !rising(knots.iter().copied()) {
        return wrong("the knots of the path do not rise from 0".into());
    }
    let limits = &problem.limits;
    let Limits { velocity, acceleration, jerk } = limits;
    for (name, unit, values) in [
        ("velocity", "mm/s", &velocity[0]),
        ("velocity", "mm/s", &velocity[1]),
        ("acceleration", "mm/s²", &acceleration[0]),
        ("acceleration", "mm/s²", &acceleration[1]),
        ("jerk", "mm/s³", jerk),
    ] {
        for (axis, &value) in values.iter().enumerate() {
            if !(value > 0.0 && value.is_finite()) {
                return wrong(format!(
                    "the {name} limit of axis {axis} is {value} {unit}: give a positive number"
                ));
            }
        }
    }
    for cap in problem.caps {
        if cap.speed.is_nan() || cap.speed <= 0.0 {
            return wrong(format!(
                "the greatest speed at {} mm is {} mm/s: give a positive number, or stop there",
                cap.s, cap.speed
            ));
        }
    }
    if !rising(problem.caps.iter().map(|cap| cap.s)) {
        return wrong("the places with a greatest speed do not rise".into());
    }
    for end in problem.ends {
        if let End::Moving { speed, acceleration } = end {
            if !(speed > 0.0 && speed.is_finite() && acceleration.is_finite()) {
                return wrong(format!(
                    "a path cannot begin or end at {speed} mm/s with {acceleration} mm/s²: give a speed above 0"
                ));
            }
        }
    }
    Ok(())
}
