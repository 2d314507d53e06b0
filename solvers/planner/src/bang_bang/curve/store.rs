//! Stores the sub-pieces of a run from the backward pass for the forward pass. Each takes the memory of its own degree, not that
//! of the capacity of its polynomials.

use super::part::{Axes, Part, SubPiece};
use feedplan_geometry::polynomial::Polynomial;

/// Sub-pieces of any degree, in the order of the backward pass.
#[derive(Default)]
pub struct Store {
    coefficients: Vec<f64>,
    entries: Vec<Entry>,
}

/// A stored sub-piece: the index of its first coefficient, and the data that its part does not contain.
struct Entry {
    start: usize,
    /// Degrees of the tangents, the weight, the speed and the curve.
    degrees: [u8; 4],
    straight: bool,
    own_speed: bool,
    cusp_orders: [u8; 2],
}

impl Store {
    pub fn clear(&mut self) {
        self.coefficients.clear();
        self.entries.clear();
    }

    pub fn push<const M: usize, const C: usize>(&mut self, sub: &SubPiece<M, C>) {
        self.entries.push(Entry {
            start: self.coefficients.len(),
            degrees: [sub.g[0].degree(), sub.weight.degree(), sub.speed.degree(), sub.degree]
                .map(|n| n as u8),
            straight: sub.straight,
            own_speed: sub.own_speed,
            cusp_orders: sub.cusp_orders,
        });
        for p in sub.g.iter().chain([&sub.weight, &sub.speed]) {
            self.coefficients.extend_from_slice(p.padded());
        }
    }

    /// Removes the last sub-piece and returns it; `part` is the part from which it was made.
    pub fn pop<const M: usize, const C: usize>(&mut self, part: &Part, axes: &Axes<M>) -> SubPiece<M, C> {
        let entry = self.entries.pop().expect("each part has a sub-piece");
        let [tangent, weight, speed, degree] = entry.degrees.map(usize::from);
        let mut rest = &self.coefficients[entry.start..];
        let mut next = |degree: usize| {
            let (own, after) = rest.split_at(Polynomial::<C>::padded_len(degree));
            rest = after;
            Polynomial::from_padded(degree, own)
        };
        let g = std::array::from_fn(|_| next(tangent));
        let (weight, speed) = (next(weight), next(speed));
        self.coefficients.truncate(entry.start);
        SubPiece {
            g,
            weight,
            speed,
            cap: part.cap,
            limits: part.limits(axes),
            moving: part.moving,
            degree,
            straight: entry.straight,
            own_speed: entry.own_speed,
            cusp_orders: entry.cusp_orders,
        }
    }
}
