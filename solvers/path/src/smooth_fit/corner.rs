//! Rounds each corner of a polyline by a curve of degree 7 between lines, where no smooth curve along the whole run is found.
//!
//! Each leg of the corner has four control points in equal steps, so that the curve meets the lines with three continuous
//! derivatives. The curve lies between both legs. The distance between curve and corner, both ways, is at most that of the
//! curve's middle from the vertex: a point V − a t₋ + b t₊ of the curve is at most min(a, b) |t₊ − t₋| from the legs.

use super::curve::{Covered, Smooth};
use super::polyline::Polyline;
use feedplan_geometry::quadratic::norm;

const DEGREE: usize = 7;
/// The distances of a leg's control points from the vertex, in parts of the length l of the leg.
const LEG: [f64; 4] = [1.0, 1.0 - 0.65 / 3.0, 1.0 - 1.3 / 3.0, 0.35];
/// The middle is V + MIDDLE l (t₊ − t₋): (LEG₀ + 7 LEG₁ + 21 LEG₂ + 35 LEG₃)/2⁷.
const MIDDLE: f64 = (LEG[0] + 7.0 * LEG[1] + 21.0 * LEG[2] + 35.0 * LEG[3]) / 128.0;
/// The width of a corner with legs of length 1 that has speed 1 where it meets the lines.
const WIDTH: f64 = DEGREE as f64 * (LEG[0] - LEG[1]);
/// The part of the tolerance that a corner uses.
const FILL: f64 = 0.99;
/// A leg is at most this part of its chord, so that neighbouring corners do not overlap.
const HALF: f64 = 0.5;
/// Two corners on one chord meet if the line between them would be shorter than this part of the chord, or if they overlap by no
/// more than that: rounding would spoil the profile on so short a line.
const SLIVER: f64 = 1e-3;
/// Where |t₊ − t₋| is less than this, the polyline does not turn.
const STRAIGHT: f64 = 1e-9;

/// Appends the lines and corners of the chords from `first` to before `end`.
pub fn append_corners<const D: usize>(line: &Polyline<D>, first: usize, end: usize, out: &mut Smooth<D>) {
    let mut from = line.vertex[first];
    let mut begun = 0.0;
    for chord in first..end {
        let length = line.chord_length(chord);
        let room = length - begun;
        let corner = (chord + 1 < end).then(|| leg(line, chord + 1)).filter(|leg| *leg > 0.0);
        let corner = corner.map(|leg| {
            let meets = (room - leg).abs() <= SLIVER * length;
            if meets {
                room
            } else {
                leg
            }
        });
        let to = match corner {
            Some(leg) if leg == room => from,
            Some(leg) => at(line, chord, length - leg),
            None => line.vertex[chord + 1],
        };
        if to != from {
            out.push(&[from, to], room - corner.unwrap_or(0.0), Covered::new(chord, chord, 0.0));
        }
        if let Some(leg) = corner {
            let next = chord + 1;
            let mut control = [[0.0; D]; DEGREE + 1];
            for (k, part) in LEG.iter().enumerate() {
                control[k] = at(line, chord, length - part * leg);
                control[DEGREE - k] = at(line, next, part * leg);
            }
            control[0] = to;
            let turn: [f64; D] = std::array::from_fn(|k| line.direction[next][k] - line.direction[chord][k]);
            out.push(&control, WIDTH * leg, Covered::new(chord, next, MIDDLE * leg * norm(&turn)));
            (from, begun) = (control[DEGREE], leg);
        } else {
            (from, begun) = (line.vertex[chord + 1], 0.0);
        }
    }
}

fn at<const D: usize>(line: &Polyline<D>, chord: usize, s: f64) -> [f64; D] {
    line.point(chord, line.station[chord] + s)
}

/// The length of the legs at a vertex, in mm; 0 where the polyline does not turn.
fn leg<const D: usize>(line: &Polyline<D>, vertex: usize) -> f64 {
    let turn: [f64; D] = std::array::from_fn(|k| line.direction[vertex][k] - line.direction[vertex - 1][k]);
    let size = norm(&turn);
    if size <= STRAIGHT {
        return 0.0;
    }
    let chords = line.chord_length(vertex - 1).min(line.chord_length(vertex));
    (FILL * line.tolerance_at(vertex) / (MIDDLE * size)).min(HALF * chords)
}

#[cfg(test)]
mod tests {
    use super::*;
    use feedplan_geometry::quadratic::sub;

    #[test]
    fn a_corner_meets_its_lines_with_three_derivatives_and_is_as_far_as_it_may() {
        let line = Polyline::new(vec![[0.0, 0.0], [10.0, 0.0], [10.0, 4.0]], vec![0.1; 2]);
        let mut out = Smooth::default();
        append_corners(&line, 0, 2, &mut out);
        assert_eq!(out.curve.pieces().map(|piece| piece.degree()).collect::<Vec<_>>(), [1, 7, 1]);
        assert_eq!(
            out.covered.iter().map(|s| (s.first, s.last)).collect::<Vec<_>>(),
            [(0, 0), (0, 1), (1, 1)]
        );
        let corner = out.curve.piece(1);
        // Equal steps at the speed of the lines: the second and the third derivative are 0.
        for k in 0..3 {
            for (step, way) in [(k, [1.0, 0.0]), (6 - k, [0.0, 1.0])] {
                let edge = sub(&corner.control[step + 1], &corner.control[step]);
                assert!(norm(&sub(&edge.map(|x| 7.0 * x / corner.width), &way)) < 1e-12);
            }
        }
        let mut points = corner.control.to_vec();
        while points.len() > 1 {
            points = points.windows(2).map(|p| [0, 1].map(|k| 0.5 * (p[0][k] + p[1][k]))).collect();
        }
        assert!((norm(&sub(&points[0], &[10.0, 0.0])) - 0.099).abs() < 1e-12);
        assert!((out.covered[1].deviation - 0.099).abs() < 1e-12);
        // Two corners that would leave a very short line between them meet.
        let left = 2e-7;
        let mut out = Smooth::default();
        let points = vec![[0.0, 0.0], [0.01, 0.0], [0.01, 0.01 + left], [0.02, 0.01 + left]];
        append_corners(&Polyline::new(points, vec![0.1; 3]), 0, 3, &mut out);
        assert_eq!(out.curve.pieces().map(|piece| piece.degree()).collect::<Vec<_>>(), [1, 7, 7, 1]);
        let [before, after] = [1, 2].map(|i| out.curve.piece(i).control);
        assert_eq!(before[DEGREE], after[0]);
        let steps = [sub(&before[DEGREE], &before[DEGREE - 1]), sub(&after[1], &after[0])];
        let speeds = [0, 1].map(|i| 7.0 * norm(&steps[i]) / out.curve.piece(i + 1).width);
        assert!(speeds.iter().all(|speed| (speed - 1.0).abs() < 1e-12), "{speeds:?}");
        // On short chords, each of two neighbouring corners gets one half.
        let zig_zag = (0..9).map(|i| [0.01 * i as f64, 0.01 * (i % 2) as f64]).collect();
        let mut out = Smooth::default();
        append_corners(&Polyline::new(zig_zag, vec![0.1; 8]), 0, 8, &mut out);
        assert_eq!(out.curve.pieces().filter(|piece| piece.degree() == 7).count(), 7);
        assert!((1..out.curve.len())
            .all(|i| out.curve.piece(i - 1).control.last() == Some(&out.curve.piece(i).control[0])));
    }
}
