//! Computes a closer lower bound, from two cases of the speed at each of some stations.
//!
//! The relaxation (`relaxed`) allows a speed that the limit of jerk forbids where that costs little time: at stations where the
//! multipliers of jerk of the plan add up to far more than the weight of the time, mostly where q''' jumps. Every profile has w ≤
//! a or w ≥ a at such a station, for any a; here a is a fraction of the plan's w. Each case has a closer relaxation:
//!
//!   low    w ≤ a: a limit of the speed, which costs time.
//!   high   a ≤ w ≤ b, with the greatest speed b of `speed_limit`. There w^(−1/2), which is convex, lies below its chord:
//!          y ≤ A − K w holds for y = w^(−1/2). In the relaxation y may exceed w^(−1/2); this limits it, and at w = a or w = b
//!          it leaves only y = w^(−1/2).
//!
//! The path is cut between such stations. The multipliers of the relaxation prove for a window between two cuts
//!
//!   time ≥ L₀ + π · (w, w') at both ends,
//!
//! and the sum of these bounds is that of `lower_bound`, in which the prices π of neighbours cancel except for rounding. Each
//! case of a window is solved with the same prices, which proves time ≥ L + π · (w, w'). One of both cases holds, independently
//! of the other windows, so that min(L_low, L_high) may replace L₀. n stations therefore need 2 n small solutions, not 2ⁿ.
//!
//! L is the value of the dual function (`lower_bound`), valid for any multipliers. Where y has a chord, the multipliers of jerk
//! may exceed the weight c of the time: with the multiplier μ ≥ 0 of 1 − (K/A) w − y/A ≥ 0 they may add up to c + μ/A.

use std::ops::Range;

use super::constraints::Constraints;
use super::hermite::{COUNT, LAST};
use super::interior_point::{Effort, Outcome};
use super::lower_bound::{self, balanced, joined, loosen, rest, sum, terms, Part, Planned, Solution};
use super::relaxed::{Price, Relaxed};
use super::window_end::WindowEnd;
use super::working_space::InteriorPoint;
use feedplan_geometry::lanes::eight::{Lanes, LANES};

/// A gap above this fraction of the time counts as wide.
const WIDE: f64 = 0.01;
/// a, as a fraction of the plan's w. A greater fraction brings the chord closer to w^(−1/2), but makes the low case cost less
/// time.
const SPLIT: f64 = 0.7;
/// Two cases are used at stations where the bound by a chord loses more than this fraction of the plan's time (see `stations`).
const LEAST: f64 = 1e-5;
/// The least number of intervals between two stations with cases.
const APART: usize = 16;
/// In the low case the solution starts at `LOW` times `SPLIT` times the plan's w, in the high case at `HIGH` times the plan's w.
const LOW: f64 = 0.9;
const HIGH: f64 = 0.97;
/// y starts above its least possible value by this fraction.
const ABOVE: f64 = 0.1;
/// Complementarity gap at the end, as a fraction of a window's time.
const TOLERANCE: f64 = 1e-4;
const MAX_ITERATIONS: usize = 60;

/// The line A − K w through two points of the curve w^(−1/2), with A = `most` and K = `fall`.
#[derive(Clone, Copy, Debug)]
struct Chord {
    most: f64,
    fall: f64,
}

impl Chord {
    /// The line through the points at w = `low` and w = `high`.
    fn new(low: f64, high: f64) -> Self {
        let [start, end] = [low, high].map(|w| 1.0 / w.sqrt());
        let fall = (start - end) / (high - low);
        Self { most: start + fall * low, fall }
    }

    fn at(&self, w: f64) -> f64 {
        self.most - self.fall * w
    }

    /// Limits y at a station by the chord, in the rows of speed at both of its collocation points; `of_y` are the coefficients of
    /// y.
    fn limit(&self, rows: &mut Constraints, of_y: &mut [[Lanes; COUNT]], station: usize) {
        for (n, p) in both_sides(station) {
            let (b, lane) = (n / LANES, n % LANES);
            rows.blocks[b].points[p].speed.values_mut()[lane] = self.fall / self.most;
            of_y[b][p].values_mut()[lane] = 1.0 / self.most;
        }
    }
}

/// The two collocation points at a station inside a window: each as interval and index of the point in it.
fn both_sides(station: usize) -> [(usize, usize); 2] {
    [(station - 1, LAST), (station, 0)]
}

/// A station with two cases, and the window around it.
struct Place {
    station: usize,
    window: Range<usize>,
    /// The bound that the relaxation proves for the window.
    known: Part,
    /// The cost of the states at the window's ends, relative to the states of the plan.
    prices: [Price; 2],
}

