//! Finds the place of a point on the path: the nearest place of a piece, or the next place along the path.

use super::curve::{Curve, Followed};
use super::number::inner;
use super::vectors::distance;

/// Limit of the pieces that one step passes: where a piece has no direction, a Newton step may have any length.
const MOST_PASSED: usize = 8;

/// A place on the path; places are ordered along it.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Place {
    pub piece: usize,
    /// Local parameter in mm.
    pub u: f64,
}

impl Place {
    /// The place at a parameter step of `step` from here, in mm, on pieces of these widths. The step is continued over the ends
    /// of pieces, but stays on the pieces from `least` to `most` and passes at most `MOST_PASSED`. A NaN counts as 0.
    #[inline]
    pub fn moved(self, step: f64, width: &[f64], [least, most]: [usize; 2]) -> Self {
        let Self { mut piece, mut u } = self;
        let (least, most) = (least.max(piece.saturating_sub(MOST_PASSED)), most.min(piece + MOST_PASSED));
        u += if step.is_nan() { 0.0 } else { step };
        while u > width[piece] && piece < most {
            u -= width[piece];
            piece += 1;
        }
        while u < 0.0 && piece > least {
            piece -= 1;
            u += width[piece];
        }
        Self { piece, u: u.max(0.0).min(width[piece]) }
    }
}

/// The Newton step of u towards the place nearest to a point; `away` is the vector to the point from the current place, `slope`
/// is C'.
#[inline]
pub fn step_towards<const M: usize>(away: &[f64; M], slope: &[f64; M]) -> f64 {
    inner(away, slope) / inner(slope, slope)
}

/// The first local minimum of the distance of `q` at or after `from`: its parameter, its distance, and whether the distance still
/// falls at the end of the piece.
#[inline]
pub fn first_minimum<const M: usize>(curve: &Curve<M>, q: &[f64; M], from: f64) -> (f64, f64, bool) {
    let width = curve.width();
    let t0 = (from / width).clamp(0.0, 1.0);
    let (t, falls) = curve.polygon.first_minimum(q, t0);
    let (u, falls) = if t > t0 { (t * width, falls) } else { (from, false) };
    (u, distance(q, &curve.at(u)), falls)
}

/// Calls `found` with parameter and distance of each local minimum of the distance at or after `from`, and of both ends.
pub fn all_minima<const M: usize>(
    curve: &Curve<M>,
    q: &[f64; M],
    from: f64,
    mut found: impl FnMut(f64, f64),
) {
    let width = curve.width();
    let t0 = (from / width).clamp(0.0, 1.0);
    curve.polygon.all_minima(q, t0, &mut |t| {
        let u = if t > t0 { t * width } else { from };
        found(u, distance(q, &curve.at(u)));
    });
}

/// The parameter of the place of a piece that is nearest to `q`, and its distance in mm.
pub fn nearest_on_piece<const M: usize>(curve: &Curve<M>, q: &[f64; M]) -> (f64, f64) {
    let mut nearest = (0.0, f64::INFINITY);
    all_minima(curve, q, 0.0, |u, distance| {
        if distance < nearest.1 {
            nearest = (u, distance);
        }
    });
    nearest
}

/// A place found for a point, and its errors.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    pub place: Place,
    /// Distance of the point from the place in mm.
    pub distance: f64,
    /// The error of the place by `judge`, in mm.
    pub error: f64,
}

/// A search along the path, and its tolerances.
pub struct Search<'a, F> {
    pub path: &'a Followed<'a>,
    /// Length of path to look along after the first piece, in mm.
    pub reach: f64,
    /// Distance up to which a point counts as on the path, in mm.
    pub close: f64,
    /// The error of a place for other reasons than its distance, in mm; and how much of it is allowed.
    pub judge: F,
    pub allowed: f64,
}

