//! What limits are about, as functions of the parameter u of the pieces of a path: its axes (here), or joints that the recorded
//! kinematics makes of them (`joints::columns`). The checks of a profile and of setpoints are the same for both.

use std::sync::Arc;

use super::curve::{Curve, Curves, Followed};
use super::station::{Rounded, Station};
use super::vectors::{from_to, length, vector_of};
use super::{Limits, EPS, FEEDS, ROUNDINGS};

/// The speed that chord errors are about, beside those that feeds are about.
pub const CHORD: usize = FEEDS;

/// A place of a piece: the columns and their slopes by u, each with a bound of its error; of positions beside the rounding of the
/// greatest coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Place<const M: usize> {
    pub piece: usize,
    pub u: f64,
    /// The tool's place, in axes of the path.
    pub tip: [f64; M],
    pub position: Rounded<M>,
    pub slope: Rounded<M>,
    /// Derivatives by u of the length of the path and of the way of the tool that the feed limits.
    pub way_slope: f64,
    pub tip_slope: f64,
}

/// Where columns come from. What differs between axes and joints is here, and nowhere else.
pub trait Columns<const M: usize> {
    /// Number of columns.
    fn count(&self) -> usize;

    /// The path of the tool.
    fn path(&self) -> &Followed<'_>;

    /// The tool's path on a piece, and what each of its axes counts in its length.
    fn curve(&mut self, piece: usize) -> &Arc<Curve<M>>;
    fn scale(&self) -> [f64; M];

    /// The place u of a piece.
    fn place(&mut self, piece: usize, u: f64) -> Place<M>;

    /// The same with derivatives by the length of the path; none where the piece has no direction.
    fn station(&mut self, piece: usize, u: f64) -> Option<Station<M>>;

    /// The way of each column from one place of a piece to another.
    fn way(&mut self, from: &Place<M>, to: &Place<M>) -> Rounded<M>;

    /// From a place on one piece to a place on another: angles known up to whole turns go the shorter way.
    fn difference(&mut self, pieces: [usize; 2], a: &[f64; M], b: &[f64; M]) -> [f64; M];

    /// The way from the place u of a piece to `q`, and the slopes there.
    fn toward(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2];

    /// Whether the columns are the axes of the path, so that bounds of its derivatives are theirs, and a speed at the feed is
    /// one along the path.
    fn are_axes(&self) -> bool;

    /// Derivative by u of the way whose speed a phase holds, in which axes of the path count by their `share`, and its error.
    fn held_slope(&mut self, piece: usize, u: f64, share: &[f64; M]) -> [f64; 2];

    /// The greatest speeds of a piece.
    fn feeds(&self, piece: usize) -> [f64; FEEDS];

    /// The speed that a feed, or with `CHORD` the chord error, is about, and its error: from velocities of the columns, or that
    /// of the `tip`.
    fn speed(&self, feed: usize, velocity: &Rounded<M>, tip: [f64; 2]) -> [f64; 2];

    /// The tool where the columns are at `q`, whose place on the path is known; the straight way of it that a feed limits between two
    /// places of a piece; which axes of the path a chord error is measured in.
    fn tip(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [f64; M];
    fn tip_way(&mut self, piece: usize, feed: usize, from: &[f64; M], to: &[f64; M]) -> f64;
    fn chord_axes(&mut self, piece: usize) -> [f64; M];

    /// Curvature of the tool's path in 1/mm.
    fn curvature(&mut self, piece: usize, u: f64) -> f64;

    /// What the rounding of positions on a piece is relative to, beside the positions: the greatest coordinate of its ends.
    fn magnitude(&mut self, piece: usize) -> f64;

    /// What rounding of the control points turns the slopes of a piece against those of its neighbour.
    fn turned(&mut self, piece: usize) -> f64;

    /// Whether the feeds of two pieces limit the same axes of the tool.
    fn comparable(&mut self, pieces: [usize; 2]) -> bool;

    /// Intervals on which the rates of a phase by length are followed that covers so many degrees of its piece and changes
    /// its speed by this part.
    fn intervals(&self, covered: f64, change: f64) -> f64;

    /// A time in s over which a jump of velocity may spread on a phase of this duration, in a servo period at least.
    fn settling(&self, duration: f64) -> f64;

    /// A jump of the speed of the tool, at a place and over a settling time, that means nothing to any column.
    fn negligible_speed(&self, place: &Place<M>, time: f64) -> f64;

    /// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
    fn smooth(&self) -> f64;
}

/// Where the columns are the axes of the path.
pub struct Axes<'a, const M: usize> {
    path: Followed<'a>,
    limits: &'a Limits<M>,
    curves: Curves<'a, M>,
    /// The last two stations: a phase begins where the one before ends.
    kept: [Option<(usize, Station<M>)>; 2],
    older: usize,
}

/// Intervals of a phase that covers its whole piece, for each degree, and of one from rest; and at least.
const PLACES: f64 = 5.0;
const SPEEDS: f64 = 10.0;
const LEAST: f64 = 4.0;

