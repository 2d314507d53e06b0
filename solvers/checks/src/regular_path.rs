//! A path as the planner takes it: straight pieces are lines cut where they turn back, and no curve has a cusp inside.

use feedplan_geometry::spline::regular::regular;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;

/// Pieces of such a path, one run.
pub struct RegularPath<const M: usize> {
    pub curve: CompositeCurve<M>,
    /// The given piece that each of them is a part of.
    pub source: Vec<usize>,
    /// Greatest speeds at their ends, one more than pieces: 0 in cusps and where a line turns back.
    pub junction: Vec<f64>,
}

impl<const M: usize> RegularPath<M> {
    /// Each piece by itself, with the greatest speeds at the ends of the given pieces.
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