impl<F: FnMut(Place) -> f64> Search<'_, F> {
    /// The first place at or after `from` that is close and whose error is allowed; else the best one within reach.
    ///
    /// A second search takes all minima of every piece: where the path turns back within a step, the first minimum may be a wrong
    /// one.
    pub fn next_place<const M: usize>(&mut self, from: Place, q: &[f64; M]) -> Found {
        let quick = self.look::<M>(from, q, false);
        if self.is_good(&quick) {
            return quick;
        }
        let thorough = self.look::<M>(from, q, true);
        if self.badness(&thorough) <= self.badness(&quick) {
            thorough
        } else {
            quick
        }
    }

    fn is_good(&self, found: &Found) -> bool {
        found.distance <= self.close && found.error <= self.allowed
    }

    /// Ranks places: those on the path by the greater of both errors, before all others by their distance.
    fn badness(&self, found: &Found) -> f64 {
        if found.distance <= self.close {
            found.error.max(found.distance)
        } else {
            1e9 + found.distance
        }
    }

    fn candidate(&mut self, piece: usize, u: f64, distance: f64) -> Found {
        let place = Place { piece, u };
        let error = if distance <= self.close { (self.judge)(place) } else { f64::INFINITY };
        Found { place, distance, error }
    }

    fn look<const M: usize>(&mut self, from: Place, q: &[f64; M], thorough: bool) -> Found {
        let mut best = Found { place: from, distance: f64::INFINITY, error: f64::INFINITY };
        let (mut travelled, mut start) = (0.0, from.u);
        for piece in from.piece..self.path.len() {
            let curve = self.path.curve::<M>(piece);
            let mut falls_on = false;
            if thorough {
                all_minima(&curve, q, start, |u, distance| {
                    let found = self.candidate(piece, u, distance);
                    if self.badness(&found) <= self.badness(&best) {
                        best = found;
                    }
                });
            } else {
                let (u, distance, falls) = first_minimum(&curve, q, start);
                let found = self.candidate(piece, u, distance);
                if self.badness(&found) <= self.badness(&best) {
                    best = found;
                    // The true minimum may be at the start of the next piece (rounding).
                    falls_on = falls;
                }
            }
            if self.is_good(&best) && !falls_on {
                break;
            }
            // The first piece does not count: the search may start long before the place.
            if piece > from.piece {
                travelled += distance(&curve.at(start), &curve.at(curve.width()));
            }
            if travelled > self.reach {
                break;
            }
            start = 0.0;
        }
        best
    }
}

