//! Finds the move nearest to each place along a path, one place after the other.

use super::close_places::ClosePlaces;
use super::moves::{Move, Programmed, Shape};
use super::nearest::Place;

/// First and last piece that follow a move.
pub type Followers = (usize, usize);

/// One of the moves by its index in `Neighbours`, and on splines the place on it.
pub type Here = (usize, Option<Place>);

/// The number of a move in the program, the move, and on splines the place that was nearest last.
type Near<'a, const M: usize> = (usize, Move<'a, M>, Option<Place>);

/// Moves that places along a path are measured against, one place after the other.
#[derive(Default)]
pub struct Neighbours<'a, const M: usize> {
    moves: Vec<Near<'a, M>>,
    /// The move nearest to the place before: mostly also nearest to the next place.
    nearest: usize,
    /// Places on the splines, if there are any.
    close: Option<ClosePlaces<'a, M>>,
}

impl<'a, const M: usize> Neighbours<'a, M> {
    /// Replaces the moves by others; keeps the known places on splines.
    pub fn replace(&mut self, program: &Programmed<'a>, numbers: impl Iterator<Item = usize>) {
        if self.close.is_none() && !program.splines.is_empty() {
            self.close = Some(ClosePlaces::new(program.splines));
        }
        let known: Vec<(usize, Place)> =
            self.moves.iter().filter_map(|(number, _, place)| Some((*number, (*place)?))).collect();
        let place = |number: usize| known.iter().find(|known| known.0 == number).map(|known| known.1);
        self.moves.clear();
        self.moves.extend(numbers.map(|number| (number, program.get(number), place(number))));
        self.nearest = 0;
    }

    /// Starts the search on a spline where no place is known, as far along the spline as `piece` is along the pieces that follow
    /// it.
    pub fn start_at(&mut self, followers: &[Followers], piece: usize) {
        for (number, programmed, place) in &mut self.moves {
            if let (Shape::Spline { first, last, .. }, None) = (programmed.shape, &place) {
                let (from, to) = followers[*number];
                let share = piece.saturating_sub(from) as f64 / (to + 1).saturating_sub(from).max(1) as f64;
                let piece = (first + (share * (last + 1 - first) as f64) as usize).min(last);
                *place = Some(Place { piece, u: 0.0 });
            }
        }
    }

    /// The move that the last distance was measured from, and on a spline the place on it.
    pub fn here(&self) -> Here {
        (self.nearest, self.moves.get(self.nearest).and_then(|(_, _, place)| *place))
    }

    /// Upper bound of the distance of the moves from the chord between two of these places, in mm; infinite unless both are on
    /// the same straight move or the same piece of a spline.
    pub fn sagitta(&mut self, from: Here, to: Here) -> f64 {
        let on = self.moves.get(from.0).filter(|_| from.0 == to.0);
        match (on, from.1, to.1, &mut self.close) {
            (Some((_, programmed, _)), ..) if programmed.is_straight() => 0.0,
            (Some(_), Some(from), Some(to), Some(close)) if from.piece == to.piece => {
                close.curves.get(to.piece).sagitta(to.u - from.u)
            }
            _ => f64::INFINITY,
        }
    }

    /// Distance of `q` from the nearest move in mm, or from the first move found within the first distance of `enough`; for the
    /// second one see `Move::distance_from`. NaN if any distance is NaN.
    pub fn distance(&mut self, q: &[f64; M], enough: [f64; 2]) -> f64 {
        let mut least = f64::INFINITY;
        let first = self.nearest;
        for m in (first..self.moves.len()).chain(0..first) {
            let (_, programmed, place) = &mut self.moves[m];
            let away = match &mut self.close {
                Some(close) if !programmed.is_straight() => {
                    programmed.distance_from(q, (place, close), enough, least)
                }
                _ => programmed.distance(q, enough[0]),
            };
            if away.is_nan() {
                return away;
            }
            if away < least {
                (least, self.nearest) = (away, m);
            }
            if least <= enough[0] {
                break;
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Pieces;

    /// Along X from 0 to 4, along Y to (4, 4), and by a half circle back to (4, 0).
    const PROGRAM: Programmed = Programmed {
        arc_move: &[2],
        arc_centre: &[4.0, 2.0, 0.0],
        arc_normal: &[2],
        arc_angle: &[std::f64::consts::PI],
        ..Programmed::of_lines(&[0.0, 0.0], &[4.0, 0.0, 4.0, 4.0, 4.0, 0.0], &[1, 2, 3])
    };

    #[test]
    fn a_straight_move_is_its_chord_and_between_moves_and_on_arcs_nothing_is_known() {
        let mut near = Neighbours::<2>::default();
        near.replace(&PROGRAM, 0..3);
        let [on_x, on_y, on_arc] = [[1.0, 0.1], [4.1, 1.0], [1.9, 2.0]].map(|q| {
            near.distance(&q, [0.0; 2]);
            near.here()
        });
        assert_eq!([near.sagitta(on_x, on_x), near.sagitta(on_x, on_y)], [0.0, f64::INFINITY]);
        assert_eq!(near.sagitta(on_arc, on_arc), f64::INFINITY);
    }

    #[test]
    fn a_piece_of_a_spline_is_as_far_from_its_chord_as_its_second_derivative_lets_it() {
        // Two parabolas: y = x²/4 from (0, 0) to (2, 1), and on to (4, 0).
        let splines = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 1.0, 0.0, 2.0, 1.0, 2.0, 1.0, 3.0, 2.0, 4.0, 0.0],
            weights: &[],
            offsets: &[0, 3, 6],
            width: &[2.0, 2.0],
        };
        let program = Programmed {
            spline_move: &[0],
            spline_pieces: &[0, 2],
            splines,
            ..Programmed::of_lines(&[0.0, 0.0], &[4.0, 0.0], &[1])
        };
        let mut near = Neighbours::<2>::default();
        near.replace(&program, 0..1);
        let [from, to, beyond] = [[0.5, 0.0625], [1.5, 0.5625], [3.0, 1.25]].map(|q| {
            near.distance(&q, [1e-12; 2]);
            near.here()
        });
        assert!((near.sagitta(from, to) - 0.125 * 0.5).abs() < 1e-9);
        assert_eq!(near.sagitta(to, beyond), f64::INFINITY);
    }
}
