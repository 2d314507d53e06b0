//! The allowed error of the interpolants of q'' on a part of a piece, from the limits of the machine and the feed.
//!
//! Three quantities must be accurate within their tolerances: the acceleration of each joint, at every speed that the other
//! limits allow; the positions; and the interpolated squares of speeds of the tool.

use super::expression::Table;
use super::path_derivatives::PointWork;
use super::tip::{Polygons, Tips};
use super::tolerance::{ACCELERATION, MARGIN, POSITION, ROUNDING, SAMPLES, SPEED_NOISE};

/// The allowed error of q''.
#[derive(Clone)]
pub enum Tolerance<'a> {
    /// A given error for each joint.
    Given(&'a [f64]),
    /// The error that follows from the limits of a machine.
    Limited(Box<Accuracy<'a>>),
}

/// Limits of the joints, the feed, and the squares of speeds to be interpolated.
#[derive(Clone)]
pub struct Accuracy<'a> {
    /// For each joint the smaller limit of both directions.
    pub acceleration: &'a [f64],
    /// For each joint the least and the greatest velocity.
    pub velocity: [&'a [f64]; 2],
    /// For each piece, in mm/s.
    pub feed: &'a [f64],
    /// The path of the tool in X, Y, Z; and for each piece whether the tool moves on it.
    pub linear: Motion<'a>,
    pub moves: &'a [bool],
    pub squares: Vec<Square<'a>>,
    pub speed_nodes: SpeedNodes<'a>,
}

/// The interpolation of squares of speeds: the nodes in [0, 1]; the points between them where the interpolant is checked; the
/// matrix from the values at the nodes to those at the points, row by row; and the allowed relative error.
#[derive(Clone, Copy)]
pub struct SpeedNodes<'a> {
    pub at: &'a [f64],
    pub between: &'a [f64],
    pub interpolation: &'a [f64],
    pub share: f64,
}

/// The square of a speed by u that is interpolated on some pieces: |C'|², or the square of the rate at which the direction of a
/// vector turns, in degrees by u.
#[derive(Clone)]
pub struct Square<'a> {
    pub motion: Motion<'a>,
    pub turning: bool,
    pub pieces: &'a [bool],
    /// A piece and the approximate greatest value on it; kept for all parts of the piece.
    pub greatest: Option<(usize, f64)>,
}

/// Position and first derivative of curves with any number of axes.
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

    /// The square of the rate at which the direction of a vector turns, in degrees by u.
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
    /// The allowed error of q'' of each joint on a part; 0 where the square of a speed is not accurate enough, so that the part
    /// is halved.
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
        // The approximate greatest u̇² that feed and joint velocities allow; meanwhile `allowed` holds the greatest |q''|.
        let mut greatest = 0.0f64;
        allowed.fill(0.0);
        for t in SAMPLES {
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
            let wanted =
                (ACCELERATION * self.acceleration[joint] / rate_sq).min(POSITION / (length * length));
            // Near a cusp u̇² is unbounded, and no interpolant is more accurate than rounding.
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

    /// Whether the interpolant on a part is accurate enough between its nodes, where its error is greatest.
    fn is_met(&mut self, piece: usize, part: [f64; 2], nodes: SpeedNodes) -> bool {
        if !self.pieces[piece] {
            return true;
        }
        let mut along = |t: f64| self.at(piece, part[0] + t * (part[1] - part[0]));
        let found: Vec<f64> = nodes.at.iter().map(|&t| along(t)).collect();
        let truth: Vec<f64> = nodes.between.iter().map(|&t| along(t)).collect();
        // Near a cusp the computed speed is only rounding, and the feed does not limit it.
        let floor = SPEED_NOISE * self.greatest(piece, nodes.at);
        let rows = nodes.interpolation.chunks_exact(found.len());
        rows.zip(truth).all(|(row, truth)| {
            let value: f64 = row.iter().zip(&found).map(|(a, b)| a * b).sum();
            (value - truth).abs() <= nodes.share * truth + floor
        })
    }

    /// The approximate greatest value on a piece, from the nodes.
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
