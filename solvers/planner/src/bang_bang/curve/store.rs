//! The sub-pieces of a run, kept from the backward pass to the forward one: what they take up is that of their own
//! degree, or of the capacity where that is small.

use super::part::{Part, SubPiece};
use super::split::Axes;
use feedplan_geometry::polynomial::Polynomial;

/// Sub-pieces of any degree, in the order of the backward pass.
#[derive(Default)]
pub struct Store {
    coefficients: Vec<f64>,
    kept: Vec<Kept>,
}

/// Where the coefficients of a sub-piece begin, and what else its part does not say.
struct Kept {
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
        self.kept.clear();
    }

    pub fn push<const M: usize, const C: usize>(&mut self, sub: &SubPiece<M, C>) {
        self.kept.push(Kept {
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

    /// Takes the last sub-piece out; `part` is its part of the piece.
    pub fn pop<const M: usize, const C: usize>(&mut self, part: &Part, axes: &Axes<M>) -> SubPiece<M, C> {
        let kept = self.kept.pop().expect("each part has a sub-piece");
        let [tangent, weight, speed, degree] = kept.degrees.map(usize::from);
        let mut rest = &self.coefficients[kept.start..];
        let mut next = |degree: usize| {
            let (own, after) = rest.split_at(Polynomial::<C>::padded_len(degree));
            rest = after;
            Polynomial::from_padded(degree, own)
        };
        let g = std::array::from_fn(|_| next(tangent));
        let (weight, speed) = (next(weight), next(speed));
        self.coefficients.truncate(kept.start);
        SubPiece {
            g,
            weight,
            speed,
            cap: part.cap,
            limits: part.limits(axes),
            moving: part.moving,
            degree,
            straight: kept.straight,
            own_speed: kept.own_speed,
            cusp_orders: kept.cusp_orders,
        }
    }
}
