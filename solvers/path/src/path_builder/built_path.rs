//! The path of a program, as it is built, and the limits of the axes that it is built for.

use super::chunk::Chunk;
use super::travel::{outside, Outside};
use crate::moves::Moves;
use crate::program_pieces::FitCounts;
use crate::smooth_fit::Offsets;

/// The limits of the axes that matter for a path.
pub struct Axes<const M: usize> {
    /// In mm/s and mm/s².
    pub max_velocity: [f64; M],
    pub max_acceleration: [f64; M],
    /// Least and greatest position in mm.
    pub travel: [[f64; 2]; M],
    /// Whether corners may be passed with a velocity jump.
    pub jump: bool,
}

/// The path of a program.
pub struct BuiltPath<const M: usize> {
    /// The pieces in order, in the chunks that were made in parallel.
    pub chunks: Vec<Chunk<M>>,
    /// Index of the first piece of each run; the last entry is the number of pieces.
    pub runs: Vec<usize>,
    /// Upper bound of the distance between path and program, both ways, in mm.
    pub deviation: f64,
    /// For a smooth path: on which side of the program it lies, and how far away.
    pub offsets: Option<Offsets>,
    pub fit: FitCounts,
    /// The first place outside the travel of an axis.
    pub outside: Option<Outside>,
    /// Where a smooth path stops although the program does not ask for it.
    pub not_smooth: NotSmooth,
}

/// Where a smooth path stops although the program does not ask for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NotSmooth {
    /// Moves at whose end the path turns back and stops.
    pub reversals: Vec<u32>,
    /// First and last move of each place where no smooth curve is within the tolerance. Corners are rounded one by one
    /// there, between two stops.
    pub corners: Vec<[u32; 2]>,
}

impl<const M: usize> BuiltPath<M> {
    /// From pieces and runs; finds the deviation and the first place outside the travel.
    pub fn new(
        chunks: Vec<Chunk<M>>,
        runs: Vec<usize>,
        fit: FitCounts,
        moves: &Moves<M>,
        travel: &[[f64; 2]; M],
    ) -> Self {
        let pieces = chunks.iter().flat_map(|chunk| &chunk.pieces);
        Self {
            deviation: pieces.map(|piece| piece.deviation).fold(0.0, f64::max),
            outside: outside(&chunks, moves, travel),
            chunks,
            runs,
            offsets: None,
            fit,
            not_smooth: NotSmooth::default(),
        }
    }
}
