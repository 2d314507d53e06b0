//! Fits a spline to a run in windows of intervals that are solved in parallel, then solves the seams between them.
//!
//! All windows share one knot vector, so that the spline is C4 whatever its coefficients. Where the coefficients of two windows
//! meet, the curve may leave the tolerance tube. So the intervals around each seam are solved once more, with the coefficients at
//! their ends held.

use super::band::Band;
use super::polyline::Polyline;
use super::problem::Problem;
use super::rows::rows;
use super::spline::{around, greville, Spline, DEGREE};
use feedplan_geometry::parallel::map_with;
use feedplan_geometry::watch::Watch;
use std::ops::Range;

/// The number of intervals of a window.
const WINDOW: usize = 300;
/// The number of intervals by which a window reaches over its ends, and by which a seam reaches to each side.
const OVERLAP: usize = 20;
/// The number of windows that a thread solves with the same memory.
const TOGETHER: usize = 4;
/// Long chords are straight except for this part of their length at each end.
const BENT: f64 = 0.25;
/// The same for a curve that is fitted to a motion: corners have more room, and the lines are still straight.
const FITTED_BENT: f64 = 0.35;
/// The greatest length of these ends, in multiples of the length above which a chord is long.
const MOST_BENT: f64 = 4.0;
/// The least slack of a row with held coefficients, in parts of its limit, because the window that they come from may exceed the
/// limit a little.
const ROOM: f64 = 0.01;
/// The value of `pin` for a coefficient that is not held on a long chord.
pub const FREE: u32 = u32::MAX;

/// The fit of a run.
pub struct Fit<'a, const D: usize> {
    pub line: &'a Polyline<D>,
    pub spline: Spline<D>,
    /// The long chord on which each coefficient is held, or FREE.
    pub pin: Vec<u32>,
}

impl<'a, const D: usize> Fit<'a, D> {
    /// Starts with the polyline as coefficients. Those in the middle of chords longer than `long` are held there.
    pub fn new(line: &'a Polyline<D>, knots: Vec<f64>, long: f64) -> Self {
        let count = knots.len() - 1 + DEGREE;
        let bent = if line.pace.fitted { FITTED_BENT } else { BENT };
        let (mut coefficient, mut pin) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for i in 0..count {
            let u = greville(&knots, i);
            let chord = line.chord_at(u);
            let length = line.chord_length(chord);
            let end = (bent * length).min(MOST_BENT * long);
            let inside = u >= line.station[chord] + end && u <= line.station[chord + 1] - end;
            pin.push(if length > long && inside { chord as u32 } else { FREE });
            coefficient.push(match i {
                0 => line.vertex[0],
                _ if i + 1 == count => line.vertex[line.chords()],
                _ => line.point(chord, u),
            });
        }
        Self { line, spline: Spline { knots, coefficient }, pin }
    }

    /// Solves the problem in ranges of intervals that are far from each other. Coefficients outside the ranges keep their values.
    pub fn solve(&mut self, ranges: &[Range<usize>], watch: Watch) {
        let (mut windows, mut seams) = (Vec::new(), Vec::new());
        for range in ranges {
            let parts = (range.len() as f64 / WINDOW as f64).round().max(1.0) as usize;
            let cut = |i: usize| range.start + range.len() * i / parts;
            for i in 0..parts {
                let own = cut(i)..cut(i + 1);
                let wide =
                    range.start.max(own.start.saturating_sub(OVERLAP))..range.end.min(own.end + OVERLAP);
                // Of the coefficients around a cut, the window on each side supplies half.
                let first = if i == 0 { wide.start } else { own.start + DEGREE / 2 };
                let end = if i + 1 == parts { wide.end + DEGREE } else { own.end + DEGREE / 2 };
                let hold = [i == 0, i + 1 == parts];
                windows.push(Window { intervals: wide, hold, keep: first..end });
                if i > 0 {
                    let around = own.start.saturating_sub(OVERLAP).max(range.start)
                        ..(own.start + OVERLAP).min(range.end);
                    let keep = around.start..around.end + DEGREE;
                    seams.push(Window { intervals: around, hold: [true; 2], keep });
                }
            }
        }
        self.solve_windows(&windows, watch.part(0.7));
        self.solve_windows(&seams, watch.part(0.3));
    }

    fn solve_windows(&mut self, windows: &[Window], watch: Watch) {
        let each = watch.each(windows.len());
        let solved = map_with(windows.len(), TOGETHER, Band::<D>::default, |band, i| {
            each.advance(1);
            self.window(&windows[i], band)
        });
        for (window, x) in windows.iter().zip(solved) {
            for i in window.keep.clone() {
                if let Some(x) = x.get(i - window.intervals.start) {
                    self.spline.coefficient[i] = *x;
                }
            }
        }
    }

    /// Solves a window; returns the coefficients of the basis functions on its intervals.
    fn window(&self, window: &Window, band: &mut Band<D>) -> Vec<[f64; D]> {
        let Window { intervals, hold, .. } = window;
        let (first, end) = (intervals.start, intervals.end);
        let count = self.spline.coefficient.len();
        let held = |i: usize| {
            let before = hold[0] && first > 0 && i < first + DEGREE;
            let after = hold[1] && end < self.spline.intervals() && i >= end;
            before || after || i == 0 || i + 1 == count || self.pin[i] != FREE
        };
        let fixed: Vec<bool> = (first..end + DEGREE).map(held).collect();
        let given = &self.spline.coefficient[first..end + DEGREE];
        if fixed.iter().all(|&fixed| fixed) {
            return given.to_vec();
        }
        let knots = &self.spline.knots;
        let origin = given[given.len() / 2];
        let pace = &self.line.pace;
        let density: Vec<f64> = (first..end)
            .map(|j| pace.density(0.5 * (knots[j] + knots[j + 1]), knots[j + 1] - knots[j]))
            .collect();
        let (mut rows, start) = rows(self.line, knots, first, &density, &origin);
        let x: Vec<[f64; D]> = given.iter().map(|x| std::array::from_fn(|k| x[k] - origin[k])).collect();
        for (j, pair) in start.windows(2).enumerate() {
            if fixed[j..=j + DEGREE].contains(&true) {
                rows[pair[0]..pair[1]].iter_mut().for_each(|row| row.admit(&x[j..=j + DEGREE], ROOM));
            }
        }
        let unit = |j: usize| {
            let tolerance = self.line.tolerance[self.line.chord_at(knots[j])];
            density[j - first] * tolerance.powi(2) / (knots[j + 1] - knots[j]).powi(5)
        };
        let (energy, pull) = (first..end).map(|j| pace.energy(&around(knots, j))).unzip();
        let mut problem =
            Problem { energy, pull, rows, start, x, fixed, unit: (first..end).map(unit).collect() };
        problem.solve(band);
        let moved = problem.x.iter().zip(&problem.fixed).zip(given).map(|((x, &fixed), given)| {
            if fixed {
                *given
            } else {
                std::array::from_fn(|k| x[k] + origin[k])
            }
        });
        moved.collect()
    }
}

/// Intervals that are solved together.
struct Window {
    intervals: Range<usize>,
    /// Whether the coefficients that it shares with the intervals before it, and with those after it, keep their values.
    hold: [bool; 2],
    /// The coefficients that are taken from the solution.
    keep: Range<usize>,
}