/// `from`, then alternately the next one after and before it, within `least` to `most`.
pub fn outwards(from: usize, least: usize, most: usize) -> impl Iterator<Item = usize> {
    let (mut after, mut before, mut turn) = (from + 1, from, false);
    let others = std::iter::from_fn(move || {
        turn = if after > most { false } else { before <= least || !turn };
        if turn {
            after += 1;
            Some(after - 1)
        } else {
            (before > least).then(|| {
                before -= 1;
                before
            })
        }
    });
    std::iter::once(from).chain(others)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Pieces;
    use crate::polygon::Polygon;
    use proptest::prelude::*;

    /// Two pieces: along X to 10 and back again.
    const THERE_AND_BACK: Followed = Followed {
        pieces: Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 5.0, 0.0, 10.0, 0.0, 10.0, 0.0, 5.0, 0.0, 0.0, 0.0],
            weights: &[],
            offsets: &[0, 3, 6],
            width: &[10.0, 10.0],
        },
        feed: &[1.0, 1.0],
        line: &[1, 2],
        moves: &[0, 0, 1, 1],
        tolerance: &[0.0, 0.0],
        runs: &[0, 2],
        new_words: &[],
        start_dwell: 0.0,
        dwell: &[0.0],
    };

    fn next(from: Place, q: [f64; 2], judge: impl FnMut(Place) -> f64) -> Found {
        Search { path: &THERE_AND_BACK, reach: 20.0, close: 1e-9, judge, allowed: 1e-9 }.next_place(from, &q)
    }

    #[test]
    fn a_step_goes_on_over_the_ends_of_pieces() {
        let (place, width) = (Place { piece: 1, u: 2.0 }, [3.0; 5]);
        let moved = |step: f64| place.moved(step, &width, [0, 3]);
        assert_eq!(moved(0.5), Place { piece: 1, u: 2.5 });
        assert_eq!([moved(5.0), moved(-3.0)], [Place { piece: 3, u: 1.0 }, Place { piece: 0, u: 2.0 }]);
        assert_eq!([moved(99.0), moved(-99.0)], [Place { piece: 3, u: 3.0 }, Place { piece: 0, u: 0.0 }]);
        assert_eq!(moved(f64::NAN), place);
    }

    #[test]
    fn a_point_ahead_is_found_ahead() {
        let found = next(Place { piece: 0, u: 2.0 }, [3.0, 0.0], |_| 0.0);
        assert!(found.place.piece == 0 && found.distance < 1e-15);
        assert!((found.place.u - 3.0).abs() < 1e-14);
    }

    #[test]
    fn a_point_behind_is_found_on_the_way_back_and_never_behind() {
        let found = next(Place { piece: 0, u: 4.0 }, [3.0, 0.0], |_| 0.0);
        assert_eq!(found.place.piece, 1);
        assert!((found.place.u - 7.0).abs() < 1e-14);
        let beside = next(Place { piece: 1, u: 8.0 }, [3.0, 0.0], |_| 0.0);
        assert!(beside.place == Place { piece: 1, u: 8.0 } && (beside.distance - 1.0).abs() < 1e-14);
    }

    #[test]
    fn of_two_places_the_one_judged_good_is_taken() {
        let on_the_way_back = |place: Place| if place.piece == 1 { 0.0 } else { 1.0 };
        let found = next(Place { piece: 0, u: 2.0 }, [3.0, 0.0], on_the_way_back);
        assert_eq!((found.place.piece, found.error), (1, 0.0));
    }

    #[test]
    fn a_place_next_to_an_end_at_rest_is_before_it() {
        for step in [0.0, -4e-15] {
            let points = [[-61.0, 0.0], [-19.0, 0.0], [-19.0 + step, 0.0]];
            let curve = Curve::new(Polygon::new(points.into_iter(), &[]), 1.0);
            let (u, off, falls) = first_minimum(&curve, &[-19.0 - 42.0 * 1e-12, 0.0], 0.99);
            assert!(!falls && off < 1e-12 && (1.0 - u - 1e-6).abs() < 1e-8, "{u} is {off} off");
        }
    }

    #[test]
    fn from_a_start_at_rest_the_next_place_is_ahead() {
        for step in [0.0, -1e-16] {
            let curve = Curve::new(Polygon::new([[0.0, 0.0], [step, 0.0], [3.0, 0.0]].into_iter(), &[]), 1.0);
            for x in [1e-9, 0.01, 2.0] {
                let (u, off, falls) = first_minimum(&curve, &[x, 0.0], 0.0);
                assert!(!falls && off < 1e-13, "{x}: {u} is {off} off");
                assert!(nearest_on_piece(&curve, &[x, 0.0]).1 < 1e-13);
            }
            let (u, off, falls) = first_minimum(&curve, &[-1.0, 0.0], 0.0);
            assert!(u < 1e-12 && off == 1.0 && !falls, "{u}");
        }
    }

    proptest! {
        #[test]
        fn no_place_of_a_piece_is_nearer_than_its_distance(
            c in prop::array::uniform6(-2.0..2.0_f64), x in -3.0..3.0_f64, y in -3.0..3.0_f64,
        ) {
            let points = [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]]];
            let curve = Curve::new(Polygon::new(points.into_iter(), &[]), 3.0);
            let dense = (0..=5000)
                .map(|i| distance(&[x, y], &curve.at(3.0 * f64::from(i) / 5000.0)))
                .fold(f64::INFINITY, f64::min);
            let (_, found) = nearest_on_piece(&curve, &[x, y]);
            prop_assert!(found <= dense + 1e-12);
            prop_assert!(found >= dense - 2e-3);
        }
    }

    #[test]
    fn places_are_looked_at_from_near_to_far() {
        assert_eq!(outwards(2, 1, 5).collect::<Vec<_>>(), [2, 3, 1, 4, 5]);
        assert_eq!(outwards(5, 5, 5).collect::<Vec<_>>(), [5]);
    }
}
