//! Random planning problems: paths like those of CAM systems, and adversarial ones.

use feedplan_geometry::quadratic::Quadratic;
use feedplan_geometry::spline::CompositeCurve;

use super::random::Random;
use super::regular_path::RegularPath;

/// A planning problem of one run that owns its arrays.
#[derive(Clone, Debug)]
pub struct Case<const M: usize> {
    pub pieces: Vec<Quadratic<M>>,
    pub feed: Vec<f64>,
    pub junction: Vec<f64>,
    pub velocity: [f64; M],
    pub acceleration: [f64; M],
    pub chord_tolerance: f64,
    pub period: f64,
    pub start_speed: f64,
    pub end_speed: f64,
}

impl<const M: usize> Case<M> {
    /// The path with these tangents dC/du at both ends of each piece. The middle control points are at the origin, so that the
    /// control points give back the tangents without rounding.
    pub fn from_tangents(tangents: &[([f64; M], [f64; M])], width: &[f64]) -> Self {
        let pieces: Vec<Quadratic<M>> = tangents
            .iter()
            .zip(width)
            .map(|((left, right), &width)| Quadratic {
                control: [
                    left.map(|value| -0.5 * width * value),
                    [0.0; M],
                    right.map(|value| 0.5 * width * value),
                ],
                width,
            })
            .collect();
        Self::new(pieces, 1e6, [1e6; M], [1.0; M])
    }

    /// A path from rest to rest under these limits.
    pub fn new(pieces: Vec<Quadratic<M>>, feed: f64, velocity: [f64; M], acceleration: [f64; M]) -> Self {
        let count = pieces.len();
        Self {
            pieces,
            feed: vec![feed; count],
            junction: vec![f64::INFINITY; count + 1],
            velocity,
            acceleration,
            chord_tolerance: f64::INFINITY,
            period: 0.001,
            start_speed: 0.0,
            end_speed: 0.0,
        }
    }

    /// The same path with straight pieces as lines, cut where they reverse, as the planner needs them.
    pub fn regular(&self) -> Self {
        let mut curve = CompositeCurve::default();
        for piece in &self.pieces {
            curve.push(&piece.control, &[], piece.width);
        }
        let found = RegularPath::new(&curve, &self.junction);
        let mut other = self.clone();
        other.pieces = found.curve.pieces().filter_map(|piece| piece.quadratic()).collect();
        other.feed = found.source.iter().map(|&i| self.feed[i]).collect();
        other.junction = found.junction;
        other
    }

    /// The path in the reverse direction.
    pub fn reversed(&self) -> Self {
        let mut other = self.clone();
        other.pieces.reverse();
        for piece in &mut other.pieces {
            piece.control.reverse();
        }
        other.feed.reverse();
        other.junction.reverse();
        std::mem::swap(&mut other.start_speed, &mut other.end_speed);
        other
    }

    /// The same part in another unit of length.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut other = self.clone();
        for piece in &mut other.pieces {
            piece.control = piece.control.map(|point| point.map(|value| value * factor));
        }
        let scale = |values: &mut Vec<f64>| values.iter_mut().for_each(|value| *value *= factor);
        scale(&mut other.feed);
        scale(&mut other.junction);
        other.velocity = self.velocity.map(|value| value * factor);
        other.acceleration = self.acceleration.map(|value| value * factor);
        other.chord_tolerance *= factor;
        other.start_speed *= factor;
        other.end_speed *= factor;
        other
    }

    /// Every piece cut in two.
    pub fn split(&self, random: &mut Random) -> Self {
        let mut other = self.clone();
        other.pieces.clear();
        other.feed.clear();
        other.junction = vec![self.junction[0]];
        for (i, piece) in self.pieces.iter().enumerate() {
            let middle = piece.width * random.between(0.1, 0.9);
            other.pieces.push(piece.part(0.0, middle));
            other.pieces.push(piece.part(middle, piece.width));
            other.feed.extend([self.feed[i]; 2]);
            other.junction.extend([f64::INFINITY, self.junction[i + 1]]);
        }
        other
    }

    /// The axes in another order.
    pub fn permuted(&self, random: &mut Random) -> Self {
        let mut order: [usize; M] = std::array::from_fn(|k| k);
        for k in (1..M).rev() {
            order.swap(k, random.below(k + 1));
        }
        let permute = |values: &[f64; M]| std::array::from_fn(|k| values[order[k]]);
        let mut other = self.clone();
        for piece in &mut other.pieces {
            piece.control = piece.control.map(|point| permute(&point));
        }
        other.velocity = permute(&self.velocity);
        other.acceleration = permute(&self.acceleration);
        other
    }

    /// The same curves with other parameters.
    pub fn reparametrised(&self, random: &mut Random) -> Self {
        let mut other = self.clone();
        for piece in &mut other.pieces {
            piece.width *= random.exponential(-3.0, 3.0);
        }
        other
    }
}

