//! A path as the planner needs it: straight pieces are lines, cut where they reverse, and cusps are at ends of pieces.

use feedplan_geometry::spline::regular::regular;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;

/// The pieces of a path that the planner accepts, in one run.
pub struct RegularPath<const M: usize> {
    pub curve: CompositeCurve<M>,
    /// For each piece, the given piece that it is a part of.
    pub source: Vec<usize>,
    /// Greatest speeds at the ends of pieces, one more than pieces: 0 in cusps and where a line reverses.
    pub junction: Vec<f64>,
}

impl<const M: usize> RegularPath<M> {
    /// From the given pieces, each processed alone, and the greatest speeds at their ends.
    pub fn new(given: &CompositeCurve<M>, speeds: &[f64]) -> Self {
        let each: Vec<_> = (0..given.len()).map(|i| i..i + 1).collect();
        let found = regular(given, &each, Watch::default());
        let (mut source, mut junction) = (vec![], vec![]);
        let mut limit = speeds[0];
        for (i, range) in found.ranges.iter().enumerate() {
            for j in range.clone() {
                let [starts_at_rest, ends_at_rest] = found.rests[j];
                junction.push(if starts_at_rest { 0.0 } else { limit });
                source.push(i);
                limit = if j + 1 < range.end || ends_at_rest { 0.0 } else { f64::INFINITY };
            }
            limit = limit.min(speeds[i + 1]);
        }
        junction.push(limit);
        Self { curve: found.curve, source, junction }
    }
}
