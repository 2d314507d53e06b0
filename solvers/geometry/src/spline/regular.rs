//! The same curve as pieces whose C' is not 0 inside: straight pieces become lines cut where they turn back, curved pieces
//! are cut in their cusps.
//!
//! Planners need C' ≠ 0 to compute a speed from a parameter. A straight piece of any degree, polynomial or rational, passes
//! the same places as the lines of degree 1 between its turns. In the cusp of a curved piece the curvature is unbounded, and
//! the tool rests: the piece and its run end there.

use std::ops::Range;

use super::bezier::{point, split};
use super::cusps::{piece_cusps, rests_at_ends};
use super::{CompositeCurve, Piece, MAX_HODOGRAPH};
use crate::polynomial::Polynomial;
use crate::quadratic::{dot, norm, sub};
use crate::tolerance::{AT_END, CUSP, ROUNDING, SAME_DIRECTION};
use crate::watch::Watch;

/// The regular pieces of a curve.
pub struct Regular<const M: usize> {
    pub curve: CompositeCurve<M>,
    /// For each piece, the first and the last of the given pieces that it goes along.
    pub source: Vec<[usize; 2]>,
    /// Whether a piece begins and ends in a cusp, where the tool rests.
    pub rests: Vec<[bool; 2]>,
    /// The pieces that each of the given ranges has become.
    pub ranges: Vec<Range<usize>>,
}

impl<const M: usize> Regular<M> {
    fn push(&mut self, source: [usize; 2], piece: &Piece<M>, rounding: f64) {
        self.curve.push(piece.control, piece.weights, piece.width);
        let last = self.curve.len() - 1;
        // A piece without length before this one may have been left out.
        if last > 0 {
            let end = self.curve.control[self.curve.offsets[last] - 1];
            let start = &mut self.curve.control_mut(last)[0];
            if near(&end, start, rounding) {
                *start = end;
            }
        }
        self.source.push(source);
    }
}

/// The form of a piece.
enum Form<const M: usize> {
    /// Its start, its turns and its end.
    Straight(Vec<LinePoint<M>>),
    Curved,
    /// It has no length.
    Point,
}

/// A point of a straight piece, or of neighbours on one line.
#[derive(Clone, Copy)]
struct LinePoint<const M: usize> {
    point: [f64; M],
    /// The parameter from the start of the first of them.
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
    /// Through two of the points that are far apart; None if all are equal.
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

    /// Whether a point is on it, up to rounding.
    fn contains(&self, point: &[f64; M], rounding: f64) -> bool {
        let (offset, along) = (sub(point, &self.origin), self.along(point));
        norm(&std::array::from_fn::<f64, M, _>(|k| offset[k] - along * self.direction[k])) <= rounding
    }
}

/// The regular pieces of a curve, of each range of its pieces by itself.
///
/// Pieces without length are left out. Neighbours on one line become one line, unless both are lines already. Parameter
/// intervals stay; on lines C' is constant.
pub fn regular<const M: usize>(
    given: &CompositeCurve<M>,
    ranges: &[Range<usize>],
    watch: Watch,
) -> Regular<M> {
    let greatest = given.control.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let rounding = ROUNDING * greatest;
    let mut out = Regular { curve: CompositeCurve::default(), source: vec![], rests: vec![], ranges: vec![] };
    for range in ranges {
        let first = out.curve.len();
        let pieces: Vec<Piece<M>> = range.clone().map(|i| given.piece(i)).collect();
        let forms = range.clone().zip(&pieces).map(|(i, piece)| {
            watch.each(given.len()).count(i);
            form(i, piece, rounding)
        });
        let mut moving: Vec<(usize, Piece<M>, Form<M>)> = range
            .clone()
            .zip(&pieces)
            .zip(forms)
            .map(|((i, piece), form)| (i, *piece, form))
            .filter(|(_, _, form)| !matches!(form, Form::Point))
            .collect();
        keep_joints(&mut moving, rounding);
        let mut straight = Straight::default();
        for (n, (i, piece, form)) in moving.iter().enumerate() {
            watch.check_at(n);
            if let Form::Straight(points) = form {
                let lines = n > 0 && piece.degree() == 1 && moving[n - 1].1.degree() == 1;
                if lines || !straight.extend(points, rounding) {
                    straight.finish(rounding, &mut out);
                    straight.extend(points, rounding);
                }
            } else {
                straight.finish(rounding, &mut out);
                cut_in_cusps(*i, piece, rounding, &mut out);
            }
        }
        straight.finish(rounding, &mut out);
        out.ranges.push(first..out.curve.len());
    }
    out.curve = joined_in_cusps(&out.curve, rounding);
    out.rests = out.curve.pieces().map(|piece| rests_at_ends(&piece)).collect();
    out
}

