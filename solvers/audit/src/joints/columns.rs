//! Evaluates joints that are not the path's axes as columns, by the parameter of the tool's path (see `columns`); keeps the last
//! results and those computed ahead.

use std::rc::Rc;

use super::path::{JointPath, Piece};
use crate::curve::{Curve, Curves, KEPT};
use crate::number::Lanes;
use crate::station::{Place, Rounded, Roundings, Station};
use crate::vectors::{length, vector_of};

/// The second derivative of joints by u on a piece is estimated as this many times that at the last station on it. Newton's
/// method stops at a thousandth of the error that is allowed for a place. If the derivative were ten times the estimate, it would
/// stop at a hundredth of the allowed error.
const BEND_GROWS: f64 = 4.0;

/// A place and its station, with bounds of the rounding errors of the latter.
type RoundedStation<const M: usize> = (Place<M>, Station<M>, Roundings<M>);

pub struct JointColumns<'a, const M: usize> {
    pub of: &'a JointPath<'a>,
    room: Vec<f64>,
    /// The pieces that were used last.
    pieces: [Option<Rc<Piece<'a, M>>>; KEPT],
    /// The last place; the last station with its piece; the last two stations with error bounds, the last one first.
    last: Option<Place<M>>,
    known: Option<(usize, Station<M>)>,
    rounded: [Option<RoundedStation<M>>; 2],
    /// Places and stations that have been computed ahead.
    ahead: Vec<Place<M>>,
    stations_ahead: Vec<RoundedStation<M>>,
}

impl<'a, const M: usize> JointColumns<'a, M> {
    pub fn new(of: &'a JointPath<'a>) -> Self {
        Self {
            of,
            room: of.room(0.0),
            pieces: [const { None }; KEPT],
            last: None,
            known: None,
            rounded: [None, None],
            ahead: vec![],
            stations_ahead: vec![],
        }
    }

    /// Piece `number` of the path, with its curve.
    pub fn piece(&mut self, number: usize, curve: &Rc<Curve<M>>) -> Rc<Piece<'a, M>> {
        let kept = &mut self.pieces[number % KEPT];
        kept.take_if(|piece| piece.number != number);
        kept.get_or_insert_with(|| Rc::new(self.of.piece_on(number, curve.clone()))).clone()
    }

    pub fn place(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64) -> Place<M> {
        let is_here = |place: &&Place<M>| place.piece == piece && place.u == u;
        let known = self.last.iter().chain(&self.ahead).find(is_here).copied();
        let known = known.or_else(|| self.known_station(piece, u).map(|(place, ..)| place));
        let place = known.unwrap_or_else(|| self.piece(piece, curve).place(u, &mut self.room));
        self.last = Some(place);
        place
    }

    /// Computes up to eight places of a piece without weights at once, for later calls of `place`.
    pub fn look_ahead(&mut self, on: &Piece<M>, places: &[f64], room: &mut [Lanes]) {
        let Some(last) = places.len().checked_sub(1) else { return };
        let found = on.places(&std::array::from_fn(|lane| places[lane.min(last)]), room);
        self.ahead.clear();
        self.ahead.extend((0..places.len()).map(|lane| found.of_lane(lane)));
    }

    pub fn station(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64) -> Station<M> {
        let station = self.piece(piece, curve).station(u, &curve.jet(u), &mut self.room);
        self.known = Some((piece, station));
        station
    }

    pub fn rounded_station(
        &mut self,
        curve: &Rc<Curve<M>>,
        piece: usize,
        u: f64,
    ) -> (Station<M>, Roundings<M>) {
        if let Some((_, station, roundings)) = self.known_station(piece, u) {
            return (station, roundings);
        }
        let found = self.piece(piece, curve).rounded_station(u, &mut self.room);
        let (place, station, roundings) = found;
        (self.last, self.known) = (Some(place), Some((piece, station)));
        self.rounded = [Some(found), self.rounded[0]];
        (station, roundings)
    }

    fn known_station(&self, piece: usize, u: f64) -> Option<RoundedStation<M>> {
        let is_here = |(place, ..): &&RoundedStation<M>| place.piece == piece && place.u == u;
        self.rounded.iter().flatten().chain(&self.stations_ahead).find(is_here).copied()
    }

    /// Computes stations and bounds of their rounding errors, each on its piece, several at once for later calls.
    pub fn look_ahead_on_each(&mut self, at: &[(Rc<Piece<M>>, f64)], room: &mut [Lanes]) {
        self.stations_ahead.clear();
        for alike in at.chunk_by(|(a, _), (b, _)| a.is_like(b)) {
            for part in alike.chunks(8) {
                let lanes = std::array::from_fn(|lane| &part[lane.min(part.len() - 1)]);
                let found = part[0].0.rounded_on_each(lanes.map(|(piece, u)| (&**piece, *u)), room);
                self.stations_ahead.extend(part.iter().enumerate().map(|(lane, (piece, _))| {
                    let place = Place { piece: piece.number, ..found.0.of_lane(lane) };
                    (place, found.1.of_lane(lane), found.2.of_lane(lane))
                }));
            }
        }
    }

    pub fn way(&mut self, curve: &Rc<Curve<M>>, from: &Place<M>, to: &Place<M>) -> Rounded<M> {
        let value = self.piece(from.piece, curve).way(&from.position.value, &to.position.value);
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
        last.way_from(&first, a, b)
    }

    pub fn toward(&mut self, curve: &Rc<Curve<M>>, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2] {
        let on = self.piece(piece, curve);
        let [position, slope] = match self.last.filter(|place| place.piece == piece && place.u == u) {
            Some(place) => [place.position.value, place.slope.value],
            None => on.position_and_slope(&curve.place(u), &mut self.room),
        };
        [on.way(&position, q), slope]
    }

    /// Estimates the greatest second derivative of the joints by u on a piece from the last station on it; infinite if there is
    /// none.
    pub fn bend(&self, piece: usize) -> f64 {
        let last = self.known.as_ref().filter(|(number, _)| *number == piece);
        last.map_or(f64::INFINITY, |(_, at)| BEND_GROWS * length(&at.second) * at.slope * at.slope)
    }
}
