//! From moves to a path: fitted splines, rounded corners, smooth curves within the tolerance.

pub mod arc;
pub mod corner;
pub mod fit;
pub mod follow;
pub mod path_builder;
pub mod smooth_fit;

use feedplan_geometry::instances;
use feedplan_geometry::watch::Watch;

use fit::{FitOptions, FittedPiece};
use follow::{FollowError, FollowOptions};
use path_builder::{Axes, BuiltPath};

instances! {
    /// The path of moves.
    pub trait Followed for [3, 6, 9] follow::Moves<'_, M> = {
        /// Lines, arcs and fitted splines, with corners rounded within the tolerance.
        fn path(&self, options: &FollowOptions, axes: &Axes<M>, watch: Watch)
            -> Result<BuiltPath<M>, FollowError> = path_builder::build_path;
        /// One curve between two stops; `sized`: arcs and bends keep their size.
        fn smooth_path(&self, options: &FollowOptions, axes: &Axes<M>, sized: bool, watch: Watch)
            -> Result<BuiltPath<M>, FollowError> = path_builder::build_smooth_path;
    }
}

instances! {
    /// Splines near points.
    pub trait Fitted for [3, 6, 9] [[f64; M]] = {
        /// Lines and quadratic B-splines within the tolerance; see `fit`.
        fn fitted(&self, options: &FitOptions, watch: Watch) -> Vec<FittedPiece<M>> = fit::fit_points;
    }
}
