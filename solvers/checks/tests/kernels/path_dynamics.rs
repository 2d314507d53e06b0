//! Path dynamics and profile together keep the limits of every axis, by third differences of positions. These share no
//! formula with the kernels: lengths come from quadrature.

use feedplan_checks::{seeds, Random};
use feedplan_geometry::watch::Watch;
use feedplan_jerk::path_limits::{allowable, bounded, chord_speed, sampled, AxisLimits, Curve, Shape};
use feedplan_jerk::s_curve::{plan, Limits, Section, Segment};

const AXES: AxisLimits<2> =
    AxisLimits { velocity: [[170.0, 180.0]; 2], acceleration: [[400.0, 600.0]; 2], jerk: [4000.0, 6000.0] };
/// Servo period in s; differences over it are averages of the derivatives.
const PERIOD: f64 = 0.002;

type Control = Vec<[f64; 2]>;

/// Weighted value and derivative of a curve, by de Casteljau.
fn evaluate(control: &[[f64; 2]], weight: &[f64], u: f64) -> ([f64; 2], f64) {
    let mut points: Vec<[f64; 3]> =
        control.iter().zip(weight).map(|(p, w)| [p[0] * w, p[1] * w, *w]).collect();
    let degree = (points.len() - 1) as f64;
    while points.len() > 2 {
        points =
            points.windows(2).map(|p| std::array::from_fn(|k| p[0][k] + u * (p[1][k] - p[0][k]))).collect();
    }
    let rate: [f64; 3] = std::array::from_fn(|k| degree * (points[1][k] - points[0][k]));
    let value: [f64; 3] = std::array::from_fn(|k| points[0][k] + u * (points[1][k] - points[0][k]));
    let place = [value[0] / value[2], value[1] / value[2]];
    let speed = |k: usize| (rate[k] - place[k] * rate[2]) / value[2];
    (place, speed(0).hypot(speed(1)))
}

/// The part of a curve on [a, b], with weights (blossoms).
fn part(control: &[[f64; 2]], weight: &[f64], a: f64, b: f64) -> (Control, Vec<f64>) {
    let points: Vec<[f64; 3]> = control.iter().zip(weight).map(|(p, w)| [p[0] * w, p[1] * w, *w]).collect();
    let degree = points.len() - 1;
    (0..=degree)
        .map(|i| {
            let mut row = points.clone();
            for j in 0..degree {
                let u = if j < i { b } else { a };
                row = row
                    .windows(2)
                    .map(|p| std::array::from_fn(|k| p[0][k] + u * (p[1][k] - p[0][k])))
                    .collect();
            }
            ([row[0][0] / row[0][2], row[0][1] / row[0][2]], row[0][2])
        })
        .unzip()
}

/// Lengths from u = 0 to the end of each of `count` equal steps of u, by Simpson's rule on ten intervals per step.
fn lengths(control: &[[f64; 2]], weight: &[f64], count: usize) -> Vec<f64> {
    let speed = |u: f64| evaluate(control, weight, u).1;
    let mut all = vec![0.0];
    for i in 0..count {
        let step = 0.1 / count as f64;
        let sum: f64 = (0..10)
            .map(|j| {
                let u = i as f64 / count as f64 + f64::from(j) * step;
                step / 6.0 * (speed(u) + 4.0 * speed(u + 0.5 * step) + speed(u + step))
            })
            .sum();
        all.push(all[i] + sum);
    }
    all
}

/// The parameter at a length, from a table and Newton's method.
fn locate(control: &[[f64; 2]], weight: &[f64], table: &[f64], length: f64) -> f64 {
    let count = table.len() - 1;
    let i = table.partition_point(|&at| at <= length).clamp(1, count) - 1;
    let start = i as f64 / count as f64;
    let speed = |u: f64| evaluate(control, weight, u).1;
    let mut u = start + (length - table[i]) / (table[i + 1] - table[i]) / count as f64;
    for _ in 0..4 {
        let step = 0.25 * (u - start);
        let sum: f64 = (0..4)
            .map(|j| {
                let at = start + f64::from(j) * step;
                step / 6.0 * (speed(at) + 4.0 * speed(at + 0.5 * step) + speed(at + step))
            })
            .sum();
        u -= (table[i] + sum - length) / speed(u);
    }
    u
}

