//! The nearest of some moves to places along a path, one place after the other.

use super::moves::{Move, Programmed, Shape};

/// First and last piece that follow a move.
pub type Followers = (usize, usize);

/// Some moves that places along a path are measured against, one after the other.
#[derive(Clone, Default)]
pub struct Neighbours<'a, const M: usize> {
    moves: Vec<(usize, Move<'a, M>)>,
    /// The one nearest to the place before: mostly nearest to the next one too.
    nearest: usize,
    /// Of each move the piece that was nearest last.
    expected: Vec<usize>,
}

impl<'a, const M: usize> Neighbours<'a, M> {
    /// Takes other moves.
    pub fn replace(&mut self, program: &Programmed<'a>, numbers: impl Iterator<Item = usize>) {
        let known = self.moves.first().zip(self.expected.first()).map(|(first, piece)| (first.0, *piece));
        self.moves.clear();
        self.moves.extend(numbers.map(|number| (number, program.get(number))));
        self.nearest = 0;
        self.expected.clear();
        let expected = |number: usize| known.filter(|known| known.0 == number).map_or(0, |known| known.1);
        self.expected.extend(self.moves.iter().map(|(number, _)| expected(*number)));
    }

    /// Expects the nearest place of a spline to be as far along it as `piece` is along the pieces that follow it.
    pub fn start_at(&mut self, followers: &[Followers], piece: usize) {
        for ((number, programmed), expected) in self.moves.iter().zip(&mut self.expected) {
            if let Shape::Spline { first, last, .. } = programmed.shape {
                let (from, to) = followers[*number];
                let share = piece.saturating_sub(from) as f64 / (to + 1).saturating_sub(from).max(1) as f64;
                *expected = (first + (share * (last + 1 - first) as f64) as usize).min(last);
            }
        }
    }

    /// Distance of `q` from the nearest move, or from the first that is within `enough`; a NaN if there is one.
    pub fn distance(&mut self, q: &[f64; M], enough: f64) -> f64 {
        let mut least = f64::INFINITY;
        let first = self.nearest;
        for m in (first..self.moves.len()).chain(0..first) {
            let away = self.moves[m].1.distance(q, &mut self.expected[m], enough);
            if away.is_nan() {
                return away;
            }
            if away < least {
                (least, self.nearest) = (away, m);
            }
            if least <= enough {
                break;
            }
        }
        least
    }
}
