//! Measures the time of the fit per chain: a smooth finishing pass like those of CAM systems, of 500 to 500 000 points, on one
//! thread and on all, and two chains that need much refinement.

use criterion::{criterion_group, BenchmarkId, Criterion, Throughput};
use feedplan_geometry::watch::Watch;
use feedplan_path::fit::{fit_points, FitOptions};

const OPTIONS: FitOptions = FitOptions {
    tolerance: 0.01,
    max_chord: 10.0,
    max_curvature: 0.9,
    corner_angle: std::f64::consts::FRAC_PI_6,
};

/// A freeform relief, cut back and forth with steps of about 0.25 mm, on a grid of 1 µm, the usual resolution of programs.
fn finishing(count: usize) -> Vec<[f64; 3]> {
    let grid = |value: f64| (value * 1000.0).round() / 1000.0;
    let mut points: Vec<[f64; 3]> = (0..count)
        .map(|i| {
            let turn = 0.25 * i as f64 / 60.0;
            let y = 60.0 * turn.sin();
            let x = 0.1 * turn;
            let z = 5.0 * (0.11 * y + 0.3 * x).sin() + 1.5 * (0.35 * y).cos() + 0.4 * (0.9 * y + x).sin();
            [grid(x), grid(y), grid(z)]
        })
        .collect();
    points.dedup();
    points
}

/// A line with noise greater than the tolerance: no smooth curve follows the points within the tolerance.
fn rough(count: usize) -> Vec<[f64; 3]> {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..count).map(|i| [0.02 * i as f64, 0.06 * random(), 0.06 * random()]).collect()
}

/// Chords of a spiral of growing radius, without extremes and breaks; the outer chords are too long for the tolerance.
fn spiral(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let angle = 0.03 * i as f64;
            [0.003 * angle * angle.cos(), 0.003 * angle * angle.sin(), 0.0]
        })
        .collect()
}

fn fit(criterion: &mut Criterion) {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("fit");
    group.sample_size(10);
    for count in [500, 5_000, 50_000, 500_000] {
        let points = finishing(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_with_input(
            BenchmarkId::new("finishing, one thread", count),
            &points,
            |bencher, points| {
                one.install(|| bencher.iter(|| fit_points(points, &OPTIONS, Watch::default())));
            },
        );
    }
    for (name, points) in
        [("finishing", finishing(500_000)), ("rough", rough(100_000)), ("spiral", spiral(100_000))]
    {
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_with_input(BenchmarkId::new(name, points.len()), &points, |bencher, points| {
            bencher.iter(|| fit_points(points, &OPTIONS, Watch::default()));
        });
    }
    group.finish();
}

criterion_group!(benches, fit);