/// Positions along the path [mm], one per servo period.
fn positions(sections: &[Section]) -> Vec<f64> {
    let last = sections.last().expect("a motion");
    let count = ((last.time + last.duration) / PERIOD) as usize;
    let mut i = 0;
    (0..=count)
        .map(|step| {
            let time = step as f64 * PERIOD;
            while i + 1 < sections.len() && sections[i + 1].time <= time {
                i += 1;
            }
            sections[i].state(time - sections[i].time)[0]
        })
        .collect()
}

/// The greatest use of every limit: velocity, acceleration, jerk over both axes, and the time.
fn uses(control: &Control, weight: &[f64], shape: impl Fn(&Curve<2>) -> Shape<2>) -> ([f64; 3], f64) {
    const PARTS: usize = 8;
    let table = lengths(control, weight, 16 * PARTS);
    let total = table[16 * PARTS];
    let segments: Vec<Segment> = (0..PARTS)
        .map(|i| {
            let (joints, weight) =
                part(control, weight, i as f64 / PARTS as f64, (i + 1) as f64 / PARTS as f64);
            let shape = shape(&Curve { joints: &joints, tip: None, weight: &weight });
            let chord = chord_speed(shape.curvature, 0.0254, PERIOD);
            let found = allowable(&shape, &AXES, chord.min(150.0), total).expect("a curve without cusps");
            let Limits { acceleration, jerk } = found.limits;
            Segment {
                length: table[16 * (i + 1)] - table[16 * i],
                allowable: found.speed,
                desired: 150.0,
                limits: Limits { acceleration, jerk },
                junction: f64::INFINITY,
            }
        })
        .collect();
    let sections = plan(&segments, PARTS, Watch::default()).expect("a profile");
    let places: Vec<[f64; 2]> = positions(&sections)
        .into_iter()
        .map(|length| evaluate(control, weight, locate(control, weight, &table, length)).0)
        .collect();
    let mut worst = [0.0_f64; 3];
    for k in 0..2 {
        for p in places.windows(4) {
            let [a, b, c, d] = [p[0][k], p[1][k], p[2][k], p[3][k]];
            let found = [b - a, c - 2.0 * b + a, d - 3.0 * (c - b) - a];
            let limits = [AXES.velocity[0][k], AXES.acceleration[0][k], AXES.jerk[k]];
            for order in 0..3 {
                worst[order] =
                    worst[order].max(found[order].abs() / PERIOD.powi(order as i32 + 1) / limits[order]);
            }
        }
    }
    let last = sections[sections.len() - 1];
    (worst, last.time + last.duration)
}

/// A curve of degree 3 to 6 that advances along x and swings along y.
fn random_curve(random: &mut Random) -> (Control, Vec<f64>) {
    let degree = 3 + random.below(4);
    let size = random.exponential(1.0, 4.0);
    let point = |random: &mut Random, i: usize| {
        [size * (i as f64 + random.between(-0.4, 0.4)), size * random.between(-1.5, 1.5)]
    };
    let control = (0..=degree).map(|i| point(random, i)).collect();
    let rational = random.chance(0.5);
    let weight = (0..=degree).map(|_| if rational { random.between(0.6, 1.6) } else { 1.0 }).collect();
    (control, weight)
}

#[test]
fn axes_keep_their_limits_along_random_curves() {
    let mut most = [0.0_f64; 3];
    for seed in seeds(100) {
        let (control, weight) = random_curve(&mut Random(seed));
        let (uses, _) = uses(&control, &weight, |curve| bounded(curve, 0.05));
        for order in 0..3 {
            // Positions have errors of 1e-11 mm, and third differences errors of a thousandth of the jerk limit.
            assert!(uses[order] < 1.0 + 2e-3, "seed {seed}: {uses:?}");
            most[order] = most[order].max(uses[order]);
        }
    }
    println!("{most:?}");
    assert!(most.iter().all(|&most| most > 0.5), "limits are far from used: {most:?}");
}

#[test]
fn few_samples_break_limits_that_the_bounds_keep() {
    // The ends of eight segments: about the Δu = 0.1 of the thesis on the whole curve.
    let mut broken = 0;
    for seed in seeds(100) {
        let (control, weight) = random_curve(&mut Random(seed));
        broken += usize::from(uses(&control, &weight, |curve| sampled(curve, 2)).0[2] > 1.01);
    }
    println!("{broken} curves");
    assert!(broken > 0);
}
