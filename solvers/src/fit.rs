//! Stand-in with the interface of the quadratic B-spline fit: every chord stays a line.

use crate::quadratic::Quadratic;

/// How closely and where points are fitted.
pub struct FitOptions {
    pub tolerance: f64,
    pub max_chord: f64,
    pub max_curvature: f64,
    pub corner_angle: f64,
}

/// A piece and the chords it stands for.
pub struct FittedPiece<const M: usize> {
    pub piece: Quadratic<M>,
    pub first: usize,
    pub last: usize,
    pub deviation: f64,
    pub spline: u32,
}

/// One line for each chord.
pub fn fit_points<const M: usize>(points: &[[f64; M]], _options: &FitOptions) -> Vec<FittedPiece<M>> {
    let line = |k: usize| Quadratic::line(points[k], points[k + 1]);
    (0..points.len() - 1)
        .map(|k| FittedPiece { piece: line(k), first: k, last: k, deviation: 0.0, spline: k as u32 })
        .collect()
}
