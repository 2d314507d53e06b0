//! Converts a curve into pieces whose C' is not 0 inside: straight pieces become lines that are cut where they turn back, curved
//! pieces are cut in their cusps.
//!
//! Planners need C' ≠ 0 to compute a speed from a parameter. A straight piece of any degree, polynomial or rational, follows the
//! same points as the lines of degree 1 between the places where it turns back. In the cusp of a curved piece the curvature is
//! unbounded and the tool rests, so the piece and its run end there.

mod cusp_ends;
mod lines;
mod pieces;

use std::ops::Range;

use self::cusp_ends::{cut_in_cusps, joined_in_cusps};
use self::lines::{form, Form, Straight};
pub use self::pieces::Regular;
use self::pieces::{is_smooth, near};
use super::cusps::rests_at_ends;
use super::{CompositeCurve, Piece};
use crate::tolerance::ROUNDING;
use crate::watch::Watch;

/// The regular pieces of a curve; each range of its pieces is converted separately.
///
/// Pieces without length are left out. Neighbours on one line become one line, unless both are lines already. The widths of
/// parameter intervals stay the same; on lines C' is constant.
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

/// Keeps pieces curved if, as lines, they would meet a neighbour in a corner although they meet it smoothly now. Such pieces are
/// so short that their directions are rounding.
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

#[cfg(test)]
mod tests {
    use super::super::bezier::point;
    use super::*;
    use crate::quadratic::{dot, norm, sub};
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
        // It stops for a moment and continues in the same direction: t³.
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
        // A line stays a line; lines that belong to different moves are not joined.
        assert_eq!(regular(&curve, &[0..1, 1..2, 2..5], Watch::default()).ranges, [0..1, 1..2, 2..5]);
    }

    #[test]
    fn a_turn_beside_the_end_of_a_piece_stays_a_turn() {
        // To 1, beyond it by a rounding error and back to 1; then to 0 in two pieces.
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
        // (s², 1e-10 s + s³) about t = 0.3: the path turns back within 1e-20.
        let blossom = |a: f64, b: f64, e: f64| {
            let [a, b, e] = [a, b, e].map(|x| x - 0.3);
            [(a * b + a * e + b * e) / 3.0, 1e-10 * (a + b + e) / 3.0 + a * b * e]
        };
        let control = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
            .map(|[a, b, e]| blossom(a, b, e));
        let made = of(&control, &[]);
        assert_eq!(made.rests, [[false, true], [true, false]]);
        // Where the path continues in its direction it is only slow there: (s³ + 1e-10 s, s⁴).
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
        // Ten chords of 1e-4 mm of a circle of 90 mm, a metre from the origin: each bulges by less than its rounding.
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
            // No place of the piece is outside the line with the same parameter.
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
