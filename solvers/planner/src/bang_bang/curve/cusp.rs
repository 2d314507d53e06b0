//! The cusps of a piece: places where every axis that moves is at rest within rounding, C' = (t − c)^r · a vector.
//!
//! Control points are rounded, and so the tangents are known to a part of their greatest size only. Around a cusp of
//! order r that leaves a stretch, about the r-th root of that part wide, on which the digits of the tangents mean
//! nothing: axes seem to turn round there, or not. The way through it is as short as rounding itself. So it is taken
//! for one place, where all axes have a zero of order r.

use super::piece::Piece;
use crate::bang_bang::tolerance::SLOW_SQ;
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// Halving stops here; a cusp of order 1 is found some levels earlier.
const MAX_DEPTH: u32 = 52;
/// So many stretches are looked at in one piece, at most.
const MAX_STRETCHES: u32 = 4000;
/// So many times half a stretch away from it the tangents have signs.
const AWAY: f64 = 10.0;
/// A stretch shorter than this power of a half on which all axes may be at rest is next to a cusp.
const NEARLY_DEPTH: u32 = 8;
/// At a cusp of order r the derivatives below r make up less than this part of the tangents nearby.
const LOWER: f64 = 0.3;

/// All axes rest at `t`, and closer to it than `reach` as far as can be told.
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
    /// Short stretches in the end without a place where all axes rest, and how often each was halved.
    nearly: Vec<(f64, f64, u32)>,
}

/// Where all axes rest, and where they nearly do.
#[derive(Default)]
pub struct Cusps {
    pub cusps: Vec<Cusp>,
    /// Next to these places the tangents are so short that what depends on their small differences is lost in the
    /// rounding of polynomials over the whole piece.
    pub nearly: Vec<Nearly>,
}

/// Within `reach` of `t` all axes are nearly at rest.
#[derive(Clone, Copy, Debug)]
pub struct Nearly {
    pub t: f64,
    pub reach: f64,
}

/// The cusps of a piece on which these axes move, and the places that are nearly one, in order.
pub fn cusps<const M: usize, const C: usize>(piece: &Piece<M, C>, moving: AxisBits) -> Cusps {
    let (least, greatest) = piece.speed.range();
    if piece.own_speed && least > SLOW_SQ * greatest {
        return Cusps::default();
    }
    let mut search =
        Search { noise: &piece.noise, moving, left: MAX_STRETCHES, found: vec![], nearly: vec![] };
    search.halve(&piece.g, (0.0, 1.0), 0);
    let mut stretches: Vec<(f64, f64)> = vec![];
    for (from, to) in search.found {
        match stretches.last_mut() {
            Some(last) if from - last.1 <= to - last.0 - (from - last.1) => last.1 = to,
            _ => stretches.push((from, to)),
        }
    }
    let cusps: Vec<Cusp> =
        stretches.into_iter().filter_map(|stretch| locate(piece, moving, stretch)).collect();
    // Of neighbours the shortest stretch stays.
    let mut nearly: Vec<(f64, f64, u32)> = vec![];
    let mut reached = 0.0;
    for stretch in search.nearly {
        match nearly.last_mut() {
            Some(last) if stretch.0 <= reached => {
                if stretch.2 > last.2 {
                    *last = stretch;
                }
            }
            _ => nearly.push(stretch),
        }
        reached = stretch.1;
    }
    let place = |(from, to, _): (f64, f64, u32)| Nearly { t: 0.5 * (from + to), reach: 0.5 * (to - from) };
    Cusps { cusps, nearly: nearly.into_iter().map(place).collect() }
}

impl<const M: usize> Search<'_, M> {
    /// Collects the stretches on which every axis is at rest within rounding.
    fn halve<const C: usize>(&mut self, g: &[Polynomial<C>; M], (from, to): (f64, f64), depth: u32) {
        let moving = self.moving;
        let mut axes = (0..M).filter(|k| moving >> k & 1 == 1);
        // An axis without a zero here.
        if axes.clone().any(|k| (0..=g[k].degree()).all(|i| g[k].bernstein(i) > self.noise[k]))
            || axes.clone().any(|k| (0..=g[k].degree()).all(|i| g[k].bernstein(i) < -self.noise[k]))
        {
            if depth >= NEARLY_DEPTH {
                self.nearly.push((from, to, depth));
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

/// Where in a stretch the cusp is, and its order: the power of the distance that the tangents grow with.
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
    // The tangents' derivatives at t in units of what is known of the tangents, for all axes.
    let derivative = |r: usize, t: f64| -> [f64; M] {
        std::array::from_fn(|k| {
            if moving >> k & 1 == 0 {
                return 0.0;
            }
            (0..r).fold(piece.g[k], |g, _| g.derivative()).value(t) / piece.noise[k]
        })
    };
    let size = |rates: &[f64; M]| rates.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Where derivative r − 1 vanishes, and how much of the tangents each derivative makes at the ends of the stretch.
    let place = |r: usize| {
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
    // Whether the tangents point back after the stretch.
    let (before, after) =
        (derivative(0, (from - AWAY * half).max(0.0)), derivative(0, (to + AWAY * half).min(1.0)));
    let along: f64 = before.iter().zip(&after).map(|(x, y)| x * y).sum();
    let odd = usize::from(along < 0.0);
    let fits = |r: &usize| middle == 0.0 || middle == 1.0 || r % 2 == odd;
    let alone = |r: &usize| {
        let t = place(*r);
        let (own, lower) = (share(*r, t), (0..*r).map(|i| share(i, t)).fold(0.0, f64::max));
        own > LOWER && lower <= LOWER * own
    };
    let greatest =
        || (1..=degree).filter(fits).max_by(|&a, &b| share(a, middle).total_cmp(&share(b, middle)));
    let order = (1..=degree).rev().filter(fits).find(alone).or_else(greatest)?;
    let t = place(order);
    Some(Cusp { t, order: order as u8, reach: (t - from).max(to - t) })
}
