//! Measures the time per segment of the jerk-limited profiler for several segment lengths, since stopping takes more segments if
//! they are short; and the time of the path dynamics before it.

use std::hint::black_box;
use std::time::Duration;

use criterion::{criterion_group, BenchmarkId, Criterion, Throughput};
use feedplan_jerk::path_limits::{allowable, bounded, sampled, AxisLimits, Curve};
use feedplan_jerk::s_curve::{Limits, Profiler, Segment};

/// Segments of about this length with speeds of 30 to 100 mm/s.
fn segments(count: usize, length: f64) -> Vec<Segment> {
    let limits = Limits { acceleration: 1000.0, jerk: 50_000.0 };
    (0..count)
        .map(|i| {
            let part = (i as f64 * 0.618_034).fract();
            let allowable = 30.0 + 70.0 * (i as f64 * 0.013).sin().abs();
            Segment {
                length: length * (0.5 + part),
                allowable,
                desired: 90.0,
                limits,
                junction: f64::INFINITY,
            }
        })
        .collect()
}

fn profile(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("s_curve");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    for (count, length) in [(1_000, 1.0), (10_000, 1.0), (100_000, 1.0), (10_000, 0.1), (10_000, 10.0)] {
        let segments = segments(count, length);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_with_input(BenchmarkId::new(format!("{length}_mm"), count), &count, |bencher, _| {
            let mut sections = vec![];
            bencher.iter(|| {
                let mut profiler = Profiler::new(256);
                for &segment in &segments {
                    profiler.push(segment, &mut sections).expect("a segment that can be planned");
                    sections.clear();
                }
                while profiler.drain(&mut sections) {
                    sections.clear();
                }
            });
        });
    }
    group.finish();
}

fn dynamics(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("path_dynamics");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let joints = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [2.0, 1.0, 0.3], [2.5, 2.0, 0.3]];
    let curve = Curve { joints: &joints, tip: None, weight: &[] };
    let rational = Curve { weight: &[1.0, 0.8, 0.9, 1.0], ..curve };
    group.bench_function("sampled_at_11", |bencher| bencher.iter(|| sampled(black_box(&curve), 11)));
    group.bench_function("bounded_5_percent", |bencher| bencher.iter(|| bounded(black_box(&curve), 0.05)));
    group.bench_function("bounded_rational", |bencher| bencher.iter(|| bounded(black_box(&rational), 0.05)));
    let shape = bounded(&curve, 0.05);
    let axes = AxisLimits { velocity: [[250.0; 3]; 2], acceleration: [[3000.0; 3]; 2], jerk: [50_000.0; 3] };
    group.bench_function("allowable", |bencher| {
        bencher.iter(|| allowable(black_box(&shape), &axes, 100.0, 10.0));
    });
    group.finish();
}

criterion_group!(benches, profile, dynamics);
