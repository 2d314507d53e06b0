//! Joints that are not the path's axes, as columns by the parameter of the tool's path: see `columns`.

use std::rc::Rc;

use super::path::{JointPath, Piece, Work};
use crate::columns::Place;
use crate::curve::{Curve, Curves};
use crate::station::{Rounded, Station};
use crate::vectors::vector_of;
use crate::FEEDS;

/// Intervals for each degree of a phase that covers its whole piece, and the least number.
const STEPS: f64 = 3.0;
const LEAST: f64 = 2.0;

/// Pieces that meet at a smaller angle than this, in rad, meet without a corner: between two pieces the formula is evaluated on
/// other numbers.
const SMOOTH: f64 = 1e-6;

pub struct JointColumns<'a, const M: usize> {
    of: &'a JointPath<'a>,
    work: Work,
    /// The last two pieces, the last one first.
    pieces: [Option<Rc<Piece<'a, M>>>; 2],
    /// The last place, and the last two at which everything is known.
    last: Option<Place<M>>,
    kept: [Option<(Place<M>, Station<M>)>; 2],
    older: usize,
}

impl<'a, const M: usize> JointColumns<'a, M> {
    pub fn new(of: &'a JointPath<'a>) -> Self {
        Self { of, work: of.work(), pieces: [None, None], last: None, kept: [None, None], older: 0 }
    }

    /// A piece of the path, on its curve.
    pub fn piece(&mut self, number: usize, curve: &Rc<Curve<M>>) -> Rc<Piece<'a, M>> {
        let is_here = |kept: &Option<Rc<Piece<M>>>| kept.as_ref().is_some_and(|piece| piece.number == number);
        if !is_here(&self.pieces[0]) {
            self.pieces.swap(0, 1);
            if !is_here(&self.pieces[0]) {
                self.pieces[0] = None;
            }
        }
        self.pieces[0].get_or_insert_with(|| Rc::new(self.of.piece_on(number, curve.clone()))).clone()
    }

    fn known(&self, piece: usize, u: f64) -> Option<&(Place<M>, Station<M>)> {
        self.kept.iter().flatten().find(|(place, _)| place.piece == piece && place.u == u)
    }

    pub fn scale(&self) -> [f64; M] {
        self.of.scale()
    }

    pub fn place(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64) -> Place<M> {
        let last = self.last.filter(|place| place.piece == piece && place.u == u);
        let known = last.or_else(|| self.known(piece, u).map(|(place, _)| *place));
        let place = known.unwrap_or_else(|| self.piece(piece, curve).place(u, &mut self.work));
        self.last = Some(place);
        place
    }

    pub fn station(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64) -> Station<M> {
        if let Some((_, station)) = self.known(piece, u) {
            return *station;
        }
        let found = self.piece(piece, curve).station(u, &mut self.work);
        self.kept[self.older] = Some(found);
        self.older = 1 - self.older;
        found.1
    }

    pub fn way(&mut self, curve: &Rc<Curve<M>>, from: &Place<M>, to: &Place<M>) -> Rounded<M> {
        let value = self.piece(from.piece, curve).between(&from.position.value, &to.position.value, None);
        Rounded { value, rounding: vector_of(|k| from.position.rounding[k] + to.position.rounding[k]) }
    }

    pub fn difference(
        &mut self,
        curves: &mut Curves<'a, M>,
        pieces: [usize; 2],
        a: &[f64; M],
        b: &[f64; M],
    ) -> [f64; M] {
        let [first, last] = pieces.map(|piece| self.piece(piece, curves.get(piece)));
        last.between(a, b, Some(&first))
    }

    pub fn toward(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2] {
        let place = self.place(curve, piece, u);
        [self.piece(piece, curve).between(&place.position.value, q, None), place.slope.value]
    }

    pub fn feeds(&self, piece: usize) -> [f64; FEEDS] {
        let mut feeds = [f64::INFINITY; FEEDS];
        feeds[0] = self.of.feed[piece];
        feeds
    }

    pub fn intervals(&self, covered: f64) -> f64 {
        (STEPS * covered).max(LEAST)
    }

    pub fn smooth(&self) -> f64 {
        SMOOTH
    }
}
