//! Cuts a piece where an axis turns round and where the lowest velocity cap changes.

use super::chord::SpeedLine;
use super::cusp::{cusps, Cusps, Nearly};
use super::piece::Piece;
use super::TIP_AXES;
use crate::planning::ChordLimit;
use crate::polynomial::Polynomial;

/// Cuts closer than this part of the piece are one.
const SAME_CUT: f64 = 1e-13;
/// Turns closer than this part of the piece are one.
const SAME_TURN: f64 = 1e-12;
/// Closer than this to a turn where |C'|² is below this part of its greatest value, no velocity cap counts.
const NEAR_CUSP: f64 = 1e-5;
const SLOW: f64 = 1e-10;
/// A weight may be so many times greater than those at the ends of a part.
const UNEVEN: f64 = 100.0;
/// A place nearly at rest asks for no cut of its own where there is one, or a cusp, within so many times its reach.
const AROUND: f64 = 4.0;
/// A part shorter than this part of the piece is not cut once more: its ends become one.
const NARROW: f64 = 1e-11;
/// The value of a polynomial is rounding below this part of its terms.
const NOISE: f64 = 1e-14;
/// A place nearer to the end of a part than this is at its end.
const AT_END: f64 = 1e-6;
/// A tangent coefficient this small beside the greatest one is zero.
const ZERO: f64 = 1e-14;

/// The lowest velocity cap of a sub-piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cap {
    /// The speed squared, linear in t between its two ends: the feed, or a bound below the chord-error limit.
    Speed([f64; 2]),
    /// The square of the velocity limit of an axis.
    Axis(usize, f64),
}

/// Limits of the axes.
pub struct Axes<const M: usize> {
    pub acceleration: [f64; M],
    pub velocity_sq: [f64; M],
}

/// What limits the speed on a piece.
pub struct Limits<'a, const M: usize> {
    pub axes: &'a Axes<M>,
    pub feed_sq: f64,
    pub chord: Option<&'a ChordLimit>,
}

/// A part [from, to] of a piece on which no axis turns round and one velocity cap is the lowest.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from: f64,
    pub to: f64,
    pub cap: Cap,
    left: End,
    right: End,
    /// Bit k: axis k moves backward, moves at all.
    pub negative: u8,
    pub moving: u8,
}

/// An end of a part.
#[derive(Clone, Copy, Debug, Default)]
struct End {
    /// Bit k: axis k turns round there.
    turns: u8,
    /// All axes have a zero of this order.
    order: u8,
    /// As far as this from the end rounding may have moved the zeros.
    reach: f64,
    /// The plan stops there.
    stops: bool,
}

impl End {
    /// Whether axis k has a zero there.
    fn is_cut_for(&self, k: usize) -> bool {
        self.order > 0 || self.turns >> k & 1 == 1
    }
}

/// A place that divides two parts.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    t: f64,
    end: End,
}

impl Cut {
    fn plain(t: f64) -> Self {
        Self { t, end: End::default() }
    }

    fn is_turn_or_end(&self) -> bool {
        self.end.turns != 0 || self.t == 0.0 || self.t == 1.0
    }

    fn turn(t: f64, turns: u8) -> Self {
        Self { t, end: End { turns, reach: SAME_TURN, ..End::default() } }
    }

    /// Takes over what another cut at the same place is for.
    fn join(&mut self, other: &Self) {
        self.end.turns |= other.end.turns;
        self.end.order = self.end.order.max(other.end.order);
        self.end.reach = self.end.reach.max(other.end.reach);
        self.end.stops |= other.end.stops;
    }
}

/// A place where a piece is cut once more because a pass came to no end there.
#[derive(Clone, Copy, Debug)]
pub struct Remedy {
    pub piece: usize,
    pub t: f64,
    /// All cuts closer than this are one.
    pub reach: f64,
    /// The plan stops there.
    pub stops: bool,
}

/// A part as a pass travels it, its polynomials over x in [0, 1], every axis moving forward.
///
/// Here g and π belong to x: π = (dx/dτ)²/ω⁴.
#[derive(Clone, Copy, Debug)]
pub struct SubPiece<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    pub speed: Polynomial<C>,
    pub cap: Cap,
    /// Bit k: axis k moves at all.
    pub moving: u8,
    /// Degree of the curve itself.
    pub degree: usize,
    pub straight: bool,
    pub own_speed: bool,
    /// The order of the zero that every tangent has at the start and at the end.
    pub cusp_orders: [u8; 2],
}

