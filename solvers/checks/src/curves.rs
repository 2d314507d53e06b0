//! Random problems on curves of any degree, polynomial and rational, most of them adversarial.

use feedplan_geometry::spline::CompositeCurve;
use feedplan_planner::problem::Fault;
use feedplan_planner::profile::Profile;
use feedplan_planner::Exact as _;

use super::axes::{padded, PADDED};
use super::elevated::problem;
use super::random::Random;
use super::regular_path::RegularPath;

/// One piece: its control points and weights, and its parameter width.
#[derive(Clone, Debug)]
pub struct Piece<const M: usize> {
    pub points: Vec<[f64; M]>,
    pub weights: Vec<f64>,
    pub width: f64,
}

/// A planning problem of one run that owns its arrays.
#[derive(Clone, Debug)]
pub struct CurveCase<const M: usize> {
    pub pieces: Vec<Piece<M>>,
    pub feed: f64,
    pub junction: Vec<f64>,
    pub velocity: [f64; M],
    pub acceleration: [f64; M],
}

impl<const M: usize> CurveCase<M> {
    /// From rest to rest under these limits.
    pub fn new(pieces: Vec<Piece<M>>, feed: f64, velocity: [f64; M], acceleration: [f64; M]) -> Self {
        let junction = vec![f64::INFINITY; pieces.len() + 1];
        Self { pieces, feed, junction, velocity, acceleration }
    }

    /// The fastest profile.
    pub fn plan(&self) -> Result<Profile, Fault> {
        let mut curve = CompositeCurve::default();
        for piece in &self.pieces {
            let weights: &[f64] = if piece.weights.iter().all(|&w| w == 1.0) { &[] } else { &piece.weights };
            curve.push(&piece.points, weights, piece.width);
        }
        let RegularPath { curve, junction, .. } = RegularPath::new(&curve, &self.junction);
        let control = curve.control.iter().map(|point| padded(point, 0.0)).collect();
        let CompositeCurve { weights, offsets, width, .. } = curve;
        let curve = CompositeCurve::<PADDED> { control, weights, offsets, width };
        let (runs, feed) = ([0, curve.len()], vec![self.feed; curve.len()]);
        let limits = [self.velocity, self.acceleration].map(|limits| padded(&limits, 1.0));
        problem(&curve, &runs, &feed, &junction, limits).fastest()
    }

    /// The path in the reverse direction.
    pub fn reversed(&self) -> Self {
        let mut other = self.clone();
        other.pieces.reverse();
        for piece in &mut other.pieces {
            piece.points.reverse();
            piece.weights.reverse();
        }
        other.junction.reverse();
        other
    }

    /// The same part in another unit of length.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut other = self.clone();
        for piece in &mut other.pieces {
            piece.points.iter_mut().flatten().for_each(|value| *value *= factor);
        }
        other.junction.iter_mut().for_each(|value| *value *= factor);
        other.feed *= factor;
        other.velocity = self.velocity.map(|value| value * factor);
        other.acceleration = self.acceleration.map(|value| value * factor);
        other
    }
}

