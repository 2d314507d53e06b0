//! Finds, for eight phases at once in SIMD vectors, those that cannot raise the greatest use of any limit found so far, and their
//! times; only the others need the closer look of `by_length`.
//!
//! The phases may be on several pieces. Each is evaluated at eight places, the nodes of Lobatto's rule (Abramowitz and Stegun
//! 25.4.32), which include both ends. The polynomial through |C'| at these places gives the lengths up to all of them; v² as a
//! cubic of the length gives speed, acceleration and jerk along the path; with the derivatives of C these give those of all axes.
//! A phase cannot raise a use if no place has a greater one than was found before, and nothing between two places can have: that
//! is shown by the bound of `bulge`, or, if this bound is small, by parabolas through two places and the polynomial half-way
//! between them. If the bound is too large for that, both halves of the phase are evaluated instead. If a place has a greater
//! use, the phase needs the closer look.

use fearless_simd::{f64x8, mask64x8, Select, Simd, SimdBase, SimdFloat, SimdMask};

use crate::bulge::{bulge, Bulge, Known};
use crate::chord::chord_error;
use crate::columns::{Columns, RATES};
use crate::number::{in_wide_vectors, Lanes, Number};
use crate::speed_by_length::{cubic_bounds, is_same_speed, Pace, SpeedByLength};
use crate::station::{Station, STILL};
use crate::together::Together;
use crate::{Check, Limits, Sided, Tally, FEEDS};

use super::by_length::WIDE;

/// Number of phases that are evaluated at once.
pub const PHASES: usize = 8;

/// Number of places of a phase.
pub const PLACES: usize = 8;

/// The places: from −1 at the start of the phase to 1 at its end; and as parts of the phase.
const NODES: [f64; PLACES] = {
    let [a, b, c] = [0.209_299_217_902_478_88, 0.591_700_181_433_142_3, 0.871_740_148_509_606_6];
    [-1.0, -c, -b, -a, a, b, c, 1.0]
};
const SHARES: [f64; PLACES] = {
    let (mut shares, mut i) = (NODES, 0);
    while i < PLACES {
        shares[i] = 0.5 * (1.0 + NODES[i]);
        i += 1;
    }
    shares
};

/// Weights of the values at some places in integrals of a function and in its values elsewhere, by the Lagrange polynomials of
/// these places.
struct Weights {
    /// For the integrals from the start up to each place, in parts of the phase; a row for each value. The last column is
    /// Lobatto's rule, exact to degree 13.
    up_to: [[f64; PLACES]; PLACES],
    /// For the values half-way to the next place; the last column is for the value at the last place.
    between: [[f64; PLACES]; PLACES],
    /// For the integral over the first half less half of the whole integral, to which only the part of the function that is odd
    /// about the middle contributes.
    odd: [f64; PLACES],
    /// For the difference between the polynomial through all places and that through all but the last one, half-way between those
    /// two neighbouring places where it is greatest.
    last: [f64; PLACES],
}

const fn weights<const N: usize>(places: [usize; N]) -> Weights {
    let none = [[0.0; PLACES]; PLACES];
    let mut weights = Weights { up_to: none, between: none, odd: [0.0; PLACES], last: [0.0; PLACES] };
    let mut row = 0;
    while row < N {
        // Coefficients of the Lagrange polynomial by powers of the node.
        let (own, mut c, mut count) = (NODES[places[row]], [0.0; PLACES], 0);
        c[0] = 1.0;
        while count < N {
            let root = NODES[places[count]];
            if count != row {
                let (per, mut power) = (1.0 / (own - root), PLACES - 1);
                while power > 0 {
                    c[power] = (c[power - 1] - root * c[power]) * per;
                    power -= 1;
                }
                c[0] *= -root * per;
            }
            count += 1;
        }
        let (j, mut i) = (places[row], 0);
        while i < PLACES {
            let next = NODES[if i + 1 < PLACES { i + 1 } else { i }];
            let middle = 0.5 * (NODES[i] + next);
            weights.up_to[j][i] = 0.5 * (primitive(&c, NODES[i]) - primitive(&c, -1.0));
            let (mut change, mut factor) = (c[N - 1], 0);
            weights.between[j][i] = 1.0;
            while factor < N {
                let root = NODES[places[factor]];
                if factor != row {
                    weights.between[j][i] *= (middle - root) / (own - root);
                }
                if factor + 1 < N {
                    change *= middle - root;
                }
                factor += 1;
            }
            if i + 1 < PLACES && change.abs() > weights.last[j].abs() {
                weights.last[j] = change;
            }
            i += 1;
        }
        weights.odd[j] = 0.5 * (primitive(&c, 0.0) - 0.5 * (primitive(&c, -1.0) + primitive(&c, 1.0)));
        row += 1;
    }
    weights
}

/// Σ c_i x^(i + 1) / (i + 1).
const fn primitive(c: &[f64; PLACES], x: f64) -> f64 {
    let (mut sum, mut i) = (0.0, PLACES);
    while i > 0 {
        i -= 1;
        sum = (sum + c[i] / (i + 1) as f64) * x;
    }
    sum
}

const ALL: Weights = weights([0, 1, 2, 3, 4, 5, 6, 7]);

/// Weights without the middle pair, exact to degree 5, and of the first and the third pair alone, exact to degree 3.
const LOWER: Weights = weights([0, 1, 2, 5, 6, 7]);
const LOWEST: Weights = weights([0, 2, 5, 7]);

