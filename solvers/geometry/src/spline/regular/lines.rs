//! Recognises straight pieces of any degree, and turns them and their neighbours on the same line into lines from turn to turn.

use super::pieces::{near, Regular};
use crate::polynomial::Polynomial;
use crate::quadratic::{dot, norm, sub};
use crate::spline::bezier::point;
use crate::spline::{Piece, MAX_HODOGRAPH};

/// The form of a piece.
pub enum Form<const M: usize> {
    /// Its start, the places where it turns back, and its end.
    Straight(Vec<LinePoint<M>>),
    Curved,
    /// It has no length.
    Point,
}

/// A point of a straight piece, or of neighbours on one line.
#[derive(Clone, Copy)]
pub struct LinePoint<const M: usize> {
    pub point: [f64; M],
    /// The parameter, counted from the start of the first of the pieces.
    u: f64,
    /// The pieces before and after it.
    pieces: [usize; 2],
}

/// The line through some points.
struct Line<const M: usize> {
    origin: [f64; M],
    direction: [f64; M],
    length: f64,
}

impl<const M: usize> Line<M> {
    /// The line through two of the points that are far apart; None if all points are equal.
    fn through(points: impl Iterator<Item = [f64; M]> + Clone) -> Option<Self> {
        let farthest = |from: &[f64; M]| {
            let apart = |point: &[f64; M]| norm(&sub(point, from));
            points.clone().max_by(|a, b| apart(a).total_cmp(&apart(b)))
        };
        let origin = farthest(&points.clone().next()?)?;
        let way = sub(&farthest(&origin)?, &origin);
        let length = norm(&way);
        (length > 0.0).then(|| Self { origin, direction: way.map(|x| x / length), length })
    }

    fn along(&self, point: &[f64; M]) -> f64 {
        dot(&sub(point, &self.origin), &self.direction)
    }

    /// Whether a point is on the line, up to rounding.
    fn contains(&self, point: &[f64; M], rounding: f64) -> bool {
        let (offset, along) = (sub(point, &self.origin), self.along(point));
        norm(&std::array::from_fn::<f64, M, _>(|k| offset[k] - along * self.direction[k])) <= rounding
    }
}

/// The form of piece `i`.
pub fn form<const M: usize>(i: usize, piece: &Piece<M>, rounding: f64) -> Form<M> {
    let control = piece.control;
    let Some(line) = Line::through(control.iter().copied()).filter(|line| line.length > rounding) else {
        return Form::Point;
    };
    if !control.iter().all(|point| line.contains(point, rounding)) {
        return Form::Curved;
    }
    let at = |u: f64, point: [f64; M]| LinePoint { point, u, pieces: [i, i] };
    let mut points = vec![at(0.0, control[0])];
    if piece.degree() > 1 {
        let turn = |u: f64| at(u, point(piece, u));
        rate(piece, |point| line.along(point)).sign_changes(&mut |t| points.push(turn(t * piece.width)));
    }
    points.push(at(piece.width, control[control.len() - 1]));
    Form::Straight(points)
}

impl<const M: usize> Form<M> {
    /// The first line of a straight form, or with `at_end` the last; None if the form is not straight.
    pub fn edge(&self, at_end: bool) -> Option<[f64; M]> {
        let Self::Straight(points) = self else { return None };
        let i = if at_end { points.len() - 2 } else { 0 };
        Some(sub(&points[i + 1].point, &points[i].point))
    }
}

/// The points of neighbours on one line.
pub struct Straight<const M: usize> {
    points: Vec<LinePoint<M>>,
    line: Option<Line<M>>,
}

impl<const M: usize> Default for Straight<M> {
    fn default() -> Self {
        Self { points: vec![], line: None }
    }
}

