//! What an arc holds constant, the piece under it, and where that makes p turn sharply.

use crate::curve::{inner, length};
use crate::polygon::Polygon;

/// What an arc holds constant.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// `start_sq` is the square of the axis velocity at the anchor.
    AxisAcceleration {
        axis: usize,
        value: f64,
        start_sq: f64,
    },
    /// p at the anchor and dp/du.
    ParameterAcceleration {
        start: f64,
        slope: f64,
    },
    Feed {
        speed: f64,
    },
    AxisVelocity {
        axis: usize,
        speed: f64,
    },
    Chord {
        value: f64,
    },
    /// The square of the speed at the start of the arc, and its change to the end.
    SpeedLine {
        start_sq: f64,
        change_sq: f64,
    },
    /// The speed follows from the length of the path: see `Motion::with_along`.
    Along,
}

/// The piece under an arc.
#[derive(Clone, Debug)]
pub enum Shape<const M: usize> {
    /// Degree 2: C' at the anchor, and C''.
    Quadratic { tangent: [f64; M], bend: [f64; M] },
    /// Any other: itself, with t at the anchor and at the other end; the part of it between them, from the anchor; and
    /// what the rounding of C' is relative to.
    General {
        whole: Box<Polygon<M>>,
        ends: [f64; 2],
        part: Box<Polygon<M>>,
        tangent: [f64; M],
        size: [f64; M],
    },
}

impl Law {
    /// `tangent` and `bend` are what counts in the speed that the law is about.
    pub fn pole<const M: usize>(&self, tangent: &[f64; M], bend: &[f64; M], p_anchor: f64) -> Option<Pole> {
        match *self {
            // p − a/q''_k falls off as (q'_k(anchor) / q'_k)².
            Law::AxisAcceleration { axis, value, .. } if bend[axis] != 0.0 => Some(Pole {
                at: -tangent[axis] / bend[axis],
                beside: 0.0,
                strength: (1.0 - bend[axis] * p_anchor / value).abs(),
            }),
            Law::Feed { .. } | Law::Chord { .. } | Law::SpeedLine { .. }
                if bend.iter().any(|&c| c != 0.0) =>
            {
                let square = inner(bend, bend);
                let at = -inner(tangent, bend) / square;
                let nearest: [f64; M] = std::array::from_fn(|k| tangent[k] + at * bend[k]);
                Some(Pole { at, beside: length(&nearest) / square.sqrt(), strength: 1.0 })
            }
            _ => None,
        }
    }
}

/// Where p would grow without bound, or turn sharply: the zero of what it is divided by.
#[derive(Clone, Copy, Debug)]
pub struct Pole {
    /// Signed distance from the anchor, and how far the pole lies beside the real line.
    pub at: f64,
    pub beside: f64,
    /// Share of p that changes in its neighbourhood.
    pub strength: f64,
}
