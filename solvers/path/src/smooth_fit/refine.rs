//! Halves the intervals that fail their certificate, and finds the ranges of intervals to be solved again.

use std::ops::Range;

use super::spline::{Spline, DEGREE};
use super::windows::Fit;

/// Intervals on each side of a halved one that are solved again with it.
const REACH: usize = 8;

/// Halves the chosen intervals and their neighbours. Returns the new fit, in which coefficients away from halved intervals keep
/// their values, and the ranges of its intervals to solve.
pub fn halved<'a, const D: usize>(
    fit: &Fit<'a, D>,
    halve: &[bool],
    long: f64,
) -> (Fit<'a, D>, Vec<Range<usize>>) {
    let count = halve.len();
    let chosen = |j: usize| halve[j.saturating_sub(1)..(j + 2).min(count)].contains(&true);
    let mut knots = Vec::with_capacity(2 * count);
    // For each new interval: whether it is a half, and the old interval from which it comes.
    let mut origin: Vec<(bool, usize)> = Vec::with_capacity(2 * count);
    for j in 0..count {
        let (low, high) = (fit.spline.knots[j], fit.spline.knots[j + 1]);
        let middle = 0.5 * (low + high);
        knots.push(low);
        // Knots that differ by rounding only have no number between them.
        let new = chosen(j) && low < middle && middle < high;
        origin.push((new, j));
        if new {
            knots.push(middle);
            origin.push((new, j));
        }
    }
    knots.push(fit.spline.knots[count]);
    let mut next = Fit::new(fit.line, knots, long);
    keep_coefficients(&fit.spline, &mut next.spline, &origin);

    let mut ranges: Vec<Range<usize>> = Vec::new();
    for (j, _) in origin.iter().enumerate().filter(|(_, (new, _))| *new) {
        let range = j.saturating_sub(REACH)..(j + 1 + REACH).min(origin.len());
        match ranges.last_mut() {
            Some(last) if range.start <= last.end => last.end = range.end,
            _ => ranges.push(range),
        }
    }
    (next, ranges)
}

/// Copies the coefficients of basis functions that are zero on all halved intervals.
fn keep_coefficients<const D: usize>(old: &Spline<D>, new: &mut Spline<D>, origin: &[(bool, usize)]) {
    // The last halved interval at or before i.
    let mut last_new = None;
    let count = origin.len();
    for i in 0..count + DEGREE {
        if i < count && origin[i].0 {
            last_new = Some(i);
        }
        // The basis function of coefficient i is not zero on the intervals i − 5 to i.
        if last_new.is_none_or(|j| j + DEGREE < i) {
            let (at, before) = if i < count { (i, 0) } else { (count - 1, i + 1 - count) };
            new.coefficient[i] = old.coefficient[origin[at].1 + before];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth_fit::polyline::Polyline;

    #[test]
    fn what_is_far_from_a_halved_interval_keeps_its_coefficients() {
        let line = Polyline::new(vec![[0.0, 0.0], [60.0, 0.0], [60.0, 40.0]], vec![0.1; 2]);
        let knots: Vec<f64> = (0..=100).map(f64::from).collect();
        let mut fit = Fit::new(&line, knots, 1e3);
        for (i, coefficient) in fit.spline.coefficient.iter_mut().enumerate() {
            coefficient[1] += i as f64;
        }
        let mut halve = vec![false; 100];
        halve[50] = true;
        let (next, ranges) = halved(&fit, &halve, 1e3);
        assert_eq!((next.spline.intervals(), ranges.len(), &ranges[0]), (103, 1, &(41..63)));
        assert_eq!(&next.spline.knots[48..56], [48.0, 49.0, 49.5, 50.0, 50.5, 51.0, 51.5, 52.0]);
        let (old, new) = (&fit.spline.coefficient, &next.spline.coefficient);
        assert_eq!(new[..49], old[..49]);
        assert_eq!(new[60..], old[57..]);
        assert!((49..60).all(|i| new[i][1] < 40.0 + 1e-12));
    }
}
