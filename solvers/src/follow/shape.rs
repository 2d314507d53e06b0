//! What a piece of a path is: a conic, which corners may cut and bend, or a piece of a programmed spline, which stays
//! as it is.

use crate::conic::Conic;
use crate::quadratic::{norm, sub};
use crate::spline::CompositeCurve;

/// Edges of a control polygon that are shorter than this part of it are none, as next to a cusp.
const VANISHING: f64 = 1e-12;

#[derive(Clone, Copy, Debug)]
pub enum Shape<const M: usize> {
    Conic(Conic<M>),
    Spline(Spline<M>),
}

/// A piece of a program's splines, known by its number, and what its neighbours have to know of it.
#[derive(Clone, Copy, Debug)]
pub struct Spline<const M: usize> {
    pub index: u32,
    pub width: f64,
    start: [f64; M],
    /// The edges of the control polygon at both ends that have a length.
    start_edge: [f64; M],
    end_edge: [f64; M],
}

impl<const M: usize> Spline<M> {
    /// Piece `index` of a curve, its width scaled; None where it has no length.
    pub fn new(curve: &CompositeCurve<M>, index: usize, scale: f64) -> Option<Self> {
        let piece = curve.piece(index);
        let edges = || piece.control.windows(2).map(|pair| sub(&pair[1], &pair[0]));
        let (extent, _) = piece.extent();
        let long = |edge: &[f64; M]| norm(edge) > VANISHING * extent;
        Some(Self {
            index: index as u32,
            width: piece.width * scale,
            start: piece.control[0],
            start_edge: edges().find(long)?,
            end_edge: edges().rev().find(long)?,
        })
    }
}

impl<const M: usize> Shape<M> {
    #[inline]
    pub fn width(&self) -> f64 {
        match self {
            Self::Conic(conic) => conic.width,
            Self::Spline(spline) => spline.width,
        }
    }

    #[inline]
    pub fn start(&self) -> &[f64; M] {
        match self {
            Self::Conic(conic) => &conic.control[0],
            Self::Spline(spline) => &spline.start,
        }
    }

    /// An edge of the control polygon along the tangent at the start.
    #[inline]
    pub fn start_edge(&self) -> [f64; M] {
        match self {
            Self::Conic(conic) => sub(&conic.control[1], &conic.control[0]),
            Self::Spline(spline) => spline.start_edge,
        }
    }

    /// The same at the end.
    #[inline]
    pub fn end_edge(&self) -> [f64; M] {
        match self {
            Self::Conic(conic) => sub(&conic.control[2], &conic.control[1]),
            Self::Spline(spline) => spline.end_edge,
        }
    }

    #[inline]
    pub fn conic(&self) -> Option<&Conic<M>> {
        match self {
            Self::Conic(conic) => Some(conic),
            Self::Spline(_) => None,
        }
    }
}
