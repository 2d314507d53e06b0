//! Measures the time per point of a curve: derivatives up to the third, lengths, and points at lengths; and the time per piece:
//! extraction, length table, cusps. Cubics in three axes, polynomial and rational.

use criterion::{criterion_group, Criterion, Throughput};
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::cusps::piece_cusps;
use feedplan_geometry::spline::extract::extract;
use feedplan_geometry::spline::knots::Spline;
use feedplan_geometry::spline::length::CurveLength;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::tolerance::CUSP;
use feedplan_geometry::watch::Watch;

const SPANS: usize = 1000;

/// A winding curve with weights between 0.5 and 2.
fn winding(degree: usize, rational: bool) -> Spline<3> {
    let points = SPANS + degree;
    let control = (0..points)
        .map(|i| {
            let x = i as f64;
            [10.0 * x + 7.0 * (2.1 * x).sin(), 30.0 * (0.7 * x).cos(), 5.0 * (1.3 * x).sin()]
        })
        .collect();
    let knots = (0..points + degree + 1).map(|i| i.clamp(degree, points) as f64).collect();
    let weights =
        if rational { (0..points).map(|i| 2f64.powf((1.7 * i as f64).sin())).collect() } else { vec![] };
    Spline::new(degree, knots, control, weights).expect("a checked spline")
}

fn spline(criterion: &mut Criterion) {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("spline");
    group.throughput(Throughput::Elements(SPANS as u64));
    for (name, degree, rational) in
        [("cubic", 3, false), ("rational cubic", 3, true), ("quintic", 5, false), ("degree 9", 9, false)]
    {
        let spline = winding(degree, rational);
        let curve: CompositeCurve<3> = extract(&spline).expect("one curve");
        let length = CurveLength::new(&curve, 1e-13, Watch::default());
        group.bench_function(format!("extract, {name}"), |bencher| bencher.iter(|| extract(&spline)));
        group.bench_function(format!("derivatives to the third, {name}"), |bencher| {
            bencher.iter(|| {
                let mut sum = 0.0;
                for i in 0..SPANS {
                    let c = derivatives(&curve.piece(i), (i as f64 * 0.618).fract());
                    sum += c[0][0] + c[1][1] + c[2][2] + c[3][0];
                }
                sum
            });
        });
        group.bench_function(format!("cusps, {name}"), |bencher| {
            bencher.iter(|| curve.pieces().map(|piece| piece_cusps(&piece, CUSP).len()).sum::<usize>())
        });
        group.bench_function(format!("length table, {name}"), |bencher| {
            one.install(|| bencher.iter(|| CurveLength::new(&curve, 1e-13, Watch::default())));
        });
        group.bench_function(format!("length at a place, {name}"), |bencher| {
            bencher.iter(|| {
                (0..SPANS).map(|i| length.length(i, (i as f64 * 0.618).fract())).fold(0.0, f64::max)
            });
        });
        group.bench_function(format!("place at a length to 1e-9 mm, {name}"), |bencher| {
            bencher.iter(|| {
                let step = length.total() / SPANS as f64;
                (0..SPANS).map(|i| length.locate(i as f64 * step, 1e-9).1).fold(0.0, f64::max)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, spline);
