//! The path of a program, from its moves: lines, arcs and splines, fitted chains, blends of corners, smooth curves within
//! the tolerance.

pub mod arc;
pub mod corner;
pub mod fit;
pub mod moves;
pub mod path_builder;
pub mod path_piece;
mod program_pieces;
pub mod smooth_fit;
mod tolerance;

use feedplan_geometry::instances;
use feedplan_geometry::watch::Watch;

use moves::{MoveError, PathOptions};
use path_builder::{Axes, BuiltPath, Motion};

instances! {
    /// The path of moves.
    pub trait PathOfMoves for [3, 9] moves::Moves<'_, M> = {
        /// Lines, arcs and fitted splines, with corners rounded within the tolerance.
        fn path(&self, options: &PathOptions, axes: &Axes<M>, watch: Watch)
            -> Result<BuiltPath<M>, MoveError> = path_builder::build_path;
        /// One smooth curve between two stops. Without a `motion` arcs and bends keep their size; with one the curve is fitted to
        /// the speed of that motion.
        fn smooth_path(&self, options: &PathOptions, axes: &Axes<M>, motion: Option<&Motion<M>>, watch: Watch)
            -> Result<BuiltPath<M>, MoveError> = path_builder::build_smooth_path;
    }
}
