//! Cuts curved pieces in their cusps, and makes C' exactly 0 at ends of pieces that are cusps.

use super::lines::{form, Form};
use super::pieces::{is_smooth, near, Regular};
use crate::quadratic::{norm, sub};
use crate::spline::bezier::split;
use crate::spline::cusps::piece_cusps;
use crate::spline::{CompositeCurve, Piece};
use crate::tolerance::{AT_END, CUSP, ROUNDING};

/// Appends a curved piece, cut in its cusps.
pub fn cut_in_cusps<const M: usize>(source: usize, piece: &Piece<M>, rounding: f64, out: &mut Regular<M>) {
    let cusps = piece_cusps(piece, CUSP);
    let inside = cusps.iter().filter(|t| (AT_END..=1.0 - AT_END).contains(*t));
    let cuts: Vec<f64> = inside.map(|t| t * piece.width).collect();
    if cuts.is_empty() {
        return out.push([source; 2], piece, rounding);
    }
    let mut parts = CompositeCurve::default();
    split(piece, &cuts, &mut parts);
    for part in parts.pieces().filter(|part| part.extent() > rounding) {
        out.push([source; 2], &part, rounding);
    }
}

/// The same curve with the control points next to a cusp moved into it, on both sides, so that C' is exactly 0 there. Pieces that
/// become straight by this are replaced by lines.
pub fn joined_in_cusps<const M: usize>(curve: &CompositeCurve<M>, rounding: f64) -> CompositeCurve<M> {
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

/// If the control point next to an end of a piece is within this distance, in mm, the end is a cusp. The path turns there within
/// reach² divided by the length of the piece, which is a rounding error. No point is moved by more than `CUSP` times the greatest
/// coordinate.
fn cusp_reach<const M: usize>(piece: &Piece<M>, rounding: f64) -> f64 {
    let size = rounding / ROUNDING;
    (rounding * piece.extent()).sqrt().min(CUSP * size).max(rounding)
}

/// For a cusp at an end of a piece: whether the path turns in it, or its direction there is only rounding. None without a cusp.
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

/// Moves the points that follow the first one to it, as long as they are within `reach` of it.
fn join_first<'a, const M: usize>(mut points: impl Iterator<Item = &'a mut [f64; M]>, reach: f64) {
    let Some(&mut first) = points.next() else { return };
    for point in points.take_while(|point| near(point, &first, reach)) {
        *point = first;
    }
}
