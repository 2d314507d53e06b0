//! Computes the motion of a speed profile at any time: setpoints, their text, and the reduction of setpoints for charts.

pub mod csv;
pub mod phase_motion;
pub mod reduce;
pub mod sampling;

use std::ops::Range;
use std::sync::Arc;

use feedplan_geometry::instances;
use feedplan_geometry::watch::Watch;

use feedplan_planner::phases::Phases;
use sampling::{Chunk, Interpolator, Resume, Sampler};

instances! {
    /// Setpoints of a path.
    pub trait Sampled for [3, 9] Arc<sampling::PathData<M>> = {
        /// Computes the times of the setpoints of a profile from its phases, the phase offsets of its runs, and the period in s.
        /// The error is a sentence for the user.
        fn sampled(&self, phases: &Arc<Phases>, runs: &[usize], period: f64, watch: Watch)
            -> Result<Sampler<M>, String> = Sampler::on;
    }
}

instances! {
    /// The motion of a profile at setpoints, at times and at places; see the methods of `Sampler` that are named here.
    pub trait States for [3, 9] Sampler<M> = {
        fn setpoints(&self, range: Range<usize>, interpolator: Interpolator, resume: &mut Option<Resume>, watch: Watch)
            -> Chunk<M> = Sampler::chunk;
        fn states_at(&self, times: &[f64], watch: Watch) -> Chunk<M> = Sampler::at;
        fn states_along(&self, pieces: &[u32], u: &[f64], watch: Watch) -> Chunk<M> = Sampler::along;
    }
}
