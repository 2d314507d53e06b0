//! A spline fitted to a run in windows of intervals: independent solutions, then the seams between them again.
//!
//! All windows share one knot vector, so C4 is automatic; where the coefficients of two windows meet only the band is
//! perturbed, and the seam, its ends held as they are, is solved once more.

use rayon::prelude::*;

use super::band::Band;
use super::interior_point::Problem;
use super::polyline::Polyline;
use super::rows::rows;
use super::spline::{around, energy, greville, Spline, DEGREE};
use feedplan_geometry::watch::Watch;
use std::ops::Range;

/// Intervals of a window.
const WINDOW: usize = 300;
/// Intervals by which a window reaches over its ends, and half the length of a seam.
const OVERLAP: usize = 20;
/// Long chords are straight in the middle: from this part of their length at each end, and from so many times the
/// length from which a chord is long.
const BENT: f64 = 0.25;
const MOST_BENT: f64 = 4.0;
/// The chord of a coefficient that is free.
pub const FREE: u32 = u32::MAX;

/// The fit of a run.
pub struct Fit<'a, const D: usize> {
    pub line: &'a Polyline<D>,
    pub spline: Spline<D>,
    /// The long chord on which a coefficient is held.
    pub pin: Vec<u32>,
    /// Newton steps times intervals.
    pub work: usize,
}

impl<'a, const D: usize> Fit<'a, D> {
    /// The polyline itself as coefficients; chords longer than `long` are pinned.
    pub fn new(line: &'a Polyline<D>, knots: Vec<f64>, long: f64) -> Self {
        let count = knots.len() - 1 + DEGREE;
        let (mut coefficient, mut pin) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for i in 0..count {
            let u = greville(&knots, i);
            let chord = line.chord_at(u);
            let length = line.chord_length(chord);
            let end = (BENT * length).min(MOST_BENT * long);
            let inside = u >= line.station[chord] + end && u <= line.station[chord + 1] - end;
            pin.push(if length > long && inside { chord as u32 } else { FREE });
            coefficient.push(match i {
                0 => line.vertex[0],
                _ if i + 1 == count => line.vertex[line.chords()],
                _ => line.point(chord, u),
            });
        }
        Self { line, spline: Spline { knots, coefficient }, pin, work: 0 }
    }

    /// Solves the problem in ranges of intervals that are far from each other; all else stays as it is.
    pub fn solve(&mut self, ranges: &[Range<usize>], watch: Watch) {
        let (mut windows, mut seams) = (Vec::new(), Vec::new());
        for range in ranges {
            let parts = (range.len() as f64 / WINDOW as f64).round().max(1.0) as usize;
            let cut = |i: usize| range.start + range.len() * i / parts;
            for i in 0..parts {
                let own = cut(i)..cut(i + 1);
                let wide =
                    range.start.max(own.start.saturating_sub(OVERLAP))..range.end.min(own.end + OVERLAP);
                // Of the coefficients that a cut lies between, half belong to each side.
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
        let solved: Vec<(Vec<[f64; D]>, usize)> = windows
            .par_iter()
            .map_init(Band::default, |band, window| {
                each.advance(1);
                self.window(window, band)
            })
            .collect();
        for (window, (x, work)) in windows.iter().zip(solved) {
            self.work += work;
            for i in window.keep.clone() {
                if let Some(x) = x.get(i - window.intervals.start) {
                    self.spline.coefficient[i] = *x;
                }
            }
        }
    }

    /// The coefficients that the intervals of a window see, and the work that they took.
    fn window(&self, window: &Window, band: &mut Band) -> (Vec<[f64; D]>, usize) {
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
            return (given.to_vec(), 0);
        }
        let knots = &self.spline.knots;
        let origin = given[given.len() / 2];
        let (rows, start) = rows(self.line, knots, first, end, &origin);
        let chord = |j: usize| self.line.tolerance[self.line.chord_at(knots[j])];
        let mut problem = Problem {
            energy: (first..end).map(|j| energy(&around(knots, j))).collect(),
            rows,
            start,
            x: given.iter().map(|x| std::array::from_fn(|k| x[k] - origin[k])).collect(),
            fixed,
            unit_energy: (first..end).map(|j| chord(j).powi(2) / (knots[j + 1] - knots[j]).powi(5)).sum(),
        };
        let iterations = problem.solve(band);
        let moved = problem.x.iter().zip(&problem.fixed).zip(given).map(|((x, &fixed), given)| {
            if fixed {
                *given
            } else {
                std::array::from_fn(|k| x[k] + origin[k])
            }
        });
        (moved.collect(), iterations * (end - first))
    }
}

/// Intervals to be solved together.
struct Window {
    intervals: Range<usize>,
    /// The coefficients that reach over the start, over the end, keep their values.
    hold: [bool; 2],
    /// The coefficients that are taken from the solution.
    keep: Range<usize>,
}
