//! The jerk-limited planner: lines by hand and by formula, known curves, random paths, windows, caps, moving ends,
//! early stops, and its lower bound.

use std::f64::consts::{FRAC_PI_2, PI};
use std::time::Instant;

use feedplan_checks::bends::{Bend, Bends};
use feedplan_checks::by_length::{ByLength, Lemniscate, Nurbs, Trefoil};
use feedplan_checks::campaign::seeds;
use feedplan_checks::jerk::plan;
use feedplan_checks::wave::Wave;
use feedplan_checks::Random;
use feedplan_jerk::jerk_limited::{
    Effort, End, Fault, Geometry, Limits, PathPoint, Plan, Problem, Profile, SpeedCap,
};

/// The excess that a dense check may find: a little more than the planner's tolerance.
const HELD: f64 = 1e-6;

/// A straight line along one axis, with a feed.
struct Line {
    knots: [f64; 2],
    feed: f64,
}

impl Line {
    fn new(length: f64) -> Self {
        Self { knots: [0.0, length], feed: f64::INFINITY }
    }
}

impl Geometry<1> for Line {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, _: usize, _: f64) -> PathPoint<1> {
        PathPoint { first: [1.0], second: [0.0], third: [0.0], speed_cap: self.feed }
    }
}

/// The problem from rest to rest, with the same limits for all axes.
fn problem<const M: usize>(geometry: &dyn Geometry<M>, [v, a, j]: [f64; 3]) -> Problem<'_, M> {
    let limits = Limits { velocity: [[v; M]; 2], acceleration: [[a; M]; 2], jerk: [j; M] };
    Problem { geometry, limits, moves: [true; M], caps: &[], ends: [End::Rest; 2] }
}

const FAST: [f64; 3] = [250.0, 3000.0, 50_000.0];

fn proving() -> Effort<'static> {
    Effort { proves: true, ..Effort::default() }
}

fn planned<const M: usize>(problem: &Problem<M>) -> Plan {
    plan(problem, &proving()).expect("the path can be travelled")
}

/// The greatest excess of velocity, acceleration and jerk over the limits, at `dense` points of each interval and ramp.
fn excess<const M: usize>(problem: &Problem<M>, profile: &Profile, dense: usize) -> [f64; 3] {
    let knots = problem.geometry.knots();
    let limits = &problem.limits;
    let mut worst = [-1.0f64; 3];
    let mut nodes = vec![profile.ends[0]];
    nodes.extend(&profile.s);
    nodes.push(profile.ends[1]);
    for pair in nodes.windows(2).filter(|pair| pair[1] > pair[0]) {
        for i in 0..dense {
            let s = pair[0] + (pair[1] - pair[0]) * (i as f64 + 0.5) / dense as f64;
            let piece = knots.partition_point(|&knot| knot <= s).clamp(1, knots.len() - 1) - 1;
            let place = problem.geometry.at(piece, s);
            let [w, w1, w2] = profile.at(s);
            let v = w.sqrt();
            worst[0] = worst[0].max(v / place.speed_cap - 1.0);
            for k in 0..M {
                let (q1, q2, q3) = (place.first[k], place.second[k], place.third[k]);
                let a = q2 * w + 0.5 * q1 * w1;
                let j = v * (q3 * w + 1.5 * q2 * w1 + 0.5 * q1 * w2);
                let used = |value: f64, most: &[[f64; M]; 2]| value.abs() / most[usize::from(value < 0.0)][k];
                worst[0] = worst[0].max(used(q1 * v, &limits.velocity) - 1.0);
                worst[1] = worst[1].max(used(a, &limits.acceleration) - 1.0);
                worst[2] = worst[2].max(j.abs() / limits.jerk[k] - 1.0);
            }
        }
    }
    worst
}

fn assert_held<const M: usize>(problem: &Problem<M>, profile: &Profile) {
    // With 17 points per interval, none coincides with one of the twelve points that the planner checks.
    let excess = excess(problem, profile, 17);
    assert!(excess.iter().all(|&part| part < HELD), "excess {excess:?}");
}

