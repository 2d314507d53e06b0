//! Evaluates the columns of a path, the quantities that machine limits apply to, as functions of the parameter u of its pieces:
//! the axes of the path, or the joints by the recorded kinematics (`joints::columns`). All that differs between the two is in
//! this file: the checks of profiles and setpoints are the same for both.

use std::rc::Rc;

use super::curve::{Curve, Curves, Followed};
use super::joints::columns::JointColumns;
use super::joints::path::JointPath;
use super::nearest;
use super::number::{are_vectors_wide, Lanes};
use super::station::{Place, Rounded, Roundings, Station};
use super::together::Together;
use super::vectors::{from_to, length, times, vector_of};
use super::{Check, Limits, Sided, EPS, FEEDS, ROUNDINGS};

/// Index of the speed that chord errors depend on; the indices below it are those of the feeds.
pub const CHORD: usize = FEEDS;

/// Two pieces whose directions differ by less than this angle in rad meet without a corner. The first number is for axes, the
/// second for joints, whose formula is evaluated on other numbers on the next piece.
const SMOOTH: [f64; 2] = [1e-9, 1e-6];

/// Number of intervals of a phase: for each degree of its piece that it covers, for the relative change of its speed (1 from
/// rest), and at least; for axes and for joints.
const INTERVALS: [[f64; 3]; 2] = [[5.0, 10.0, 4.0], [3.0, 0.0, 2.0]];

/// The rates of an axis: velocity, acceleration and jerk.
pub const RATES: [Check; 3] = [Check::Velocity, Check::Acceleration, Check::Jerk];

/// The columns of a path, evaluated at one place after the other.
pub struct Columns<'a, const M: usize> {
    pub path: Followed<'a>,
    pub limits: &'a Limits<M>,
    /// The limits of velocity, acceleration and jerk, and their inverses.
    pub rates: [[Sided<M>; 2]; 3],
    /// The inverse of the smaller limit of both directions.
    pub per_least: [[f64; M]; 3],
    curves: Curves<'a, M>,
    joints: Option<Box<JointColumns<'a, M>>>,
}

impl<'a, const M: usize> Columns<'a, M> {
    /// The axes of a path, or the joints on it.
    pub fn new(path: &Followed<'a>, limits: &'a Limits<M>, joints: Option<&'a JointPath<'a>>) -> Self {
        let joints = joints.map(|of| Box::new(JointColumns::new(of)));
        let jerk = Sided { positive: limits.jerk, negative: limits.jerk };
        let rates = [limits.velocity, limits.acceleration, jerk].map(|limit| [limit, limit.inverse()]);
        let per_least = rates.each_ref().map(|[_, per]| per.greater());
        Self { path: *path, limits, rates, per_least, curves: Curves::new(path.pieces), joints }
    }

    /// Number of columns.
    pub fn count(&self) -> usize {
        self.limits.axes
    }

    /// Whether the columns are the axes of the path: then bounds of its derivatives hold for them, and a speed at the feed is one
    /// along the path.
    pub fn are_axes(&self) -> bool {
        self.joints.is_none()
    }

    /// The tool's path on a piece.
    pub fn curve(&mut self, piece: usize) -> &Rc<Curve<M>> {
        self.curves.get(piece)
    }

