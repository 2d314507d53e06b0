//! Finds the cusps of a piece: points t₀ where the tangents of all moving axes are 0 within rounding, C' ≈ (t − t₀)^r ·
//! a constant vector.
//!
//! Control points are rounded, so tangents are known to a fraction of their greatest magnitude only. Around a cusp of order r
//! there is an interval, about as wide as the r-th root of that fraction, in which no digit of the tangents is correct: axes may
//! seem to turn or not. The path through this interval is as short as rounding errors. So the interval is treated as one point
//! where all axes have a zero of order r.

use super::piece::Piece;
use crate::bang_bang::tolerance::SLOW_SQ;
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// Greatest number of halvings; a cusp of order 1 is found with fewer.
const MAX_DEPTH: u32 = 52;
/// Greatest number of intervals examined on one piece.
const MAX_INTERVALS: u32 = 4000;
/// At a distance of this many half widths from the interval, the signs of the tangents are certain.
const AWAY: f64 = 10.0;
/// An interval that needs at least this many halvings until some axis certainly has no zero in it is a near cusp.
const NEAR_DEPTH: u32 = 8;
/// At a cusp of order r, every Taylor term of the tangents of lower order is at most this fraction of the term of order r.
const LOWER: f64 = 0.3;

/// All axes rest at `t`; within `reach` of `t` no digit of the tangents is correct.
#[derive(Clone, Copy, Debug)]
pub struct Cusp {
    pub t: f64,
    pub order: u8,
    pub reach: f64,
}

struct Search<'a, const M: usize> {
    noise: &'a [f64; M],
    moving: AxisBits,
    left: u32,
    found: Vec<(f64, f64)>,
    /// Short intervals in which some axis has no zero, with the number of halvings.
    near_cusps: Vec<(f64, f64, u32)>,
}

/// The cusps of a piece, and the points next to which all axes are nearly at rest.
#[derive(Default)]
pub struct Cusps {
    pub cusps: Vec<Cusp>,
    /// Here the tangents are so short that polynomials over the whole piece do not resolve their small differences.
    pub near_cusps: Vec<NearCusp>,
}

/// Within `reach` of `t` all axes are nearly at rest.
#[derive(Clone, Copy, Debug)]
pub struct NearCusp {
    pub t: f64,
    pub reach: f64,
}

/// The cusps and near cusps of a piece in order of t; bit k of `moving`: axis k moves.
pub fn cusps<const M: usize, const C: usize>(piece: &Piece<M, C>, moving: AxisBits) -> Cusps {
    let (least, greatest) = piece.speed.range();
    if piece.own_speed && least > SLOW_SQ * greatest {
        return Cusps::default();
    }
    let mut search =
        Search { noise: &piece.noise, moving, left: MAX_INTERVALS, found: vec![], near_cusps: vec![] };
    search.halve(&piece.g, (0.0, 1.0), 0);
    let mut intervals: Vec<(f64, f64)> = vec![];
    for (from, to) in search.found {
        match intervals.last_mut() {
            Some(last) if from - last.1 <= to - last.0 - (from - last.1) => last.1 = to,
            _ => intervals.push((from, to)),
        }
    }
    let cusps: Vec<Cusp> =
        intervals.into_iter().filter_map(|interval| locate(piece, moving, interval)).collect();
    // Of adjacent intervals the shortest is kept.
    let mut near_cusps: Vec<(f64, f64, u32)> = vec![];
    let mut reached = 0.0;
    for interval in search.near_cusps {
        match near_cusps.last_mut() {
            Some(last) if interval.0 <= reached => {
                if interval.2 > last.2 {
                    *last = interval;
                }
            }
            _ => near_cusps.push(interval),
        }
        reached = interval.1;
    }
    let near_cusp =
        |(from, to, _): (f64, f64, u32)| NearCusp { t: 0.5 * (from + to), reach: 0.5 * (to - from) };
    Cusps { cusps, near_cusps: near_cusps.into_iter().map(near_cusp).collect() }
}

