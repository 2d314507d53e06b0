//! The path of a program: its pieces in order, and the runs between full stops.
//!
//! | file | computes |
//! |---|---|
//! | `built_path`, `chunk` | the path as it is built, with its deviation |
//! | `corner_rounding` | the path with each corner rounded by itself within the tolerance |
//! | `chords` | moves as chords, the input of the smooth fit |
//! | `smooth_path` | the path with one smooth curve between two stops |
//! | `travel` | the first place that is outside the travel of an axis |

mod built_path;
mod chords;
mod chunk;
mod corner_rounding;
mod smooth_path;
mod travel;

use crate::moves::{MoveError, Moves, PathOptions};
use crate::program_pieces::{program_pieces, ProgramPieces};
pub use built_path::{Axes, BuiltPath};
pub use chunk::Chunk;
use corner_rounding::round_corners;
pub use smooth_path::{build_smooth_path, Motion};

use feedplan_geometry::watch::Watch;

/// The path of a program, its corners rounded one by one.
pub fn build_path<const M: usize>(
    moves: &Moves<M>,
    options: &PathOptions,
    axes: &Axes<M>,
    watch: Watch,
) -> Result<BuiltPath<M>, MoveError> {
    let ProgramPieces { pieces, fit } = program_pieces(moves, options, watch.part(0.6))?;
    let (chunks, runs) =
        round_corners(&pieces, moves.splines, moves.halt, options.rounding, axes, watch.part(0.4));
    Ok(BuiltPath::new(chunks, runs, fit, moves, &axes.travel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corner::{Rounding, TangentJump};
    use crate::moves::{LINE, SPLINE};
    use crate::path_piece::{PathPiece, Shape};
    use feedplan_geometry::conic::Conic;
    use feedplan_geometry::quadratic::{norm, sub};
    use feedplan_geometry::spline::CompositeCurve;
    use proptest::prelude::*;

    const OPTIONS: PathOptions = PathOptions {
        exact_tolerance: 1e-3,
        max_chord: 5.0,
        corner_acceleration: 4e3,
        max_speed: 1e3,
        corner_angle: 0.48,
        rounding: Rounding::Parabola,
    };

    fn axes<const M: usize>(jump: bool) -> Axes<M> {
        Axes {
            max_velocity: [500.0; M],
            max_acceleration: [1000.0; M],
            travel: [[f64::NEG_INFINITY, f64::INFINITY]; M],
            jump,
        }
    }

    fn all<const M: usize>(path: &BuiltPath<M>) -> Vec<PathPiece<M>> {
        path.chunks.iter().flat_map(|chunk| &chunk.pieces).copied().collect()
    }

    fn polyline(
        points: &[[f64; 2]],
        tolerance: &[f64],
        fit: bool,
        jump: bool,
    ) -> (Vec<PathPiece<2>>, Vec<usize>) {
        let count = points.len() - 1;
        let fit: Vec<f64> =
            tolerance.iter().map(|tolerance| if fit { 0.5 * tolerance } else { 0.0 }).collect();
        let moves = Moves {
            start: points[0],
            kind: &vec![LINE; count],
            target: &points[1..],
            feed: &vec![100.0; count],
            tolerance,
            fit_tolerance: &fit,
            halt: &vec![false; count],
            arcs: &[],
            spline_moves: &[],
            changes: &[],
            splines: &CompositeCurve::default(),
            joints: &vec![true; count],
        };
        let path = build_path(&moves, &OPTIONS, &axes(jump), Watch::default()).unwrap();
        (all(&path), path.runs)
    }

    fn conic<const M: usize>(piece: &PathPiece<M>) -> &Conic<M> {
        piece.shape.conic().unwrap()
    }

    #[test]
    fn a_square_is_rounded_at_its_corners_and_nowhere_else() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        let (pieces, runs) = polyline(&square, &[0.01; 4], false, false);
        let edge = 10.0 - 0.02 * 2f64.sqrt();
        assert_eq!((pieces.len(), &runs[..]), (7, &[0, 7][..]));
        assert!(norm(&sub(&conic(&pieces[0]).control[2], &[edge, 0.0])) < 1e-12);
        assert_eq!(conic(&pieces[1]).control[1], [10.0, 0.0]);
        assert_eq!((pieces[1].first, pieces[1].last), (0, 1));
        let (exact, stops) = polyline(&square, &[0.0; 4], false, false);
        assert_eq!((exact.len(), &stops[..]), (4, &[0, 1, 2, 3, 4][..]));
        let (passed, none) = polyline(&square, &[0.0; 4], false, true);
        assert_eq!((passed.len(), &none[..]), (4, &[0, 4][..]));
    }

    #[test]
    fn a_square_with_circles_has_a_quarter_of_one_at_each_corner() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        let moves = Moves {
            start: square[0],
            kind: &[LINE; 4],
            target: &square[1..],
            feed: &[100.0; 4],
            tolerance: &[0.01; 4],
            fit_tolerance: &[0.0; 4],
            halt: &[false; 4],
            arcs: &[],
            spline_moves: &[],
            changes: &[],
            splines: &CompositeCurve::default(),
            joints: &[true; 4],
        };
        let options = PathOptions { rounding: Rounding::Circle, ..OPTIONS };
        let path = build_path(&moves, &options, &axes(false), Watch::default()).unwrap();
        let pieces = all(&path);
        let radius = 0.01 / (2f64.sqrt() - 1.0);
        assert_eq!((pieces.len(), &path.runs[..]), (7, &[0, 7][..]));
        for corner in pieces.iter().skip(1).step_by(2) {
            let arc = conic(corner);
            assert!((arc.weight - 0.5f64.sqrt()).abs() < 1e-15);
            assert!((norm(&sub(&arc.control[1], &arc.control[0])) - radius).abs() < 1e-12);
            assert!((corner.deviation - 0.01).abs() < 1e-12);
        }
    }

    #[test]
    fn a_zig_zag_of_short_edges_is_all_corners_that_touch() {
        let points: Vec<[f64; 2]> =
            (0..41).map(|i| [0.02 * i as f64, if i % 2 == 0 { 0.0 } else { 0.02 }]).collect();
        let (pieces, runs) = polyline(&points, &[0.1; 40], false, false);
        // 39 corners; half of the first and of the last edge is left.
        assert_eq!((pieces.len(), runs.len()), (41, 2));
        for pair in pieces.windows(2) {
            assert_eq!(conic(&pair[0]).control[2], conic(&pair[1]).control[0]);
            assert!(TangentJump::new(&pair[0].shape, &pair[1].shape).unwrap().size < 1e-9);
        }
    }

    #[test]
    fn a_corner_far_shorter_than_its_sides_is_rounded_all_the_same() {
        for (turn, tolerance) in [(1e-4, 1e-3), (1.5, 1e-5), (1.5, 1e-6)] {
            let end = [100.0 + 100.0 * f64::cos(turn), 100.0 * f64::sin(turn)];
            let (pieces, runs) = polyline(&[[0.0, 0.0], [100.0, 0.0], end], &[tolerance; 2], false, false);
            assert_eq!((pieces.len(), &runs[..]), (3, &[0, 3][..]), "{turn} {tolerance}");
            assert!(pieces[1].deviation <= tolerance * (1.0 + 1e-9));
        }
    }

    /// Two splines between lines: a tangent cubic with weights, a piece of no length, a line of degree 1 at a right
    /// angle; then a corner to a line.
    fn between_lines(
        tolerance: f64,
        joints: &[bool; 3],
        axes: &Axes<2>,
        missing: bool,
    ) -> Option<BuiltPath<2>> {
        let mut splines = CompositeCurve::default();
        splines.push(&[[10.0, 0.0], [11.0, 0.0], [12.0, 0.0], [12.0, 2.0]], &[1.0, 2.0, 1.0, 1.0], 1.0);
        splines.push(&[[12.0, 2.0], [12.0, 2.0]], &[], 1.0);
        splines.push(&[[12.0, 2.0], [14.0, 2.0]], &[], 1.0);
        let moves = Moves {
            start: [0.0, 0.0],
            kind: &[LINE, SPLINE, LINE],
            target: &[[10.0, 0.0], [14.0, 2.0], [14.0, 10.0]],
            feed: &[10.0; 3],
            tolerance: &[tolerance; 3],
            fit_tolerance: &[0.0; 3],
            halt: &[false; 3],
            arcs: &[],
            spline_moves: if missing { &[] } else { &[(1, 0..3)] },
            changes: &[],
            splines: &splines,
            joints,
        };
        build_path(&moves, &OPTIONS, axes, Watch::default()).ok()
    }

    #[test]
    fn an_exact_spline_passes_smoothly_between_lines_and_stops_in_its_corners() {
        let mut limits = axes(false);
        let path = between_lines(0.0, &[true; 3], &limits, false).unwrap();
        let pieces = all(&path);
        assert_eq!((pieces.len(), &path.runs[..]), (4, &[0, 2, 3, 4][..]));
        let widths: Vec<f64> = pieces.iter().map(|piece| piece.shape.width()).collect();
        assert_eq!(widths[0], 10.0);
        assert!(widths[1] == widths[2] && pieces[1].shape.conic().is_none());
        assert!(path.outside.is_none() && path.deviation == 0.0);
        // The control polygon reaches 12; the curve stays below that before its end.
        limits.travel[0] = [f64::NEG_INFINITY, 13.0];
        let outside = between_lines(0.0, &[true; 3], &limits, false).unwrap().outside.unwrap();
        assert_eq!((outside.index, outside.axis, outside.position), (1, 0, 14.0));
        let elsewhere = [true, false, false];
        assert!(between_lines(0.0, &elsewhere, &limits, false).unwrap().outside.is_none());
        assert!(between_lines(0.0, &elsewhere, &limits, true).is_none());
        assert_eq!(between_lines(0.0, &elsewhere, &axes(true), false).unwrap().runs, [0, 4]);
    }

    #[test]
    fn corners_at_splines_are_rounded_and_what_is_not_bent_stays_as_it_is() {
        let path = between_lines(0.1, &[true; 3], &axes(false), false).unwrap();
        let pieces = all(&path);
        assert_eq!(path.runs, [0, pieces.len()]);
        assert!(path.deviation > 0.05 && path.deviation <= 0.1 * (1.0 + 1e-9), "{}", path.deviation);
        assert_joined_smoothly(&pieces, &path.runs);
        let no_splines = CompositeCurve::default();
        let [chunk] = &path.chunks[..] else { panic!("one task") };
        let curves = pieces.iter().filter_map(|piece| match &piece.shape {
            Shape::Spline(spline) if spline.made => {
                Some((piece.deviation, chunk.spline(spline, &no_splines)))
            }
            _ => None,
        });
        // The rest of the cubic, its end, and the line in three parts, of which the middle one is still a line.
        let made: Vec<_> =
            curves.map(|(deviation, piece)| (deviation, piece.degree(), piece.is_rational())).collect();
        assert_eq!(made.iter().map(|piece| piece.1).collect::<Vec<_>>(), [3, 3, 2, 2, 2]);
        assert!(
            made[0].0 == 0.0 && made[0].2 && made[1].0 == made[2].0 && made[2].0 > 0.0 && made[3].0 == 0.0
        );
    }

    fn assert_joined_smoothly<const M: usize>(pieces: &[PathPiece<M>], runs: &[usize]) {
        for (i, pair) in pieces.windows(2).enumerate() {
            if runs.binary_search(&(i + 1)).is_err() {
                let jump = TangentJump::new(&pair[0].shape, &pair[1].shape).unwrap();
                assert!(jump.is_smooth(&pair[0].shape, &pair[1].shape), "{i}: {}", jump.size);
            }
        }
    }

    proptest! {
        #[test]
        fn random_polylines_are_joined_smoothly_within_tolerance(
            steps in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -3..2i32), 2..60),
            tolerance in prop::sample::select(vec![1e-4, 1e-2, 1.0]),
            fit: bool,
            exact_from in 0..60usize,
        ) {
            let mut points = vec![[0.0, 0.0]];
            for (x, y, exponent) in steps {
                let scale = 10f64.powi(exponent);
                let [a, b] = points[points.len() - 1];
                points.push([a + scale * x + 1e-4, b + scale * y]);
            }
            let count = points.len() - 1;
            let limits: Vec<f64> = (0..count).map(|i| if i < exact_from { tolerance } else { 0.0 }).collect();
            let (pieces, runs) = polyline(&points, &limits, fit, false);
            prop_assert_eq!(conic(&pieces[0]).control[0], points[0]);
            prop_assert_eq!(conic(&pieces[pieces.len() - 1]).control[2], points[count]);
            prop_assert!(pieces[0].first == 0 && pieces[pieces.len() - 1].last as usize == count - 1);
            for (i, pair) in pieces.windows(2).enumerate() {
                prop_assert_eq!(conic(&pair[0]).control[2], conic(&pair[1]).control[0]);
                prop_assert!(pair[1].first >= pair[0].first && pair[1].first <= pair[0].last + 1);
                prop_assert!(pair[1].last >= pair[0].last);
                if runs.binary_search(&(i + 1)).is_err() {
                    let jump = TangentJump::new(&pair[0].shape, &pair[1].shape).unwrap();
                    prop_assert!(jump.is_smooth(&pair[0].shape, &pair[1].shape), "{}", jump.size);
                }
            }
            for piece in &pieces {
                prop_assert!(piece.deviation <= piece.tolerance * (1.0 + 1e-9));
                prop_assert!(!piece.exact || piece.deviation == 0.0);
                prop_assert!(piece.shape.width() > 0.0);
            }
        }
    }
}