/// The time of a line from rest to rest in seven sections of constant jerk.
fn seven_sections(length: f64, [v, a, j]: [f64; 3]) -> f64 {
    let rise = |v: f64| if v * j <= a * a { 2.0 * (v / j).sqrt() } else { v / a + a / j };
    if v * rise(v) <= length {
        return 2.0 * rise(v) + (length - v * rise(v)) / v;
    }
    let (mut low, mut high) = (0.0, v);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * rise(middle) < length {
            low = middle;
        } else {
            high = middle;
        }
    }
    2.0 * rise(low)
}

#[test]
fn sides_of_a_square_take_as_long_as_by_hand() {
    // 100 mm/s is reached in 0.2 s + 0.01 s, the rest of the 100 mm takes 1.21 − 0.42 s: 4 × 1.21 s = 4.84 s.
    let line = Line::new(100.0);
    let problem = problem(&line, [100.0, 500.0, 50_000.0]);
    let plan = planned(&problem);
    assert!((4.0 * plan.time - 4.84).abs() < 4.84e-5, "{}", 4.0 * plan.time);
    assert_held(&problem, &plan.profile);
}

#[test]
fn lines_take_as_long_as_seven_sections() {
    for exponent in -3..=4 {
        let length = 10f64.powi(exponent);
        let line = Line::new(length);
        let problem = problem(&line, FAST);
        for (resolution, most) in [(16.0, 1e-5), (64.0, 2e-6)] {
            let plan =
                plan(&problem, &Effort { resolution, ..proving() }).expect("the line can be travelled");
            let part = plan.time / seven_sections(length, FAST) - 1.0;
            assert!((-1e-9..most).contains(&part), "{length} mm: {part:e} above the formula");
            assert!(plan.converged);
            assert_held(&problem, &plan.profile);
        }
    }
}

/// An axis with different limits for acceleration and deceleration.
#[test]
fn a_line_with_a_limit_for_each_direction_takes_as_long_as_its_sections() {
    let path = Line::new(100.0);
    for [up, down] in [[3000.0, 400.0], [500.0, 4000.0]] {
        let mut problem = problem(&path, FAST);
        problem.limits.acceleration = [[up], [down]];
        problem.limits.velocity[1] = [1.0];
        let plan = planned(&problem);
        assert_held(&problem, &plan.profile);
        // With the same limit for both, a line reaches its peak speed in the middle.
        let [_, _, j] = FAST;
        let rise = |v: f64, a: f64| if v * j <= a * a { 2.0 * (v / j).sqrt() } else { v / a + a / j };
        let (mut low, mut high) = (0.0, FAST[0]);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            let way = 0.5 * middle * (rise(middle, up) + rise(middle, down));
            (low, high) = if way < path.knots[1] { (middle, high) } else { (low, middle) };
        }
        let ramps = rise(low, up) + rise(low, down);
        let time = ramps + (path.knots[1] - 0.5 * low * ramps) / low;
        let error = plan.time / time - 1.0;
        assert!((-1e-6..2e-4).contains(&error), "{error:e} with {up} and {down}");
        let least = plan.lower_bound;
        assert!(least <= plan.time && least > 0.999 * time, "{least} of {time}");
    }
}

#[test]
fn units_do_not_change_the_answer() {
    let bend =
        |scale: f64| Bends::new(30.0 * scale, vec![Bend { s: 12.0 * scale, angle: 1.3, width: 2.0 * scale }]);
    let millimetres = bend(1.0);
    let expected = planned(&problem(&millimetres, FAST)).time;
    for scale in [1e-3, 1e3] {
        let path = bend(scale);
        let time = planned(&problem(&path, FAST.map(|limit| limit * scale))).time;
        assert!((time / expected - 1.0).abs() < 1e-6, "{time} and {expected}");
    }
}

fn infinity() -> ByLength<Lemniscate, 2> {
    let parameters: Vec<f64> = (0..=60).map(|i| FRAC_PI_2 + PI * i as f64 / 30.0).collect();
    ByLength::new(Lemniscate(50.0), &parameters, 20)
}

/// Plans from rest to rest, asserts the time and the limits, and returns the certified gap.
fn assert_curve<G: Geometry<M>, const M: usize>(geometry: &G, most: f64) -> f64 {
    let problem = problem(geometry, FAST);
    let plan = planned(&problem);
    assert!(plan.converged);
    assert!(plan.time <= most, "{} s", plan.time);
    assert_held(&problem, &plan.profile);
    assert!((plan.profile.time() / plan.time - 1.0).abs() < 1e-12);
    assert!(plan.lower_bound <= plan.time);
    1.0 - plan.lower_bound / plan.time
}

