//! Random and adversarial paths: every limit holds, some limit is active everywhere, and what does not matter to
//! the path does not change its time.

mod support;

use support::{audit, random_case, Audit, Random};

/// The worst figures over cases with these seeds, and every failure as a sentence.
fn campaign(seeds: std::ops::Range<u64>) -> (Audit, Vec<String>) {
    let mut worst = Audit::default();
    let mut failures = vec![];
    for seed in seeds {
        let count = 1 + (seed % 6) as usize;
        for_axes!(count, M, {
            let case = random_case::<M>(seed);
            match case.plan() {
                Err(fault) => failures.push(format!("seed {seed}: {fault}")),
                Ok(profile) => {
                    let found = audit(&case, &profile, 20);
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
        let count = 1 + (seed % 6) as usize;
        for_axes!(count, M, {
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
                        let change = (changed.time() / profile.time() - 1.0).abs();
                        if change > 1e-10 {
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
    let (worst, failures) = campaign(0..200_000);
    println!("{worst:?}");
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(400)].join("\n")
    );
}

#[test]
fn the_time_depends_on_the_path_alone() {
    let (worst, failures) = changes(0..100_000);
    println!("{worst:?}");
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(400)].join("\n")
    );
}
