//! The kernel of curves: on quadratics of elevated degree it agrees with the closed forms of `quadratic`.

use feedplan_checks::{assert_none, milder_case, FEW_AXES};

#[test]
fn quadratics_of_elevated_degree_take_the_same_time() {
    let mut failures = vec![];
    for seed in 0..2000 {
        let axes = FEW_AXES[(seed % 3) as usize];
        feedplan_checks::for_axes!(axes, M, {
            let mut case = milder_case::<M>(seed);
            case.chord_tolerance = f64::INFINITY;
            let exact = case.time();
            for elevate in [1, 2] {
                match case.plan_elevated(elevate) {
                    Err(fault) => failures.push(format!("seed {seed} elevated by {elevate}: {fault}")),
                    Ok(profile) => {
                        let change = (profile.phases.time() / exact - 1.0).abs();
                        if change.is_nan() || change > 1e-12 {
                            failures.push(format!("seed {seed} elevated by {elevate}: {change:.1e}"));
                        }
                    }
                }
            }
        });
    }
    assert_none(&failures);
}

/// Near rest, the check must evaluate the distance and the tangent of a phase at the same point.
#[test]
fn the_guard_makes_no_alarm_of_its_own_next_to_rest() {
    for seed in [27_653, 47_526] {
        let mut case = milder_case::<2>(seed);
        case.chord_tolerance = f64::INFINITY;
        let profile = case.plan_elevated(1).expect("a profile");
        let change = profile.phases.time() / case.time() - 1.0;
        assert!(profile.slowed.is_empty() && change.abs() < 1e-12, "seed {seed}: {change:.1e}");
    }
}

/// Both kernels replace the chord-error limit by straight lines below it, between turns or over a whole piece.
#[test]
fn with_a_chord_error_limit_the_times_agree_to_the_margin() {
    for seed in 0..600 {
        let case = milder_case::<3>(seed);
        if case.chord_tolerance.is_finite() {
            let profile = case.plan_elevated(1).expect("a profile");
            let change = profile.phases.time() / case.time() - 1.0;
            assert!(change.abs() < 4e-4, "seed {seed}: {change:.1e}");
        }
    }
}
