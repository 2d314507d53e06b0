//! How far stand-ins for q'' may be off on parts of pieces.
//!
//! An axis's acceleration is to be met within a share of its limit at every speed that the other limits allow, positions
//! far below what any scale reads, and the squares of the tool's speeds that are no polynomials by interpolation.

use super::expression::Table;
use super::path_derivatives::PointWork;
use super::tip::{Polygons, Tips};

/// Part of an acceleration limit by which the stand-ins may be off.
const SHARE: f64 = 1e-9;
/// How far positions may be off, in mm or degrees.
const POSITION: f64 = 1e-9;
/// What rounding leaves of q'', as a part of itself.
const ROUNDING: f64 = 1e-13;
/// Of the greatest square of a speed of a piece: what rounding leaves of it elsewhere.
const SPEED_NOISE: f64 = 1e-12;
/// Places of a part at which the greatest possible u̇² is estimated, and how many times more it may be.
const PLACES: [f64; 3] = [0.0, 0.5, 1.0];
const MARGIN: f64 = 4.0;

/// How far q'' may be off.
#[derive(Clone)]
pub enum Tolerance<'a> {
    /// By so much for each joint.
    Given(&'a [f64]),
    /// By what the limits of a machine allow.
    Limited(Box<Accuracy<'a>>),
}

/// Limits of the joints, the feed, and the squares of speeds that must be met.
#[derive(Clone)]
pub struct Accuracy<'a> {
    /// Of each joint: the lesser limit of both directions.
    pub acceleration: &'a [f64],
    /// Of each joint: least and greatest.
    pub velocity: [&'a [f64]; 2],
    /// Of each piece, in mm/s.
    pub feed: &'a [f64],
    /// The tool in X, Y, Z, and which pieces move it there.
    pub linear: Motion<'a>,
    pub moves: &'a [bool],
    pub squares: Vec<Square<'a>>,
    pub speed_nodes: SpeedNodes<'a>,
}

/// Where squares of speeds are interpolated, in [0, 1]; the places between, where they are compared; the matrix from values
/// at the first to those at the second, row by row; and the share of them that they may be off by.
#[derive(Clone, Copy)]
pub struct SpeedNodes<'a> {
    pub at: &'a [f64],
    pub between: &'a [f64],
    pub interpolation: &'a [f64],
    pub share: f64,
}

/// The square of a speed by u that is interpolated on some pieces: |C'|², or that of the rate in degrees at which a
/// direction of any length turns.
#[derive(Clone)]
pub struct Square<'a> {
    pub motion: Motion<'a>,
    pub turning: bool,
    pub pieces: &'a [bool],
    /// About the greatest on the last piece that was asked for.
    pub greatest: Option<(usize, f64)>,
}

/// Place and slope of curves of any axes.
pub struct Motion<'a> {
    tips: Tips<'a>,
    polygons: Polygons<f64>,
    table: Table<f64>,
}

impl<'a> Motion<'a> {
    pub fn new(tips: Tips<'a>) -> Self {
        Self { tips, polygons: Polygons::new(&tips, 1), table: Table::new(tips.axes, 1) }
    }

    fn at(&mut self, piece: usize, fraction: f64) {
        self.tips.at_point(piece, fraction, &mut self.polygons, &mut self.table);
    }

    /// |C'|².
    fn speed_sq(&mut self, piece: usize, fraction: f64) -> f64 {
        self.at(piece, fraction);
        (0..self.tips.axes).map(|axis| self.table.input(axis)[1].powi(2)).sum()
    }

    /// The square of the rate at which a direction turns, in degrees by u.
    fn turning_sq(&mut self, piece: usize, fraction: f64) -> f64 {
        self.at(piece, fraction);
        let [d, s] = [0, 1].map(|order| [0, 1, 2].map(|axis| self.table.input(axis)[order]));
        let cross = [d[1] * s[2] - d[2] * s[1], d[2] * s[0] - d[0] * s[2], d[0] * s[1] - d[1] * s[0]];
        let squares = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
        1f64.to_degrees().powi(2) * squares(cross) / squares(d).powi(2)
    }
}