/// The other rules can agree by chance, so the difference of the lowest one counts as well, times this. An integral is accepted
/// if no difference is more than `RULES_AGREE` of it.
const CHANCE: f64 = 3e-3;
const RULES_AGREE: f64 = 3e-8;

/// The polynomial through all places is nowhere greater than this times the greatest absolute value at a place.
const GREATEST: f64 = 2.0;

/// The longest interval between two places, in parts of the phase.
const LONGEST: f64 = SHARES[4] - SHARES[3];

/// Next to rest, where v² at one end is below this part of that at the other one, v² by the length has too few correct digits.
const SLOW_SQ: f64 = 1e-4;

/// For joints no bound of what lies between the places is known. So a part of a phase covers at most this share of its piece,
/// divided by `Curve::turns`: then its places are as close to each other as those of `by_length`.
const MOST_TURNED: f64 = 7.0 / 3.0;

/// A part of a phase is halved at most this many times: its eight places cost as much as about five places of `by_length`.
const MOST_HALVINGS: u32 = 4;

/// A phase whose v² is a cubic polynomial of the length: u, p in mm²/s² and the acceleration along the path at both ends. If
/// v² is constant, `held_sq` is its value, and p is another record of it.
#[derive(Clone, Copy)]
pub struct Phase {
    /// Index of its piece in `Looks::pieces`.
    pub piece: usize,
    pub u: [f64; 2],
    pub p: [f64; 2],
    pub a: [f64; 2],
    pub held_sq: Option<f64>,
}

/// A part of the phase `number` of `Looks::phases`. Numbers that are not known are NaN.
#[derive(Clone, Copy)]
struct Part {
    number: usize,
    u: [f64; 2],
    /// The lengths from the start of the phase up to both ends of the part.
    ends: [f64; 2],
    /// v² at both ends of the phase, and the length of the phase.
    speed_sq: [f64; 2],
    whole: f64,
    halvings: u32,
}

/// Verdicts on a part: it cannot raise any use; that is open, and its halves may show it; it needs a closer look.
const NOTHING: f64 = 0.0;
const OPEN: f64 = 1.0;
const MORE: f64 = 2.0;

/// The verdict on each part, with its time, its length, and v² at both ends and the length of its phase; NaN where a number is
/// not known.
struct Found {
    verdict: Lanes,
    time: Lanes,
    length: Lanes,
    speed_sq: [Lanes; 2],
    whole: Lanes,
}

/// A polynomial piece, with its feeds and bounds.
pub struct OnPiece<'a, const M: usize> {
    on: Together<'a, M>,
    feeds: [f64; FEEDS],
    feeds_along: [bool; FEEDS],
    /// See `Curve::bounds`.
    bounds: [f64; 4],
    moves: [f64; M],
}

/// Consecutive phases, without those that cannot be evaluated at once, and the times of those that cannot raise any use.
pub struct Looks<'a, const M: usize> {
    pub pieces: Vec<OnPiece<'a, M>>,
    pub phases: Vec<Option<Phase>>,
    pub times: Vec<Option<f64>>,
    /// Parts of phases that have not been evaluated yet.
    open: Vec<Part>,
    /// The places of eight parts; if there are fewer, the results of the other lanes are ignored.
    stations: Box<[Station<M, Lanes>; PHASES]>,
    /// Ends of phases that need a closer look, and those where two pieces meet, each with its piece.
    pub ends: Vec<(usize, f64)>,
    /// See `Columns::room`.
    pub room: Vec<Lanes>,
}

/// Compares phases with the limits.
pub struct Judge<'a, const M: usize> {
    /// See `Columns`.
    pub rates: &'a [[Sided<M>; 2]; 3],
    pub per_least: &'a [[f64; M]; 3],
    pub limits: &'a Limits<M>,
}

impl<'a, const M: usize> OnPiece<'a, M> {
    /// None for a rational piece, and on processors with narrow vectors.
    pub fn new(piece: usize, columns: &mut Columns<'a, M>) -> Option<Self> {
        let on = columns.together(piece)?;
        let (feeds, feeds_along) = (columns.feeds(piece), columns.feeds_along(piece));
        let (bounds, moves) = (on.curve.bounds(), on.curve.derivative_size());
        Some(Self { on, feeds, feeds_along, bounds, moves })
    }

    pub fn width(&self) -> f64 {
        self.on.curve.width()
    }

    /// Width in u of the widest part of a phase that is evaluated; infinite for axes.
    fn widest(&self) -> f64 {
        match self.on.joints {
            Some(_) => MOST_TURNED / self.on.curve.turns() as f64 * self.width(),
            None => f64::INFINITY,
        }
    }

