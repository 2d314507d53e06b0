//! Random and adversarial paths: every limit is kept, everywhere some limit is reached, and changes that do not change the path
//! do not change its time.

use feedplan_checks::{assert_none, audit, random_case, seeds, Audit, Case, Random, AXES};
use feedplan_geometry::quadratic::Quadratic;

/// The worst figures over cases with these seeds, and every failure as a sentence.
fn campaign(seeds: std::ops::Range<u64>) -> (Audit, Vec<String>) {
    let mut worst = Audit::default();
    let mut failures = vec![];
    for seed in seeds {
        let count = AXES[(seed % 4) as usize];
        feedplan_checks::for_axes!(count, M, {
            let case = random_case::<M>(seed);
            match case.plan() {
                Err(fault) => failures.push(format!("seed {seed}: {fault}")),
                Ok(profile) => {
                    let found = audit(&case, &profile.phases, 20);
                    if !(found.excess() < 1e-9
                        && found.idle < 1e-6
                        && found.jump < 1e-12
                        && found.duration < 1e-6)
                    {
                        failures.push(format!("seed {seed}: {found:?}"));
                    }
                    worst = worst.worst(&found);
                }
            }
        });
    }
    (worst, failures)
}

/// The greatest relative change of the time over cases with these seeds, and every failure.
fn changes(seeds: std::ops::Range<u64>) -> ([f64; 6], Vec<String>) {
    let mut worst = [0.0; 6];
    let mut failures = vec![];
    for seed in seeds {
        let count = AXES[(seed % 4) as usize];
        feedplan_checks::for_axes!(count, M, {
            let case = random_case::<M>(seed);
            let mut random = Random(seed ^ 0x5eed);
            let others = [
                ("reversed", case.reversed()),
                ("metres", case.scaled(1e-3)),
                ("micrometres", case.scaled(1e3)),
                ("split", case.split(&mut random)),
                ("permuted", case.permuted(&mut random)),
                ("reparametrised", case.reparametrised(&mut random)),
            ];
            let Ok(profile) = case.plan() else { continue };
            for ((name, other), worst) in others.iter().zip(&mut worst) {
                // Pieces cut in two have other least radii: their chord-error limits differ.
                if *name == "split" && case.chord_tolerance.is_finite() {
                    continue;
                }
                match other.plan() {
                    Err(fault) => failures.push(format!("seed {seed} {name}: {fault}")),
                    Ok(changed) => {
                        let change = (changed.phases.time() / profile.phases.time() - 1.0).abs();
                        if change > 1e-9 {
                            failures.push(format!("seed {seed} {name}: {change:.1e}"));
                        }
                        *worst = change.max(*worst);
                    }
                }
            }
        });
    }
    (worst, failures)
}

#[test]
fn every_limit_holds_and_one_is_active_everywhere() {
    let (worst, failures) = campaign(seeds(1_500));
    println!("{worst:?}");
    assert_none(&failures);
}

#[test]
fn the_time_depends_on_the_path_alone() {
    let (worst, failures) = changes(seeds(1_500));
    println!("{worst:?}");
    assert_none(&failures);
}

/// Two right angles rounded by parabolas, with equal limits for both axes: on the parabolas the limit curve is
/// constant, and rounding alone makes it fall or rise.
#[test]
fn a_level_limit_curve_is_passed() {
    let (x, middle, end) = ([-31.9377, -31.9066, -31.8755], 0.0311, 0.2474);
    let corners = [
        [[x[0], 119.96885], [x[0], 59.999975], [x[0], middle]],
        [[x[0], middle], [x[0], 0.0], [x[1], 0.0]],
        [[x[1], 0.0], [x[2], 0.0], [x[2], middle]],
        [[x[2], middle], [x[2], 0.5 * (middle + end)], [x[2], end]],
    ];
    let width = [119.93775, 0.0622, 0.0622, 0.2163];
    for nudge in 0..1000 {
        // The last digits of the points decide whether it falls or rises.
        let shift = 1e-9 * f64::from(nudge);
        let pieces = corners.iter().zip(width).map(|(control, width)| Quadratic {
            control: control.map(|[x, y]| [x + shift, y + 3.0 * shift]),
            width,
        });
        let case: Case<2> = Case::new(pieces.collect(), 100.0, [500.0; 2], [3000.0; 2]);
        let profile = case.plan().expect("a profile");
        let found = audit(&case, &profile.phases, 100);
        assert!(found.excess() < 1e-9 && found.jump < 1e-12, "{nudge}: {found:?}");
    }
}
