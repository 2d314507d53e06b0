//! Cuts a piece into parts: where an axis turns, at and next to cusps, where another cap becomes the lowest, at the
//! ends of the chord-error lines, where weights are uneven, and at remedies.

use super::cusp::{cusps, Cusps, NearCusp};
use super::part::{Axes, Cap, End, Part, Remedy};
use super::piece::Piece;
use crate::bang_bang::speed_line::SpeedLine;
use crate::bang_bang::tolerance::{NEAR_CUSP, SAME_CUT, SAME_TURN, SLOW_SQ, ZERO};
use crate::problem::ChordLimit;
use crate::problem::{greater, TIP_AXES};
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// Greatest ratio of a weight inside a part to the weights at its ends.
const UNEVEN: f64 = 100.0;
/// A near cusp needs no cut of its own if there is a cut, or a cusp, within this many times its reach.
const AROUND: f64 = 4.0;

/// What limits the speed on a piece.
pub struct Limits<'a, const M: usize> {
    pub axes: &'a Axes<M>,
    pub feed_sq: f64,
    pub chord: Option<&'a ChordLimit>,
}

/// A cut between two parts.
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

    fn turn(t: f64, turns: AxisBits) -> Self {
        Self { t, end: End { turns, reach: SAME_TURN, ..End::default() } }
    }

    /// Adds the turns, order, reach and stop of another cut at the same t.
    fn join(&mut self, other: &Self) {
        self.end.turns |= other.end.turns;
        self.end.order = self.end.order.max(other.end.order);
        self.end.reach = self.end.reach.max(other.end.reach);
        self.end.stops |= other.end.stops;
    }
}

impl From<&Remedy> for Cut {
    fn from(remedy: &Remedy) -> Self {
        Self { t: remedy.t, end: End { reach: remedy.reach, stops: remedy.stops, ..End::default() } }
    }
}

/// Appends the parts of the piece from left to right. `tip` is the tip's own piece, where the axes are joints; `cuts` is working
/// memory.
pub fn split<const M: usize, const C: usize>(
    piece: &Piece<M, C>,
    tip: Option<&Piece<TIP_AXES, C>>,
    limits: &Limits<M>,
    remedies: impl Iterator<Item = Remedy>,
    cuts: &mut Vec<Cut>,
    out: &mut Vec<Part>,
) {
    let Limits { axes, feed_sq, chord } = *limits;
    cuts.clear();
    cuts.extend([Cut::plain(0.0), Cut::plain(1.0)]);
    let moving = cut_at_turns(piece, cuts);
    let feed = piece.feed_rate().map(|rate| (rate, feed_sq));
    let most_sq = if feed.is_some() { f64::INFINITY } else { feed_sq };
    let (whole, mut below_chord) = ([SpeedLine { from: 0.0, to: 1.0, speed_sq: [most_sq; 2] }], vec![]);
    match (chord, tip) {
        (Some(chord), Some(tip)) => chord.lines(tip, most_sq, &mut below_chord),
        (Some(chord), None) if piece.own_speed => chord.lines(piece, most_sq, &mut below_chord),
        _ => {}
    }
    let lines = if below_chord.is_empty() { &whole } else { below_chord.as_slice() };
    // Where the axes are those of the tool, no axis is faster than the tool.
    let can_cap = (0..M).fold(0, |bits, k| {
        let slow = piece.own_speed && axes.velocities_sq(k).all(|v_sq| v_sq >= most_sq);
        bits | AxisBits::from(!slow && moving >> k & 1 == 1) << k
    });
    let mut fast = 0;
    for line in lines {
        if line.from > 0.0 {
            cuts.push(Cut::plain(line.from));
        }
        if can_cap != 0 {
            fast |= cut_by_cap(piece, axes, feed.as_ref(), line, can_cap, cuts);
        }
    }
    merge_near_cusps(piece, cuts);
    cut_by_weight(&piece.weight, (0.0, 1.0), cuts);
    let remedies: Vec<Remedy> = remedies.collect();
    cuts.extend(remedies.iter().filter(|remedy| remedy.reach == 0.0).map(Cut::from));
    cut_at_cusps(piece, moving, cuts);
    for remedy in remedies.iter().filter(|remedy| remedy.reach > 0.0) {
        join_around(remedy, cuts);
    }
    put_in_order(cuts);
    let mut lines = lines.iter().peekable();
    for pair in cuts.windows(2) {
        let (from, to) = (pair[0].t, pair[1].t);
        while lines.peek().is_some_and(|line| line.to <= 0.5 * (from + to)) {
            lines.next();
        }
        let Some(line) = lines.peek() else { break };
        let middle = 0.5 * (from + to);
        let g: [f64; M] = std::array::from_fn(|k| piece.g[k].value(middle));
        let feed = feed.as_ref().map(|(rate, feed_sq)| (rate.value(middle), *feed_sq));
        out.push(Part {
            from,
            to,
            cap: lowest_cap(&g, piece.speed.value(middle), axes, feed, line, (from, to), fast),
            left: pair[0].end,
            right: pair[1].end,
            negative: (0..M).fold(0, |bits, k| bits | AxisBits::from(g[k] < 0.0) << k),
            moving,
        });
    }
}

