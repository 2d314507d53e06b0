//! Prepares what the solver starts from: the checked problem, its grid, the known ends, and a first plan within all limits.

use std::ops::Range;

use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::parallel::each_part;

use super::constraints::Constraints;
use super::grid::Grid;
use super::hermite;
use super::initial_plan;
use super::rest_ramp::{self, Ramp};
use super::speed_envelope::{sample_envelope, Slopes};
use super::window::Window;
use super::window_end::WindowEnd;
use crate::path_problem::{Effort, End, Fault, Limits, Problem};
use feedplan_geometry::watch::Watch;

/// Intervals that one thread takes at a time.
const CHUNK: usize = 1024;
/// Rounds in which the first plan is lowered where it exceeds a limit.
const ROUNDS: usize = 12;
/// The fraction of a plan's progress that the preparation takes.
pub const PREPARING: f64 = 0.1;

/// A problem on its grid.
pub struct Prepared<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub grid: Grid,
    pub ends: [WindowEnd; 2],
    /// The ends for the lower bound, which holds for every motion between these ends.
    pub bound_ends: [WindowEnd; 2],
    /// The constraints on all intervals if one window takes them all, else None.
    rows: Option<Constraints>,
    /// A valid plan (w_0, w'_0, w_1, …); empty if none was found.
    pub x: Vec<f64>,
    /// The greatest speed that the envelope allows on each interval, in mm/s.
    pub speeds: Vec<f64>,
    /// The use of the limits by the valid plan on each interval; see `initial_plan::used`.
    pub used: Vec<f64>,
    pub slopes: Slopes,
    watch: Watch<'a>,
}

impl<'a, const M: usize> Prepared<'a, M> {
    pub fn new(problem: &'a Problem<'a, M>, effort: &Effort<'a>) -> Result<Self, Fault> {
        check(problem)?;
        let knots = problem.geometry.knots();
        let total = knots[knots.len() - 1];
        let limits = &problem.limits;
        let [ends, bound_ends] = window_ends(problem);
        let watch = effort.watch.part(PREPARING);
        let (samples, slopes) = sample_envelope(
            problem.geometry,
            limits,
            problem.caps,
            [ends[0].ramp().length, total - ends[1].ramp().length],
            &ends,
            watch,
        )?;
        let grid = Grid::new(&samples, slopes, problem.caps, &ends, effort.resolution);
        watch.check();
        let mut prepared = Self::on(problem, grid, [ends, bound_ends], slopes, effort);
        prepared.begin();
        Ok(prepared)
    }

    /// Keeps only what the preparation on a finer grid needs.
    pub fn start(self) -> Start {
        let Self { grid, ends, bound_ends, x, slopes, .. } = self;
        Start { grid, ends: [ends, bound_ends], x, slopes }
    }

    fn on(
        problem: &'a Problem<'a, M>,
        grid: Grid,
        [ends, bound_ends]: [[WindowEnd; 2]; 2],
        slopes: Slopes,
        effort: &Effort<'a>,
    ) -> Self {
        let whole = || {
            let mut rows = Constraints::new(&problem.limits, &problem.moves);
            grid.sample(problem, 0..grid.pieces.len(), &mut rows);
            rows
        };
        let rows = (grid.pieces.len() <= effort.window).then(whole);
        Self {
            problem,
            grid,
            ends,
            bound_ends,
            rows,
            x: vec![],
            speeds: vec![],
            used: vec![],
            slopes,
            watch: effort.watch.part(PREPARING),
        }
    }

    /// Computes the first plan: smooths the speed envelope, with lower caps of r where the plan exceeds a limit. If it still does
    /// after all rounds, all of w is scaled down; x is left empty where given ends do not allow that.
    fn begin(&mut self) {
        let (limits, slopes) = (&self.problem.limits, self.slopes);
        let mut caps =
            self.each(|rows, _| (0..rows.count()).map(|n| rows.envelope_cap(n, limits, slopes.k)).collect());
        self.speeds = caps.iter().map(|r| r.cbrt().powi(2)).collect();
        let mut worst = f64::INFINITY;
        for _ in 0..ROUNDS {
            self.watch.check();
            self.x = initial_plan::smooth(&self.grid.stations, &caps, slopes, &self.ends);
            self.used =
                self.each(|rows, x| rows.utilisation(x).into_iter().map(initial_plan::used).collect());
            worst = self.used.iter().copied().fold(0.0, f64::max);
            if worst <= 1.0 {
                return;
            }
            for (n, &used) in self.used.iter().enumerate() {
                if used > 1.0 {
                    let r = self.x[2 * n].max(self.x[2 * n + 2]).power(0.75);
                    caps[n] = caps[n].min(2.0 * r) * initial_plan::factor(used);
                }
            }
        }
        let scale = 1.0 / worst;
        if scale == 0.0 || self.ends.iter().any(|kind| matches!(kind, WindowEnd::Fixed { .. })) {
            self.x.clear();
        }
        self.x.iter_mut().for_each(|x| *x *= scale);
    }