    /// Evaluates the columns at eight places of a piece at once. None for a rational piece, and on processors with narrow
    /// vectors.
    pub fn together(&mut self, piece: usize) -> Option<Together<'a, M>> {
        let bend = self.bend(piece);
        let curve = self.curves.get(piece);
        if curve.polygon.is_rational() || !are_vectors_wide() {
            return None;
        }
        let (scale, joints) = match &mut self.joints {
            Some(joints) => (Some(joints.of.scale()), Some(joints.piece(piece, curve))),
            None => (None, None),
        };
        Some(Together { curve: curve.clone(), joints, scale, bend })
    }

    /// Computes up to eight places at once for later calls. Only joints are computed so: for axes it would save no time.
    pub fn look_ahead(&mut self, on: &Together<M>, places: &[f64], room: &mut [Lanes]) {
        if let (Some(joints), Some(piece)) = (&mut self.joints, &on.joints) {
            joints.look_ahead(piece, places, room);
        }
    }

    /// Computes stations and bounds of their rounding errors, each on its piece, several at once for later calls. Only those of
    /// joints are computed so.
    pub fn look_ahead_on_each(&mut self, at: &[(usize, f64)], room: &mut [Lanes]) {
        let Some(joints) = self.joints.as_mut().filter(|_| are_vectors_wide()) else { return };
        let at: Vec<_> =
            at.iter().map(|&(piece, u)| (joints.piece(piece, self.curves.get(piece)), u)).collect();
        joints.look_ahead_on_each(&at, room);
    }

    /// Memory for the results of the joints' formula at eight places at once.
    pub fn room(&self) -> Vec<Lanes> {
        self.joints.as_ref().map_or(Vec::new(), |joints| joints.of.room([0.0; 8]))
    }

    /// The factor of each path axis in the length of the path.
    pub fn scale(&self) -> [f64; M] {
        self.joints.as_ref().map_or([1.0; M], |joints| joints.of.scale())
    }

    /// The place u of a piece.
    pub fn place(&mut self, piece: usize, u: f64) -> Place<M> {
        let curve = self.curves.get(piece);
        if let Some(joints) = &mut self.joints {
            return joints.place(curve, piece, u);
        }
        let ([tip, slope], size) = (curve.place(u), curve.derivative_size());
        let (way_slope, unit) = (length(&slope), ROUNDINGS * EPS);
        let slope = Rounded { value: slope, rounding: vector_of(|k| unit * size[k]) };
        let position = Rounded { value: tip, rounding: [0.0; M] };
        Place { piece, u, tip, position, slope, way_slope, tip_slope: way_slope }
    }

    /// The derivatives by the length of the path at the place u of a piece; None where the piece has no direction.
    pub fn station(&mut self, piece: usize, u: f64) -> Option<Station<M>> {
        let curve = self.curves.get(piece);
        match &mut self.joints {
            Some(joints) => Some(joints.station(curve, piece, u)),
            None => Station::new(curve, u),
        }
    }

    /// A station at an end of a phase. For joints its rounding errors are needed later, and are computed with it at little extra
    /// cost.
    pub fn station_at_end(&mut self, piece: usize, u: f64) -> Option<Station<M>> {
        match self.are_axes() {
            true => self.station(piece, u),
            false => self.rounded_station(piece, u).map(|(station, _)| station),
        }
    }

    /// Bounds of the rounding errors of a station on a piece.
    pub fn roundings(&mut self, piece: usize, station: &Station<M>) -> Roundings<M> {
        let curve = self.curves.get(piece);
        match &mut self.joints {
            Some(joints) => joints.rounded_station(curve, piece, station.u).1,
            None => Roundings::new(curve, station, &curve.derivatives(station.u)),
        }
    }

    /// A station, and bounds of its rounding errors. Inlined, so that what a caller does not use of both is not computed.
    #[inline(always)]
    pub fn rounded_station(&mut self, piece: usize, u: f64) -> Option<(Station<M>, Roundings<M>)> {
        let curve = self.curves.get(piece);
        if let Some(joints) = &mut self.joints {
            return Some(joints.rounded_station(curve, piece, u));
        }
        let derivatives = curve.derivatives(u);
        let station = Station::by(curve, u, &derivatives)?;
        Some((station, Roundings::new(curve, &station, &derivatives)))
    }

    /// Displacement of each column from one place of a piece to another one.
    pub fn way(&mut self, from: &Place<M>, to: &Place<M>) -> Rounded<M> {
        let curve = self.curves.get(from.piece);
        if let Some(joints) = &mut self.joints {
            return joints.way(curve, from, to);
        }
        let value = curve.way([from.u, to.u], [&from.slope.value, &to.slope.value]);
        let step = (to.u - from.u).abs();
        Rounded { value, rounding: vector_of(|k| step * from.slope.rounding[k]) }
    }

    /// Displacement from a place on one piece to a place on another: angles known up to whole turns go the shorter way.
    pub fn difference(&mut self, pieces: [usize; 2], a: &[f64; M], b: &[f64; M]) -> [f64; M] {
        match &mut self.joints {
            Some(joints) => joints.difference(&mut self.curves, pieces, a, b),
            None => from_to(a, b),
        }
    }

    /// The displacement from the place u of a piece to `q`, and the derivatives by u at that place.
    pub fn toward(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2] {
        let curve = self.curves.get(piece);
        if let Some(joints) = &mut self.joints {
            return joints.toward(curve, piece, u, q);
        }
        let [point, slope] = curve.place(u);
        [from_to(&point, q), slope]
    }

    /// Derivative by u of the length whose speed a phase holds, in which the axes of the path count by their `share`; and its
    /// error.
    pub fn held_slope(&mut self, piece: usize, u: f64, share: &[f64; M]) -> [f64; 2] {
        let curve = self.curves.get(piece);
        if let Some(joints) = &mut self.joints {
            return [joints.piece(piece, curve).feed_slope(u), 0.0];
        }
        let [slope, size] = [curve.derivative(u), curve.derivative_size()]
            .map(|of| length::<M>(&vector_of(|k| share[k] * of[k])));
        [slope, ROUNDINGS * EPS * size]
    }

    /// The derivative of `held_slope` at several places.
    pub fn held_slopes<const K: usize>(&mut self, piece: usize, u: [f64; K], share: &[f64; M]) -> [f64; K] {
        let (curve, Some(joints)) = (self.curves.get(piece), &mut self.joints) else {
            // For axes these pieces are mostly lines, on which one place at a time takes no longer.
            return u.map(|u| self.held_slope(piece, u, share)[0]);
        };
        let on = joints.piece(piece, curve);
        on.fed_axes().map_or_else(|| u.map(|u| on.feed_slope(u)), |counts| curve.speeds(u, &counts))
    }

    /// The feeds of a piece, in mm/s or degrees/s.
    pub fn feeds(&self, piece: usize) -> [f64; FEEDS] {
        match &self.joints {
            Some(joints) => [joints.of.feed[piece], f64::INFINITY, f64::INFINITY, f64::INFINITY],
            None => self.path.feeds(piece),
        }
    }

    /// Which feeds of a piece count all axes that move on it, and so limit the speed along the path (for joints: the speed of the
    /// tool).
    pub fn feeds_along(&mut self, piece: usize) -> [bool; FEEDS] {
        let (are_axes, limits) = (self.are_axes(), self.limits);
        let moves = self.curves.get(piece).derivative_size();
        let counts = |feed: usize, k: usize| moves[k] == 0.0 || limits.feed_axes[feed][k] == 1.0;
        std::array::from_fn(|feed| !are_axes || (0..limits.axes).all(|k| counts(feed, k)))
    }

    /// The speed that a feed limits, or with `CHORD` the one that the chord error depends on, and its error, in mm/s. For axes it
    /// follows from their velocities; for joints it is that of the tool, `tip`.
    pub fn speed(&self, feed: usize, velocity: &Rounded<M>, tip: [f64; 2]) -> [f64; 2] {
        let Rounded { value, rounding } = velocity;
        match feed {
            _ if !self.are_axes() => tip,
            CHORD => [value, rounding].map(length),
            _ => [value, rounding].map(|of| length(&self.limits.counted(feed, of))),
        }
    }

    /// Position of the tool for the columns `q`, which belong to the place u of a piece.
    pub fn tip(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [f64; M] {
        match self.are_axes() {
            true => *q,
            false => self.curves.get(piece).at(u),
        }
    }

    /// For joints: position of the tool at a place, in the axes whose motion the feed of its piece limits, and that feed. NaN
    /// instead of the feed where it limits an angular speed.
    pub fn fed_tip(&mut self, nearest::Place { piece, u }: nearest::Place) -> ([f64; M], f64) {
        let curve = self.curves.get(piece);
        let (tip, Some(joints)) = (curve.at(u), &mut self.joints) else { return ([0.0; M], f64::NAN) };
        let (counts, feed) = (joints.piece(piece, curve).fed_axes(), joints.of.feed[piece]);
        counts.map_or((tip, f64::NAN), |counts| (times(&counts, &tip), feed))
    }

    /// Straight distance of the tool between two places of a piece, as `feed` counts it.
    pub fn tip_way(&mut self, piece: usize, feed: usize, from: &[f64; M], to: &[f64; M]) -> f64 {
        match &mut self.joints {
            Some(joints) => joints.piece(piece, self.curves.get(piece)).feed_way(from, to),
            None => length(&self.limits.counted(feed, &from_to(from, to))),
        }
    }

    /// The axes of the path in which a chord error is measured, 1 or 0.
    pub fn chord_axes(&mut self, piece: usize) -> [f64; M] {
        match &mut self.joints {
            Some(joints) => joints.piece(piece, self.curves.get(piece)).linear(),
            None => [1.0; M],
        }
    }

    /// Curvature of the tool's path at u of a piece, in 1/mm.
    pub fn curvature(&mut self, piece: usize, u: f64) -> f64 {
        let curve = self.curves.get(piece);
        match &mut self.joints {
            Some(joints) => joints.piece(piece, curve).curvature(u),
            None => curve.curvature(u),
        }
    }

    /// Bound of the second derivative of the columns by u on a piece, for joints an estimate; infinite if it is not known.
    pub fn bend(&mut self, piece: usize) -> f64 {
        match &self.joints {
            Some(joints) => joints.bend(piece),
            None => self.curves.get(piece).bounds()[0],
        }
    }

    /// The magnitude to which the rounding of positions on a piece is relative, besides the positions: the greatest coordinate of
    /// its ends, for joints that of the first control point.
    pub fn magnitude(&mut self, piece: usize) -> f64 {
        let curve = self.curves.get(piece);
        match &mut self.joints {
            Some(joints) => joints.piece(piece, curve).start_size(),
            None => curve.magnitude(),
        }
    }

    /// By how much rounding of the control points may change C' of a piece against that of its neighbour; 0 for joints.
    pub fn turned(&mut self, piece: usize) -> f64 {
        let curve = self.curves.get(piece);
        match self.joints {
            Some(_) => 0.0,
            None => 2.0 * ROUNDINGS * EPS * curve.magnitude() * curve.derivative_scale(),
        }
    }

    /// Whether the feeds of two pieces limit the same axes of the tool.
    pub fn comparable(&mut self, pieces: [usize; 2]) -> bool {
        let Some(joints) = &mut self.joints else { return true };
        let [before, after] = pieces.map(|piece| joints.piece(piece, self.curves.get(piece)).counts);
        before == after
    }

    /// Number of intervals of a phase by length that covers `covered` degrees of its piece and changes its speed by the relative
    /// amount `change`.
    pub fn intervals(&self, covered: f64, change: f64) -> f64 {
        let [places, speeds, least] = INTERVALS[usize::from(!self.are_axes())];
        (places * covered + speeds * change).max(least)
    }

    /// Time in s over which a jump of velocity may be spread on a phase of this duration, at least a servo period. It is longer
    /// for joints: their plans are made on interpolants of the joints, which are some 1e-10 mm off.
    pub fn settling(&self, duration: f64) -> f64 {
        self.limits.period.max(if self.are_axes() { 0.0 } else { duration })
    }

    /// The greatest jump of the tool's speed at a place, in mm/s, that is negligible for all columns if it is spread over `time`.
    pub fn negligible_speed(&self, place: &Place<M>, time: f64) -> f64 {
        let least = |of: &dyn Fn(usize) -> f64| (0..self.count()).map(of).fold(f64::INFINITY, f64::min);
        let weakest = |time: f64| least(&|k| self.limits.negligible_jump(k, time));
        if self.are_axes() {
            return weakest(time);
        }
        let share =
            |k: usize| self.limits.negligible_jump(k, time) / place.slope.value[k].abs() * place.tip_slope;
        let moved = least(&|k| Some(share(k)).filter(|share| share.is_finite()).unwrap_or(f64::INFINITY));
        let weakest = weakest(self.limits.period);
        if moved.is_finite() {
            moved.max(weakest)
        } else {
            weakest
        }
    }

    /// Two pieces whose directions differ by less than this angle in rad meet without a corner.
    pub fn smooth(&self) -> f64 {
        SMOOTH[usize::from(!self.are_axes())]
    }
}