/// Cuts at the turns; returns the axes that move.
fn cut_at_turns<const M: usize, const C: usize>(piece: &Piece<M, C>, cuts: &mut Vec<Cut>) -> AxisBits {
    let size = piece.g.each_ref().map(|g| g.padded().iter().fold(0.0, |most: f64, c| most.max(c.abs())));
    let greatest = size.iter().copied().fold(0.0, f64::max);
    let mut moving = 0;
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
    moving
}

/// Cuts at the cusps and near cusps. The cut at a cusp, where all axes turn, replaces all other cuts around it.
fn cut_at_cusps<const M: usize, const C: usize>(piece: &Piece<M, C>, moving: AxisBits, cuts: &mut Vec<Cut>) {
    let Cusps { cusps, near_cusps } = cusps(piece, moving);
    for NearCusp { t, reach } in near_cusps {
        let reach = AROUND * reach.max(SAME_TURN);
        let at_cusp = cusps.iter().any(|cusp| (t - cusp.t).abs() <= AROUND * cusp.reach + reach);
        if !at_cusp && !cuts.iter().any(|cut| (t - cut.t).abs() <= reach) {
            cuts.push(Cut::plain(t));
        }
    }
    for cusp in cusps {
        let mut all = Cut {
            t: cusp.t,
            end: End { turns: moving, order: cusp.order, reach: cusp.reach.max(SAME_TURN), stops: false },
        };
        let near = |t: f64| (t - cusp.t).abs() <= AROUND * all.end.reach;
        let is_end = |t: f64| t == 0.0 || t == 1.0;
        all.end.stops = cuts.iter().any(|cut| near(cut.t) && cut.end.stops);
        all.t = [0.0, 1.0].into_iter().find(|&t| near(t)).unwrap_or(cusp.t);
        cuts.retain(|cut| !near(cut.t) || is_end(cut.t));
        cuts.push(all);
    }
}

