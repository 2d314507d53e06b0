//! Fits C1 quadratic B-splines to a chain of G1 points, within a tolerance that is certified both ways.
//!
//! After Zhang, Yan, Yuan, Wang and Gao, "Curve fitting and optimal interpolation on CNC machines based on quadratic
//! B-splines", Sci. China Inf. Sci. 53 (2010), section 3:
//!
//! | file | computes | source |
//! |---|---|---|
//! | `chain` | points, lengths, tolerance | |
//! | `breaking` | the groups of points between breaking points | 3.1 |
//! | `features` | the feature points of a group, which are interpolated | 3.2, Algorithm 1 |
//! | `spline` | the spline through feature points | 3.3 |
//! | `certificate` | a bound of the distance between spline and polygon, both ways | own |
//! | `refine` | adds feature points until the bound is within the tolerance, and breaks splines where none helps | own |
//! | `piece_builder` | the quadratic pieces of a spline | |
//!
//! The paper tests its tolerance on the Bézier curves of Algorithm 1 only, not on the spline.
//!
//! At a breaking point that is no corner, the tangent is that of one spline through the groups on both sides. So the path is C1
//! there, and each group can be refined by itself, in parallel.

mod breaking;
mod certificate;
mod chain;
mod features;
mod piece_builder;
mod refine;
mod spline;

use breaking::{group, Break};
use chain::{lengths_along, Chain};
use features::select;
use feedplan_geometry::quadratic::{dot, norm, Quadratic};
use feedplan_geometry::watch::Watch;
pub use piece_builder::FittedPiece;
use refine::Block;
use spline::{interpolate, EndCondition};

/// Chains of fewer points are fitted by one thread: this is faster.
const PARALLEL: usize = 4096;
/// A long group is refined in blocks of about this many points, so that one refinement changes few of them.
const BLOCK: usize = 512;

#[derive(Clone, Copy, Debug)]
pub struct FitOptions {
    /// Allowed distance between spline and polygon, both ways, in mm.
    pub tolerance: f64,
    /// Chords longer than this, in mm, stay lines.
    pub max_chord: f64,
    /// Extremes of the curvature above this, in 1/mm, are breaking points (Zhang eq. 2: α a_max / F²).
    pub max_curvature: f64,
    /// A breaking point that turns by more than this, in rad, is a corner, where the tangent may jump.
    pub corner_angle: f64,
}

/// Lines and C1 quadratic B-splines within the tolerance of the polygon of `points`, both ways.
///
/// * Breaking points and both ends are interpolated exactly. Other features are as well, unless a chord beside them would be out
///   of tolerance; such a feature is passed at an offset.
/// * Chords that no smooth curve follows within the tolerance stay lines, with corners at their ends.
/// * All chords stay lines if the tolerance is not positive, a point is not finite or two neighbours are equal.
///
/// The result does not depend on the number of threads.
pub fn fit_points<const M: usize>(
    points: &[[f64; M]],
    options: &FitOptions,
    watch: Watch,
) -> Vec<FittedPiece<M>> {
    if points.len() < 2 {
        return Vec::new();
    }
    let along = lengths_along(points);
    let measurable = along.windows(2).all(|pair| pair[1] > pair[0]) && along[points.len() - 1].is_finite();
    if options.tolerance.is_nan() || options.tolerance <= 0.0 || !measurable {
        let chord = |i: usize| FittedPiece {
            piece: Quadratic::line(points[i], points[i + 1]),
            first: i,
            last: i,
            deviation: 0.0,
            spline: i as u32,
        };
        return (0..points.len() - 1).map(chord).collect();
    }
    let chain = Chain {
        points,
        along: &along,
        tolerance: options.tolerance,
        corner_cosine: options.corner_angle.clamp(0.0, std::f64::consts::PI).cos(),
        parallel: points.len() >= PARALLEL,
        watch,
    };
    let (breaks, extremes) = group(&chain, options.max_chord, options.max_curvature);
    let groups: Vec<&[Break]> = breaks.windows(2).collect();
    let features = chain.map(&groups, watch.part(0.3), |group| {
        let (a, b) = (group[0].at, group[1].at);
        match group[0].line {
            true => vec![a, b],
            false => {
                let inside = |at: usize| extremes.partition_point(|&extreme| extreme < at);
                select(&chain, a, b, &extremes[inside(a + 1)..inside(b)])
            }
        }
    });
    let blocks = blocks(&chain, &breaks, &features);
    let fitted = chain.map(&blocks, watch.part(0.7), |block| block.fit(&chain));

    // Splines are numbered consecutively; a block that continues its group continues its spline.
    let mut pieces = Vec::with_capacity(fitted.iter().map(|block| block.pieces.len()).sum());
    let (mut spline, mut open) = (0, false);
    for (block, part) in blocks.iter().zip(fitted) {
        if !(block.continues && open && part.starts_smooth) {
            spline += u32::from(!pieces.is_empty());
        }
        pieces
            .extend(part.pieces.iter().map(|piece| FittedPiece { spline: spline + piece.spline, ..*piece }));
        spline += part.pieces.last().map_or(0, |piece| piece.spline);
        open = part.ends_smooth;
    }
    pieces
}

