//! The programmed path: straight moves, true arcs and helices, and splines; and distances of points from them.

use std::f64::consts::TAU;

use super::arc_slope::{Arc, ArcSlope};
use super::close_places::ClosePlaces;
use super::curve::Pieces;
use super::nearest::{nearest_on_piece, outwards, Place};
use super::vectors::{distance, vector, Segment};

/// The arrays of the program, one entry for each move; see `feedplan.Program`.
#[derive(Clone, Copy)]
pub struct Programmed<'a> {
    /// At most `M`.
    pub axes: usize,
    /// Where the first move begins, in mm.
    pub start: &'a [f64],
    /// Ends of the moves, `axes` numbers for each move, in mm.
    pub target: &'a [f64],
    pub line: &'a [i32],
    /// Arcs, in the order of their moves: the move; the centre in X, Y, Z in mm; the normal axis (0, 1 or 2 of X, Y, Z); the
    /// signed sweep in rad.
    pub arc_move: &'a [i64],
    pub arc_centre: &'a [f64],
    pub arc_normal: &'a [u8],
    pub arc_angle: &'a [f64],
    /// Splines, in the order of their moves: the move; and the first piece of each spline in `splines`, then the number of
    /// pieces.
    pub spline_move: &'a [i64],
    pub spline_pieces: &'a [i64],
    pub splines: Pieces<'a>,
    /// Moves that do not begin at the end of the move before, in order; and where they begin, `axes` numbers for each.
    pub change_move: &'a [i64],
    pub change_start: &'a [f64],
    /// The axes that are X, Y and Z.
    pub xyz: [Option<usize>; 3],
}

/// One move.
#[derive(Clone, Copy)]
pub struct Move<'a, const M: usize> {
    pub from: [f64; M],
    pub to: [f64; M],
    pub(super) shape: Shape<'a>,
}

#[derive(Clone, Copy)]
pub(super) enum Shape<'a> {
    Line,
    Arc(Arc),
    /// The pieces from `first` to `last`.
    Spline {
        pieces: Pieces<'a>,
        first: usize,
        last: usize,
    },
}

#[cfg(test)]
impl<'a> Programmed<'a> {
    /// Lines in X, Y and perhaps Z from one place through others, on the given source lines.
    pub const fn of_lines(start: &'a [f64], target: &'a [f64], line: &'a [i32]) -> Self {
        let axes = start.len();
        Self {
            axes,
            start,
            target,
            line,
            arc_move: &[],
            arc_centre: &[],
            arc_normal: &[],
            arc_angle: &[],
            spline_move: &[],
            spline_pieces: &[0],
            splines: Pieces { axes, stride: axes, control: &[], weights: &[], offsets: &[0], width: &[] },
            change_move: &[],
            change_start: &[],
            xyz: [Some(0), Some(1), if axes > 2 { Some(2) } else { None }],
        }
    }
}

impl<'a> Programmed<'a> {
    /// Number of moves.
    pub fn len(&self) -> usize {
        self.line.len()
    }

    /// Whether there are no moves.
    pub fn is_empty(&self) -> bool {
        self.line.is_empty()
    }

    /// End of move `i`; the start of the program for None.
    pub fn end<const M: usize>(&self, i: Option<usize>) -> [f64; M] {
        match i {
            Some(i) => vector(self.target, self.axes, i),
            None => vector(self.start, self.axes, 0),
        }
    }

    /// Move `i`.
    pub fn get<const M: usize>(&self, i: usize) -> Move<'a, M> {
        let from = match self.change_move.binary_search(&(i as i64)) {
            Ok(row) => vector(self.change_start, self.axes, row),
            Err(_) => self.end(i.checked_sub(1)),
        };
        let to = self.end(Some(i));
        let arc = self.arc_move.binary_search(&(i as i64)).ok().and_then(|row| self.arc(row, &from, &to));
        let shape = match arc {
            Some(arc) => Shape::Arc(arc),
            None => self.spline(i).unwrap_or(Shape::Line),
        };
        Move { from, to, shape }
    }

    fn spline(&self, i: usize) -> Option<Shape<'a>> {
        let row = self.spline_move.binary_search(&(i as i64)).ok()?;
        let [first, end] = [row, row + 1].map(|row| self.spline_pieces[row] as usize);
        (end > first).then(|| Shape::Spline { pieces: self.splines, first, last: end - 1 })
    }

    fn arc<const M: usize>(&self, row: usize, from: &[f64; M], to: &[f64; M]) -> Option<Arc> {
        let normal = self.arc_normal[row] as usize;
        let [first, second] = [(normal + 1) % 3, (normal + 2) % 3];
        let (a, b) = (self.xyz[first]?, self.xyz[second]?);
        let centre = [first, second].map(|axis| self.arc_centre[3 * row + axis]);
        let arm = |point: &[f64; M]| [point[a] - centre[0], point[b] - centre[1]];
        let (start, end) = (arm(from), arm(to));
        let radius = start[0].hypot(start[1]);
        Some(Arc {
            a,
            b,
            centre,
            start_angle: start[1].atan2(start[0]),
            sweep: self.arc_angle[row],
            radius,
            widening: end[0].hypot(end[1]) - radius,
        })
    }
}