    /// Derivatives of the length by u, at several u.
    fn speeds<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        self.on.curve.speeds(u, &self.on.scale.unwrap_or([1.0; M]))
    }

    /// The length between two parameters; None if the rules still differ after `halvings` halvings.
    fn length(&self, [from, to]: [f64; 2], halvings: u32) -> Option<f64> {
        let width = to - from;
        let (length, doubts) = integral(&self.speeds(SHARES.map(|share| from + share * width)));
        if doubts.iter().all(|&doubt| doubt <= RULES_AGREE * length) {
            return Some(length * width);
        }
        let (middle, halvings) = (0.5 * (from + to), halvings.checked_sub(1)?);
        Some(self.length([from, middle], halvings)? + self.length([middle, to], halvings)?)
    }

    /// Adds both halves of a part to `open`, with what its own evaluation has found, if there was one. None if it has been halved
    /// too often, or if its length or its speed is not known.
    fn halve(
        &self,
        (part, phase): (&Part, &Phase),
        found: Option<(&Found, usize)>,
        open: &mut Vec<Part>,
    ) -> Option<()> {
        let halvings = part.halvings.checked_sub(1)?;
        let known = |x: f64| Some(x).filter(|x| !x.is_nan());
        let length = found.and_then(|(found, i)| known(found.length[i]));
        let length = length.or_else(|| self.length(part.u, MOST_HALVINGS))?;
        let [start, end] = part.ends(length);
        let of_phase =
            found.and_then(|(found, i)| Some((found.speed_sq.map(|lanes| lanes[i]), known(found.whole[i])?)));
        let (speed_sq, whole) = match of_phase {
            Some(known) => known,
            None if !part.whole.is_nan() => (part.speed_sq, part.whole),
            None => (phase.speed_sq(self.speeds(part.u).map(|slope| slope * slope))?, length),
        };
        let middle = 0.5 * (part.u[0] + part.u[1]);
        let half = |u, ends| Part { u, ends, speed_sq, whole, halvings, ..*part };
        open.push(half([middle, part.u[1]], [f64::NAN, end]));
        open.push(half([part.u[0], middle], [start, f64::NAN]));
        Some(())
    }
}

impl<const M: usize> Looks<'_, M> {
    /// Without any phase.
    pub fn new(room: Vec<Lanes>) -> Self {
        let (number, vector) = ([f64::NAN; PLACES], [[f64::NAN; PLACES]; M]);
        let [u, slope, tip, curvature] = [number; 4];
        let none = Station { u, slope, first: vector, second: vector, third: vector, tip, curvature };
        let stations = Box::new([none; PHASES]);
        Self { pieces: vec![], phases: vec![], times: vec![], open: vec![], stations, ends: vec![], room }
    }
}

