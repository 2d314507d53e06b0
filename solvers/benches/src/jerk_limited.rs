//! Measures the time per interval and iteration of the jerk-limited planner in three axes on one thread: of whole plans,
//! including preparation and checks between the stations, and of iterations alone, from two plans that differ only in the number
//! of iterations.

use std::time::{Duration, Instant};

use criterion::{criterion_group, BenchmarkId, Criterion, Throughput};
use feedplan_jerk::jerk_limited::{plan, Effort, End, Geometry, Limits, PathPoint, Problem};

/// A space curve that winds to both sides and up and down, with its derivatives by length.
struct Winding([f64; 2]);

impl Geometry<3> for Winding {
    fn knots(&self) -> &[f64] {
        &self.0
    }

    fn at(&self, _: usize, s: f64) -> PathPoint<3> {
        // Angles of the direction, and two derivatives.
        let (x, z) = (0.31 * s, 0.17 * s);
        let turn = [2.0 * x.sin(), 0.62 * x.cos(), -0.1922 * x.sin()];
        let rise = [0.5 * z.sin(), 0.085 * z.cos(), -0.01445 * z.sin()];
        let ([sin, cos], [up, flat]) = ([turn[0].sin(), turn[0].cos()], [rise[0].sin(), rise[0].cos()]);
        let first = [cos * flat, sin * flat, up];
        let [aside, upward] = [[-sin * flat, cos * flat, 0.0], [-cos * up, -sin * up, flat]];
        let mixed = [sin * up, -cos * up, 0.0];
        let level = [-cos * flat, -sin * flat, 0.0];
        let second = std::array::from_fn(|k| turn[1] * aside[k] + rise[1] * upward[k]);
        let third = std::array::from_fn(|k| {
            turn[2] * aside[k]
                + rise[2] * upward[k]
                + turn[1] * turn[1] * level[k]
                + 2.0 * turn[1] * rise[1] * mixed[k]
                - rise[1] * rise[1] * first[k]
        });
        PathPoint { first, second, third, speed_cap: f64::INFINITY }
    }
}

/// The numbers of iterations of the two plans; both are too few to converge.
const ITERATIONS: [usize; 2] = [3, 12];

fn jerk_limited(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("jerk_limited");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let limits = Limits { velocity: [[250.0; 3]; 2], acceleration: [[3000.0; 3]; 2], jerk: [50_000.0; 3] };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for length in [100.0, 1_000.0, 10_000.0] {
        let geometry = Winding([0.0, length]);
        let problem =
            Problem { geometry: &geometry, limits, moves: [true; 3], caps: &[], ends: [End::Rest; 2] };
        let planned = |max_iterations: usize| {
            let effort = Effort { max_iterations, ..Effort::default() };
            one.install(|| plan(&problem, &effort).expect("a plan"))
        };
        let steps = |max_iterations: usize| {
            let plan = planned(max_iterations);
            (plan.profile.s.len() - 1) as f64 * plan.iterations
        };
        let whole = Effort::default().max_iterations;
        group.throughput(Throughput::Elements(steps(whole) as u64));
        group.bench_with_input(BenchmarkId::new("plan", length), &whole, |bencher, &whole| {
            bencher.iter(|| planned(whole));
        });
        let [few, many] = ITERATIONS;
        group.throughput(Throughput::Elements((steps(many) - steps(few)) as u64));
        group.bench_with_input(BenchmarkId::new("iterations", length), &[few, many], |bencher, both| {
            bencher.iter_custom(|count| {
                let difference = || {
                    let [few, many] = both.map(|most| {
                        let start = Instant::now();
                        planned(most);
                        start.elapsed()
                    });
                    many.saturating_sub(few)
                };
                (0..count).map(|_| difference()).sum()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, jerk_limited);