#[test]
fn the_lemniscate_is_optimal_and_holds_all_limits() {
    let gap = assert_curve(&infinity(), 1.3170);
    assert!(gap < 2e-5, "{gap:e}");
}

#[test]
fn the_trefoil_is_optimal_and_holds_all_limits() {
    let parameters: Vec<f64> = (0..=60).map(|i| 0.3 + PI * i as f64 / 30.0).collect();
    let gap = assert_curve(&ByLength::new(Trefoil(20.0), &parameters, 20), 2.0352);
    assert!(gap < 2e-5, "{gap:e}");
}

#[test]
fn the_butterfly_holds_all_limits_near_its_bound() {
    let nurbs = Nurbs::butterfly();
    let parameters = nurbs.parameters.clone();
    let gap = assert_curve(&ByLength::new(nurbs, &parameters, 8), 3.376);
    assert!(gap < 0.005, "{gap}");
}

/// Up to 24 bends on 0.03 mm to 1 m, as sharp as 1e-4 of their distance, under limits over orders of magnitude.
fn random_case(seed: u64) -> (Bends, [f64; 3]) {
    let mut random = Random(seed);
    let count = 1 + random.below(24);
    let length = random.power(-1.5, 3.0);
    let mut places: Vec<f64> = (0..count).map(|_| random.between(0.02, 0.98) * length).collect();
    places.sort_by(f64::total_cmp);
    let bends = places
        .iter()
        .map(|&s| {
            let angle = random.between(-2.0, 2.0);
            let width = (random.power(-4.0, 0.0) * length / count as f64).min(0.05 * length);
            Bend { s, angle, width }
        })
        .collect();
    (Bends::new(length, bends), [random.power(1.5, 3.0), random.power(3.0, 4.3), random.power(3.5, 6.5)])
}

#[test]
fn random_paths_hold_all_limits() {
    let mut stopped = 0;
    // In the cases of the last three seeds, the direction turns unevenly between collocation points.
    for seed in seeds(24).chain([663, 945, 1440]) {
        let (path, limits) = random_case(seed);
        let problem = problem(&path, limits);
        let plan = plan(&problem, &proving()).unwrap_or_else(|fault| panic!("seed {seed}: {fault:?}"));
        let excess = excess(&problem, &plan.profile, 17);
        assert!(excess.iter().all(|&part| part < HELD), "seed {seed}: excess {excess:?}");
        let least = plan.lower_bound;
        assert!(least <= plan.time * (1.0 + 1e-9), "seed {seed}: {least} s proven, {} s planned", plan.time);
        stopped += usize::from(!plan.converged);
    }
    assert!(stopped <= 2, "{stopped} paths did not converge");
}

/// All limits hold, and no plan is slower than with the lesser limits of both directions.
#[test]
fn random_paths_hold_limits_that_differ_by_direction() {
    for seed in seeds(4) {
        let (path, limits) = random_case(seed);
        let mut problem = problem(&path, limits);
        for k in 0..2 {
            let part = 0.3 + 0.1 * ((seed + k as u64) % 7) as f64;
            problem.limits.acceleration[(seed as usize + k) % 2][k] *= part;
            problem.limits.velocity[(seed as usize / 2 + k) % 2][k] *= part;
        }
        let plan = planned(&problem);
        assert_held(&problem, &plan.profile);
        let least = plan.lower_bound;
        assert!(least <= plan.time * (1.0 + 1e-9) && least > 0.8 * plan.time, "seed {seed}: {least}");
        for which in [&mut problem.limits.velocity, &mut problem.limits.acceleration] {
            let less = std::array::from_fn(|k| which[0][k].min(which[1][k]));
            *which = [less; 2];
        }
        let slow = planned(&problem).time;
        assert!(plan.time <= slow * (1.0 + 2e-4), "seed {seed}: {} and {slow}", plan.time);
    }
}

#[test]
fn every_iteration_leaves_a_valid_plan() {
    let path = infinity();
    let problem = problem(&path, FAST);
    let mut best = f64::INFINITY;
    for max_iterations in (0..40).step_by(5) {
        let effort = Effort { max_iterations, ..Effort::default() };
        let plan = plan(&problem, &effort).expect("there is a first plan");
        assert_held(&problem, &plan.profile);
        best = plan.time.min(best);
        assert!(plan.time < 1.02 * best, "{max_iterations} iterations: {} s after {best} s", plan.time);
    }
    assert!(best < 1.3170, "{best} s");
}