/// Appends the parts of the piece from left to right; `tip` is the tool's own piece where it is another one, `cuts`
/// is space.
pub fn split<const M: usize, const C: usize>(
    piece: &Piece<M, C>,
    tip: Option<&Piece<TIP_AXES, C>>,
    limits: &Limits<M>,
    remedies: impl Iterator<Item = Remedy>,
    cuts: &mut Vec<Cut>,
    out: &mut Vec<Part>,
) {
    let Limits { axes, feed_sq, chord } = *limits;
    let size = piece.g.each_ref().map(|g| g.padded().iter().fold(0.0, |most: f64, c| most.max(c.abs())));
    let greatest = size.iter().copied().fold(0.0, f64::max);
    let mut moving = 0u8;
    cuts.clear();
    cuts.extend([Cut::plain(0.0), Cut::plain(1.0)]);
    for (k, g) in piece.g.iter().enumerate() {
        if size[k] <= ZERO * greatest {
            continue;
        }
        moving |= 1 << k;
        for (end, t) in [(g.first(), 0.0), (g.last(), 1.0)] {
            if end.abs() <= piece.noise[k] {
                cuts.push(Cut::turn(t, 1 << k));
            }
        }
        if !piece.straight {
            g.sign_changes(&mut |t| cuts.push(Cut::turn(t, 1 << k)));
        }
    }
    if piece.straight {
        // All axes turn at once, in a cusp.
        let greatest = (0..M).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        piece.g[greatest].sign_changes(&mut |t| cuts.push(Cut::turn(t, moving)));
    }
    let (whole, mut below_chord) = ([SpeedLine { from: 0.0, to: 1.0, speed_sq: [feed_sq; 2] }], vec![]);
    match (chord, tip) {
        (Some(chord), Some(tip)) => chord.lines(tip, feed_sq, &mut below_chord),
        (Some(chord), None) if piece.own_speed => chord.lines(piece, feed_sq, &mut below_chord),
        _ => {}
    }
    let lines = if below_chord.is_empty() { &whole } else { below_chord.as_slice() };
    // Where the axes are the tool's none is faster than the tool.
    let can_cap = (0..M).fold(0u8, |bits, k| {
        let slow = piece.own_speed && axes.velocity_sq[k] >= feed_sq;
        bits | u8::from(!slow && moving >> k & 1 == 1) << k
    });
    let mut fast = 0u8;
    for line in lines {
        if line.from > 0.0 {
            cuts.push(Cut::plain(line.from));
        }
        if can_cap != 0 {
            fast |= cut_by_cap(piece, axes, line, can_cap, cuts);
        }
    }
    merge_near_cusps(piece, cuts);
    cut_by_weight(&piece.weight, (0.0, 1.0), cuts);
    let remedies: Vec<Remedy> = remedies.collect();
    let remedy_cut = |remedy: &Remedy| Cut {
        t: remedy.t,
        end: End { reach: remedy.reach, stops: remedy.stops, ..End::default() },
    };
    cuts.extend(remedies.iter().filter(|remedy| remedy.reach == 0.0).map(remedy_cut));
    let Cusps { cusps, nearly } = cusps(piece, moving);
    for Nearly { t, reach } in nearly {
        let reach = AROUND * reach.max(SAME_TURN);
        let at_cusp = cusps.iter().any(|cusp| (t - cusp.t).abs() <= AROUND * cusp.reach + reach);
        if !at_cusp && !cuts.iter().any(|cut| (t - cut.t).abs() <= reach) {
            cuts.push(Cut::plain(t));
        }
    }
    for cusp in cusps {
        // The axes turn here or nowhere near.
        let mut all = Cut {
            t: cusp.t,
            end: End { turns: moving, order: cusp.order, reach: cusp.reach.max(SAME_TURN), stops: false },
        };
        let near = |t: f64| (t - cusp.t).abs() <= 4.0 * all.end.reach;
        let is_end = |t: f64| t == 0.0 || t == 1.0;
        all.end.stops = cuts.iter().any(|cut| near(cut.t) && cut.end.stops);
        all.t = [0.0, 1.0].into_iter().find(|&t| near(t)).unwrap_or(cusp.t);
        cuts.retain(|cut| !near(cut.t) || is_end(cut.t));
        cuts.push(all);
    }
    for remedy in remedies.iter().filter(|remedy| remedy.reach > 0.0) {
        let mut all = remedy_cut(remedy);
        cuts.retain(|cut| {
            let near = (cut.t - remedy.t).abs() <= remedy.reach;
            if near {
                all.join(cut);
                all.t = if cut.t == 0.0 || cut.t == 1.0 { cut.t } else { all.t };
            }
            !near
        });
        cuts.push(all);
    }
    if !cuts.is_sorted_by(|a, b| a.t <= b.t) {
        cuts.sort_by(|a, b| a.t.total_cmp(&b.t));
    }
    cuts.dedup_by(|b, a| {
        let both_turn = a.is_turn_or_end() && b.is_turn_or_end();
        let same = b.t - a.t <= if both_turn { SAME_TURN } else { SAME_CUT };
        if same {
            a.join(b);
        }
        same
    });
    if let Some(last) = cuts.last_mut() {
        last.t = 1.0;
    }
    let mut lines = lines.iter().peekable();
    for pair in cuts.windows(2) {
        let (from, to) = (pair[0].t, pair[1].t);
        while lines.peek().is_some_and(|line| line.to <= 0.5 * (from + to)) {
            lines.next();
        }
        let Some(line) = lines.peek() else { break };
        let middle = 0.5 * (from + to);
        let g: [f64; M] = std::array::from_fn(|k| piece.g[k].value(middle));
        out.push(Part {
            from,
            to,
            cap: lowest_cap(&g, piece.speed.value(middle), axes, line, (from, to), fast),
            left: pair[0].end,
            right: pair[1].end,
            negative: (0..M).fold(0, |bits, k| bits | u8::from(g[k] < 0.0) << k),
            moving,
        });
    }
}

