//! The planner for pieces of any degree: on quadratics it agrees with the quadratic planner, and what does not matter
//! to the path does not change its time.

use feedplan_checks::{milder_case, Case, Elevated, FEW_AXES};
use feedplan_planner::bang_bang::plan;
use feedplan_planner::bang_bang_quadratic::{Fault, Profile};

/// The case planned as pieces of degree 2, or elevated.
fn general<const M: usize>(case: &Case<M>, elevate: usize) -> Result<Profile, Fault> {
    plan(&Elevated::new(case, elevate).problem(case))
}

#[test]
fn quadratics_take_the_time_of_the_quadratic_planner() {
    let mut failures = vec![];
    for seed in 0..2000 {
        let axes = FEW_AXES[(seed % 3) as usize];
        feedplan_checks::for_few_axes!(axes, M, {
            let mut case = milder_case::<M>(seed);
            case.chord_tolerance = f64::INFINITY;
            let exact = case.time();
            for elevate in [0, 1] {
                match general(&case, elevate) {
                    Err(fault) => failures.push(format!("seed {seed} elevated by {elevate}: {fault}")),
                    Ok(profile) => {
                        let change = (profile.time() / exact - 1.0).abs();
                        if change.is_nan() || change > 1e-12 {
                            failures.push(format!("seed {seed} elevated by {elevate}: {change:.1e}"));
                        }
                    }
                }
            }
        });
    }
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(40)].join("\n")
    );
}

/// Next to rest the guard must take an arc's way and tangent at one place.
#[test]
fn the_guard_makes_no_alarm_of_its_own_next_to_rest() {
    for seed in [27_653, 47_526] {
        let mut case = milder_case::<2>(seed);
        case.chord_tolerance = f64::INFINITY;
        let profile = general(&case, 0).expect("a profile");
        let change = profile.time() / case.time() - 1.0;
        assert!(profile.slowed.is_empty() && change.abs() < 1e-12, "seed {seed}: {change:.1e}");
    }
}

/// The chord-error limit is taken with a margin, by each planner in its own way.
#[test]
fn with_a_chord_error_limit_the_times_agree_to_the_margin() {
    for seed in 0..600 {
        let case = milder_case::<3>(seed);
        if case.chord_tolerance.is_finite() {
            let profile = general(&case, 0).expect("a profile");
            let change = profile.time() / case.time() - 1.0;
            // The quadratic planner gives away δ/(4 ρ) where ρ doubles, this one 4e-4 of v² at most.
            assert!(change > -0.05 && change < 1e-3, "seed {seed}: {change:.1e}");
        }
    }
}