impl Clone for Motion<'_> {
    fn clone(&self) -> Self {
        Self::new(self.tips)
    }
}

impl Tolerance<'_> {
    /// How far q'' of each joint may be off on a part; 0 where the square of a speed would not be met.
    pub fn allowed(&mut self, points: &mut PointWork, piece: usize, part: [f64; 2], allowed: &mut [f64]) {
        match self {
            Tolerance::Given(tolerance) => allowed.copy_from_slice(tolerance),
            Tolerance::Limited(accuracy) => accuracy.allowed(points, piece, part, allowed),
        }
    }
}

impl Accuracy<'_> {
    fn allowed(&mut self, points: &mut PointWork, piece: usize, part: [f64; 2], allowed: &mut [f64]) {
        let nodes = self.speed_nodes;
        if !self.squares.iter_mut().all(|square| square.is_met(piece, part, nodes)) {
            allowed.fill(0.0);
            return;
        }
        // About the greatest u̇² that feed and joint velocities allow, and |q''| as `allowed`.
        let mut greatest = 0.0f64;
        allowed.fill(0.0);
        for t in PLACES {
            let fraction = part[0] + t * (part[1] - part[0]);
            points.at(piece, fraction);
            let mut rate = f64::INFINITY;
            for (joint, bend) in allowed.iter_mut().enumerate() {
                *bend = bend.max(points.derivative(joint, 2).abs());
                let slope = points.derivative(joint, 1);
                let limit = if slope < 0.0 { -self.velocity[0][joint] } else { self.velocity[1][joint] };
                rate = rate.min(limit / slope.abs());
            }
            let mut rate_sq = rate * rate;
            if self.moves[piece] {
                rate_sq = rate_sq.min(self.feed[piece].powi(2) / self.linear.speed_sq(piece, fraction));
            }
            if rate_sq.is_finite() {
                greatest = greatest.max(rate_sq);
            }
        }
        let rate_sq = MARGIN * if greatest > 0.0 { greatest } else { 1.0 };
        let length = points.width(piece) * (part[1] - part[0]);
        for (joint, allowed) in allowed.iter_mut().enumerate() {
            let wanted = (SHARE * self.acceleration[joint] / rate_sq).min(POSITION / (length * length));
            // Near a cusp u̇² has no bound that would help; no stand-in is nearer than rounding.
            *allowed = wanted.max(ROUNDING * *allowed);
        }
    }
}

impl Square<'_> {
    fn at(&mut self, piece: usize, fraction: f64) -> f64 {
        if self.turning {
            self.motion.turning_sq(piece, fraction)
        } else {
            self.motion.speed_sq(piece, fraction)
        }
    }

    /// Whether it is met halfway between the nodes of a part, where interpolation is off the most.
    fn is_met(&mut self, piece: usize, part: [f64; 2], nodes: SpeedNodes) -> bool {
        if !self.pieces[piece] {
            return true;
        }
        let mut along = |t: f64| self.at(piece, part[0] + t * (part[1] - part[0]));
        let found: Vec<f64> = nodes.at.iter().map(|&t| along(t)).collect();
        let truth: Vec<f64> = nodes.between.iter().map(|&t| along(t)).collect();
        // In a near cusp the speed is rounding, and no limit of the feed.
        let floor = SPEED_NOISE * self.greatest(piece, nodes.at);
        let rows = nodes.interpolation.chunks_exact(found.len());
        rows.zip(truth).all(|(row, truth)| {
            let value: f64 = row.iter().zip(&found).map(|(a, b)| a * b).sum();
            (value - truth).abs() <= nodes.share * truth + floor
        })
    }

    /// About the greatest on a piece.
    fn greatest(&mut self, piece: usize, nodes: &[f64]) -> f64 {
        match self.greatest {
            Some((known, value)) if known == piece => value,
            _ => {
                let value = nodes.iter().map(|&t| self.at(piece, t)).fold(0.0, f64::max);
                self.greatest = Some((piece, value));
                value
            }
        }
    }
}