impl<const M: usize> Move<'_, M> {
    /// The place at the parameter `t` of the move, in [0, 1].
    pub fn at(&self, t: f64) -> [f64; M] {
        match &self.shape {
            Shape::Line => self.straight(t),
            Shape::Arc(arc) => self.on_arc(arc, t),
            Shape::Spline { pieces, first, last } => {
                let along = t * (last + 1 - first) as f64;
                let piece = (first + along as usize).min(*last);
                pieces.curve::<M>(piece).at((along - (piece - first) as f64) * pieces.width[piece])
            }
        }
    }

    fn straight(&self, t: f64) -> [f64; M] {
        std::array::from_fn(|k| self.from[k] + t * (self.to[k] - self.from[k]))
    }

    fn on_arc(&self, arc: &Arc, t: f64) -> [f64; M] {
        let mut point = self.straight(t);
        let (sin, cos) = (arc.start_angle + t * arc.sweep).sin_cos();
        let radius = arc.radius + t * arc.widening;
        point[arc.a] = arc.centre[0] + radius * cos;
        point[arc.b] = arc.centre[1] + radius * sin;
        point
    }

    /// Whether the move goes anywhere.
    pub fn is_motion(&self) -> bool {
        self.from != self.to || !self.is_straight()
    }

    /// Whether it goes straight from one end to the other.
    pub fn is_straight(&self) -> bool {
        matches!(self.shape, Shape::Line)
    }

    /// Number of intervals between equally spaced places that show the shape of the move: more on arcs and splines.
    pub fn places(&self) -> usize {
        match &self.shape {
            // Every 7.5 degrees: between such places a circle is 0.2 % of the radius from its chord.
            Shape::Arc(arc) => 4 + (arc.sweep.abs() / (TAU / 48.0)) as usize,
            Shape::Spline { pieces, first, last } => {
                let most = (*first..=*last).map(|piece| pieces.rows(piece).len() - 1).max().unwrap_or(1);
                4 * most * (last + 1 - first)
            }
            Shape::Line => 4,
        }
    }

    /// Distance of `q` from the nearest place of the move, in mm, or from any place within `enough`.
    pub(super) fn distance(&self, q: &[f64; M], enough: f64) -> f64 {
        match &self.shape {
            Shape::Line => Segment::new(&self.from, &self.to).distance_sq(q).sqrt(),
            Shape::Arc(arc) => self.distance_to_arc(arc, q, enough),
            Shape::Spline { pieces, first, last } => {
                nearest_of(
                    pieces,
                    q,
                    Place { piece: *first, u: 0.0 },
                    (*first, *last),
                    [enough, f64::INFINITY],
                )
                .1
            }
        }
    }

    /// Like `distance`, but on a spline the search starts at `last_place`, which is then replaced by the place found. The place
    /// of a few Newton steps is good enough within the second distance of `enough`. Where the distance exceeds `least`, `least`
    /// may be returned.
    pub(super) fn distance_from(
        &self,
        q: &[f64; M],
        (last_place, close): (&mut Option<Place>, &mut ClosePlaces<M>),
        enough: [f64; 2],
        least: f64,
    ) -> f64 {
        let Shape::Spline { pieces, first, last } = &self.shape else { return self.distance(q, enough[0]) };
        close.start_at(last_place.unwrap_or(Place { piece: *first, u: 0.0 }));
        let found = close.find(q, [*first, *last], |_| enough);
        let (place, away) = found
            .unwrap_or_else(|| nearest_of(pieces, q, close.place(), (*first, *last), [enough[0], least]));
        *last_place = Some(place);
        away
    }

    /// Distance from the nearest of all local minima and both ends, or from any place within `enough`.
    fn distance_to_arc(&self, arc: &Arc, q: &[f64; M], enough: f64) -> f64 {
        let slope = ArcSlope::new([&self.from, &self.to], arc, q);
        let off = |t: f64| distance(q, &self.on_arc(arc, t));
        let mut nearest = distance(q, &self.from).min(distance(q, &self.to)).min(off(slope.beside()));
        if nearest <= enough {
            return nearest;
        }
        slope.each_half_turn(|from, to| {
            if slope.off_height(from.t, to.t) >= nearest {
                return;
            }
            // Between the zeros of the next rate a rate is monotone, so it has at most one zero there.
            let bend = slope.root::<2>(from, to);
            for [from, to] in [[from, &bend], [&bend, to]] {
                let level = slope.root::<1>(from, to);
                for [from, to] in [[from, &level], [&level, to]] {
                    if from.rates[0] < 0.0 && to.rates[0] >= 0.0 {
                        nearest = nearest.min(off(slope.root::<0>(from, to).t));
                    }
                }
            }
        });
        nearest
    }
}