impl<const M: usize> Judge<'_, M> {
    /// Finds the times of those phases that cannot raise any use in the tally; the others get None.
    pub fn look_at(&self, looks: &mut Looks<M>, tally: &Tally<M>) {
        let Looks { pieces, phases, times, open, stations, room, .. } = looks;
        times.clear();
        times.extend(phases.iter().map(|phase| phase.map(|_| 0.0)));
        open.clear();
        for (number, phase) in phases.iter().enumerate() {
            let (ends, speed_sq, whole) = ([0.0, f64::NAN], [f64::NAN; 2], f64::NAN);
            open.extend(phase.map(|Phase { u, .. }| Part {
                number,
                u,
                ends,
                speed_sq,
                whole,
                halvings: MOST_HALVINGS,
            }));
        }
        let Some((&any, Some(phase))) = open.last().map(|part| (part, &phases[part.number])) else { return };
        let (mut parts, mut lanes, mut on) = ([any; PHASES], [phase; PHASES], [&pieces[phase.piece]; PHASES]);
        loop {
            // Halves of open parts come first, then other phases.
            let mut count = 0;
            while let Some(part) = if count < PHASES { open.pop() } else { None } {
                if let (Some(_), Some(phase)) = (times[part.number], &phases[part.number]) {
                    let piece = &pieces[phase.piece];
                    if part.u[1] - part.u[0] > piece.widest() {
                        let halves = piece.halve((&part, phase), None, open);
                        times[part.number] = times[part.number].filter(|_| halves.is_some());
                        continue;
                    }
                    let width = part.u[1] - part.u[0];
                    let u = SHARES.map(|share| part.u[0] + width * share);
                    piece.on.stations(&u, room, &mut stations[count]);
                    (parts[count], lanes[count], on[count], count) = (part, phase, piece, count + 1);
                }
            }
            if count == 0 {
                return;
            }
            let found = in_wide_vectors!(simd => self.look(simd, (&parts, &lanes, &on), stations, tally));
            for (i, (part, phase)) in parts.iter().zip(lanes).enumerate().take(count) {
                let sum = times[part.number];
                times[part.number] = if found.verdict[i] == NOTHING {
                    sum.zip(part.time(phase, &found, i)).map(|(sum, time)| sum + time)
                } else if found.verdict[i] == OPEN {
                    sum.filter(|_| on[i].halve((part, phase), Some((&found, i)), open).is_some())
                } else {
                    None
                };
            }
        }
    }

    /// Evaluates eight parts of phases, and compares them with the limits.
    #[inline(always)]
    fn look<S: Simd>(
        &self,
        simd: S,
        (parts, phases, on): (&[Part; PHASES], &[&Phase; PHASES], &[&OnPiece<M>; PHASES]),
        stations: &[Station<M, Lanes>; PHASES],
        tally: &Tally<M>,
    ) -> Found {
        let all = |x: f64| f64x8::splat(simd, x);
        let (nothing, are_axes) = (all(0.0), on[0].on.joints.is_none());
        let width = of_each(simd, parts, |part| part.u[1]) - of_each(simd, parts, |part| part.u[0]);
        let mut slope = [width; PLACES];
        for i in 0..PLACES {
            slope[i] = of_each(simd, stations, |at| at.slope[i]);
        }
        let slopes = [joined(&slope, f64x8::min), joined(&slope, f64x8::max)];
        let (share, doubts) = integral(&slope);
        let is_good = agree(share, doubts);
        let is_still = slopes[0].simd_le(of_each(simd, on, |piece| piece.on.curve.size_length()) * STILL);
        let length = share * width;
        // The motion along the path.
        let ends: [Lanes; 2] = [(slope[0] * slope[0]).into(), (slope[PLACES - 1] * slope[PLACES - 1]).into()];
        let mut speed_sq = [[f64::NAN; PHASES]; 2];
        for i in 0..PHASES {
            let of_ends = || phases[i].speed_sq([ends[0][i], ends[1][i]]).unwrap_or([f64::NAN; 2]);
            let [first, last] = if parts[i].whole.is_nan() { of_ends() } else { parts[i].speed_sq };
            (speed_sq[0][i], speed_sq[1][i]) = (first, last);
        }
        let known = of_each(simd, parts, |part| part.whole);
        let unknown = is_good.select(length, all(f64::NAN));
        let whole = known.simd_eq(known).select(known, unknown);
        let first = f64x8::from_slice(simd, &speed_sq[0]);
        let last = f64x8::from_slice(simd, &speed_sq[1]);
        let (twice, rise) = (whole + whole, last - first);
        let start_slope = of_each(simd, phases, |phase| phase.a[0]) * twice;
        let end_slope = of_each(simd, phases, |phase| phase.a[1]) * twice;
        let c = [
            first,
            start_slope,
            rise * 3.0 - start_slope * 2.0 - end_slope,
            start_slope + end_slope - rise * 2.0,
        ];
        let start = of_each(simd, parts, |part| part.ends[0]);
        let end = of_each(simd, parts, |part| part.ends[1]);
        let before = start.simd_eq(start).select(start, end - length);
        let per_whole = 1.0 / whole;
        let (per_slope, per_bend) = (per_whole * 0.5, per_whole * per_whole * 0.5);
        // Speeds, curvatures, and the rates of the axes.
        let (mut v, mut slowness, mut curvature, mut third_sq) = (slope, slope, slope, nothing);
        let mut rates = [[[width; PLACES]; M]; 3];
        let mut paces = [Pace { v: nothing, a: nothing, j: nothing }; PLACES];
        for i in 0..PLACES {
            let mut way = if i == PLACES - 1 { share } else { nothing };
            if (1..PLACES - 1).contains(&i) {
                for j in 0..PLACES {
                    way += slope[j] * ALL.up_to[j][i];
                }
            }
            let x = (before + way * width) * per_whole;
            v[i] = (c[0] + x * (c[1] + x * (c[2] + x * c[3]))).sqrt();
            let a = per_slope * (c[1] + x * (c[2] * 2.0 + x * (c[3] * 3.0)));
            let j = per_bend * v[i] * (c[2] * 2.0 + x * (c[3] * 6.0));
            paces[i] = Pace { v: v[i], a, j };
            slowness[i] = slope[i] / v[i];
            let (square, mixed, mut sum) = (v[i] * v[i], v[i] * a * 3.0, nothing);
            let cube = square * v[i];
            for k in 0..M {
                let first = of_each(simd, stations, |at| at.first[k][i]);
                let second = of_each(simd, stations, |at| at.second[k][i]);
                let third = of_each(simd, stations, |at| at.third[k][i]);
                sum += third * third;
                rates[0][k][i] = first * v[i];
                rates[1][k][i] = first * a + second * square;
                rates[2][k][i] = first * j + second * mixed + third * cube;
            }
            third_sq = third_sq.max(sum);
            v[i] *= of_each(simd, stations, |at| at.tip[i]);
            curvature[i] = of_each(simd, stations, |at| at.curvature[i]);
        }
        let (time, doubts) = integral(&slowness);
        let time = agree(time, doubts).select(time * width, all(f64::NAN));
        let most_curved = joined(&curvature, f64x8::max);
        let bulge = if are_axes {
            let mut bounds = [nothing; 4];
            for order in 0..4 {
                bounds[order] = of_each(simd, on, |piece| piece.bounds[order]);
            }
            let known = Known {
                interval: width * LONGEST,
                slopes,
                second: most_curved,
                third: third_sq.sqrt(),
                paces: cubic_bounds([&paces[0], &paces[PLACES - 1]], length),
            };
            bulge(bounds, &known)
        } else {
            Bulge::unknown(width)
        };
        let is_bounded = bulge.slope.simd_gt(nothing);
        let (nothing_more, open, more) = (all(NOTHING), all(OPEN), all(MORE));
        let is_refused = first.simd_ne(first);
        let mut verdict = is_bounded.select(nothing_more, open);
        verdict = is_refused.select(more, verdict);
        verdict = is_good.select(verdict, open);
        verdict = is_still.select(more, verdict);
        let mut find = |found: f64x8<S>| verdict = verdict.simd_eq(nothing).select(found, verdict);
        // How far a use between two places may be off the straight line between them, in parts of the limit. None for joints, for
        // which no bound is known: there the polynomial through the places decides.
        let off = |rate: f64x8<S>, per: f64x8<S>| are_axes.then(|| rate * per);
        // The limits of the axes.
        let judged = if self.limits.judges_jerk { 3 } else { 2 };
        for row in (0..judged).rev() {
            let worst = tally.ratios(RATES[row]);
            let (per, per_least) = (&self.rates[row][1], &self.per_least[row]);
            for k in 0..self.limits.axes {
                // An axis that does not move on a piece stays on the straight line.
                let moves = |piece: &&OnPiece<M>| !are_axes || piece.moves[k] > 0.0;
                if !on.iter().any(moves) {
                    continue;
                }
                let per_least = of_each(simd, on, |piece| if moves(piece) { per_least[k] } else { 0.0 });
                // No axis is faster than the tool.
                if row == 0 && are_all((bulge.most_speed * per_least).simd_le(all(worst[k]))) {
                    continue;
                }
                let (positive, negative) = (all(per.positive[k]), all(per.negative[k]));
                let use_of = |rate: f64x8<S>| rate * rate.simd_lt(nothing).select(negative, positive);
                find(verdict_of(&rates[row][k], use_of, off(bulge.rates[row], per_least), worst[k]));
            }
        }
        let worst = |check: Check| tally.get(check, 0).ratio;
        for feed in (0..FEEDS).filter(|&feed| on.iter().any(|piece| piece.feeds[feed] != f64::INFINITY)) {
            let (per, worst) = (1.0 / of_each(simd, on, |piece| piece.feeds[feed]), worst(Check::Feed));
            // The speed that a feed limits is at most that along the path.
            if are_all((bulge.most_speed * per).simd_le(all(worst))) {
                continue;
            }
            let mut speed = v;
            let is_across = of_each(simd, on, |piece| if piece.feeds_along[feed] { 0.0 } else { 1.0 });
            let is_across = is_across.simd_gt(nothing);
            for i in 0..if is_any(is_across) { PLACES } else { 0 } {
                let mut square = nothing;
                for k in 0..M {
                    let counted = rates[0][k][i] * self.limits.feed_axes[feed][k];
                    square += counted * counted;
                }
                speed[i] = is_across.select(square.sqrt(), v[i]);
            }
            find(verdict_of(&speed, |v| v * per, off(bulge.rates[0], per), worst));
        }
        if self.limits.chord_tolerance.is_finite() && !are_axes {
            let (mut error, per) = (v, 1.0 / self.limits.chord_tolerance);
            for i in 0..PLACES {
                error[i] = chord_error(v[i] * self.limits.period, curvature[i]);
            }
            find(verdict_of(&error, |error| error * per, None, worst(Check::Chord)));
        } else if self.limits.chord_tolerance.is_finite() {
            let (period, most) = (self.limits.period, all(worst(Check::Chord) * self.limits.chord_tolerance));
            let mut are_low = are_chords_low(bulge.most_speed, most_curved, &bulge, period, most);
            if !are_all(are_low) {
                // Between two neighbouring places, speed and curvature exceed the greater value at these by no more than their
                // bounds.
                let mut are_steps_low = nothing.simd_eq(nothing);
                for i in 0..PLACES - 1 {
                    let (fastest, curved) = (v[i].max(v[i + 1]), curvature[i].max(curvature[i + 1]));
                    are_steps_low &= are_chords_low(fastest, curved, &bulge, period, most);
                }
                are_low |= are_steps_low;
            }
            find(are_low.select(nothing, open));
        }
        Found {
            verdict: verdict.into(),
            time: time.into(),
            length: unknown.into(),
            speed_sq,
            whole: whole.into(),
        }
    }
}