/// A short adversarial path of curves: cusps of any order and points near a cusp, pieces that are nearly a
/// point, double control points, reversals on a line, weights and units of any size, degrees up to 9.
pub fn random_curves<const M: usize>(seed: u64) -> CurveCase<M> {
    let mut random = Random(seed);
    let count = 1 + random.below(4);
    let kind = random.below(10);
    let most = if random.chance(0.2) { 9 } else { 5 };
    let unit = if kind == 9 { random.power(-6.0, 6.0) } else { 1.0 };
    let mut corner = vec![false; count + 1];
    let mut start = [0.0; M];
    let mut tangent: [f64; M] = random.normals();
    let mut pieces = vec![];
    for i in 0..count {
        let degree = 2 + random.below(most - 1);
        let width = random.exponential(-2.0, 2.0);
        // Tangents as a polynomial of degree − 1 in Bernstein form, continuous at the ends of pieces unless the kind of the
        // case breaks it.
        let mut rates: Vec<[f64; M]> = (0..degree).map(|_| random.normals()).collect();
        rates[0] = tangent.map(|x| x * width);
        match kind {
            // Near a cusp: the tangents pass through a point near the origin.
            1 | 2 => {
                let off = if kind == 1 { random.exponential(-36.0, -2.0) } else { 0.0 };
                let order = 1 + random.below(3.min(degree - 1));
                let place = if random.chance(0.3) { 0.5 } else { random.uniform() };
                let direction: [f64; M] = random.normals();
                let factors: Vec<[f64; 2]> = (0..order).map(|_| [-place, 1.0 - place]).collect();
                let along = product(&factors, degree - 1, &mut random);
                rates = along
                    .iter()
                    .map(|&x| std::array::from_fn(|k| x * direction[k] + off * random.normal()))
                    .collect();
                if kind == 2 && random.chance(0.5) && degree > order + 1 {
                    // The direction changes in the cusp as well.
                    let second: [f64; M] = random.normals();
                    let factors: Vec<[f64; 2]> = (0..=order).map(|_| [-place, 1.0 - place]).collect();
                    let across = product(&factors, degree - 1, &mut random);
                    for (rate, &x) in rates.iter_mut().zip(&across) {
                        *rate = std::array::from_fn(|k| rate[k] + x * second[k]);
                    }
                }
                corner.fill(true);
            }
            // Double control points.
            3 => {
                let doubled = 1 + random.below(degree - 1);
                for _ in 0..doubled {
                    let at = random.below(degree);
                    let near = if random.chance(0.5) { 0.0 } else { random.exponential(-36.0, -8.0) };
                    rates[at] = rates[at].map(|x| near * x);
                }
                corner.fill(true);
            }
            // Reversals on a line.
            4 => {
                let direction: [f64; M] = random.normals();
                let off = if random.chance(0.5) { 0.0 } else { random.exponential(-36.0, -2.0) };
                for rate in &mut rates {
                    let along = random.normal();
                    *rate = std::array::from_fn(|k| along * direction[k] + off * random.normal());
                }
                corner.fill(true);
            }
            // Axes that hardly move.
            5 => {
                for rate in &mut rates {
                    *rate =
                        rate.map(|x| if random.chance(0.5) { x * random.exponential(-30.0, 0.0) } else { x });
                }
                corner.fill(true);
            }
            // Pieces that are nearly a point.
            6 => {
                if random.chance(0.5) {
                    let size = random.exponential(-30.0, -2.0);
                    rates.iter_mut().for_each(|rate| *rate = rate.map(|x| x * size));
                }
                corner.fill(true);
            }
            // Integers make ties and exact zeros.
            7 => {
                rates.iter_mut().for_each(|rate| *rate = rate.map(f64::round));
                corner.fill(true);
            }
            _ => {}
        }
        if rates.iter().flatten().all(|&x| x == 0.0) {
            rates[0][0] = 1.0;
        }
        let mut points = vec![start];
        for rate in &rates {
            let last = points[points.len() - 1];
            points.push(std::array::from_fn(|k| last[k] + unit * rate[k] / degree as f64));
        }
        if points.iter().all(|point| *point == points[0]) {
            points[degree][0] += unit;
        }
        let rational = kind == 8 || random.chance(0.2);
        let spread = if kind == 8 { 6.9 } else { 1.5 };
        let weights: Vec<f64> =
            (0..=degree).map(|_| if rational { random.exponential(-spread, spread) } else { 1.0 }).collect();
        corner[i] |= rational;
        corner[i + 1] |= rational;
        start = points[degree];
        tangent = rates[degree - 1].map(|x| x / width);
        pieces.push(Piece { points, weights, width });
    }
    let strength = random.exponential(-2.0, 6.0);
    let spread = if random.chance(0.2) { 5.0 } else { 1.0 };
    let equal = random.chance(0.3);
    let acceleration = std::array::from_fn(|_| {
        unit * strength * if equal { 1.0 } else { random.exponential(-spread, spread) }
    });
    let velocity = std::array::from_fn(|_| unit * random.exponential(-1.0, 3.0));
    let feed = unit * if random.chance(0.5) { 1e6 } else { random.exponential(-1.0, 3.0) };
    let mut case = CurveCase::new(pieces, feed, velocity, acceleration);
    for (limit, corner) in case.junction.iter_mut().zip(corner) {
        *limit = if corner { 0.0 } else { f64::INFINITY };
    }
    case
}

/// Bernstein coefficients of the product of linear factors and of a random one, of this degree.
fn product(factors: &[[f64; 2]], degree: usize, random: &mut Random) -> Vec<f64> {
    let mut scaled = vec![1.0];
    let mut binomials: Vec<f64> = vec![1.0];
    let rest = degree - factors.len();
    let positive = random.chance(0.5);
    let linear: Vec<[f64; 2]> = (0..rest)
        .map(|_| {
            if positive {
                [random.between(0.5, 2.0), random.between(0.5, 2.0)]
            } else {
                [random.normal(), random.normal()]
            }
        })
        .collect();
    for factor in factors.iter().chain(&linear) {
        let times = |c: &[f64], f: &[f64; 2]| {
            let mut out = vec![0.0; c.len() + 1];
            for (i, x) in c.iter().enumerate() {
                out[i] += x * f[0];
                out[i + 1] += x * f[1];
            }
            out
        };
        scaled = times(&scaled, factor);
        binomials = times(&binomials, &[1.0, 1.0]);
    }
    scaled.iter().zip(&binomials).map(|(x, b)| x / b).collect()
}