#[test]
fn a_plan_that_is_due_at_once_is_valid() {
    let path = infinity();
    let problem = problem(&path, FAST);
    let effort = Effort { deadline: Some(Instant::now()), ..Effort::default() };
    let plan = plan(&problem, &effort).expect("there is a first plan");
    assert!(!plan.converged);
    assert_held(&problem, &plan.profile);
}

/// A path of many alternating bends.
fn slalom(count: usize) -> Bends {
    let mut random = Random(7);
    let mut s = 0.0;
    let bends = (0..count)
        .map(|i| {
            s += random.between(4.0, 12.0);
            let angle = random.between(0.2, 1.5) * if i % 2 == 0 { 1.0 } else { -1.0 };
            Bend { s, angle, width: random.between(0.3, 1.5) }
        })
        .collect();
    Bends::new(s + 8.0, bends)
}

/// Limits with short stopping distances: many windows on a short path.
const SHORT_STOPS: [f64; 3] = [50.0, 3000.0, 1e6];

#[test]
fn windows_lose_less_than_a_millionth() {
    let path = slalom(60);
    let problem = problem(&path, SHORT_STOPS);
    let whole = plan(&problem, &Effort { window: usize::MAX, ..Effort::default() }).expect("a plan");
    let windows = plan(&problem, &Effort { window: 400, ..Effort::default() }).expect("a plan");
    assert!(whole.converged && windows.converged);
    let loss = windows.time / whole.time - 1.0;
    assert!(loss < 1e-6, "{loss:e}");
    assert_held(&problem, &windows.profile);
}

#[test]
fn windows_agree_where_the_optimum_lies_on_limits_all_along() {
    // With window ends fixed at the optimum of their neighbours, the windows did not reach the optimum here: 0.7 % of the time
    // was lost at one cut. Rounds with tightened limits start from the last solution; without its multipliers a round took some
    // ten iterations more.
    let path = Wave::new(200);
    let problem = problem(&path, FAST);
    let whole = plan(&problem, &Effort { window: usize::MAX, ..Effort::default() }).expect("a plan");
    let windows = plan(&problem, &Effort { window: 1000, ..Effort::default() }).expect("a plan");
    assert!(whole.converged && windows.converged);
    assert!(whole.iterations < 60.0, "{} iterations", whole.iterations);
    let loss = windows.time / whole.time - 1.0;
    assert!(loss < 1e-6, "{loss:e}");
    assert_held(&problem, &windows.profile);
}

#[test]
fn a_feed_is_reached_and_kept() {
    let path = Line { feed: 80.0, ..Line::new(100.0) };
    let problem = problem(&path, FAST);
    let plan = planned(&problem);
    let expected = seven_sections(100.0, [80.0, 3000.0, 50_000.0]);
    assert!((plan.time / expected - 1.0).abs() < 1e-5, "{} s", plan.time);
    assert_held(&problem, &plan.profile);
}

#[test]
fn speeds_at_single_places_are_kept() {
    // The plan passes both caps. Three plans from rest to rest over 20 mm each would take longer.
    let path = Line::new(60.0);
    let caps = [SpeedCap::new(20.0, 10.0), SpeedCap::new(40.0, 0.1)];
    let problem = Problem { caps: &caps, ..problem(&path, FAST) };
    let plan = planned(&problem);
    assert_held(&problem, &plan.profile);
    for cap in caps {
        let speed = plan.profile.at(cap.s)[0].sqrt();
        assert!(speed <= cap.speed * (1.0 + 1e-9), "{speed} mm/s at {} mm", cap.s);
        assert!(speed > 0.99 * cap.speed, "{speed} mm/s at {} mm", cap.s);
    }
    let stops = 3.0 * seven_sections(20.0, FAST);
    assert!(plan.time < stops && plan.time > seven_sections(60.0, FAST), "{} s, {stops} s", plan.time);
}

