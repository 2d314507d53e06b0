//! Joints that are not the path's axes, as columns by the parameter of the tool's path.

use std::rc::Rc;
use std::sync::Arc;

use super::path::{Piece, Work};
use super::plan::JointAudit;
use crate::columns::{Columns, Place};
use crate::curve::{Curve, Curves, Followed};
use crate::station::{Rounded, Station};
use crate::vectors::vector_of;
use crate::FEEDS;

/// Intervals for each degree of a phase that covers its whole piece, and the least number.
const STEPS: f64 = 4.0;
const LEAST: f64 = 2.0;

/// See `Columns::smooth`: between two pieces the formula is evaluated on other numbers.
const SMOOTH: f64 = 1e-6;

pub struct JointColumns<'a, const M: usize> {
    of: &'a JointAudit<'a, M>,
    work: Work,
    curves: Curves<'a, M>,
    /// The last two pieces, the last one first.
    pieces: [Option<Rc<Piece<'a, M>>>; 2],
    /// The last two places at which everything is known.
    kept: [Option<(Place<M>, Station<M>)>; 2],
    older: usize,
}

impl<'a, const M: usize> JointColumns<'a, M> {
    pub fn new(of: &'a JointAudit<'a, M>) -> Self {
        let (work, curves) = (of.path.work(), Curves::new(of.path.path.pieces));
        Self { of, work, curves, pieces: [None, None], kept: [None, None], older: 0 }
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
        pieces[0].get_or_insert_with(|| Rc::new(of.path.piece_on(number, curves.get(number).clone()))).clone()
    }

    fn known(&self, piece: usize, u: f64) -> Option<&(Place<M>, Station<M>)> {
        self.kept.iter().flatten().find(|(place, _)| place.piece == piece && place.u == u)
    }
}

impl<const M: usize> Columns<M> for JointColumns<'_, M> {
    fn count(&self) -> usize {
        self.of.path.joints
    }

    fn path(&self) -> &Followed<'_> {
        &self.of.path.path
    }

    fn curve(&mut self, piece: usize) -> Arc<Curve<M>> {
        self.curves.get(piece).clone()
    }

    fn scale(&self) -> [f64; M] {
        self.of.path.scale()
    }

    fn place(&mut self, piece: usize, u: f64) -> Place<M> {
        match self.known(piece, u) {
            Some((place, _)) => *place,
            None => self.piece(piece).place(u, &mut self.work),
        }
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

    fn are_axes(&self) -> bool {
        false
    }

    fn held_slope(&mut self, piece: usize, u: f64, _: &[f64; M]) -> f64 {
        self.piece(piece).feed_slope(u)
    }

    fn feeds(&self, piece: usize) -> [f64; FEEDS] {
        let mut feeds = [f64::INFINITY; FEEDS];
        feeds[0] = self.of.path.feed[piece];
        feeds
    }

    fn speed(&self, _: usize, _: &Rounded<M>, tip: [f64; 2]) -> [f64; 2] {
        tip
    }

    fn curvature(&mut self, piece: usize, u: f64) -> f64 {
        self.piece(piece).curvature(u)
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
        self.of.limits.period.max(duration)
    }

    fn negligible_speed(&self, place: &Place<M>, time: f64) -> f64 {
        let limits = &self.of.limits;
        let (mut least, mut weakest) = (f64::INFINITY, f64::INFINITY);
        for k in 0..self.count() {
            let share = limits.negligible_jump(k, time) / place.slope.value[k].abs() * place.tip_slope[0];
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
