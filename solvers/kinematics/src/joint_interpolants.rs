//! Polynomials that approximate q'(u) of each joint, with a proven error bound.
//!
//! q'' is interpolated at n Chebyshev points and integrated from the exact q' at the start of the part. Over a part of width h in
//! u, with c ≥ |q^(n+2)|/(n + 1)!, the interpolation error formula gives
//! ```text
//! |q'' − interpolant''| ≤ ε₂ = 2 (n + 1) c (h/4)^n,   |q' − interpolant'| ≤ ε₁ = h ε₂,
//! ```
//! so the error of a joint's acceleration q' s + q'' p is at most ε₁ |s| + ε₂ p. q'' is interpolated rather than q', because the
//! error of the derivative of an interpolant is n² times as large. Parts are halved until ε₂ is small enough. Rounding errors,
//! some 1e-14 of the greatest |q''| of the part, are not included in ε.

use super::accuracy::Tolerance;
use super::path_derivatives::{Machine, PartWork, PointWork, BLOCK};
use super::singularities::halves;
use super::tip::Tips;
use super::tolerance::{DEEPEST, INTERVAL_DEPTH, INTERVAL_PARTS};
use feedplan_geometry::parallel::map;

/// Interpolants on parts, in order of the path.
#[derive(Debug, Default)]
pub struct Interpolants {
    pub piece: Vec<usize>,
    /// Fractions of the pieces.
    pub part: Vec<[f64; 2]>,
    /// Bernstein coefficients of q', of degree n: part by part, coefficient by coefficient, joint by joint.
    pub slope: Vec<f64>,
    /// ε₂, part by part, joint by joint; infinite on parts near a singular place, where halving has not made it small enough.
    pub curvature_error: Vec<f64>,
}

/// The nodes in [0, 1] where q'' is interpolated, and the matrix from the values there to Bernstein coefficients, row by row.
#[derive(Clone, Copy)]
pub struct Nodes<'a> {
    pub at: &'a [f64],
    pub to_bernstein: &'a [f64],
}

/// Interpolants whose ε₂ is within the tolerance.
pub fn interpolants(machine: Machine, tips: Tips, nodes: Nodes, tolerance: &Tolerance) -> Interpolants {
    let blocks = map(tips.len().div_ceil(BLOCK), 1, |block| {
        let mut work = Work {
            machine,
            tips,
            nodes,
            tolerance: tolerance.clone(),
            parts: PartWork::new(machine, tips, nodes.at.len() + 2),
            points: PointWork::new(machine, tips, 2),
        };
        let mut found = Interpolants::default();
        for piece in block * BLOCK..((block + 1) * BLOCK).min(tips.len()) {
            work.piece(piece, &mut found);
        }
        found
    });
    let mut all = Interpolants::default();
    for block in blocks {
        all.piece.extend(block.piece);
        all.part.extend(block.part);
        all.slope.extend(block.slope);
        all.curvature_error.extend(block.curvature_error);
    }
    all
}

struct Work<'a> {
    machine: Machine<'a>,
    tips: Tips<'a>,
    nodes: Nodes<'a>,
    tolerance: Tolerance<'a>,
    parts: PartWork<'a>,
    points: PointWork<'a>,
}

impl Work<'_> {
    /// Adds the interpolants on one piece.
    fn piece(&mut self, piece: usize, found: &mut Interpolants) {
        let joints = self.machine.joints.outputs();
        let nodes = self.nodes.at.len();
        let (mut constants, mut allowed) = (vec![0.0; joints], vec![0.0; joints]);
        let mut done: Vec<([f64; 2], Vec<f64>)> = Vec::new();
        let mut open = vec![[0.0, 1.0]];
        for depth in 0..=DEEPEST {
            let (mut left, mut unbounded) = (Vec::new(), 0);
            for part in open {
                self.parts.constants(piece, part, &mut constants);
                self.tolerance.allowed(&mut self.points, piece, part, &mut allowed);
                let length = self.tips.width[piece] * (part[1] - part[0]);
                let per_constant =
                    2.0 * (nodes + 1) as f64 * (length / 4.0).powi(nodes as i32) * (1.0 + 1e-13);
                let bound: Vec<f64> = constants.iter().map(|c| c * per_constant).collect();
                let is_unbounded = constants.iter().any(|c| c.is_infinite());
                unbounded += usize::from(is_unbounded);
                if bound.iter().zip(&allowed).all(|(bound, allowed)| bound <= allowed) {
                    done.push((part, bound));
                } else {
                    left.push((part, is_unbounded));
                }
            }
            let singular = unbounded > INTERVAL_PARTS && depth >= INTERVAL_DEPTH;
            open = Vec::new();
            for (part, is_unbounded) in left {
                if (is_unbounded && singular) || depth == DEEPEST {
                    done.push((part, vec![f64::INFINITY; joints]));
                } else {
                    open.extend(halves(part));
                }
            }
            if open.is_empty() {
                break;
            }
        }
        done.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        for (part, bound) in done {
            self.slopes(piece, part, &mut found.slope);
            found.piece.push(piece);
            found.part.push(part);
            found.curvature_error.extend(bound);
        }
    }

    /// Adds the Bernstein coefficients of q', the integral of the polynomial through the values of q'' at the nodes.
    fn slopes(&mut self, piece: usize, part: [f64; 2], slope: &mut Vec<f64>) {
        let (joints, nodes) = (self.machine.joints.outputs(), self.nodes.at.len());
        let length = part[1] - part[0];
        let mut curvature = vec![0.0; nodes * joints];
        for (t, row) in self.nodes.at.iter().zip(curvature.chunks_exact_mut(joints)) {
            self.points.at(piece, part[0] + t * length);
            for (joint, value) in row.iter_mut().enumerate() {
                *value = self.points.derivative(joint, 2);
            }
        }
        self.points.at(piece, part[0]);
        let step = self.tips.width[piece] * length / nodes as f64;
        let mut sums = vec![0.0; joints];
        for i in 0..=nodes {
            for joint in 0..joints {
                if i > 0 {
                    let row = &self.nodes.to_bernstein[(i - 1) * nodes..][..nodes];
                    let values = curvature.iter().skip(joint).step_by(joints);
                    sums[joint] += step * row.iter().zip(values).map(|(a, b)| a * b).sum::<f64>();
                }
                slope.push(self.points.derivative(joint, 1) + sums[joint]);
            }
        }
    }
}