/// A short adversarial path: exact zeros, ties, cusps, straight runs, corners, jumps of the
/// parameter's speed, tangents and limits over many orders of magnitude, a low chord-error limit.
pub fn random_case<const M: usize>(seed: u64) -> Case<M> {
    case_of_kinds(seed, 9)
}

/// Like `random_case`, but without near cusps and without axes that hardly move.
pub fn milder_case<const M: usize>(seed: u64) -> Case<M> {
    case_of_kinds(seed, 7)
}

fn case_of_kinds<const M: usize>(seed: u64, kinds: usize) -> Case<M> {
    let mut random = Random(seed);
    let count = 1 + random.below(30);
    let kind = random.below(kinds);
    let width: Vec<f64> = (0..count).map(|_| random.exponential(-2.0, 2.0)).collect();
    let mut knots: Vec<[f64; M]> = (0..=count).map(|_| random.normals()).collect();
    match kind {
        1 => {
            let mut sum: [f64; M] = random.normals();
            for knot in &mut knots {
                sum = std::array::from_fn(|k| sum[k] + 0.3 * knot[k]);
                *knot = sum;
            }
        }
        2 => knots.iter_mut().for_each(|knot| *knot = knot.map(|x| (2.0 * x).round() / 2.0)),
        3 => knots.iter_mut().for_each(|knot| *knot = knot.map(f64::signum)),
        4 => {
            for i in 0..count {
                if random.chance(0.5) {
                    knots[i + 1] = knots[i];
                }
            }
        }
        5 => {
            for knot in &mut knots {
                let scale = random.exponential(-6.0, 6.0);
                *knot = knot.map(|x| x * scale);
            }
        }
        // Nearly a cusp: the next tangent is almost the reverse of this one.
        7 => {
            for i in 0..count {
                if random.chance(0.5) {
                    let (back, off) = (-random.exponential(-2.0, 2.0), random.exponential(-36.0, -2.0));
                    knots[i + 1] = std::array::from_fn(|k| back * knots[i][k] + off * random.normal());
                }
            }
        }
        // Axes that hardly move.
        8 => {
            for knot in &mut knots {
                *knot = knot.map(|x| if random.chance(0.5) { x * random.exponential(-30.0, 0.0) } else { x });
            }
        }
        _ => {}
    }
    let mut tangents: Vec<_> = (0..count).map(|i| (knots[i], knots[i + 1])).collect();
    let mut corner = vec![false; count + 1];
    if kind == 6 {
        for i in 0..count - 1 {
            let choice = random.uniform();
            if choice < 0.2 {
                tangents[i + 1].0 = random.normals();
                corner[i + 1] = true;
            } else if choice < 0.4 {
                let scale = random.between(0.2, 5.0);
                tangents[i + 1].0 = tangents[i + 1].0.map(|x| x * scale);
            } else if choice < 0.5 {
                tangents[i].1 = tangents[i].0;
                corner[i + 1] = true;
            }
        }
    }
    // Pieces of length 0 get a length.
    for (left, right) in &mut tangents {
        if left.iter().chain(right.iter()).all(|&x| x == 0.0) {
            left[0] = 1.0;
            corner.fill(true);
        }
    }
    let mut case = Case::from_tangents(&tangents, &width);
    let feed = random.exponential(-1.0, 2.0);
    let varies = random.chance(0.5);
    case.feed = (0..count).map(|_| if varies { random.exponential(-1.0, 2.0) } else { feed }).collect();
    let equal = random.chance(0.3);
    let spread = if random.chance(0.2) { 7.0 } else { 1.0 };
    let strength = if random.chance(0.5) { random.exponential(-2.0, 4.0) } else { 1.0 };
    case.acceleration =
        std::array::from_fn(|_| strength * if equal { 1.0 } else { random.exponential(-spread, spread) });
    case.velocity = std::array::from_fn(|_| random.exponential(-1.0, 3.0));
    let stops = random.chance(0.5);
    for (limit, _) in case.junction.iter_mut().zip(corner).filter(|(_, corner)| *corner) {
        *limit = if stops { 0.0 } else { random.between(0.05, 0.5) };
    }
    if random.chance(0.3) {
        // α = 8 δ/T² near the acceleration limits, δ from far below to far above the radii of curvature.
        case.chord_tolerance = random.exponential(-10.0, 1.0);
        let alpha = strength * random.exponential(-3.0, 1.0);
        case.period = (8.0 * case.chord_tolerance / alpha).sqrt();
    }
    case.regular()
}