/// The part of the intervals `core` of a window, by cases if the relaxation leaves a wide gap.
pub fn part(
    planned: &Planned,
    core: &Range<usize>,
    effort: &Effort,
    space: &mut InteriorPoint<Relaxed>,
) -> Part {
    let (known, solution) = lower_bound::part(planned, core, effort, space);
    let value = |part: &Part| part.at(planned.x, core);
    match solution {
        Some(Solution { rows, x }) if value(&known) < (1.0 - WIDE) * known.time => {
            let closer = by_cases(&Planned { rows: &rows, ..*planned }, core, &x, effort, space);
            if value(&closer) > value(&known) {
                closer
            } else {
                known
            }
        }
        _ => known,
    }
}

/// The part by cases, from a solution x of the relaxation with its multipliers in `space`.
fn by_cases(
    planned: &Planned,
    core: &Range<usize>,
    x: &[f64],
    effort: &Effort,
    space: &mut InteriorPoint<Relaxed>,
) -> Part {
    let terms = terms(planned, x, space);
    let of = |at_ends: [bool; 2], range: &Range<usize>, space: &InteriorPoint<Relaxed>| {
        sum(&Planned { at_ends, ..*planned }, range, x, &terms, &space.ends).0
    };
    let whole = of(planned.at_ends, core, space);
    let places = places(planned, core, LEAST * whole.time, |window| of([false; 2], window, space));
    if places.is_empty() {
        return whole;
    }
    let mut parts = vec![of([planned.at_ends[0], false], &(core.start..core.start + 1), space)];
    let mut rows = planned.rows.clone();
    for place in &places {
        let cases = [true, false].map(|high| case(planned, place, high, &mut rows, effort, space));
        parts.push(place.with(cases));
    }
    parts.push(of([false, planned.at_ends[1]], &(core.end - 1..core.end), space));
    space.model.chord.clear();
    space.model.prices = [Price::default(); 2];
    joined(&parts)
}

impl Place {
    /// The bound of the window by the lesser bound of both cases, because either may hold; the prices are those of `known`. If a
    /// case has no solution, this is `known`.
    fn with(&self, cases: [Option<f64>; 2]) -> Part {
        let mut part = self.known.clone();
        if let [Some(high), Some(low)] = cases {
            // The cases count the cost of the ends from the states of the plan, the part counts it from state 0.
            let from_plan: f64 = self.prices.iter().map(|price| price.of([0.0; 2])).sum();
            part.least = part.least.max(high.min(low) - from_plan);
        }
        part
    }
}

/// The stations with two cases, where the bound by a chord loses more than `least`, in s. `known` gives the bound that the
/// relaxation proves for a window.
fn places(
    planned: &Planned,
    core: &Range<usize>,
    least: f64,
    known: impl Fn(&Range<usize>) -> Part,
) -> Vec<Place> {
    let stations = stations(planned, core, least);
    let middle = |pair: &[usize]| (pair[0] + pair[1]) / 2;
    // The first and the last interval of the core have no cases; their bound is that of the relaxation.
    let starts = std::iter::once(core.start + 1).chain(stations.windows(2).map(middle));
    let ends = stations.windows(2).map(middle).chain([core.end - 1]);
    let place = |(&station, (start, end)): (&usize, (usize, usize))| {
        let (window, from) = (start..end, [start, end].map(|n| [planned.x[2 * n], planned.x[2 * n + 1]]));
        let known = known(&window);
        let prices = [0, 1].map(|end| Price { price: known.price[end].map(|price| -price), from: from[end] });
        Place { station, window, known, prices }
    };
    stations.iter().zip(starts.zip(ends)).map(place).collect()
}

/// The stations where the bound by a chord and by the plan's multipliers loses more than `least`, in s: the excess of the
/// multipliers of jerk over c, times the height of the chord above w^(−1/2). Stations with greater losses are chosen first.
fn stations(planned: &Planned, core: &Range<usize>, least: f64) -> Vec<usize> {
    let Planned { rows, x, .. } = *planned;
    let mut dual = vec![];
    loosen(planned, &mut dual);
    let over = |n: usize, p: usize| {
        let (b, layout) = (n / LANES, rows.layout());
        let rest = rest(&rows.blocks[b].h, layout.of(&dual, b, p), layout, p);
        (-rest.values()[n % LANES]).max(0.0)
    };
    let loss = |station: &usize| {
        let w = x[2 * station];
        let over: f64 = both_sides(*station).into_iter().map(|(n, p)| over(n, p)).sum();
        over * (chord(rows, *station, w).at(w) - 1.0 / w.sqrt())
    };
    let inside = core.start + APART..(core.end + 1).saturating_sub(APART);
    let mut found: Vec<(f64, usize)> = inside.map(|station| (loss(&station), station)).collect();
    found.retain(|(loss, _)| *loss > least);
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut stations: Vec<usize> = vec![];
    for (_, station) in found {
        if stations.iter().all(|other| station.abs_diff(*other) >= APART) {
            stations.push(station);
        }
    }
    stations.sort_unstable();
    stations
}