impl Phase {
    /// v² at both ends, from the squares of |C'| there. None next to rest, and where a constant speed and its record by p differ
    /// by more than rounding.
    fn speed_sq(&self, square: [f64; 2]) -> Option<[f64; 2]> {
        let recorded = [square[0] * self.p[0], square[1] * self.p[1]];
        let is_held = |sq: f64| recorded.iter().all(|recorded| is_same_speed(sq.sqrt(), recorded.sqrt()));
        let [from, to] = match self.held_sq {
            Some(sq) if !is_held(sq) => return None,
            Some(sq) => [sq; 2],
            None => recorded,
        };
        (from.min(to) > SLOW_SQ * from.max(to)).then_some([from, to])
    }
}

impl Part {
    /// The lengths from the start of the phase up to both ends of the part, from the length of the part.
    fn ends(&self, length: f64) -> [f64; 2] {
        match self.ends {
            [start, end] if start.is_nan() => [end - length, end],
            [start, _] => [start, start + length],
        }
    }

    /// The time of a part that cannot raise any use. Where the speed changes so fast that eight places do not give it, it is
    /// integrated with more places. None if that fails.
    fn time(&self, phase: &Phase, found: &Found, i: usize) -> Option<f64> {
        let mut time = found.time[i];
        if time.is_nan() {
            let speed = SpeedByLength::cubic(found.speed_sq.map(|lanes| lanes[i]), phase.a, found.whole[i]);
            let [start, end] = self.ends(found.length[i]);
            time = speed.time(end) - speed.time(start);
        }
        time.is_finite().then_some(time)
    }
}

