//! The planner for pieces of any degree on adversarial curves: it ends, and its times are finite.

use feedplan_checks::curves::{random_curves, CurveCase, Piece};
use feedplan_checks::{seeds, FEW_AXES};

/// Rounding decides where the axes reverse, and planning still ends.
#[test]
fn a_cubic_that_comes_back_on_its_own_way_is_planned() {
    let there = [-0.0008179203719107516, 4.482764973940271e-05, 0.004785619607813126];
    let again = [-0.0008179203719107515, 4.482764973940271e-05, 0.004785619607813128];
    let points = vec![[0.0; 3], there, [0.0; 3], again];
    let acceleration = [1.87209756, 6.52307862, 43.35589112];
    let piece = Piece { points, weights: vec![1.0; 4], width: 2.2850075 };
    let case = CurveCase::new(vec![piece], 9.07536759, [12.37519959, 7.97605913, 1.91222309], acceleration);
    let profile = case.plan().expect("a profile");
    // x(t)/x₁ = 3 t − 6 t² + 4 t³ rises everywhere, with x' = 0 in the middle; X is slowest: a line of length x₁.
    let time = 2.0 * (there[0].abs() / acceleration[0]).sqrt();
    assert!((profile.phases.time() / time - 1.0).abs() < 1e-9, "{} {time}", profile.phases.time());
}

/// Cases that rounding makes infeasible are reported; they are a few in ten thousand.
#[test]
fn curves_made_to_break_the_planner_are_planned_in_finite_time() {
    let count = seeds(6_000).end;
    let (mut slowed, mut stuck, mut arcs) = (0, 0, 0);
    for seed in 0..count {
        feedplan_checks::for_axes!(FEW_AXES[(seed % 3) as usize], M, {
            let case = random_curves::<M>(seed);
            match case.plan() {
                Err(_) => stuck += 1,
                Ok(profile) => {
                    let are_times =
                        profile.phases.duration.iter().all(|&time| time >= 0.0 && time.is_finite());
                    assert!(are_times, "seed {seed}: {:?}", profile.phases.duration);
                    slowed += usize::from(!profile.slowed.is_empty());
                    arcs = arcs.max(profile.phases.len() / case.pieces.len());
                }
            }
        });
    }
    println!("of {count}: {slowed} slowed, {stuck} without a plan; at most {arcs} arcs a piece");
    assert!(slowed <= 3 + count as usize / 200, "{slowed} of {count} plans stop for rounding");
    assert!(stuck <= 1 + count as usize / 2000, "{stuck} of {count} have no plan");
    assert!(arcs < 1000);
}