impl<const M: usize> Straight<M> {
    /// Adds a straight piece if it begins at the last point and is on the same line; otherwise returns false.
    pub fn extend(&mut self, next: &[LinePoint<M>], rounding: f64) -> bool {
        let Some((line, end)) = self.line.as_ref().zip(self.points.last().copied()) else {
            self.points.extend_from_slice(next);
            self.line = Line::through(next.iter().map(|place| place.point));
            return true;
        };
        if !near(&end.point, &next[0].point, rounding) {
            return false;
        }
        let points = || self.points.iter().chain(next).map(|place| place.point);
        // If a point is beyond twice the length of the known line, its direction may be inaccurate: it is computed again.
        let known = |place: &LinePoint<M>| {
            let reached = line.along(&place.point);
            line.contains(&place.point, rounding) && reached.abs() <= 2.0 * line.length
        };
        if !next.iter().all(known) {
            let Some(line) =
                Line::through(points()).filter(|line| points().all(|p| line.contains(&p, rounding)))
            else {
                return false;
            };
            self.line = Some(line);
        }
        if let Some(joint) = self.points.last_mut() {
            joint.pieces[1] = next[0].pieces[1];
        }
        self.points.extend(next[1..].iter().map(|place| LinePoint { u: end.u + place.u, ..*place }));
        true
    }

    /// Appends the lines from turn to turn to `out`, and removes all points.
    pub fn finish(&mut self, rounding: f64, out: &mut Regular<M>) {
        let (Some(line), mut points) = (self.line.take(), std::mem::take(&mut self.points)) else { return };
        let along = |place: &LinePoint<M>| line.along(&place.point);
        drop_rounding(&mut points, along, rounding);
        let turns = |i: usize| {
            let inside = i > 0 && i + 1 < points.len();
            !inside
                || (along(&points[i]) - along(&points[i - 1])) * (along(&points[i + 1]) - along(&points[i]))
                    < 0.0
        };
        let ends: Vec<LinePoint<M>> = (0..points.len()).filter(|&i| turns(i)).map(|i| points[i]).collect();
        for pair in ends.windows(2) {
            let control = [pair[0].point, pair[1].point];
            let piece = Piece { control: &control, weights: &[], width: pair[1].u - pair[0].u };
            out.push([pair[0].pieces[1], pair[1].pieces[0]], &piece, rounding);
        }
    }
}

/// The derivative (on rational pieces its numerator) of a linear function of the points along the piece.
fn rate<const M: usize>(
    piece: &Piece<M>,
    along: impl Fn(&[f64; M]) -> f64,
) -> Polynomial<{ MAX_HODOGRAPH + 1 }> {
    let weight = |i: usize| if piece.is_rational() { piece.weights[i] / piece.weights[0] } else { 1.0 };
    let start = along(&piece.control[0]);
    let form = |of: &dyn Fn(usize) -> f64| Polynomial::from_bernstein((0..piece.control.len()).map(of));
    let values = form(&|i| weight(i) * (along(&piece.control[i]) - start));
    if piece.is_rational() {
        values.wronskian(&form(&weight))
    } else {
        values.derivative()
    }
}

/// Removes turns between which the path is not longer than `rounding`, the shortest first. Both ends stay where they are.
fn drop_rounding<T>(points: &mut Vec<T>, along: impl Fn(&T) -> f64, rounding: f64) {
    loop {
        let way = |i: usize| (along(&points[i + 1]) - along(&points[i])).abs();
        let Some(shortest) = (0..points.len() - 1).min_by(|&i, &j| way(i).total_cmp(&way(j))) else { return };
        if way(shortest) > rounding {
            return;
        }
        let last = points.len() - 1;
        let step = |i: usize| along(&points[i + 1]) - along(&points[i]);
        match shortest {
            // The path between two turns is rounding: it continues in the same direction.
            i if i > 0 && i + 1 < last && step(i - 1) * step(i + 1) > 0.0 => drop(points.drain(i..i + 2)),
            // Two points at one turn.
            i if i > 0 && i + 1 < last => drop(points.remove(i)),
            // The whole path is rounding.
            _ if last == 1 => drop(points.drain(..)),
            0 => drop(points.remove(1)),
            i => drop(points.remove(i)),
        }
        if points.is_empty() {
            return;
        }
    }
}
