//! The law of a phase, and where it makes p turn sharply.
//!
//! All laws are one: p = u̇² = N/D. Distances d of the parameter are counted from the anchor of the phase.
//!
//! | law | N | D |
//! |---|---|---|
//! | axis acceleration, axis velocity | v_k² + 2 a Δq_k | q'_k² |
//! | parameter acceleration | p + 2 s d | 1 |
//! | feed of shares, speed line | v² linear in d | the square of what counts of C' |
//!
//! Where v is by the length of the path see `phase_by_length`.

use crate::vectors::{inner, length};

/// N and D, with the values at the anchor.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// N = `start_sq` + 2 `value` Δq_k, the square of the velocity of axis k.
    Axis { axis: usize, value: f64, start_sq: f64 },
    /// N = `start` + `slope` d, and D = 1.
    Parameter { start: f64, slope: f64 },
    /// N changes by `change_sq` to the other end, evenly with d.
    Speed { start_sq: f64, change_sq: f64 },
}

impl Law {
    /// `tangent` and `bend` are what counts in D.
    pub fn pole<const M: usize>(&self, tangent: &[f64; M], bend: &[f64; M], p_anchor: f64) -> Option<Pole> {
        match *self {
            // p − a/q''_k falls off as (q'_k(anchor) / q'_k)².
            Law::Axis { axis, value, .. } if bend[axis] != 0.0 => Some(Pole {
                at: -tangent[axis] / bend[axis],
                beside: 0.0,
                strength: (1.0 - bend[axis] * p_anchor / value).abs(),
            }),
            Law::Speed { .. } if bend.iter().any(|&c| c != 0.0) => {
                let square = inner(bend, bend);
                let at = -inner(tangent, bend) / square;
                let nearest: [f64; M] = std::array::from_fn(|k| tangent[k] + at * bend[k]);
                Some(Pole { at, beside: length(&nearest) / square.sqrt(), strength: 1.0 })
            }
            _ => None,
        }
    }
}

/// Where D is 0, so that p grows without bound or turns sharply.
#[derive(Clone, Copy, Debug)]
pub struct Pole {
    /// Signed distance from the anchor, and how far the pole lies beside the real line.
    pub at: f64,
    pub beside: f64,
    /// Share of p that changes in its neighbourhood.
    pub strength: f64,
}