/// The verdict on one limit from its uses at the places. `off` bounds how far the use may be off the straight line between two
/// places, if that is known. That no use between the places is above `worst` is shown by this bound; by the polynomial through
/// all places, which is nowhere greater than `GREATEST` times the greatest value at a place; or by parabolas through two
/// neighbouring places and the polynomial half-way between them (see `peak`).
#[inline(always)]
fn verdict_of<S: Simd>(
    rate: &[f64x8<S>; PLACES],
    use_of: impl Fn(f64x8<S>) -> f64x8<S>,
    off: Option<f64x8<S>>,
    worst: f64,
) -> f64x8<S> {
    let all = |x: f64| f64x8::splat(rate[0].simd, x);
    let (most, mut used) = (all(worst), *rate);
    let (mut greatest, mut sum) = (all(0.0), all(0.0));
    for i in 0..PLACES {
        used[i] = use_of(rate[i]);
        greatest = greatest.max(used[i].abs());
        // `max` may lose a NaN, a sum does not.
        sum += used[i];
    }
    let are_below = greatest.simd_le(most) & (sum * 0.0).simd_eq(all(0.0));
    let (mut are_certain, mut are_narrow) = (greatest.simd_lt(greatest), are_below);
    if let Some(off) = off {
        are_certain = are_below & (greatest + off).simd_le(most);
        are_narrow = are_below & !are_certain & off.simd_le(all(WIDE));
    }
    let verdict = are_certain.select(all(NOTHING), are_below.select(all(OPEN), all(MORE)));
    if !is_any(are_narrow) {
        return verdict;
    }
    let mut last = all(0.0);
    for j in 0..PLACES {
        last += rate[j] * ALL.last[j];
    }
    let doubt = use_of(last).abs();
    let limit = most - doubt;
    let are_nowhere_greater = are_narrow & (greatest * GREATEST).simd_le(limit);
    if !is_any(are_narrow & !are_nowhere_greater) {
        return are_nowhere_greater.select(all(NOTHING), verdict);
    }
    let mut are_low = are_narrow;
    for i in 0..PLACES - 1 {
        let mut middle = all(0.0);
        for j in 0..PLACES {
            middle += rate[j] * ALL.between[j][i];
        }
        let between = use_of(middle);
        let bend = between * 2.0 - used[i] - used[i + 1];
        let are_far_below = (between.abs() + bend.abs() * 1.5).simd_le(limit);
        if are_all(are_far_below) {
            continue;
        }
        let slope = used[i + 1] - used[i];
        let top = (between + slope * slope / (bend * 8.0)).abs() + bend * bend / most;
        let is_flat = top.simd_le(limit) | slope.abs().simd_ge(bend.abs() * 2.0);
        are_low &= are_far_below | is_flat;
    }
    are_low.select(all(NOTHING), verdict)
}

/// Where the chord error is at most `most` for this speed and this curvature, each increased by its bound between the places.
#[inline(always)]
fn are_chords_low<S: Simd>(
    fastest: f64x8<S>,
    curvature: f64x8<S>,
    between: &Bulge<f64x8<S>>,
    period: f64,
    most: f64x8<S>,
) -> mask64x8<S> {
    let fastest = (fastest + between.rates[0]).min(between.most_speed);
    chord_error(fastest * period, curvature + between.curvature).simd_le(most)
}

/// The integral over a phase of width 1, and three estimates of its error by lower rules.
#[inline(always)]
fn integral<T: Number>(f: &[T; PLACES]) -> (T, [T; 3]) {
    let (mut sums, mut odd) = ([f[0].filled(0.0); 3], f[0].filled(0.0));
    for i in 0..PLACES / 2 {
        let [near, far] = [f[i], f[PLACES - 1 - i]];
        for (sum, of) in sums.iter_mut().zip([&ALL, &LOWER, &LOWEST]) {
            *sum = *sum + (near + far) * of.up_to[i][PLACES - 1];
        }
        odd = odd + (near + far * -1.0) * (ALL.odd[i] - LOWER.odd[i]);
    }
    let [whole, lower, lowest] = sums;
    (whole, [(lower - whole).size(), odd.size(), (lowest - whole).size() * CHANCE])
}

/// Where the rules agree.
#[inline(always)]
fn agree<S: Simd>(whole: f64x8<S>, doubts: [f64x8<S>; 3]) -> mask64x8<S> {
    let most = whole * RULES_AGREE;
    doubts[0].simd_le(most) & doubts[1].simd_le(most) & doubts[2].simd_le(most)
}

#[inline(always)]
fn of_each<S: Simd, T>(simd: S, of: &[T; PHASES], number: impl Fn(&T) -> f64) -> f64x8<S> {
    let mut lanes = [0.0; PHASES];
    for i in 0..PHASES {
        lanes[i] = number(&of[i]);
    }
    f64x8::from_slice(simd, &lanes)
}

#[inline(always)]
fn joined<S: Simd>(of: &[f64x8<S>; PLACES], join: impl Fn(f64x8<S>, f64x8<S>) -> f64x8<S>) -> f64x8<S> {
    let mut whole = of[0];
    for i in 1..PLACES {
        whole = join(whole, of[i]);
    }
    whole
}

#[inline(always)]
fn are_all<S: Simd>(mask: mask64x8<S>) -> bool {
    mask.to_bitmask() == (1 << PHASES) - 1
}