/// Joins all cuts within the remedy's reach into one.
fn join_around(remedy: &Remedy, cuts: &mut Vec<Cut>) {
    let mut all = Cut::from(remedy);
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

/// Sorts the cuts and joins equal ones.
fn put_in_order(cuts: &mut Vec<Cut>) {
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
}

/// Next to a cusp rounding hides the order of the turns: they become one. Velocity caps are ignored there, since the
/// tool hardly moves.
fn merge_near_cusps<const M: usize, const C: usize>(piece: &Piece<M, C>, cuts: &mut Vec<Cut>) {
    let (slowest, fastest) = piece.speed.range();
    if cuts.len() == 2 || slowest > SLOW_SQ * fastest {
        return;
    }
    let mut turns: Vec<Cut> = cuts.iter().copied().filter(Cut::is_turn_or_end).collect();
    turns.sort_by(|a, b| a.t.total_cmp(&b.t));
    turns.dedup_by(|b, a| {
        let same = b.t - a.t <= SAME_TURN;
        if same {
            a.join(b);
            // The ends of the piece stay.
            a.t = if b.t == 1.0 { 1.0 } else { a.t };
        }
        same
    });
    let slow = |t: f64| piece.speed.value(t) <= SLOW_SQ * fastest;
    let near = |t: f64| turns.iter().any(|turn| (t - turn.t).abs() <= NEAR_CUSP && slow(turn.t));
    cuts.retain(|cut| !cut.is_turn_or_end() && !near(cut.t));
    cuts.extend(turns);
}

/// Halves the interval until no weight exceeds the weights at its ends by more than a factor of `UNEVEN`: integrals are computed
/// from the weights at the ends.
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

/// Cuts where two caps cross on the interval of a speed line; returns the axes that can be faster than their limits.
fn cut_by_cap<const M: usize, const C: usize>(
    piece: &Piece<M, C>,
    axes: &Axes<M>,
    feed: Option<&(Polynomial<C>, f64)>,
    line: &SpeedLine,
    can_cap: AxisBits,
    cuts: &mut Vec<Cut>,
) -> AxisBits {
    let mut fast = 0;
    let mut cut = |t: f64| cuts.push(Cut::plain(line.from + t * (line.to - line.from)));
    let whole = line.from == 0.0 && line.to == 1.0;
    let on_line = |p: &Polynomial<C>| if whole { *p } else { p.part(line.from, line.to) };
    let speed = on_line(&piece.speed);
    let [f0, f1] = line.speed_sq;
    // The speed line does not matter where it is above the speed of the tool with all axes at their velocity limits.
    let binds = !piece.own_speed || f0.min(f1) < greater(&axes.velocity_sq).iter().sum();
    let speed_sq =
        if f0 == f1 { Polynomial::constant(f0) } else { Polynomial::from_bernstein([f0, f1].into_iter()) };
    let finite = f0.is_finite() && f1.is_finite();
    let feed = feed.map(|(rate, feed_sq)| (on_line(rate), *feed_sq));
    // Cuts for the velocity limits of both directions; `lowest_cap` uses the limit of the direction in which the axis moves.
    for k in (0..M).filter(|&k| can_cap >> k & 1 == 1) {
        for v_sq in axes.velocities_sq(k).filter(|&v_sq| v_sq < f64::MAX) {
            let square = || on_line(&piece.g[k].multiply(&piece.g[k]));
            let mut excesses = [None, None];
            if binds && finite {
                excesses[0] = Some(square().multiply(&speed_sq).combine(1.0, &speed, -v_sq));
            }
            if let Some((rate, feed_sq)) = &feed {
                excesses[1] = Some(square().combine(*feed_sq, rate, -v_sq));
            }
            let is_slow = |excess: &Polynomial<C>| excess.coefficients().iter().all(|&value| value <= 0.0);
            if excesses.iter().flatten().any(is_slow) {
                continue;
            }
            excesses.iter().flatten().for_each(|excess| crossings(excess, &mut cut));
            fast |= 1 << k;
        }
    }
    if let Some((rate, feed_sq)) = feed.filter(|_| finite) {
        crossings(&rate.multiply(&speed_sq).combine(1.0, &speed, -feed_sq), &mut cut);
    }
    for j in (0..M).filter(|&j| fast >> j & 1 == 1) {
        for k in (j + 1..M).filter(|&k| fast >> k & 1 == 1) {
            for v_j in axes.velocities_sq(j).map(f64::sqrt) {
                for v_k in axes.velocities_sq(k).map(f64::sqrt) {
                    for sign in [1.0, -1.0] {
                        crossings(&on_line(&piece.g[k].combine(v_j, &piece.g[j], sign * v_k)), &mut cut);
                    }
                }
            }
        }
    }
    fast
}

/// Calls `cut` at the zeros where a polynomial changes its sign by more than rounding. Rounding may turn a double root into two
/// zeros, between which the polynomial is 0 within rounding: these are left out.
fn crossings<const C: usize>(p: &Polynomial<C>, cut: &mut impl FnMut(f64)) {
    let mut roots: Vec<f64> = vec![];
    p.sign_changes(&mut |t| {
        if let Some(&last) = roots.last() {
            let middle = 0.5 * (last + t);
            if p.value(middle).abs() <= ZERO * p.magnitude().value(middle) {
                roots.pop();
                return;
            }
        }
        roots.push(t);
    });
    roots.into_iter().for_each(cut);
}

/// The lowest cap of a part, from g and D in its middle.
fn lowest_cap<const M: usize>(
    g: &[f64; M],
    speed: f64,
    axes: &Axes<M>,
    feed: Option<(f64, f64)>,
    line: &SpeedLine,
    (from, to): (f64, f64),
    fast: AxisBits,
) -> Cap {
    let ends = [line.at(from), line.at(to)];
    let mut lowest = 0.5 * (ends[0] + ends[1]) / speed;
    let mut cap = Cap::Speed(ends);
    if let Some((rate, feed_sq)) = feed.filter(|(rate, feed_sq)| rate * lowest > *feed_sq) {
        (lowest, cap) = (feed_sq / rate, Cap::Feed(feed_sq));
    }
    for k in (0..M).filter(|&k| fast >> k & 1 == 1) {
        let v_sq = axes.velocity_sq[usize::from(g[k] < 0.0)][k];
        if g[k] * g[k] * lowest > v_sq {
            lowest = v_sq / (g[k] * g[k]);
            cap = Cap::Axis(k, v_sq);
        }
    }
    cap
}