/// The place of the pieces from `first` to `last` that is nearest to `q`, or one within `enough`, and its distance; searched
/// outwards from the place `from`. Returns `from` and `least` where no place is nearer than `least`.
fn nearest_of<const M: usize>(
    pieces: &Pieces,
    q: &[f64; M],
    from: Place,
    (first, last): (usize, usize),
    [enough, least]: [f64; 2],
) -> (Place, f64) {
    let mut nearest = (from, least);
    for piece in outwards(from.piece.clamp(first, last), first, last) {
        if pieces.distance_at_least(piece, q) > nearest.1 {
            continue;
        }
        let (u, away) = nearest_on_piece(&pieces.curve::<M>(piece), q);
        if away < nearest.1 {
            nearest = (Place { piece, u }, away);
        }
        if nearest.1 <= enough {
            break;
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The distance from the nearest place.
    fn off<const M: usize>(programmed: &Move<M>, q: &[f64; M]) -> f64 {
        programmed.distance(q, 0.0)
    }

    #[test]
    fn a_spline_is_as_far_as_its_nearest_piece() {
        // A line to (4, 0), then a parabola y = (x − 4)²/4 to (8, 4).
        let splines = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 4.0, 0.0, 4.0, 0.0, 6.0, 0.0, 8.0, 4.0],
            weights: &[],
            offsets: &[0, 2, 5],
            width: &[4.0, 4.0],
        };
        let program = Programmed {
            spline_move: &[0],
            spline_pieces: &[0, 2],
            splines,
            ..Programmed::of_lines(&[0.0, 0.0], &[8.0, 4.0], &[1])
        };
        let spline = program.get::<2>(0);
        assert!(spline.is_motion());
        assert_eq!(spline.places(), 16);
        assert!(distance(&spline.at(0.75), &[6.0, 1.0]) < 1e-15);
        assert!((off(&spline, &[1.0, -2.0]) - 2.0).abs() < 1e-15);
        // Across the parabola at x = 6, where it rises at 45 degrees.
        assert!((off(&spline, &[7.0, 0.0]) - 2.0_f64.sqrt()).abs() < 1e-12);
        let (mut close, mut place) = (ClosePlaces::new(splines), None);
        for enough in [0.0, 1.5, 0.0, 1.42] {
            let from = (&mut place, &mut close);
            let away = spline.distance_from(&[7.0, 0.0], from, [enough; 2], f64::INFINITY);
            let most = enough.max(2.0_f64.sqrt() + 1e-12);
            assert!((2.0_f64.sqrt() - 1e-12..=most).contains(&away), "{away}");
        }
        // Nothing is nearer than that.
        assert_eq!(spline.distance_from(&[7.0, 0.0], (&mut place, &mut close), [0.0; 2], 1.4), 1.4);
    }

    /// Helices about Z that start at radius 10, with 0.25 or 2.25 turns, up to 100 mm high or flat; some turn clockwise, some
    /// narrow or widen.
    const HELICES: [([f64; 3], [f64; 1]); 9] = [
        ([0.0, 10.0, 9.0], [2.25 * TAU]),
        ([0.0, 10.0, 100.0], [2.25 * TAU]),
        ([0.0, 10.0, 9.0], [0.25 * TAU]),
        ([0.0, 10.0, 100.0], [0.25 * TAU]),
        ([0.0, -10.0, 30.0], [-2.25 * TAU]),
        ([0.0, 10.0, 0.0], [0.25 * TAU]),
        ([0.0, 10.01, 9.0], [2.25 * TAU]),
        ([0.0, -25.0, 40.0], [-2.25 * TAU]),
        ([0.0, 0.0, 9.0], [2.25 * TAU]),
    ];

    fn helix<'a>((target, angle): &'a ([f64; 3], [f64; 1])) -> Move<'a, 3> {
        Programmed {
            arc_move: &[0],
            arc_centre: &[0.0, 0.0, 0.0],
            arc_normal: &[2],
            arc_angle: angle,
            ..Programmed::of_lines(&[10.0, 0.0, 0.0], target, &[1])
        }
        .get(0)
    }

    #[test]
    fn a_quarter_circle_is_as_far_as_the_radii_differ() {
        let quarter = Programmed {
            arc_move: &[0],
            arc_centre: &[0.0, 0.0, 0.0],
            arc_normal: &[2],
            arc_angle: &[TAU / 4.0],
            ..Programmed::of_lines(&[10.0, 0.0], &[0.0, 10.0], &[1])
        }
        .get::<2>(0);
        assert!((off(&quarter, &[6.0, 9.0]) - (117.0_f64.sqrt() - 10.0)).abs() < 1e-14);
        assert!((off(&quarter, &[3.0, 4.0]) - 5.0).abs() < 1e-14);
        // Beyond the ends the ends are nearest.
        assert_eq!(off(&quarter, &[10.0, -2.0]), 2.0);
        assert_eq!(off(&quarter, &[-3.0, 14.0]), 5.0);
    }

    #[test]
    fn arcs_in_the_other_planes_turn_about_their_normal() {
        // G18 and G19: counter-clockwise seen from the tip of Y, of X.
        for (normal, target) in [(1_u8, [0.0, 0.0, -1.0]), (2, [0.0, 1.0, 0.0])] {
            let normals = [normal];
            let quarter = Programmed {
                arc_move: &[0],
                arc_centre: &[0.0, 0.0, 0.0],
                arc_normal: &normals,
                arc_angle: &[TAU / 4.0],
                ..Programmed::of_lines(&[1.0, 0.0, 0.0], &target, &[1])
            }
            .get::<3>(0);
            assert!(distance(&quarter.at(1.0), &target) < 1e-15, "normal {normal}");
        }
    }

    #[test]
    fn a_place_on_a_helix_is_on_it() {
        for helix in HELICES.each_ref().map(helix) {
            for i in 0..=200 {
                let t = f64::from(i) / 200.0;
                assert!(off(&helix, &helix.at(t)) < 1e-12, "t = {t}");
            }
        }
    }

    /// Errors of the distance of `q` from a helix, compared with the nearest of 20 000 places on it: how much it is too great,
    /// and how much it is too small. Neither is positive if the distance is right.
    fn errors(which: usize, q: &[f64; 3]) -> [f64; 2] {
        let helix = helix(&HELICES[which]);
        let places: Vec<_> = (0..=20_000).map(|i| helix.at(f64::from(i) / 20_000.0)).collect();
        let dense = places.iter().map(|place| distance(q, place)).fold(f64::INFINITY, f64::min);
        let step = places.windows(2).map(|pair| distance(&pair[0], &pair[1])).fold(0.0, f64::max);
        let found = off(&helix, q);
        // The nearest place is at most half a step from one of these, at right angles to the direction of `q`; the whole step
        // also covers the curvature.
        [found - dense, dense - found.hypot(step)]
    }

    #[test]
    fn the_nearest_place_of_a_helix_may_be_at_another_angle() {
        let q = [3.758_070_079_136_945, -3.986_070_725_022_069, 1.422_999_270_949_225_2 * 9.0];
        assert!(errors(2, &q).iter().all(|&error| error < 1e-12));
    }

    proptest! {
        #[test]
        fn no_place_of_a_helix_is_nearer_than_its_distance(
            which in 0..HELICES.len(),
            x in -20.0..20.0_f64,
            y in -20.0..20.0_f64,
            height in -0.5..1.5_f64,
        ) {
            let q = [x, y, height * HELICES[which].0[2]];
            for error in errors(which, &q) {
                prop_assert!(error < 1e-12, "{error:e}");
            }
        }
    }
}