/// The chord of the high case at a station where the plan has this w.
fn chord(rows: &Constraints, station: usize, w: f64) -> Chord {
    let high = both_sides(station).map(|(n, p)| 1.0 / rows.speed(n, p));
    Chord::new(SPLIT * w, high[0].min(high[1]))
}

/// The lower bound that a case proves for the time of a window plus the cost of its ends, in s; None if no solution is found.
fn case(
    planned: &Planned,
    place: &Place,
    high: bool,
    rows: &mut Constraints,
    effort: &Effort,
    space: &mut InteriorPoint<Relaxed>,
) -> Option<f64> {
    let Place { station, window, prices, .. } = place;
    let plan = &planned.x[2 * window.start..2 * window.end + 2];
    let w = planned.x[2 * station];
    rows.copy(planned.rows, window.clone());
    let model = &mut space.model;
    (model.above, model.prices) = (ABOVE, *prices);
    model.chord.clear();
    model.chord.resize(rows.blocks.len(), [Lanes::ZERO; COUNT]);
    let inside = station - window.start;
    if high {
        chord(planned.rows, *station, w).limit(rows, &mut model.chord, inside);
    } else {
        for (n, p) in both_sides(inside) {
            rows.lower(n, p, SPLIT * w);
        }
    }
    let part = if high { HIGH } else { LOW * SPLIT };
    let mut x: Vec<f64> = plan.iter().map(|x| part * x).collect();
    let (tolerance, max_iterations, barrier) = (TOLERANCE, MAX_ITERATIONS, 1.0);
    let effort = Effort { tolerance, max_iterations, barrier, warm: false, ..*effort };
    let ends = [WindowEnd::Free; 2];
    let converged = space.solve(rows, ends, &mut x, &effort).outcome == Outcome::Converged;
    let own = Planned { rows, ends, at_ends: [true; 2], x: plan, ..*planned };
    converged.then(|| balanced(&own, &(0..rows.count()), ends, &mut x, space).least)
}

#[cfg(test)]
mod tests {
    use super::super::profiles::{around, planned, random, relaxed_times, Winding};
    use super::super::speed_limit;
    use super::*;
    use crate::path_problem::{Geometry, PathPoint};

    /// A turn by half a radian between lines of 10 mm: over 1 mm the curvature rises to 0.5/mm, over 1 mm it falls.
    struct Turn;

    impl Geometry<2> for Turn {
        fn knots(&self) -> &[f64] {
            &[0.0, 10.0, 11.0, 12.0, 22.0]
        }

        fn at(&self, piece: usize, s: f64) -> PathPoint<2> {
            let (rise, fall) = ((s - 10.0).max(0.0), (12.0 - s).max(0.0));
            let change = [0.0, 0.5, -0.5, 0.0][piece];
            let bend = 0.5 * if piece < 2 { rise } else { fall };
            let angle = if piece < 2 { 0.25 * rise * rise } else { 0.5 - 0.25 * fall * fall };
            let (sin, cos) = angle.sin_cos();
            PathPoint {
                first: [cos, sin],
                second: [-bend * sin, bend * cos],
                third: [-bend * bend * cos - change * sin, change * cos - bend * bend * sin],
                speed_cap: 200.0,
            }
        }
    }

    #[test]
    fn a_chord_by_hand() {
        // From 1 at w = 1 to 1/2 at w = 4: 7/6 − w/6.
        let chord = Chord::new(1.0, 4.0);
        assert!((chord.most - 7.0 / 6.0).abs() < 1e-15 && (chord.fall - 1.0 / 6.0).abs() < 1e-15);
        for (w, known) in [(1.0, 1.0), (2.5, 0.75), (4.0, 0.5)] {
            assert!((chord.at(w) - known).abs() < 1e-15);
        }
    }

    #[test]
    fn the_lesser_case_counts_by_hand() {
        // The part is 1 s − 0.5 s · w at the start, which is −1 s for the plan's w = 4. The cases count from that w.
        let known = Part { least: 1.0, price: [[-0.5, 0.0], [0.0; 2]], ..Part::default() };
        let prices = [Price { price: [0.5, 0.0], from: [4.0, 0.0] }, Price::default()];
        let place = Place { station: 1, window: 0..2, known, prices };
        for (cases, least) in [
            ([Some(4.0), Some(3.0)], 5.0),
            ([Some(2.0), Some(3.0)], 4.0),
            ([Some(-2.0), Some(3.0)], 1.0),
            ([Some(2.0), None], 1.0),
        ] {
            let part = place.with(cases);
            assert_eq!((part.least, part.price), (least, place.known.price));
        }
    }