/// Near a cusp the axes turn within what rounding can tell apart: there they turn at once, and no velocity cap counts,
/// for the tool hardly moves.
fn merge_near_cusps<const M: usize, const C: usize>(piece: &Piece<M, C>, cuts: &mut Vec<Cut>) {
    let (slowest, fastest) = piece.speed.range();
    if cuts.len() == 2 || slowest > SLOW * fastest {
        return;
    }
    let mut turns: Vec<Cut> = cuts.iter().copied().filter(Cut::is_turn_or_end).collect();
    turns.sort_by(|a, b| a.t.total_cmp(&b.t));
    turns.dedup_by(|b, a| {
        let same = b.t - a.t <= SAME_TURN;
        if same {
            a.join(b);
            // The ends of the piece stay where they are.
            a.t = if b.t == 1.0 { 1.0 } else { a.t };
        }
        same
    });
    let slow = |t: f64| piece.speed.value(t) <= SLOW * fastest;
    let near = |t: f64| turns.iter().any(|turn| (t - turn.t).abs() <= NEAR_CUSP && slow(turn.t));
    cuts.retain(|cut| !cut.is_turn_or_end() && !near(cut.t));
    cuts.extend(turns);
}

/// Halves until no weight is much greater than those at the ends, from which integrals are computed.
fn cut_by_weight<const C: usize>(weight: &Polynomial<C>, (from, to): (f64, f64), cuts: &mut Vec<Cut>) {
    if weight.range().1 <= UNEVEN * weight.first().min(weight.last()) {
        return;
    }
    let middle = 0.5 * (from + to);
    cuts.push(Cut::plain(middle));
    let (left, right) = weight.split(0.5);
    cut_by_weight(&left, (from, middle), cuts);
    cut_by_weight(&right, (middle, to), cuts);
}