    /// Calls f(constraints of some intervals, x at their stations) for all intervals, in parallel. Returns one value for each
    /// interval.
    fn each(&self, f: impl Fn(&Constraints, &[f64]) -> Vec<f64> + Sync) -> Vec<f64> {
        let mut out = vec![0.0; self.grid.pieces.len()];
        each_part(&mut out, CHUNK, &|first, out| {
            self.watch.check();
            let mut rows = Constraints::new(&self.problem.limits, &self.problem.moves);
            self.take(first..first + out.len(), &mut rows);
            let x = self.x.get(2 * first..2 * (first + out.len() + 1)).unwrap_or(&[]);
            out.copy_from_slice(&f(&rows, x));
        });
        out
    }

    /// Sets `rows` to the constraints on a range of intervals.
    fn take(&self, range: Range<usize>, rows: &mut Constraints) {
        match &self.rows {
            Some(all) => rows.copy(all, range),
            None => self.grid.sample(self.problem, range, rows),
        }
    }

    /// Sets the constraints and the check of a window to those of a range of intervals.
    pub fn fill(&self, range: Range<usize>, window: &mut Window) {
        self.take(range.clone(), &mut window.rows);
        let stations = &self.grid.stations[range.start..=range.end];
        window.check.sample(self.problem.geometry, stations, &self.grid.pieces[range], &window.rows);
    }
}

/// A grid, the ends for the plan and for the lower bound, and a valid plan.
pub struct Start {
    pub grid: Grid,
    ends: [[WindowEnd; 2]; 2],
    x: Vec<f64>,
    slopes: Slopes,
}

impl Start {
    /// The problem on a finer grid, in which interval n is split into `parts[n]` equal parts. The first plan is kept if it is
    /// valid there, else a new one is made.
    pub fn refined<'a, const M: usize>(
        &self,
        problem: &'a Problem<'a, M>,
        parts: &[u32],
        effort: &Effort<'a>,
    ) -> Prepared<'a, M> {
        let mut fine = Prepared::on(problem, self.grid.refined(parts), self.ends, self.slopes, effort);
        if !self.x.is_empty() {
            let counts = parts.iter().map(|&parts| parts as usize);
            fine.x = hermite::prolong(&self.x, counts, &fine.grid.lengths());
            fine.used =
                fine.each(|rows, x| rows.utilisation(x).into_iter().map(initial_plan::kept).collect());
        }
        if fine.x.is_empty() || fine.used.iter().any(|&used| used > 1.0) {
            fine.begin();
        }
        fine
    }
}

/// The known values at both ends of a path, for the plan and for the lower bound.
fn window_ends<const M: usize>(problem: &Problem<M>) -> [[WindowEnd; 2]; 2] {
    let knots = problem.geometry.knots();
    let (pieces, limits) = (knots.len() - 1, &problem.limits);
    let total = knots[pieces];
    let at_rest = |end: usize, power: f64, most: f64| {
        let (piece, s) = if end == 0 { (0, 0.0) } else { (pieces - 1, total) };
        let length = rest_ramp::length(limits, &problem.geometry.at(piece, s), total);
        let ramp = Ramp { length, power };
        let greatest = rest_ramp::greatest(problem.geometry, limits, problem.caps, ramp, end);
        WindowEnd::Rest { ramp, greatest: greatest.min(2.0 * most * length) }
    };
    let both = [0, 1].map(|end| match problem.ends[end] {
        End::Rest => [at_rest(end, Ramp::JERK, f64::INFINITY); 2],
        End::Turn { acceleration, greatest } => {
            [acceleration, greatest].map(|most| at_rest(end, Ramp::ACCELERATION, most))
        }
        End::Moving { speed, acceleration } => {
            [WindowEnd::Fixed { w: speed * speed, slope: 2.0 * acceleration }; 2]
        }
        End::Held { speed } => [WindowEnd::Fixed { w: speed * speed, slope: 0.0 }, WindowEnd::Free],
    });
    // The rounding error of arc lengths, about 2e-5 of the shortest ramps. A plan's w at the end of a ramp stays below its limit
    // by the fraction that this error is of the ramp's length.
    let rounding = f64::EPSILON * total;
    let planned = both.map(|end| match end[0] {
        WindowEnd::Rest { ramp, greatest } => {
            WindowEnd::Rest { ramp, greatest: greatest / (1.0 + rounding / ramp.length) }
        }
        end => end,
    });
    [planned, both.map(|end| end[1])]
}

/// Whether each number is greater than the one before.
fn rising(numbers: impl Iterator<Item = f64> + Clone) -> bool {
    numbers.clone().zip(numbers.skip(1)).all(|(a, b)| a < b)
}

/// Checks the problem's numbers; the fault names the first wrong one.
fn check<const M: usize>(problem: &Problem<M>) -> Result<(), Fault> {
    let wrong = |what: String| Err(Fault::Input(what));
    let knots = problem.geometry.knots();
    if knots.len() < 2 || !rising(knots.iter().copied()) {
        return wrong("the knots of the path do not rise: give two or more, each above the last".into());
    }
    if knots[0] != 0.0 && matches!(problem.ends[0], End::Rest | End::Turn { .. }) {
        return wrong(format!("a path from rest begins at {} mm: let it begin at 0", knots[0]));
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
                "the speed cap at {} mm is {} mm/s: give a positive number, or stop there",
                cap.s, cap.speed
            ));
        }
    }
    if !rising(problem.caps.iter().map(|cap| cap.s)) {
        return wrong("the speed caps do not rise along the path: sort them, one at each place".into());
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