    #[test]
    fn with_a_chord_the_lagrangian_of_any_multipliers_is_below_the_time() {
        planned(&Winding::new(2.2), |own, _| {
            let station = own.rows.count() / 3;
            let w = own.x[2 * station];
            let chord = chord(own.rows, station, w);
            let high = 1.0 / own.rows.speed(station, 0);
            let mut rows = own.rows.clone();
            let mut space = InteriorPoint::<Relaxed>::default();
            space.model.chord = vec![[Lanes::ZERO; COUNT]; rows.blocks.len()];
            chord.limit(&mut rows, &mut space.model.chord, station);
            let at = Planned { rows: &rows, ..*own };
            let (mut random, layout) = (random(), rows.layout());
            let (mut held, mut over) = (0, 0);
            for z in around(own.x, &rows, 300) {
                if !(0.7 * w..high).contains(&z[2 * station]) {
                    continue;
                }
                held += 1;
                // A multiplier of jerk far above the weight of the time if z keeps the limit of jerk, and a multiplier of the
                // chord.
                let used = rows.utilisation(&z);
                let keeps = used[station - 1][2] <= 1.0 && used[station][2] <= 1.0;
                over += usize::from(keeps);
                space.state.dual = vec![Lanes::ZERO; rows.blocks.len() * layout.all()];
                for (n, p) in both_sides(station) {
                    let dual = layout.of_mut(&mut space.state.dual, n / LANES, p);
                    for row in [0, layout.speed()].into_iter().filter(|row| keeps || *row > 0) {
                        dual[row].values_mut()[n % LANES] = 4.0 * random().abs() * rows.h(n);
                    }
                }
                for (terms, time) in terms(&at, &z, &mut space).iter().zip(relaxed_times(&rows, &z)) {
                    assert!(terms.value <= time + 1e-12, "{} and {time} s", terms.value);
                }
            }
            assert!(held > 100 && over > 30, "{held} profiles, {over} within the limit of jerk");
        });
    }

    #[test]
    fn one_of_both_cases_holds_for_every_profile_and_closes_the_gap() {
        planned(&Turn, |own, effort| {
            let mut rows = own.rows.clone();
            speed_limit::lower(&mut rows);
            let (own, core) = (Planned { rows: &rows, ..*own }, 0..rows.count());
            let mut space = InteriorPoint::<Relaxed>::default();
            let mut x: Vec<f64> = own.x.iter().map(|x| 0.97 * x).collect();
            space.solve(own.rows, own.ends, &mut x, &Effort { tolerance: 1e-6, ..*effort });
            let plain = balanced(&own, &core, own.ends, &mut x, &mut space);
            let terms = terms(&own, &x, &mut space);
            let inside = Planned { at_ends: [false; 2], ..own };
            let known = |window: &Range<usize>| sum(&inside, window, &x, &terms, &space.ends).0;
            let places = places(&own, &core, LEAST * plain.time, known);
            let closer = by_cases(&own, &core, &x, effort, &mut space);
            let gaps = [plain.least, closer.least].map(|least| 1.0 - least / plain.time);
            assert!(gaps[0] > 0.005 && gaps[1] > 0.0 && gaps[1] < 0.0015, "{gaps:?}");
            // Both cases bound the profiles around the plan, slowed down until they keep every limit.
            let mut profiles = around(own.x, own.rows, 300);
            for z in &mut profiles {
                while rows.utilisation(z).as_flattened().iter().any(|&used| used > 1.0) {
                    z.iter_mut().for_each(|z| *z *= 0.95);
                }
            }
            for place in &places {
                let bounds = [false, true].map(|high| {
                    case(&own, place, high, &mut own.rows.clone(), effort, &mut space).expect("a solution")
                });
                let mut counts = [0; 2];
                let ends = [place.window.start, place.window.end];
                for z in &profiles {
                    let high = usize::from(z[2 * place.station] > 0.7 * own.x[2 * place.station]);
                    let cost =
                        place.prices.iter().zip(ends).map(|(price, n)| price.of([z[2 * n], z[2 * n + 1]]));
                    let time =
                        relaxed_times(&rows, z)[place.window.clone()].iter().sum::<f64>() + cost.sum::<f64>();
                    assert!(time >= bounds[high], "{time} s, {bounds:?} s proven");
                    counts[high] += 1;
                }
                assert!(counts.iter().all(|&count| count > 20), "{counts:?} profiles");
            }
        });
    }
}
