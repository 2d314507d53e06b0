//! Measures the time per piece of the exact planner on one thread, for ten pieces to a million: it should not depend on their
//! number.

use std::time::Duration;

use criterion::{criterion_group, BenchmarkId, Criterion, Throughput};
use feedplan_checks::{problem, Random};
use feedplan_geometry::quadratic::{norm, sub, Quadratic};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_planner::problem::Problem;
use feedplan_planner::Exact as _;

/// A C1 quadratic B-spline like those through points of a CAM system: edges of 0.3 to 3 mm, small turns, 8 % of them sharp.
fn cam_path(count: usize, seed: u64) -> Vec<Quadratic<3>> {
    let mut random = Random(seed);
    let mut direction = [1.0, 0.0, 0.0];
    let mut points = vec![[0.0; 3]];
    for _ in 0..=count {
        let edge = (0.3f64.ln() + random.uniform() * 10f64.ln()).exp();
        let sharp = random.uniform() < 0.08;
        let keep = if sharp { random.uniform() - 0.5 } else { 1.0 };
        let turn = if sharp { 0.6 } else { 0.15 };
        direction = direction.map(|value: f64| keep * value + turn * random.normal());
        let length = norm(&direction);
        direction = direction.map(|value| value / length);
        let last = points[points.len() - 1];
        points.push(std::array::from_fn(|k| last[k] + edge * direction[k]));
    }
    let edges: Vec<f64> = points.windows(2).map(|pair| norm(&sub(&pair[1], &pair[0]))).collect();
    let width = |i: usize| if i < count { 0.5 * (edges[i] + edges[i + 1]) } else { 0.0 };
    // Knots: the piece of control point i + 1 begins where its knot span divides the edge.
    let knot = |i: usize| {
        let (before, after) = (if i == 0 { 0.0 } else { width(i - 1) }, width(i));
        let part = before / (before + after);
        std::array::from_fn(|k| points[i][k] + part * (points[i + 1][k] - points[i][k]))
    };
    (0..count)
        .map(|i| Quadratic { control: [knot(i), points[i + 1], knot(i + 1)], width: width(i) })
        .collect()
}

fn pieces(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("bang_bang");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    for (name, feed) in [("feed_100", 100.0), ("feed_400", 400.0)] {
        for count in [10, 100, 1_000, 10_000, 100_000, 1_000_000] {
            let path = cam_path(count, 1);
            let (runs, feed, junction) = ([0, count], vec![feed; count], vec![f64::INFINITY; count + 1]);
            group.throughput(Throughput::Elements(count as u64));
            group.bench_with_input(BenchmarkId::new(name, count), &count, |bencher, _| {
                let mut curve = CompositeCurve::default();
                path.iter().for_each(|piece| curve.push(&piece.control, &[], piece.width));
                let limits = [[250.0; 3], [3000.0, 3000.0, 1000.0]];
                let problem = problem(&curve, &runs, &feed, &junction, limits);
                let problem = Problem { chord_tolerance: 0.01, ..problem };
                pool.install(|| bencher.iter(|| problem.fastest().expect("a profile")));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, pieces);
