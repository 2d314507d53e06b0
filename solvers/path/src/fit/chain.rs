//! The input of the fit: points with the lengths along their polygon, the tolerance and the angle of corners.

use feedplan_geometry::parallel::map;
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::watch::Watch;

/// The input of the fit.
pub struct Chain<'a, const M: usize> {
    pub points: &'a [[f64; M]],
    /// Polygon length from the first point to each point, in mm.
    pub along: &'a [f64],
    pub tolerance: f64,
    /// A point is a corner if the cosine of its turn is smaller.
    pub corner_cosine: f64,
    pub parallel: bool,
    pub watch: Watch<'a>,
}

#[cfg(test)]
impl<'a, const M: usize> Chain<'a, M> {
    /// A chain that has corners where it turns by more than 90 degrees.
    pub fn of(points: &'a [[f64; M]], along: &'a [f64], tolerance: f64) -> Self {
        Self { points, along, tolerance, corner_cosine: 0.0, parallel: false, watch: Watch::default() }
    }
}

impl<const M: usize> Chain<'_, M> {
    /// Applies f to all items, in parallel if the chain is long; the results are in order.
    pub fn map<T: Sync, R: Send>(&self, items: &[T], watch: Watch, f: impl Fn(&T) -> R + Sync) -> Vec<R> {
        let each = watch.each(items.len());
        let f = |item: &T| {
            each.advance(1);
            f(item)
        };
        match self.parallel && items.len() > 1 {
            true => map(items.len(), items.len().div_ceil(256), |i| f(&items[i])),
            false => items.iter().map(f).collect(),
        }
    }

    /// Unit vector from point `a` to point `b`.
    pub fn direction(&self, a: usize, b: usize) -> [f64; M] {
        let chord = sub(&self.points[b], &self.points[a]);
        let length = norm(&chord);
        chord.map(|value| value / length)
    }

    pub fn is_corner(&self, at: usize) -> bool {
        at > 0
            && at + 1 < self.points.len()
            && turn_cosine(&self.points[at - 1], &self.points[at], &self.points[at + 1]) < self.corner_cosine
    }
}

/// Polygon length from the first point to each point.
pub fn lengths_along<const M: usize>(points: &[[f64; M]]) -> Vec<f64> {
    let mut total = 0.0;
    std::iter::once(0.0)
        .chain(points.windows(2).map(|pair| {
            total += norm(&sub(&pair[1], &pair[0]));
            total
        }))
        .collect()
}

/// Cosine of the turn at `p` on the way from `a` to `b`.
pub fn turn_cosine<const M: usize>(a: &[f64; M], p: &[f64; M], b: &[f64; M]) -> f64 {
    let (before, after) = (sub(p, a), sub(b, p));
    dot(&before, &after) / (norm(&before) * norm(&after))
}