/// Cuts the places where the caps cross on a line; says which axes can be faster than their limits.
fn cut_by_cap<const M: usize, const C: usize>(
    piece: &Piece<M, C>,
    axes: &Axes<M>,
    line: &SpeedLine,
    can_cap: u8,
    cuts: &mut Vec<Cut>,
) -> u8 {
    let mut fast = 0u8;
    let mut cut = |t: f64| cuts.push(Cut::plain(line.from + t * (line.to - line.from)));
    let whole = line.from == 0.0 && line.to == 1.0;
    let on_line = |p: &Polynomial<C>| if whole { *p } else { p.part(line.from, line.to) };
    let speed = on_line(&piece.speed);
    let [f0, f1] = line.speed_sq;
    // The tool is never faster than all of its axes at their limits.
    let binds = !piece.own_speed || f0.min(f1) < axes.velocity_sq.iter().sum();
    let bound =
        if f0 == f1 { Polynomial::constant(f0) } else { Polynomial::from_bernstein([f0, f1].into_iter()) };
    for k in (0..M).filter(|&k| can_cap >> k & 1 == 1 && axes.velocity_sq[k] < f64::MAX) {
        if binds && f0.is_finite() && f1.is_finite() {
            let square = on_line(&piece.g[k].multiply(&piece.g[k]));
            let excess = square.multiply(&bound).combine(1.0, &speed, -axes.velocity_sq[k]);
            if excess.coefficients().iter().all(|&value| value <= 0.0) {
                continue;
            }
            crossings(&excess, &mut cut);
        }
        fast |= 1 << k;
    }
    for j in (0..M).filter(|&j| fast >> j & 1 == 1) {
        for k in (j + 1..M).filter(|&k| fast >> k & 1 == 1) {
            let (v_j, v_k) = (axes.velocity_sq[j].sqrt(), axes.velocity_sq[k].sqrt());
            for sign in [1.0, -1.0] {
                crossings(&on_line(&piece.g[k].combine(v_j, &piece.g[j], sign * v_k)), &mut cut);
            }
        }
    }
    fast
}

impl Part {
    /// Whether the plan stops at its left end.
    pub fn starts_at_rest(&self) -> bool {
        self.left.stops
    }

    /// Another cut of the part at x where a pass found no way: in the middle where it has one near x. The ends of a
    /// part as short as rounding become one.
    pub fn remedy(&self, piece: usize, x: f64) -> Remedy {
        let length = self.to - self.from;
        let narrow = length <= NARROW;
        let inside = AT_END < x && x < 1.0 - AT_END && !narrow;
        let t = self.from + length * if inside { x } else { 0.5 };
        Remedy { piece, t, reach: if narrow { length } else { 0.0 }, stops: false }
    }

    /// The part as travelled forward.
    pub fn sub_piece<const M: usize, const C: usize>(&self, piece: &Piece<M, C>) -> SubPiece<M, C> {
        let length = self.to - self.from;
        let mut whole = length == 1.0;
        let g: [Polynomial<C>; M] = std::array::from_fn(|k| {
            if self.moving >> k & 1 == 0 {
                return Polynomial::constant(0.0).elevate(piece.g[k].degree());
            }
            let sign = if self.negative >> k & 1 == 1 { -length } else { length };
            let mut g = piece.g[k].part(self.from, self.to).scale(sign);
            let degree = g.degree();
            if !self.left.is_cut_for(k) && !self.right.is_cut_for(k) {
                return g;
            }
            for (end, at_end) in [(&self.left, false), (&self.right, true)] {
                if !end.is_cut_for(k) {
                    continue;
                }
                let turns = end.turns >> k & 1 == 1;
                let (low, high) = piece.g[k].range();
                let noise = length * piece.noise[k].max(SAME_TURN * degree as f64 * high.max(-low));
                let known = usize::from(end.order).max(usize::from(turns));
                let reach = (end.reach / length).min(1.0);
                for i in 0..=degree {
                    let place = if at_end { degree - i } else { i };
                    // An axis that rounding, or a turn taken for another one, sends back stands still.
                    let back = -g.coefficients()[place] * reach.powi(i as i32);
                    if i >= known && !(turns && back > 0.0 && back <= 64.0 * noise) {
                        break;
                    }
                    g.clear(place);
                    whole = false;
                }
            }
            g
        });
        // Next to a cusp |C'|² is lost in the rounding of that of the whole piece.
        let speed = if piece.own_speed && !whole {
            Polynomial::sum_of_squares(&g)
        } else {
            piece.speed.part(self.from, self.to).scale(length * length)
        };
        SubPiece {
            cusp_orders: [false, true].map(|at_end| cusp_order(&g, at_end)),
            g,
            weight: piece.weight.part(self.from, self.to),
            speed,
            cap: self.cap,
            moving: self.moving,
            degree: piece.degree,
            straight: piece.straight,
            own_speed: piece.own_speed,
        }
    }
}

