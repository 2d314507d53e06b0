//! A piece of a path: the moves along which it goes, and its shape. The shape is a conic or a piece of a spline, as programmed,
//! fitted, or cut and bent at a corner.

use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::sub;
use feedplan_geometry::spline::cusps::rests_at_ends;
use feedplan_geometry::spline::{bezier, CompositeCurve, Piece};

/// A piece of a path, and the moves along which it goes.
#[derive(Clone, Copy, Debug)]
pub struct PathPiece<const M: usize> {
    pub shape: Shape<M>,
    /// First and last move.
    pub first: u32,
    pub last: u32,
    pub feed: f64,
    /// Upper bound of the distance from the moves, both ways, in mm.
    pub deviation: f64,
    /// Allowed distance from the moves, in mm.
    pub tolerance: f64,
    /// Whether the moves ask for the exact path.
    pub exact: bool,
    /// Whether the piece belongs to an arc, whose extent is checked as programmed.
    pub arc: bool,
}

#[derive(Clone, Copy, Debug)]
pub enum Shape<const M: usize> {
    Conic(Conic<M>),
    Spline(Spline<M>),
}

/// A piece of a spline, by its number, with the directions at its ends that blends need.
#[derive(Clone, Copy, Debug)]
pub struct Spline<const M: usize> {
    /// The number of the piece in the splines of the program or, if `made`, of its chunk.
    pub index: u32,
    pub made: bool,
    pub width: f64,
    start: [f64; M],
    /// The first and the last edge of the control polygon that has a direction.
    start_edge: [f64; M],
    end_edge: [f64; M],
    /// Whether the tool rests at the start, and at the end, because the curve has a cusp there.
    rests: [bool; 2],
}

impl<const M: usize> Spline<M> {
    /// Piece `index` of a program's splines with its width scaled; None if it has no length.
    pub fn new(splines: &CompositeCurve<M>, index: usize, scale: f64) -> Option<Self> {
        let piece = splines.piece(index);
        Self::of(&piece, index, false, piece.width * scale)
    }

    fn of(piece: &Piece<M>, index: usize, made: bool, width: f64) -> Option<Self> {
        Some(Self {
            index: index as u32,
            made,
            width,
            start: piece.control[0],
            start_edge: piece.edge(false)?,
            end_edge: piece.edge(true)?,
            rests: rests_at_ends(piece),
        })
    }

    /// The part on [low, high], appended to `made` with degree 2 or more, so that it can be bent; `splines` are the program's.
    pub fn part(
        &self,
        splines: &CompositeCurve<M>,
        low: f64,
        high: f64,
        made: &mut CompositeCurve<M>,
    ) -> Option<Self> {
        let whole = splines.piece(self.index as usize);
        let scale = whole.width / self.width;
        let cuts = [low, high].map(|u| u * scale);
        let inner = usize::from(low <= 0.0)..1 + usize::from(high < self.width);
        let mut parts = CompositeCurve::default();
        bezier::split(&whole, &cuts[inner], &mut parts);
        let part = parts.piece(usize::from(low > 0.0));
        bezier::elevate(&part, usize::from(part.degree() == 1), made);
        let index = made.len() - 1;
        Self::of(&made.piece(index), index, true, high - low)
    }

    /// The last piece of `made`; None if it has no length.
    pub fn last_made(made: &CompositeCurve<M>) -> Option<Self> {
        let index = made.len().checked_sub(1)?;
        let piece = made.piece(index);
        Self::of(&piece, index, true, piece.width)
    }

    /// The same piece with the ends of its changed control points.
    pub fn bent(&self, made: &CompositeCurve<M>) -> Option<Self> {
        let index = self.index as usize;
        Self::of(&made.piece(index), index, true, self.width)
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

    /// An edge of the control polygon in the direction of the tangent at the start.
    #[inline]
    pub fn start_edge(&self) -> [f64; M] {
        match self {
            Self::Conic(conic) => sub(&conic.control[1], &conic.control[0]),
            Self::Spline(spline) => spline.start_edge,
        }
    }

    /// An edge of the control polygon in the direction of the tangent at the end.
    #[inline]
    pub fn end_edge(&self) -> [f64; M] {
        match self {
            Self::Conic(conic) => sub(&conic.control[2], &conic.control[1]),
            Self::Spline(spline) => spline.end_edge,
        }
    }

    /// Whether the tool rests at the start, and at the end, because the curve has a cusp there.
    #[inline]
    pub fn rests(&self) -> [bool; 2] {
        match self {
            Self::Conic(_) => [false; 2],
            Self::Spline(spline) => spline.rests,
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

#[cfg(test)]
impl<const M: usize> From<Conic<M>> for PathPiece<M> {
    /// A piece of one move at a feed of 10 mm/s with a tolerance of 1 mm.
    fn from(conic: Conic<M>) -> Self {
        let shape = Shape::Conic(conic);
        let [exact, arc] = [false; 2];
        Self { shape, first: 0, last: 0, feed: 10.0, deviation: 0.0, tolerance: 1.0, exact, arc }
    }
}
