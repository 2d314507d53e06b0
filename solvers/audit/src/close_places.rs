//! Finds places of a path or of programmed splines that are close enough to given points, one point after the other.
//!
//! Uses Newton's method from the place of the point before, on its piece or across pieces. The distance of a point from any place
//! of the path is an upper bound of its distance from the path: where it is small enough, no search for the nearest place is
//! needed.

use super::curve::{Curves, Pieces};
use super::nearest::{step_towards, Place};
use super::vectors::{from_to, length};

/// Limit of the Newton steps; points mostly come in the order of the path and need two.
const MOST_STEPS: usize = 8;

pub struct ClosePlaces<'a, const M: usize> {
    pub curves: Curves<'a, M>,
    /// The place of the point before.
    place: Place,
}

impl<'a, const M: usize> ClosePlaces<'a, M> {
    pub fn new(pieces: Pieces<'a>) -> Self {
        Self { curves: Curves::new(pieces), place: Place { piece: 0, u: 0.0 } }
    }

    /// The last place.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The next search starts at this place.
    pub fn start_at(&mut self, place: Place) {
        self.place = place;
    }

    /// Whether the last place is on one of these pieces.
    fn is_on(&self, [least, most]: [usize; 2]) -> bool {
        (least..=most).contains(&self.place.piece)
    }

    /// A place on the pieces from `least` to `most` that is close to `q`, and its distance in mm. `close` gives two distances for
    /// a piece: the first place within the smaller one ends the search; else the nearest place of a few steps is returned if it
    /// is within the greater one, and None if it is not.
    pub fn find(
        &mut self,
        q: &[f64; M],
        [least, most]: [usize; 2],
        close: impl Fn(usize) -> [f64; 2],
    ) -> Option<(Place, f64)> {
        let mut place = if self.is_on([least, most]) { self.place } else { Place { piece: least, u: 0.0 } };
        let (mut nearest, mut came_from) = ((place, f64::INFINITY), None);
        for _ in 0..MOST_STEPS {
            let [point, slope] = self.curves.get(place.piece).place(place.u);
            let away = from_to(&point, q);
            let distance = length(&away);
            if distance < nearest.1 {
                nearest = (place, distance);
            }
            if distance <= close(place.piece)[0] {
                break;
            }
            let mut next = place.moved(step_towards(&away, &slope), self.curves.pieces.width, [least, most]);
            if next.piece != place.piece {
                // The steps go from one piece to the other and back: their junction is the nearest place.
                if came_from == Some(next.piece) {
                    let u =
                        if next.piece < place.piece { 0.0 } else { self.curves.pieces.width[place.piece] };
                    next = Place { u, ..place };
                } else {
                    came_from = Some(place.piece);
                }
            }
            if next == place {
                break;
            }
            place = next;
        }
        self.place = nearest.0;
        (nearest.1 <= close(nearest.0.piece)[1]).then_some(nearest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_on_any_piece_ahead_or_behind_is_close_to_a_place_there() {
        // Along X from 0 to 3 in three pieces of degree 2, then up.
        let control: Vec<f64> = (0..4)
            .flat_map(|i| {
                let x = f64::from(i);
                if i < 3 {
                    [x, 0.0, x + 0.5, 0.0, x + 1.0, 0.0]
                } else {
                    [3.0, 0.0, 3.0, 0.5, 3.0, 1.0]
                }
            })
            .collect();
        let offsets = [0, 3, 6, 9, 12];
        let pieces = Pieces {
            axes: 2,
            stride: 2,
            control: &control,
            weights: &[],
            offsets: &offsets,
            width: &[1.0; 4],
        };
        let mut places = ClosePlaces::new(pieces);
        for (q, piece) in [([0.3, 0.01], 0), ([2.4, 0.01], 2), ([0.7, 0.0], 0), ([3.01, 0.6], 3)] {
            let (found, distance) = places.find(&q, [0, 3], |_| [0.0100001; 2]).unwrap();
            assert!(found.piece == piece && distance <= 0.0100001, "{q:?}: {found:?}, {distance}");
        }
        assert!(places.find(&[0.3, 0.01], [2, 3], |_| [0.5; 2]).is_none());
        assert!(places.find(&[0.3, 1.0], [0, 3], |_| [0.5; 2]).is_none());
        assert!(places.find(&[f64::NAN, 0.0], [0, 3], |_| [0.5; 2]).is_none());
    }
}