impl<const M: usize> Search<'_, M> {
    /// Collects the intervals on which every axis is at rest within rounding, and the near cusps.
    fn halve<const C: usize>(&mut self, g: &[Polynomial<C>; M], (from, to): (f64, f64), depth: u32) {
        let moving = self.moving;
        let mut axes = (0..M).filter(|k| moving >> k & 1 == 1);
        // Some axis has no zero here.
        if axes.clone().any(|k| (0..=g[k].degree()).all(|i| g[k].bernstein(i) > self.noise[k]))
            || axes.clone().any(|k| (0..=g[k].degree()).all(|i| g[k].bernstein(i) < -self.noise[k]))
        {
            if depth >= NEAR_DEPTH {
                self.near_cusps.push((from, to, depth));
            }
            return;
        }
        let rests = |k: usize| (0..=g[k].degree()).all(|i| g[k].bernstein(i).abs() <= self.noise[k]);
        if axes.all(rests) {
            self.found.push((from, to));
            return;
        }
        if depth == MAX_DEPTH || self.left == 0 {
            return;
        }
        self.left -= 1;
        let halves = g.each_ref().map(|g| g.split(0.5));
        let middle = 0.5 * (from + to);
        self.halve(&halves.each_ref().map(|half| half.0), (from, middle), depth + 1);
        self.halve(&halves.each_ref().map(|half| half.1), (middle, to), depth + 1);
    }
}

/// The cusp in an interval, and its order r: the tangents grow as the r-th power of the distance from it.
fn locate<const M: usize, const C: usize>(
    piece: &Piece<M, C>,
    moving: AxisBits,
    (from, to): (f64, f64),
) -> Option<Cusp> {
    let degree = piece.g[0].degree();
    let middle = match (from, to) {
        (0.0, _) => 0.0,
        (_, 1.0) => 1.0,
        _ => 0.5 * (from + to),
    };
    let half = (to - from) * if middle == 0.0 || middle == 1.0 { 1.0 } else { 0.5 };
    // Derivative r of the tangents at t, each axis in units of its noise.
    let derivative = |r: usize, t: f64| -> [f64; M] {
        std::array::from_fn(|k| {
            if moving >> k & 1 == 0 {
                return 0.0;
            }
            (0..r).fold(piece.g[k], |g, _| g.derivative()).value(t) / piece.noise[k]
        })
    };
    let size = |rates: &[f64; M]| rates.iter().map(|x| x * x).sum::<f64>().sqrt();
    // `zero_of(r)`: the zero of derivative r − 1, by three Newton steps. `share(r, t)`: the Taylor term of order r of the
    // tangents around t, at the ends of the interval.
    let zero_of = |r: usize| {
        let mut t = middle;
        if middle != 0.0 && middle != 1.0 {
            for _ in 0..3 {
                let (value, slope) = (derivative(r - 1, t), derivative(r, t));
                let along: f64 = value.iter().zip(&slope).map(|(x, y)| x * y).sum();
                let steepness = size(&slope).powi(2);
                t = if steepness > 0.0 { (t - along / steepness).clamp(from, to) } else { t };
            }
        }
        t
    };
    let share = |r: usize, t: f64| (1..=r).fold(size(&derivative(r, t)), |share, i| share * half / i as f64);
    // Whether the tangents are reversed after the interval.
    let (before, after) =
        (derivative(0, (from - AWAY * half).max(0.0)), derivative(0, (to + AWAY * half).min(1.0)));
    let along: f64 = before.iter().zip(&after).map(|(x, y)| x * y).sum();
    let odd = usize::from(along < 0.0);
    let fits = |r: &usize| middle == 0.0 || middle == 1.0 || r % 2 == odd;
    let alone = |r: &usize| {
        let t = zero_of(*r);
        let (own, lower) = (share(*r, t), (0..*r).map(|i| share(i, t)).fold(0.0, f64::max));
        own > LOWER && lower <= LOWER * own
    };
    let greatest =
        || (1..=degree).filter(fits).max_by(|&a, &b| share(a, middle).total_cmp(&share(b, middle)));
    let order = (1..=degree).rev().filter(fits).find(alone).or_else(greatest)?;
    let t = zero_of(order);
    Some(Cusp { t, order: order as u8, reach: (t - from).max(to - t) })
}