/// The form of piece `i`.
fn form<const M: usize>(i: usize, piece: &Piece<M>, rounding: f64) -> Form<M> {
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

/// The points of neighbours on one line.
struct Straight<const M: usize> {
    points: Vec<LinePoint<M>>,
    line: Option<Line<M>>,
}

impl<const M: usize> Default for Straight<M> {
    fn default() -> Self {
        Self { points: vec![], line: None }
    }
}

impl<const M: usize> Straight<M> {
    /// Adds a straight piece if it begins at the last point and is on the same line; false if not.
    fn extend(&mut self, next: &[LinePoint<M>], rounding: f64) -> bool {
        let Some((line, end)) = self.line.as_ref().zip(self.points.last().copied()) else {
            self.points.extend_from_slice(next);
            self.line = Line::through(next.iter().map(|place| place.point));
            return true;
        };
        if !near(&end.point, &next[0].point, rounding) {
            return false;
        }
        let points = || self.points.iter().chain(next).map(|place| place.point);
        // Beyond twice the length of the known line its direction may be wrong: it is computed again.
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
    fn finish(&mut self, rounding: f64, out: &mut Regular<M>) {
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

/// The derivative, or on rational pieces its numerator, of a linear function of the points.
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

/// Removes turns between which the path is no longer than rounding, the shortest first. Both ends stay where they are.
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
            // Two turns between which the path is rounding: it goes on in the same direction.
            i if i > 0 && i + 1 < last && step(i - 1) * step(i + 1) > 0.0 => drop(points.drain(i..i + 2)),
            // Two points of one turn.
            i if i > 0 && i + 1 < last => drop(points.remove(i)),
            // All of the path is rounding.
            _ if last == 1 => drop(points.drain(..)),
            0 => drop(points.remove(1)),
            i => drop(points.remove(i)),
        }
        if points.is_empty() {
            return;
        }
    }
}

/// Keeps pieces as they are if as a line they would meet a neighbour in a corner that is smooth now: they are so short that
/// their directions are rounding.
fn keep_joints<const M: usize>(moving: &mut [(usize, Piece<M>, Form<M>)], rounding: f64) {
    let mut kept = false;
    while !std::mem::replace(&mut kept, true) {
        for n in 1..moving.len() {
            let [(_, before, form), (_, after, next)] = &moving[n - 1..=n] else { return };
            let edge = |piece: &Piece<M>, at_end| piece.edge(at_end).unwrap_or([0.0; M]);
            let (own, own_next) = (edge(before, true), edge(after, false));
            let (line, line_next) = (form.edge(true), next.edge(false));
            if (line.is_none() && line_next.is_none())
                || !near(&before.control[before.degree()], &after.control[0], rounding)
                || !is_smooth(&own, &own_next, rounding)
                || is_smooth(&line.unwrap_or(own), &line_next.unwrap_or(own_next), rounding)
            {
                continue;
            }
            for (_, piece, form) in &mut moving[n - 1..=n] {
                if piece.degree() > 1 && matches!(form, Form::Straight(_)) {
                    *form = Form::Curved;
                    kept = false;
                }
            }
        }
    }
}

impl<const M: usize> Form<M> {
    /// Its first line, or with `at_end` its last; None if it is not straight.
    fn edge(&self, at_end: bool) -> Option<[f64; M]> {
        let Self::Straight(points) = self else { return None };
        let i = if at_end { points.len() - 2 } else { 0 };
        Some(sub(&points[i + 1].point, &points[i].point))
    }
}

/// Whether two edges have one direction, up to the rounding of their ends.
fn is_smooth<const M: usize>(before: &[f64; M], after: &[f64; M], rounding: f64) -> bool {
    let (own, others) = (norm(before), norm(after));
    let turn = norm(&std::array::from_fn::<f64, M, _>(|k| after[k] / others - before[k] / own));
    turn <= SAME_DIRECTION + rounding / own.min(others)
}

fn near<const M: usize>(a: &[f64; M], b: &[f64; M], rounding: f64) -> bool {
    norm(&sub(a, b)) <= rounding
}

/// Appends a curved piece, cut in its cusps.
fn cut_in_cusps<const M: usize>(source: usize, piece: &Piece<M>, rounding: f64, out: &mut Regular<M>) {
    let cusps = piece_cusps(piece, CUSP);
    let inside = cusps.iter().filter(|t| (AT_END..=1.0 - AT_END).contains(*t));
    let cuts: Vec<f64> = inside.map(|t| t * piece.width).collect();
    if cuts.is_empty() {
        return out.push([source; 2], piece, rounding);
    }
    let mut parts = CompositeCurve::default();
    split(piece, &cuts, &mut parts);
    for part in parts.pieces().filter(|part| part.extent().0 > rounding) {
        out.push([source; 2], &part, rounding);
    }
}

/// The same curve with the control points next to a cusp moved into it, on both sides, so that C' is exactly 0 there. Pieces
/// that become straight by this become lines.
fn joined_in_cusps<const M: usize>(curve: &CompositeCurve<M>, rounding: f64) -> CompositeCurve<M> {
    let sides = |piece| [false, true].map(|at_end| turns_in_cusp(&piece, at_end, rounding));
    let sides: Vec<[Option<bool>; 2]> = curve.pieces().map(sides).collect();
    let mut out = CompositeCurve::default();
    for (i, piece) in curve.pieces().enumerate() {
        let before = i.checked_sub(1).and_then(|before| sides[before][1]);
        let after = sides.get(i + 1).and_then(|after| after[0]);
        let [start, end] = [(sides[i][0], before), (sides[i][1], after)]
            .map(|(own, beside)| own.is_some_and(|turns| turns || beside == Some(true)));
        if !start && !end {
            out.push(piece.control, piece.weights, piece.width);
            continue;
        }
        let mut control = piece.control.to_vec();
        let reach = cusp_reach(&piece, rounding);
        if start {
            join_first(control.iter_mut(), reach);
        }
        if end {
            join_first(control.iter_mut().rev(), reach);
        }
        let joined = Piece { control: &control, ..piece };
        match form(i, &joined, rounding) {
            Form::Straight(ends) if ends.len() == 2 => {
                out.push(&[ends[0].point, ends[1].point], &[], piece.width);
            }
            _ => out.push(joined.control, joined.weights, joined.width),
        }
    }
    out
}

/// The distance from an end of a piece within which the next control point makes a cusp. The path turns there within
/// reach² over the length of the piece, which is rounding; and no point is moved by more than `CUSP` times the greatest
/// coordinate.
fn cusp_reach<const M: usize>(piece: &Piece<M>, rounding: f64) -> f64 {
    let size = rounding / ROUNDING;
    (rounding * piece.extent().0).sqrt().min(CUSP * size).max(rounding)
}

/// Whether the path turns in the cusp at an end of a piece, or its direction there is rounding; None if there is no cusp.
fn turns_in_cusp<const M: usize>(piece: &Piece<M>, at_end: bool, rounding: f64) -> Option<bool> {
    let (control, last, reach) = (piece.control, piece.degree(), cusp_reach(piece, rounding));
    let away = |n: usize| match at_end {
        false => sub(&control[n], &control[0]),
        true => sub(&control[last - n], &control[last]),
    };
    let edge = away(1);
    if norm(&edge) > reach {
        return None;
    }
    let long = (2..=last).map(away).find(|edge| norm(edge) > reach)?;
    Some(norm(&edge) <= rounding || !is_smooth(&edge, &long, rounding))
}

/// Moves the points that follow the first one within reach of it to it.
fn join_first<'a, const M: usize>(mut points: impl Iterator<Item = &'a mut [f64; M]>, reach: f64) {
    let Some(&mut first) = points.next() else { return };
    for point in points.take_while(|point| near(point, &first, reach)) {
        *point = first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn whole<const M: usize>(curve: &CompositeCurve<M>) -> Regular<M> {
        regular(curve, std::slice::from_ref(&(0..curve.len())), Watch::default())
    }

    fn of<const M: usize>(control: &[[f64; M]], weights: &[f64]) -> Regular<M> {
        let mut curve = CompositeCurve::default();
        curve.push(control, weights, 2.0);
        whole(&curve)
    }

    #[test]
    fn a_line_of_any_degree_is_one_of_degree_one() {
        for weights in [&[][..], &[1.0, 10.0, 0.1, 3.0]] {
            let line = of(&[[1.0, 0.0], [1.0, 0.0], [4.0, 6.0], [3.0, 4.0]], weights);
            let turn = line.curve.control[1];
            assert_eq!((&line.curve.offsets[..], &line.source[..]), (&[0, 2, 4][..], &[[0; 2]; 2][..]));
            assert_eq!((line.curve.control[0], line.curve.control[3]), ([1.0, 0.0], [3.0, 4.0]));
            assert!(turn[0] > 3.0 && (turn[1] - 2.0 * (turn[0] - 1.0)).abs() < 1e-15);
            assert_eq!(line.curve.width.iter().sum::<f64>(), 2.0);
            assert_eq!(line.rests, [[false; 2]; 2]);
        }
    }

    #[test]
    fn a_line_on_one_axis_goes_from_each_of_its_turns_to_the_next() {
        // C' = 8 (t − ¼)(t − ¾).
        let line = of(&[[0.0], [0.5], [-1.0 / 3.0], [1.0 / 6.0]], &[]);
        let place = |t: f64| 8.0 * (t * t * t / 3.0 - t * t / 2.0 + 3.0 * t / 16.0);
        for (i, t) in [(1, 0.25), (3, 0.75)] {
            assert!((line.curve.control[i][0] - place(t)).abs() < 1e-15);
        }
        assert_eq!(line.curve.len(), 3);
        // It stands still for a moment and goes on: t³.
        assert_eq!(of(&[[0.0], [0.0], [0.0], [1.0]], &[]).curve.control, [[0.0], [1.0]]);
        assert_eq!(of(&[[-1.0], [1.0], [-1.0], [1.0]], &[]).curve.control, [[-1.0], [1.0]]);
    }

    #[test]
    fn what_has_no_length_is_left_out_and_a_curve_stays_as_it_is() {
        let mut curve = CompositeCurve::default();
        let bow: &[[f64; 2]] = &[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
        curve.push(bow, &[1.0, 2.0, 1.0], 1.0);
        curve.push(&[[2.0, 0.0], [2.0, 1e-16], [2.0, 2e-16]], &[], 1.0);
        curve.push(&[[2.0, 2e-16], [3.0, -1.0]], &[], 1.0);
        let made = whole(&curve);
        assert_eq!((made.source, made.curve.control[4]), (vec![[0; 2], [2; 2]], [3.0, -1.0]));
        assert_eq!(made.curve.control[3], [2.0, 0.0]);
        assert_eq!(&made.curve.control[..3], bow);
        assert_eq!(regular(&curve, &[1..2, 2..3, 0..0], Watch::default()).ranges, [0..0, 0..1, 1..1]);
    }

    #[test]
    fn neighbours_on_one_line_are_one_from_turn_to_turn() {
        let mut curve = CompositeCurve::default();
        curve.push(&[[0.1, 0.1], [0.2, 0.2]], &[], 1.0);
        curve.push(&[[0.2, 0.2], [0.2 + 3e-9, 0.2 + 3e-9], [0.2 + 7e-9, 0.2 + 7e-9]], &[], 1e-6);
        curve.push(&[[0.2 + 7e-9, 0.2 + 7e-9], [0.9, 0.9], [0.7, 0.7]], &[1.0, 2.0, 1.0], 1.0);
        curve.push(&[[0.7, 0.7], [0.5, 0.5]], &[], 1.0);
        curve.push(&[[0.5, 0.5], [0.4, 0.4]], &[], 1.0);
        let made = whole(&curve);
        assert_eq!(made.source, [[0, 2], [2, 3], [4, 4]]);
        assert_eq!((made.curve.control[0], made.curve.control[3]), ([0.1; 2], [0.5; 2]));
        assert!((made.curve.width.iter().sum::<f64>() - 4.000001).abs() < 1e-15);
        // What is a line already stays one; each is one of its own where they belong to different moves.
        assert_eq!(regular(&curve, &[0..1, 1..2, 2..5], Watch::default()).ranges, [0..1, 1..2, 2..5]);
    }

    #[test]
    fn a_turn_beside_the_end_of_a_piece_stays_a_turn() {
        // To 1, beyond it by a rounding and back to it; then to 0 in two pieces.
        let mut curve = CompositeCurve::default();
        curve.push(&[[0.0], [1.0 + 2e-15], [1.0]], &[], 1.0);
        curve.push(&[[1.0], [0.8], [0.6]], &[], 1.0);
        curve.push(&[[0.6], [0.3], [0.0]], &[], 1.0);
        let made = whole(&curve);
        assert_eq!(made.curve.len(), 2);
        assert!((made.curve.control[1][0] - 1.0).abs() < 1e-14, "{:?}", made.curve.control);
    }

    #[test]
    fn a_cusp_is_the_end_of_a_piece_that_rests_there() {
        // (s², s³) about t = 0.3.
        let blossom = |a: f64, b: f64, e: f64| {
            let [a, b, e] = [a, b, e].map(|x| x - 0.3);
            [(a * b + a * e + b * e) / 3.0, a * b * e]
        };
        let control = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
            .map(|[a, b, e]| blossom(a, b, e));
        let made = of(&control, &[]);
        assert_eq!(made.rests, [[false, true], [true, false]]);
        let control = &made.curve.control;
        assert!(control[2] == control[3] && control[3] == control[4] && control[4] == control[5]);
        assert!(norm(&control[3]) < 1e-16 && (made.curve.width[0] - 0.6).abs() < 1e-15);
    }

    #[test]
    fn a_turn_within_rounding_is_a_cusp_on_both_sides() {
        // (s², 1e-10 s + s³) about t = 0.3: the way turns back within 1e-20.
        let blossom = |a: f64, b: f64, e: f64| {
            let [a, b, e] = [a, b, e].map(|x| x - 0.3);
            [(a * b + a * e + b * e) / 3.0, 1e-10 * (a + b + e) / 3.0 + a * b * e]
        };
        let control = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
            .map(|[a, b, e]| blossom(a, b, e));
        let made = of(&control, &[]);
        assert_eq!(made.rests, [[false, true], [true, false]]);
        // Where the way goes on, it is slow and no more: (s³ + 1e-10 s, s⁴).
        let along = |t: f64| [(t - 0.3).powi(3) + 1e-10 * (t - 0.3), (t - 0.3).powi(4)];
        let rate = |t: f64| [3.0 * (t - 0.3).powi(2) + 1e-10, 4.0 * (t - 0.3).powi(3)];
        let control = {
            let ([p, v], [q, w]) = ([along(0.0), rate(0.0)], [along(1.0), rate(1.0)]);
            let [a, c] = [[0, 1].map(|k| p[k] + v[k] / 4.0), [0, 1].map(|k| q[k] - w[k] / 4.0)];
            // The middle point by the blossoms at (0, 0, 1, 1).
            let x = (2.0 * 0.09 * 0.7 - 2.0 * 0.3 * 0.49) / 4.0 + 0.2e-10;
            [p, a, [x, 0.09 * 0.49], c, q]
        };
        assert_eq!(of(&control, &[]).rests, [[false; 2]; 2]);
    }

    #[test]
    fn a_short_arc_that_rounding_makes_straight_stays_smooth_for_its_neighbours() {
        // Ten chords of a circle of 90 mm, of 1e-4 mm each, a metre away: each bows by less than its rounding.
        let point = |angle: f64| [1000.0 + 90.0 * angle.cos(), 90.0 * angle.sin()];
        let mut curve = CompositeCurve::default();
        for i in 0..10 {
            let (a, b) = (1e-6 * i as f64, 1e-6 * (i + 1) as f64);
            let (p, q) = (point(a), point(b));
            let third = |from: [f64; 2], angle: f64, sign: f64| {
                let reach = sign * 90.0 * 1e-6 / 3.0;
                [from[0] - reach * angle.sin(), from[1] + reach * angle.cos()]
            };
            curve.push(&[p, third(p, a, 1.0), third(q, b, -1.0), q], &[], 1.0);
        }
        let made = whole(&curve);
        for i in 1..made.curve.len() {
            let (before, after) = (made.curve.piece(i - 1), made.curve.piece(i));
            assert!(
                is_smooth(&before.edge(true).unwrap(), &after.edge(false).unwrap(), 2.0 * ROUNDING * 1100.0),
                "{i}"
            );
        }
    }

    proptest! {
        #[test]
        fn lines_cover_what_the_piece_does(
            places in prop::collection::vec(-1.0..1.0_f64, 2..11),
            weights in prop::collection::vec(-2.3..2.3_f64, 10),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            origin in prop::array::uniform3(-100.0..100.0_f64),
            rational: bool,
        ) {
            prop_assume!(norm(&direction) > 0.1 && places.windows(2).any(|pair| (pair[0] - pair[1]).abs() > 0.1));
            let on_line = |x: f64| -> [f64; 3] { std::array::from_fn(|k| origin[k] + 10.0 * x * direction[k]) };
            let control: Vec<[f64; 3]> = places.iter().map(|&x| on_line(x)).collect();
            let weights: Vec<f64> = weights[..control.len()].iter().map(|w| w.exp()).collect();
            let given = Piece { control: &control, weights: if rational { &weights } else { &[] }, width: 1.0 };
            let made = of(&control, given.weights);
            prop_assert!(made.curve.pieces().all(|piece| piece.degree() == 1));
            let along = |p: &[f64; 3]| dot(&sub(p, &origin), &direction) / dot(&direction, &direction) / 10.0;
            // At no place of the piece is it outside the line of that parameter.
            let breaks: Vec<f64> = made.curve.width.iter().scan(0.0, |sum, w| { *sum += w / 2.0; Some(*sum) }).collect();
            for i in 0..=200 {
                let t = i as f64 / 200.0;
                let n = breaks.partition_point(|&end| end < t).min(made.curve.len() - 1);
                let line = made.curve.piece(n);
                let (a, b, x) = (along(&line.control[0]), along(&line.control[1]), along(&point(&given, t)));
                prop_assert!(x >= a.min(b) - 1e-13 && x <= a.max(b) + 1e-13, "{t}: {x} on {a} {b}");
            }
            // Each line turns back against the one before.
            for pair in made.curve.control.chunks(2).collect::<Vec<_>>().windows(2) {
                let way = |line: &[[f64; 3]]| along(&line[1]) - along(&line[0]);
                prop_assert!(way(pair[0]) * way(pair[1]) < 0.0);
            }
        }
    }
}
