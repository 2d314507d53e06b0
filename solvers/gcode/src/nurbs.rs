//! A NURBS that is read from several blocks: G5.2 with uniform knots, G6.2 with knots of its own.

use super::block::{g_name, Block};
use super::coordinates::Point;
use super::fault::Outcome;
use super::modal::Feed;
use super::moves::only_turns;
use feedplan_geometry::spline::extract::extract;
use feedplan_geometry::spline::knots::Spline;
use feedplan_geometry::spline::{CompositeCurve, MAX_DEGREE};

/// A NURBS that is being read.
pub struct Nurbs {
    /// 52 or 62.
    pub code: u16,
    pub line: u32,
    pub feed: Feed,
    pub order: usize,
    pub points: Vec<Point>,
    pub weights: Vec<f64>,
    /// The knots of G6.2; empty for G5.2.
    pub knots: Vec<f64>,
}

impl Nurbs {
    /// Sets the order to L, which may be in any block of G5.2.
    pub fn set_order(&mut self, block: &Block) -> Outcome<()> {
        if let Some(order) = block.count(b'L', 3, "order of G5.2")? {
            self.order = order as usize;
            check_order(block, b'L', self.order)?;
        }
        Ok(())
    }

    /// The curve of a NURBS that is complete.
    pub fn curve(&self) -> Outcome<CompositeCurve<9>> {
        let (k, n, line) = (self.order, self.points.len(), self.line);
        if n < k {
            return fault!(
                "the spline G5.2 of line {line} has {n} control points and its order is {k}: give at least so many, or \
                 a lower L"
            );
        }
        let knots = if self.code == 52 {
            // Clamped and uniform: the first and the last knot k times.
            (0..n + k).map(|i| (i.clamp(k - 1, n) - (k - 1)) as f64).collect()
        } else {
            let knots = &self.knots;
            let clamped = |part: &[f64]| part.windows(2).all(|pair| pair[0] == pair[1]);
            if !clamped(&knots[..k]) || !clamped(&knots[n..]) {
                return fault!(
                    "the spline G6.2 of line {line} does not begin and end with {k} equal knots, so it does not reach \
                     its end points: repeat them"
                );
            }
            knots.clone()
        };
        let equal = self.weights.iter().all(|weight| *weight == self.weights[0] && *weight > 0.0);
        let weights = if equal { vec![] } else { self.weights.clone() };
        let curve =
            Spline::new(k - 1, knots, self.points.clone(), weights).and_then(|spline| extract(&spline));
        let mut curve = match curve {
            Ok(curve) => curve,
            Err(error) => {
                return fault!("the spline {} of line {line}: {error}", g_name(self.code));
            }
        };
        // Both ends are the control points, without rounding.
        let last = curve.control.len() - 1;
        (curve.control[0], curve.control[last]) = (self.points[0], self.points[n - 1]);
        Ok(curve)
    }

    /// The feed along the curve: that of rotary moves if only rotary axes move.
    pub fn feed_along(&self) -> f64 {
        let turns = self.points.iter().all(|point| only_turns(&self.points[0], point));
        if turns {
            self.feed.angular
        } else {
            self.feed.linear
        }
    }
}

/// Refuses an order above that of the greatest degree; `letter` is its word.
pub fn check_order(block: &Block, letter: u8, order: usize) -> Outcome<()> {
    if order > MAX_DEGREE + 1 {
        return fault!(
            "word {} is an order beyond {}: post the spline at a lower one",
            block.word(letter),
            MAX_DEGREE + 1
        );
    }
    Ok(())
}