/// See `Columns::smooth`.
const SMOOTH: f64 = 1e-9;

impl<'a, const M: usize> Axes<'a, M> {
    pub fn new(path: &Followed<'a>, limits: &'a Limits<M>) -> Self {
        Self { path: *path, limits, curves: Curves::new(path.pieces), kept: [None, None], older: 0 }
    }
}

impl<const M: usize> Columns<M> for Axes<'_, M> {
    fn count(&self) -> usize {
        self.path.axes
    }

    fn path(&self) -> &Followed<'_> {
        &self.path
    }

    fn curve(&mut self, piece: usize) -> &Arc<Curve<M>> {
        self.curves.get(piece)
    }

    fn scale(&self) -> [f64; M] {
        [1.0; M]
    }

    fn place(&mut self, piece: usize, u: f64) -> Place<M> {
        let curve = self.curves.get(piece);
        let ([tip, slope], size) = (curve.place(u), curve.derivative_size());
        let (way_slope, unit) = (length(&slope), ROUNDINGS * EPS);
        let slope = Rounded { value: slope, rounding: vector_of(|k| unit * size[k]) };
        let position = Rounded { value: tip, rounding: [0.0; M] };
        Place { piece, u, tip, position, slope, way_slope, tip_slope: way_slope }
    }

    fn station(&mut self, piece: usize, u: f64) -> Option<Station<M>> {
        let is_here =
            |kept: &Option<(usize, Station<M>)>| matches!(kept, Some((i, at)) if *i == piece && at.u == u);
        if let Some(number) = self.kept.iter().position(is_here) {
            return self.kept[number].map(|(_, station)| station);
        }
        let station = Station::new(self.curves.get(piece), u)?;
        self.kept[self.older] = Some((piece, station));
        self.older = 1 - self.older;
        Some(station)
    }

    fn way(&mut self, from: &Place<M>, to: &Place<M>) -> Rounded<M> {
        let curve = self.curves.get(from.piece);
        let value = curve.way([from.u, to.u], [&from.slope.value, &to.slope.value]);
        let step = (to.u - from.u).abs();
        let rounding = vector_of(|k| step * from.slope.rounding[k]);
        Rounded { value, rounding }
    }

    fn difference(&mut self, _: [usize; 2], a: &[f64; M], b: &[f64; M]) -> [f64; M] {
        from_to(a, b)
    }

    fn toward(&mut self, piece: usize, u: f64, q: &[f64; M]) -> [[f64; M]; 2] {
        let [point, slope] = self.curves.get(piece).place(u);
        [from_to(&point, q), slope]
    }

    fn are_axes(&self) -> bool {
        true
    }

    fn held_slope(&mut self, piece: usize, u: f64, share: &[f64; M]) -> [f64; 2] {
        let curve = self.curves.get(piece);
        let [slope, size] = [curve.derivative(u), curve.derivative_size()]
            .map(|of| length::<M>(&vector_of(|k| share[k] * of[k])));
        [slope, ROUNDINGS * EPS * size]
    }

    fn feeds(&self, piece: usize) -> [f64; FEEDS] {
        self.path.feeds(piece)
    }

    fn speed(&self, feed: usize, velocity: &Rounded<M>, _: [f64; 2]) -> [f64; 2] {
        let Rounded { value, rounding } = velocity;
        match feed {
            CHORD => [value, rounding].map(length),
            _ => [value, rounding].map(|of| length(&self.limits.counted(feed, of))),
        }
    }

    fn tip(&mut self, _: usize, _: f64, q: &[f64; M]) -> [f64; M] {
        *q
    }

    fn tip_way(&mut self, _: usize, feed: usize, from: &[f64; M], to: &[f64; M]) -> f64 {
        length(&self.limits.counted(feed, &from_to(from, to)))
    }

    fn chord_axes(&mut self, _: usize) -> [f64; M] {
        [1.0; M]
    }

    fn curvature(&mut self, piece: usize, u: f64) -> f64 {
        self.curves.get(piece).curvature(u)
    }

    fn magnitude(&mut self, piece: usize) -> f64 {
        self.curves.get(piece).magnitude()
    }

    fn turned(&mut self, piece: usize) -> f64 {
        let curve = self.curves.get(piece);
        2.0 * ROUNDINGS * EPS * curve.magnitude() * curve.derivative_scale()
    }

    fn comparable(&mut self, _: [usize; 2]) -> bool {
        true
    }

    fn intervals(&self, covered: f64, change: f64) -> f64 {
        (PLACES * covered + SPEEDS * change).max(LEAST)
    }

    fn settling(&self, _: f64) -> f64 {
        self.limits.period
    }

    fn negligible_speed(&self, _: &Place<M>, time: f64) -> f64 {
        (0..self.count()).map(|k| self.limits.negligible_jump(k, time)).fold(f64::INFINITY, f64::min)
    }

    fn smooth(&self) -> f64 {
        SMOOTH
    }
}
