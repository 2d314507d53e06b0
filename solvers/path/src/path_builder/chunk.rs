//! Consecutive pieces of a path, with the control points of those that are not the program's.

use crate::corner::Sides;
use crate::path_piece::{PathPiece, Shape, Spline};
use feedplan_geometry::conic::Conic;
use feedplan_geometry::spline::{CompositeCurve, Piece};

/// Consecutive pieces of a path that one parallel task makes. `made` has the pieces of splines that are not the program's: they
/// are cut or bent at corners, or fitted.
#[derive(Clone, Debug)]
pub struct Chunk<const M: usize> {
    pub pieces: Vec<PathPiece<M>>,
    pub made: CompositeCurve<M>,
}

impl<const M: usize> Default for Chunk<M> {
    fn default() -> Self {
        Self { pieces: vec![], made: CompositeCurve::default() }
    }
}

impl<const M: usize> Chunk<M> {
    /// The control points of a spline of this chunk; `splines` are the program's. The width to use is that of `spline`, not that
    /// of the returned piece.
    pub fn spline<'a>(&'a self, spline: &Spline<M>, splines: &'a CompositeCurve<M>) -> Piece<'a, M> {
        let source = if spline.made { &self.made } else { splines };
        source.piece(spline.index as usize)
    }

    /// Appends a polynomial piece with the properties of `like` except its shape.
    pub fn push(&mut self, control: &[[f64; M]], width: f64, like: PathPiece<M>) {
        if let [start, end] = *control {
            self.pieces.push(PathPiece { shape: Shape::Conic(Conic::line(start, end)), ..like });
            return;
        }
        self.made.push(control, &[], width);
        let shape = Spline::last_made(&self.made).map(Shape::Spline);
        self.pieces.extend(shape.map(|shape| PathPiece { shape, ..like }));
    }

    /// Appends both sides of a blend.
    pub fn append(&mut self, sides: &Sides<M>) {
        let before = self.made.len() as u32;
        for piece in sides.made.pieces() {
            self.made.push(piece.control, piece.weights, piece.width);
        }
        for &piece in sides.before.iter().chain(&sides.after) {
            let mut own = piece;
            if let Shape::Spline(spline) = &mut own.shape {
                spline.index += before;
            }
            self.pieces.push(own);
        }
    }
}