#[inline(always)]
fn is_any<S: Simd>(mask: mask64x8<S>) -> bool {
    mask.to_bitmask() != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Columns;
    use crate::curve::{Followed, Pieces};
    use crate::joints::path::{JointPath, Words};
    use crate::phases::{Phases, SPEED_CUBIC};
    use crate::Sided;
    use proptest::prelude::*;

    fn sum(weights: &[f64; PLACES], degree: i32) -> f64 {
        (0..PLACES).map(|i| weights[i] * SHARES[i].powi(degree)).sum()
    }

    #[test]
    fn the_polynomial_through_all_places_is_exact_to_degree_seven_and_each_rule_to_its_own() {
        let near = |found: f64, exact: f64| (found - exact).abs() < 1e-14;
        for degree in 0..=13 {
            let exact = |x: f64| x.powi(degree + 1) / f64::from(degree + 1);
            let column = |rows: &[[f64; PLACES]; PLACES], i: usize| sum(&rows.map(|row| row[i]), degree);
            let whole = |of: &Weights| column(&of.up_to, PLACES - 1);
            assert!(near(whole(&ALL), exact(1.0)), "{degree}");
            assert!(degree > 5 || near(whole(&LOWER), exact(1.0)), "{degree}");
            assert!(degree > 3 || near(whole(&LOWEST), exact(1.0)), "{degree}");
            assert!(degree > 5 || near(sum(&LOWER.odd, degree), exact(0.5) - 0.5 * exact(1.0)), "{degree}");
            assert!(degree > 7 || near(sum(&ALL.odd, degree), exact(0.5) - 0.5 * exact(1.0)), "{degree}");
            assert_eq!(degree <= 6, near(sum(&ALL.last, degree), 0.0), "{degree}");
            for i in (0..PLACES).filter(|_| degree <= 7) {
                let (next, own) = (SHARES[(i + 1).min(PLACES - 1)], SHARES[i]);
                assert!(near(column(&ALL.up_to, i), exact(own)), "{degree} {i}");
                assert!(near(column(&ALL.between, i), (0.5 * (own + next)).powi(degree)), "{degree} {i}");
            }
        }
    }

    #[test]
    fn the_polynomial_through_all_places_is_nowhere_greater_than_its_bound() {
        let mut most = 0.0_f64;
        for step in 0..=10_000 {
            let x = -1.0 + 2e-4 * f64::from(step);
            let of = |j: usize| {
                (0..PLACES).filter(|&i| i != j).map(|i| (x - NODES[i]) / (NODES[j] - NODES[i])).product()
            };
            most = most.max((0..PLACES).map(|j| f64::abs(of(j))).sum());
        }
        assert!((0.9 * GREATEST..GREATEST).contains(&most), "{most}");
    }

    /// What is found of a phase if uses of `worst` times its own greatest rates, feed and chord error were found before: its time
    /// or None. Then its time by the law, and its greatest rates.
    fn look(
        control: &[f64],
        phase: [[f64; 2]; 3],
        worst: &dyn Fn(Check, usize) -> f64,
    ) -> (Option<f64>, f64, [[f64; 2]; 3]) {
        look_of(control, phase, worst, false)
    }

    /// `look` for axes, or for joints with a polar kinematics.
    fn look_of(
        control: &[f64],
        [u, speeds, a]: [[f64; 2]; 3],
        worst: &dyn Fn(Check, usize) -> f64,
        has_joints: bool,
    ) -> (Option<f64>, f64, [[f64; 2]; 3]) {
        let degree = control.len() / 2 - 1;
        // The second piece is a line.
        let control = &[control, &[-5.0, 2.0, -4.0, 2.0]].concat();
        let (offsets, width) = ([0, degree + 1, degree + 3], [degree as f64, 1.0]);
        let pieces = Pieces { axes: 2, stride: 2, control, weights: &[], offsets: &offsets, width: &width };
        let feed = &[f64::INFINITY; 2 * FEEDS];
        let (path, free) = (Followed { feed, runs: &[0, 2], ..Followed::of_one(pieces) }, Limits::none());
        let words = Words::polar();
        let joints = JointPath::of_one(path, &words, &[1.0; 2]);
        let joints = has_joints.then_some(&joints);
        let mut columns = Columns::new(&path, &free, joints);
        let p = [0, 1].map(|i| (speeds[i] / columns.station(0, u[i]).unwrap().slope).powi(2));
        let phases =
            Phases { a0: &a[..1], a1: &a[1..], ..Phases::of_one(&[SPEED_CUBIC], &[255], &[0.0], &u, &p) };
        let motion = phases.by_length(0, &mut columns).unwrap();
        let (mut most, mut fastest, mut farthest) = ([[0.0_f64; 2]; 3], 0.0_f64, 0.0_f64);
        for i in 0..=2000 {
            let at = u[0] + (u[1] - u[0]) * f64::from(i) / 2000.0;
            let (pace, station) = (motion.place(at).pace, columns.station(0, at).unwrap());
            let rates = [station.velocity(pace.v), station.acceleration(pace), station.jerk(pace)];
            let v = pace.v * station.tip;
            fastest = fastest.max(v);
            farthest = farthest.max(chord_error(v * free.period, station.curvature));
            for (row, rate) in rates.iter().enumerate() {
                for k in 0..2 {
                    most[row][k] = most[row][k].max(rate[k].abs());
                }
            }
        }
        // Both axes have one limit; the tally has the greatest use of each axis times `worst`.
        let limit = most.map(|row| [row[0].max(row[1]); 2]);
        let of = |limit: [f64; 2]| Sided { positive: limit, negative: limit };
        let mut limits = Limits { judges_jerk: true, jerk: limit[2], chord_tolerance: farthest, ..free };
        (limits.velocity, limits.acceleration) = (of(limit[0]), of(limit[1]));
        let mut tally = Tally::default();
        for (row, check) in RATES.into_iter().enumerate() {
            for k in 0..2 {
                tally.offer(check, k, worst(check, k) * most[row][k], limit[row][k], 0.0, 1);
            }
        }
        tally.offer(Check::Feed, 0, worst(Check::Feed, 0), 1.0, 0.0, 1);
        tally.offer(Check::Chord, 0, worst(Check::Chord, 0) * farthest, farthest, 0.0, 1);
        let feeds = [fastest, f64::INFINITY, f64::INFINITY, f64::INFINITY];
        let mut columns = Columns::new(&path, &limits, joints);
        let mut looks = Looks::new(columns.room());
        for piece in 0..2 {
            let on = OnPiece::new(piece, &mut columns).expect("a piece without weights, in wide vectors");
            looks.pieces.push(OnPiece { feeds, ..on });
        }
        let Columns { rates, per_least, .. } = &columns;
        let judge = Judge { rates, per_least, limits: &limits };
        // Beside other phases a phase gets the same answer as alone, up to rounding: its halves are added in another order.
        let phase = Some(Phase { piece: 0, u, p, a, held_sq: None });
        let gentle = Some(Phase { piece: 1, u: [0.1, 0.11], p: [1e-9; 2], a: [0.0; 2], held_sq: None });
        let mut found_of = |phases: &[Option<Phase>]| {
            looks.phases = phases.to_vec();
            judge.look_at(&mut looks, &tally);
            looks.times.clone()
        };
        let found = found_of(&[phase])[0];
        let beside = [None, gentle, phase, phase, None, gentle, phase, None, gentle, phase, gentle];
        let times = found_of(&beside);
        for time in [times[2], times[3], times[6], times[9]] {
            assert_eq!(time.is_some(), found.is_some());
            assert!(time.zip(found).is_none_or(|(a, b)| (a / b - 1.0).abs() < 1e-14));
        }
        (found, motion.time(), most)
    }

    #[test]
    fn a_gentle_phase_that_uses_no_more_than_was_found_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        // Speed and curvature are greatest at different ends of the phase.
        let worst = |check, _| if check == Check::Chord { 1.0 + 1e-3 } else { 1.0 + 1e-6 };
        let (found, time, _) = look(&control, [[0.5, 0.55], [1.0, 1.0012], [0.02, 0.028]], &worst);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_phase_whose_speed_changes_fast_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        let (found, time, _) = look(&control, [[0.5, 0.6], [0.3, 1.0], [4.5, 4.5]], &|_, _| 10.0);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_phase_that_eight_places_leave_open_is_looked_at_by_halves() {
        let control = [0.0, 0.0, 1.0, 1.0, 2.0, -1.0, 3.0, 0.0];
        let (found, time, _) = look(&control, [[0.1, 2.9], [1.0, 1.2], [0.1, 0.05]], &|_, _| 3.0);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-8);
        for broken in [Check::Velocity, Check::Acceleration, Check::Jerk, Check::Feed, Check::Chord] {
            let worst = |check, _| if check == broken { 0.999 } else { 3.0 };
            assert_eq!(look(&control, [[0.1, 2.9], [1.0, 1.2], [0.1, 0.05]], &worst).0, None, "{broken:?}");
        }
    }

    #[test]
    fn a_speed_that_is_held_has_both_records_of_it() {
        let phase = |p: f64| Phase { piece: 0, u: [0.0, 1.0], p: [4.0, p], a: [0.0; 2], held_sq: Some(16.0) };
        assert_eq!(phase(1.0).speed_sq([4.0, 16.0]), Some([16.0; 2]));
        assert_eq!(phase(1.0 + 1e-13).speed_sq([4.0, 16.0]), None);
    }

    #[test]
    fn a_phase_that_is_fastest_where_it_is_bent_least_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.3];
        let worst = |check, _| if check == Check::Chord { 1.2 } else { 10.0 };
        // From 1.4 mm/s to 1 mm/s, where the curvature is 1.4 times as great.
        let (found, time, _) = look(&control, [[1.0, 1.4], [1.4, 1.0], [-1.2, -1.2]], &worst);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_phase_from_rest_or_of_rubbish_is_looked_at_closer() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        for speeds in [[0.0, 1.0], [1.0, 1e-3], [f64::NAN, 1.0]] {
            assert_eq!(look(&control, [[0.5, 0.8], speeds, [0.1, 0.05]], &|_, _| 10.0).0, None);
        }
        assert_eq!(look(&control, [[0.5, 0.8], [1.0; 2], [f64::NAN, 0.0]], &|_, _| 10.0).0, None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn a_phase_that_uses_more_than_was_found_is_looked_at_closer_wherever_that_is(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 2..=9_usize,
            cut in 0.0..0.8_f64,
            part in -3.0..-0.7_f64,
            speed in 0.9..1.1_f64,
            a in prop::array::uniform2(-0.1..0.1_f64),
            has_joints: bool,
        ) {
            // Beside the origin, where joints have no direction.
            let control: Vec<f64> = (0..=degree).flat_map(|i| [-4.0 + i as f64, 3.0 + bends[i]]).collect();
            let (degree, part) = (degree as f64, 10.0_f64.powf(part));
            let (u, gained) = ([degree * cut, degree * (cut + part)], 0.5 * (a[0] + a[1]) * degree * part);
            let speeds = [speed, speed + gained / speed];
            let (found, time, most) = look_of(&control, [u, speeds, a], &|_, _| 1.001, has_joints);
            prop_assert!(found.is_none_or(|found| (found / time - 1.0).abs() < 1e-9), "{found:?} {time}");
            let rates = RATES.into_iter().enumerate().flat_map(|(row, check)| [(row, check, 0), (row, check, 1)]);
            let rates = rates.filter(|&(row, _, k)| most[row][k] > 1e-6).map(|(_, check, k)| (check, k));
            for broken in rates.chain([(Check::Feed, 0), (Check::Chord, 0)]) {
                let worst = |check, k| if (check, k) == broken { 0.9999 } else { 1.001 };
                prop_assert_eq!(look_of(&control, [u, speeds, a], &worst, has_joints).0, None, "{:?}", broken);
            }
        }
    }
}
