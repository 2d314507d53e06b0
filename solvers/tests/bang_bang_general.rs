//! The planner for pieces of any degree: on quadratics it agrees with the quadratic planner, and what does not matter
//! to the path does not change its time.

mod support;

use feedplan_solvers::bang_bang::{plan, Problem};
use feedplan_solvers::bang_bang_quadratic::{Fault, Profile};
use support::{random_case, Case};

/// The case planned as pieces of degree 2, or elevated.
fn general<const M: usize, const C: usize>(case: &Case<M>, elevate: usize) -> Result<Profile, Fault> {
    let mut control: Vec<[f64; M]> = vec![];
    let mut offset = vec![0];
    for piece in &case.pieces {
        let mut points = piece.control.to_vec();
        for _ in 0..elevate {
            let n = points.len() as f64;
            let mut higher = vec![points[0]];
            for i in 1..points.len() {
                let t = i as f64 / n;
                higher.push(std::array::from_fn(|k| t * points[i - 1][k] + (1.0 - t) * points[i][k]));
            }
            higher.push(points[points.len() - 1]);
            points = higher;
        }
        control.extend(points);
        offset.push(control.len());
    }
    let width: Vec<f64> = case.pieces.iter().map(|piece| piece.width).collect();
    plan::<M, C>(&Problem {
        control: &control,
        weight: &[],
        offset: &offset,
        width: &width,
        tip_speed: None,
        runs: &[0, case.pieces.len()],
        feed: &case.feed,
        junction_speed: &case.junction,
        max_velocity: case.velocity,
        max_acceleration: case.acceleration,
        chord_tolerance: case.chord_tolerance,
        period: case.period,
        start_speed: case.start_speed,
        end_speed: case.end_speed,
    })
}

#[test]
fn quadratics_take_the_time_of_the_quadratic_planner() {
    let mut failures = vec![];
    let (mut worst, mut count) = (0.0_f64, 0);
    for seed in 0..std::env::var("SEEDS").map_or(600, |n| n.parse().unwrap()) {
        let axes = 1 + (seed % 6) as usize;
        for_axes!(axes, M, {
            let mut case = random_case::<M>(seed);
            case.chord_tolerance = f64::INFINITY;
            let exact = case.time();
            count += 1;
            for elevate in [0, 1] {
                match general::<M, 16>(&case, elevate) {
                    Err(fault) => failures.push(format!("seed {seed} +{elevate}: {fault}")),
                    Ok(profile) => {
                        let change = (profile.time() / exact - 1.0).abs();
                        worst = worst.max(change);
                        if !(change < 1e-9) {
                            failures.push(format!(
                                "seed {seed} +{elevate}: {change:.1e} {} {exact}",
                                profile.time()
                            ));
                        }
                    }
                }
            }
        });
    }
    println!("worst {worst:e} of {count}");
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(60)].join("\n")
    );
}

#[test]
fn one() {
    let Ok(seed) = std::env::var("SEED") else { return };
    let seed: u64 = seed.parse().unwrap();
    let axes = 1 + (seed % 6) as usize;
    for_axes!(axes, M, {
        let mut case = random_case::<M>(seed);
        case.chord_tolerance = f64::INFINITY;
        let a = case.plan().unwrap();
        let b = general::<M, 16>(&case, 0).unwrap();
        let show = |name: &str, p: &Profile, i: usize| {
            for r in 0..p.len() {
                if p.piece[r] as usize == i {
                    println!(
                        "   {name} kind {} axis {} value {:e} u {:e} {:e} p {:e} {:e} t {:e}",
                        p.kind[r], p.axis[r], p.value[r], p.u0[r], p.u1[r], p.p0[r], p.p1[r], p.duration[r]
                    );
                }
            }
        };
        for i in 0..case.pieces.len() {
            let t = |p: &Profile| {
                (0..p.len()).filter(|&r| p.piece[r] as usize == i).map(|r| p.duration[r]).sum::<f64>()
            };
            if std::env::var("ALL").is_ok() || !((t(&a) - t(&b)).abs() < 1e-9 * t(&a)) {
                println!(
                    "piece {i} feed {} control {:?} width {}",
                    case.feed[i], case.pieces[i].control, case.pieces[i].width
                );
                show("A", &a, i);
                show("B", &b, i);
            }
        }
        println!("V {:?} A {:?} junction {:?}", case.velocity, case.acceleration, case.junction);
    });
}
