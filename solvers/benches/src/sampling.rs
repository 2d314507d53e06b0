//! Measures the time per setpoint with all derivatives, for each law of the phases, and per inversion of a length table.
//!
//! The path is a C1 quadratic spline of 1000 pieces in three axes, about 1.2 mm each; also with its degree raised, and with
//! weights that change the parameter. Its profile does not come from a planner: constant feed, or X speeding up and slowing down
//! in turn from piece to piece.

use criterion::{criterion_group, BenchmarkId, Criterion, Throughput};
use feedplan_geometry::spline::bezier::elevate;
use feedplan_geometry::spline::length::CurveLength;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases};
use feedplan_setpoints::sampling::{Interpolator, PathData, Sampler};

const PIECES: usize = 1000;
const SETPOINTS: usize = 100_000;

/// x = u; the slopes of y and z vary.
fn spline() -> CompositeCurve<3> {
    let slope = |i: usize| [1.0, (1.7 * i as f64).sin(), 0.5 * (2.3 * i as f64).cos()];
    let mut curve = CompositeCurve::default();
    let mut from = [0.0; 3];
    for i in 0..PIECES {
        let (a, b) = (slope(i), slope(i + 1));
        let middle = std::array::from_fn(|k| from[k] + 0.5 * a[k]);
        let to = std::array::from_fn(|k| middle[k] + 0.5 * b[k]);
        curve.push(&[from, middle, to], &[], 1.0);
        from = to;
    }
    curve
}

/// The same points with the degree raised by `by`, and with the weights 1, r, r²: X is no longer linear in u.
fn changed(curve: &CompositeCurve<3>, by: usize, r: f64) -> CompositeCurve<3> {
    let mut raised = CompositeCurve::default();
    for piece in curve.pieces() {
        elevate(&piece, by, &mut raised);
    }
    if r != 1.0 {
        let powers =
            |i: usize| (0..raised.piece(i).control.len()).map(|j| r.powi(j as i32)).collect::<Vec<_>>();
        raised.weights = (0..raised.len()).flat_map(powers).collect();
    }
    raised
}

fn profile(law: PhaseLaw, curve: &CompositeCurve<3>, r: f64) -> Phases {
    let lengths = CurveLength::new(curve, 1e-13, Watch::default());
    // x' of the weights 1, r, …, r^d on a piece with x' = 1 without them: r at its start, 1/r at its end.
    let at_ends = |p0: f64, p1: f64| (p0 / (r * r), p1 * r * r);
    (0..PIECES)
        .map(|i| {
            let phase = Phase {
                piece: i as u32,
                law,
                axis: 0,
                value: 1e4,
                u0: 0.0,
                u1: 1.0,
                p0: 1e4,
                p1: 1e4,
                duration: 0.01,
                a0: 0.0,
                a1: 0.0,
            };
            match law {
                PhaseLaw::Feed => {
                    Phase { duration: (lengths.length(i, 1.0) - lengths.length(i, 0.0)) / 100.0, ..phase }
                }
                // Between 50 and 100 mm/s on 1 mm.
                PhaseLaw::AxisAcceleration => {
                    let (p0, p1) = if i % 2 == 0 { (2500.0, 1e4) } else { (1e4, 2500.0) };
                    let value = 0.5 * (p1 - p0);
                    let (p0, p1) = at_ends(p0, p1);
                    Phase { value, p0, p1, duration: 1.0 / 75.0, ..phase }
                }
                _ => phase,
            }
        })
        .collect()
}

fn setpoints(c: &mut Criterion) {
    let mut group = c.benchmark_group("setpoints");
    group.throughput(Throughput::Elements(SETPOINTS as u64)).sample_size(20);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let shapes = [("quadratic", 0, 1.0), ("cubic", 1, 1.0), ("quintic", 3, 1.0), ("rational cubic", 1, 1.5)];
    for (shape, by, r) in shapes {
        for law in [PhaseLaw::AxisAcceleration, PhaseLaw::Feed] {
            for interpolator in [Interpolator::Sarfraz, Interpolator::Newton] {
                let curve = changed(&spline(), by, r);
                let phases = profile(law, &curve, r);
                let time: f64 = phases.duration.iter().sum();
                let path = PathData {
                    curve: curve.into(),
                    axes: 3,
                    tip_speed: None,
                    way_speed: None,
                    feed_share: vec![],
                    lines: vec![1; PIECES],
                    runs: vec![0, PIECES],
                    start_dwell: 0.0,
                    dwell: vec![0.0],
                };
                let period = time / (SETPOINTS - 1) as f64;
                let sampler =
                    Sampler::on(&path.into(), &phases.into(), &[0, PIECES], period, Watch::default())
                        .expect("a profile");
                let name = BenchmarkId::new(format!("{interpolator:?}, {shape}"), format!("{law:?}"));
                group.bench_function(name, |b| {
                    b.iter(|| {
                        one_thread.install(|| {
                            sampler.chunk(0..SETPOINTS, interpolator, &mut None, Watch::default())
                        })
                    })
                });
            }
        }
    }
    group.finish();
}

fn lengths(c: &mut Criterion) {
    let mut group = c.benchmark_group("lengths");
    let curve = spline();
    group.throughput(Throughput::Elements(PIECES as u64));
    group.bench_function("table per piece", |b| b.iter(|| CurveLength::new(&curve, 1e-13, Watch::default())));
    let table = CurveLength::new(&curve, 1e-13, Watch::default());
    for count in [500, 50_000] {
        let wanted: Vec<f64> = (0..count).map(|i| table.total() * i as f64 / count as f64).collect();
        let tolerance = 1e-6 * table.total() / count as f64;
        group.throughput(Throughput::Elements(count));
        group.bench_function(BenchmarkId::new("Sarfraz", count), |b| {
            b.iter(|| wanted.iter().map(|&s| table.locate(s, tolerance).1).sum::<f64>())
        });
    }
    group.finish();
}

criterion_group!(benches, setpoints, lengths);