#[test]
fn moving_ends_are_met() {
    let path = slalom(5);
    let moving = |speed, acceleration| End::Moving { speed, acceleration };
    let problem = Problem { ends: [moving(60.0, 200.0), moving(40.0, -100.0)], ..problem(&path, FAST) };
    let plan = planned(&problem);
    let profile = &plan.profile;
    let last = profile.s.len() - 1;
    assert_eq!((profile.s[0], profile.speed_sq[0], profile.slope[0]), (0.0, 3600.0, 400.0));
    assert_eq!((profile.speed_sq[last], profile.slope[last]), (1600.0, -200.0));
    assert_held(&problem, profile);
}

/// A straight line along one axis, with a feed on each of two pieces.
struct TwoFeeds {
    knots: [f64; 3],
    feeds: [f64; 2],
}

impl Geometry<1> for TwoFeeds {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, piece: usize, _: f64) -> PathPoint<1> {
        PathPoint { first: [1.0], second: [0.0], third: [0.0], speed_cap: self.feeds[piece] }
    }
}

#[test]
fn the_bound_beside_a_held_feed_is_for_every_motion_there() {
    // A motion that arrives more slowly but already speeds up reaches 100 mm/s sooner than one that holds 20 mm/s up to 0.1 mm.
    let path = TwoFeeds { knots: [0.0, 0.1, 10.0], feeds: [20.0, 100.0] };
    let with =
        |start| planned(&Problem { ends: [start, End::Held { speed: 100.0 }], ..problem(&path, FAST) });
    let held = with(End::Held { speed: 20.0 });
    let sooner = with(End::Moving { speed: 18.0, acceleration: 300.0 });
    assert!(sooner.time < held.time, "{} s and {} s", sooner.time, held.time);
    assert!(held.lower_bound < sooner.time, "{} s proven, {} s planned", held.lower_bound, sooner.time);
    assert!(held.lower_bound > 0.9 * held.time, "{} s of {} s proven", held.lower_bound, held.time);
}

#[test]
fn ends_that_cannot_be_reached_are_refused() {
    let path = Line::new(10.0);
    let moving = End::Moving { speed: 200.0, acceleration: 0.0 };
    for (ends, s) in [([End::Rest, moving], 10.0), ([moving, End::Rest], 0.0)] {
        let problem = Problem { ends, ..problem(&path, FAST) };
        assert_eq!(plan(&problem, &Effort::default()).expect_err("200 mm/s in 10 mm"), Fault::NoPlan { s });
    }
}

#[test]
fn a_place_without_speed_is_refused() {
    let path = Line { feed: 0.0, ..Line::new(10.0) };
    assert!(matches!(plan(&problem(&path, FAST), &Effort::default()), Err(Fault::NoPlan { .. })));
}

#[test]
fn the_same_path_backwards_takes_as_long() {
    let path = slalom(8);
    let length = path.knots()[path.knots().len() - 1];
    let turned = |bend: &Bend| Bend { s: length - bend.s, angle: -bend.angle, width: bend.width };
    let total: f64 = path.bends().iter().map(|bend| bend.angle).sum();
    let mut back: Vec<Bend> = path.bends().iter().map(turned).collect();
    back.reverse();
    let back = Bends::turned(length, back, 0.3 + total + PI);
    let forth = planned(&problem(&path, FAST)).time;
    let time = planned(&problem(&back, FAST)).time;
    assert!((time / forth - 1.0).abs() < 2e-5, "{time} s and {forth} s");
}

#[test]
fn bad_numbers_are_refused_with_their_place() {
    let path = Line::new(10.0);
    let fault = plan(&problem(&path, [250.0, 0.0, 5e4]), &Effort::default()).expect_err("no acceleration");
    assert_eq!(
        fault,
        Fault::Input("the acceleration limit of axis 0 is 0 mm/s²: give a positive number".into())
    );
}

#[test]
fn the_excess_of_a_plan_says_how_far_it_is_from_the_best_on_its_grid() {
    let path = infinity();
    let problem = problem(&path, FAST);
    let at = |tolerance: f64| plan(&problem, &Effort { tolerance, ..Effort::default() }).expect("a plan");
    let best = at(1e-7);
    assert!(best.excess < 1e-6 * best.time, "{}", best.excess);
    for tolerance in [1e-1, 1e-2, 1e-3] {
        let rough = at(tolerance);
        assert!(rough.converged && rough.excess < 2.0 * tolerance * rough.time);
        assert!(rough.time - best.time < rough.excess, "{} of {}", rough.time - best.time, rough.excess);
    }
}
