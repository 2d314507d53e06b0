//! Joints that are not the path's axes, as columns by the parameter of the tool's path.

use std::rc::Rc;
use std::sync::Arc;

use super::path::{JointPath, Piece, Work};
use crate::columns::{Columns, Place};
use crate::curve::{Curve, Curves, Followed};
use crate::station::{Rounded, Station};
use crate::vectors::vector_of;
use crate::{Limits, FEEDS};

/// Intervals for each degree of a phase that covers its whole piece, and the least number.
const STEPS: f64 = 3.0;
const LEAST: f64 = 2.0;

/// See `Columns::smooth`: between two pieces the formula is evaluated on other numbers.
const SMOOTH: f64 = 1e-6;

pub struct JointColumns<'a, const M: usize> {
    of: &'a JointPath<'a>,
    limits: &'a Limits<M>,
    work: Work,
    curves: Curves<'a, M>,
    /// The last two pieces, the last one first.
    pieces: [Option<Rc<Piece<'a, M>>>; 2],
    /// The last place, and the last two at which everything is known.
    last: Option<Place<M>>,
    kept: [Option<(Place<M>, Station<M>)>; 2],
    older: usize,
}

impl<'a, const M: usize> JointColumns<'a, M> {
    pub fn new(of: &'a JointPath<'a>, limits: &'a Limits<M>) -> Self {
        let (work, curves) = (of.work(), Curves::new(of.path.pieces));
        Self { of, limits, work, curves, pieces: [None, None], last: None, kept: [None, None], older: 0 }
    }

    /// A piece of the path.
    pub fn piece(&mut self, number: usize) -> Rc<Piece<'a, M>> {
        let is_here = |kept: &Option<Rc<Piece<M>>>| kept.as_ref().is_some_and(|piece| piece.number == number);
        if !is_here(&self.pieces[0]) {
            self.pieces.swap(0, 1);
            if !is_here(&self.pieces[0]) {
                self.pieces[0] = None;
            }
        }
        let Self { of, curves, pieces, .. } = self;
        pieces[0].get_or_insert_with(|| Rc::new(of.piece_on(number, curves.get(number).clone()))).clone()
    }

    fn known(&self, piece: usize, u: f64) -> Option<&(Place<M>, Station<M>)> {
        self.kept.iter().flatten().find(|(place, _)| place.piece == piece && place.u == u)
    }
}

impl<const M: usize> Columns<M> for JointColumns<'_, M> {
    fn count(&self) -> usize {
        self.of.joints
    }

    fn path(&self) -> &Followed<'_> {
        &self.of.path
    }

    fn curve(&mut self, piece: usize) -> &Arc<Curve<M>> {
        self.curves.get(piece)
    }

    fn scale(&self) -> [f64; M] {
        self.of.scale()
    }

    fn place(&mut self, piece: usize, u: f64) -> Place<M> {
        let last = self.last.filter(|place| place.piece == piece && place.u == u);
        let known = last.or_else(|| self.known(piece, u).map(|(place, _)| *place));
        let place = known.unwrap_or_else(|| self.piece(piece).place(u, &mut self.work));
        self.last = Some(place);
        place
    }

    fn station(&mut self, piece: usize, u: f64) -> Option<Station<M>> {
        if let Some((_, station)) = self.known(piece, u) {
            return Some(*station);
        }
        let found = self.piece(piece).station(u, &mut self.work);
        self.kept[self.older] = Some(found);
        self.older = 1 - self.older;
        Some(found.1)
    }

    fn way(&mut self, from: &Place<M>, to: &Place<M>) -> Rounded<M> {
        let value = self.piece(from.piece).between(&from.position.value, &to.position.value, None);
        Rounded { value, rounding: vector_of(|k| from.position.rounding[k] + to.position.rounding[k]) }
    }

    fn difference(&mut self, [from, to]: [usize; 2], a: &[f64; M], b: &[f64; M]) -> [f64; M] {
        let [first, last] = [from, to].map(|piece| self.piece(piece));
        last.between(a, b, Some(&first))
    }

    fn toward(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2] {
        let place = self.place(piece, u);
        [self.piece(piece).between(&place.position.value, q, None), place.slope.value]
    }

    fn are_axes(&self) -> bool {
        false
    }

    fn held_slope(&mut self, piece: usize, u: f64, _: &[f64; M]) -> [f64; 2] {
        [self.piece(piece).feed_slope(u), 0.0]
    }

    fn feeds(&self, piece: usize) -> [f64; FEEDS] {
        let mut feeds = [f64::INFINITY; FEEDS];
        feeds[0] = self.of.feed[piece];
        feeds
    }

    fn speed(&self, _: usize, _: &Rounded<M>, tip: [f64; 2]) -> [f64; 2] {
        tip
    }

    fn tip(&mut self, piece: usize, u: f64, _: &[f64; M]) -> [f64; M] {
        self.curves.get(piece).at(u)
    }

    fn tip_way(&mut self, piece: usize, _: usize, from: &[f64; M], to: &[f64; M]) -> f64 {
        self.piece(piece).feed_way(from, to)
    }

    fn chord_axes(&mut self, piece: usize) -> [f64; M] {
        self.piece(piece).linear()
    }

    fn curvature(&mut self, piece: usize, u: f64) -> f64 {
        self.piece(piece).curvature(u)
    }

    fn magnitude(&mut self, piece: usize) -> f64 {
        self.piece(piece).start_size()
    }

    fn turned(&mut self, _: usize) -> f64 {
        0.0
    }

    fn comparable(&mut self, pieces: [usize; 2]) -> bool {
        let [before, after] = pieces.map(|piece| self.piece(piece).counts);
        before == after
    }

    fn intervals(&self, covered: f64, _: f64) -> f64 {
        (STEPS * covered).max(LEAST)
    }

    /// Plans are made on stand-ins for the joints, some 1e-10 mm from them.
    fn settling(&self, duration: f64) -> f64 {
        self.limits.period.max(duration)
    }

    fn negligible_speed(&self, place: &Place<M>, time: f64) -> f64 {
        let limits = self.limits;
        let (mut least, mut weakest) = (f64::INFINITY, f64::INFINITY);
        for k in 0..self.count() {
            let share = limits.negligible_jump(k, time) / place.slope.value[k].abs() * place.tip_slope;
            if share.is_finite() {
                least = least.min(share);
            }
            weakest = weakest.min(limits.negligible_jump(k, limits.period));
        }
        if least.is_finite() {
            least.max(weakest)
        } else {
            weakest
        }
    }

    fn smooth(&self) -> f64 {
        SMOOTH
    }
}
