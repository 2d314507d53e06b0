//! The path that setpoints follow: its curve, the speeds that phase laws refer to, source lines, runs and pauses.

use std::rc::Rc;
use std::sync::Arc;

use crate::phase_motion::{Counts, PhaseMotion, PiecePath, TipSpeed};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_planner::phases::Phase;

/// A path: the curve that the axes follow, source lines of the pieces, runs as piece offsets, pauses before the first run and
/// after each run in s. `tip_speed` is given where the feed refers to another curve, and `way_speed` where the laws along the
/// path do: Bernstein coefficients of the square of that curve's speed per parameter for all pieces, and their offsets.
pub struct PathData<const M: usize> {
    pub curve: Arc<CompositeCurve<M>>,
    /// Number of axes; axes beyond it rest.
    pub axes: usize,
    pub tip_speed: Option<(Vec<f64>, Vec<usize>)>,
    pub way_speed: Option<(Vec<f64>, Vec<usize>)>,
    /// Share of each axis in the feed on each piece; empty where the feed has no shares.
    pub feed_share: Vec<[f64; M]>,
    pub lines: Vec<i32>,
    pub runs: Vec<usize>,
    pub start_dwell: f64,
    pub dwell: Vec<f64>,
}

impl<const M: usize> PathData<M> {
    /// Piece i with its lengths.
    pub(super) fn piece(&self, i: usize) -> PiecePath<'_, M> {
        let [feed, way] = [&self.tip_speed, &self.way_speed].map(|speed| {
            speed.as_ref().map(|(coefficients, offsets)| {
                let coefficients = &coefficients[offsets[i]..offsets[i + 1]];
                Counts::Tip(TipSpeed::new(coefficients, self.curve.width[i]))
            })
        });
        let shares = self.feed_share.get(i).filter(|share| **share != [1.0; M]).copied();
        let feed = feed.or(shares.map(Counts::Shares)).unwrap_or(Counts::Axes);
        PiecePath::new(self.curve.piece(i), feed, way.unwrap_or(Counts::Axes))
    }

    /// The motion on a phase.
    pub(super) fn motion(&self, phase: &Phase) -> PhaseMotion<'_, M> {
        PhaseMotion::new(Rc::new(self.piece(phase.piece as usize)), phase)
    }
}