impl<const M: usize, const C: usize> SubPiece<M, C> {
    /// The order of the zero that every tangent has at an end.
    #[inline(always)]
    pub fn cusp_order(&self, at_end: bool) -> usize {
        usize::from(self.cusp_orders[usize::from(at_end)])
    }

    /// The speed squared of the axes over π at an end.
    pub fn rate_sq(&self, at_end: bool) -> f64 {
        let end = |p: &Polynomial<C>| if at_end { p.last() } else { p.first() };
        if self.own_speed {
            end(&self.speed)
        } else {
            self.g.iter().map(|g| end(g) * end(g)).sum()
        }
    }

    /// The tool's speed squared over that of the axes at an end, also in the limit where both are at rest.
    pub fn tip_share(&self, at_end: bool) -> f64 {
        if self.own_speed {
            return 1.0;
        }
        let lead = |p: &Polynomial<C>, r: usize| {
            let c = p.coefficients();
            c.get(if at_end { c.len().wrapping_sub(1 + r) } else { r }).copied().unwrap_or(0.0)
        };
        let order = self.cusp_order(at_end);
        let axes: f64 = self.g.iter().map(|g| lead(g, order).powi(2)).sum();
        (lead(&self.speed, 2 * order) / axes).max(0.0)
    }

    /// The same as the backward pass travels it.
    pub fn reversed(&self) -> Self {
        let cap = match self.cap {
            Cap::Speed([f0, f1]) => Cap::Speed([f1, f0]),
            cap => cap,
        };
        Self {
            g: std::array::from_fn(|k| self.g[k].reverse()),
            weight: self.weight.reverse(),
            speed: self.speed.reverse(),
            cap,
            cusp_orders: [self.cusp_orders[1], self.cusp_orders[0]],
            ..*self
        }
    }
}

/// The order of the zero that all of these have at an end.
fn cusp_order<const M: usize, const C: usize>(g: &[Polynomial<C>; M], at_end: bool) -> u8 {
    let degree = g[0].degree();
    let rests = |r: usize| g.iter().all(|g| g.coefficients()[if at_end { degree - r } else { r }] == 0.0);
    (0..degree).take_while(|&r| rests(r)).count() as u8
}

/// Where a polynomial changes its sign by more than rounding: between two places that rounding alone keeps apart, as
/// next to a double root, it does not.
fn crossings<const C: usize>(p: &Polynomial<C>, cut: &mut impl FnMut(f64)) {
    let mut places: Vec<f64> = vec![];
    p.sign_changes(&mut |t| {
        if let Some(&last) = places.last() {
            let middle = 0.5 * (last + t);
            if p.value(middle).abs() <= NOISE * p.magnitude().value(middle) {
                places.pop();
                return;
            }
        }
        places.push(t);
    });
    places.into_iter().for_each(cut);
}

/// The lowest cap in the middle of a part, where it is so everywhere; g and D are those of the middle.
fn lowest_cap<const M: usize>(
    g: &[f64; M],
    speed: f64,
    axes: &Axes<M>,
    line: &SpeedLine,
    (from, to): (f64, f64),
    fast: u8,
) -> Cap {
    let [f0, f1] = line.speed_sq;
    let at = |t: f64| if f0 == f1 { f0 } else { f0 + (f1 - f0) * ((t - line.from) / (line.to - line.from)) };
    let ends = [at(from), at(to)];
    let mut lowest = 0.5 * (ends[0] + ends[1]) / speed;
    let mut cap = Cap::Speed(ends);
    for k in (0..M).filter(|&k| fast >> k & 1 == 1) {
        if g[k] * g[k] * lowest > axes.velocity_sq[k] {
            lowest = axes.velocity_sq[k] / (g[k] * g[k]);
            cap = Cap::Axis(k, axes.velocity_sq[k]);
        }
    }
    cap
}