/// The blocks of a chain with their end conditions: it is cut at its breaking points, and long groups also at feature points.
fn blocks<const M: usize>(chain: &Chain<M>, breaks: &[Break], features: &[Vec<usize>]) -> Vec<Block<M>> {
    let count = features.len();
    // The end condition of a curve at break `at`: the direction of the neighbouring group `beside` if that is a line without a
    // corner.
    let end =
        |beside: Option<usize>, at: usize| match beside.filter(|&g| breaks[g].line && !breaks[at].corner) {
            Some(g) => EndCondition::Tangent(chain.direction(breaks[g].at, breaks[g + 1].at)),
            None => EndCondition::Free,
        };
    let mut blocks = Vec::with_capacity(count);
    let mut g = 0;
    while g < count {
        if breaks[g].line {
            blocks.push(Block::line(breaks[g].at, breaks[g + 1].at));
            g += 1;
            continue;
        }
        // Groups that follow each other without a line or a corner share one spline.
        let first = g;
        g += 1;
        while g < count && !breaks[g].corner && !breaks[g].line {
            g += 1;
        }
        let start = end(first.checked_sub(1), first);
        let finish = end(Some(g).filter(|&g| g < count), g);
        append_blocks(chain, &breaks[first..=g], &features[first..g], start, finish, &mut blocks);
    }
    blocks
}

/// Appends the blocks of groups that share one spline. They are cut at the breaking points. Long groups are also cut at features
/// where the tangent of that spline is plausible: its length is near 1, and its direction near those of both chords.
fn append_blocks<const M: usize>(
    chain: &Chain<M>,
    breaks: &[Break],
    groups: &[Vec<usize>],
    start: EndCondition<M>,
    finish: EndCondition<M>,
    blocks: &mut Vec<Block<M>>,
) {
    let mut features = vec![groups[0][0]];
    for group in groups {
        features.extend(&group[1..]);
    }
    let through: Vec<_> = features.iter().map(|&at| chain.points[at]).collect();
    let spline = interpolate(&through, start, finish);
    let plausible = |j: usize| {
        let (tangent, at) = (&spline.tangent[j], features[j]);
        let speed = norm(tangent);
        let along = |direction: [f64; M]| dot(tangent, &direction) > 0.8 * speed;
        (0.7..1.4).contains(&speed)
            && along(chain.direction(features[j - 1], at))
            && along(chain.direction(at, features[j + 1]))
    };

    let (mut j, mut from, mut begin, mut continues) = (0, 0, start, false);
    for (group, end) in groups.iter().zip(&breaks[1..]) {
        let break_at = j + group.len() - 1;
        while j < break_at {
            j += 1;
            let long = features[j] - features[from] >= BLOCK && features[break_at] - features[j] >= BLOCK / 2;
            let (cut, stop) = if j + 1 == features.len() {
                (true, finish)
            } else if j == break_at {
                let tangent = if plausible(j) { spline.tangent[j] } else { end.tangent(chain) };
                (true, EndCondition::Tangent(tangent))
            } else {
                (long && plausible(j), EndCondition::Tangent(spline.tangent[j]))
            };
            if cut {
                blocks.push(Block::curve(features[from..=j].to_vec(), begin, stop, continues));
                (from, begin, continues) = (j, stop, j != break_at);
            }
        }
    }
}
