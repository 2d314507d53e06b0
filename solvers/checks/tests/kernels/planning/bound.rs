//! The lower bound: equal to the time where that is known by hand, limit by limit; never above the time of a plan, and close to
//! it, whatever the first intervals are.

use rayon::prelude::*;

use feedplan_checks::{audit, random_case, seeds, Case, Elevated, Random, FEW_AXES, PADDED};
use feedplan_geometry::quadratic::Quadratic;
use feedplan_planner::phases::Phases;
use feedplan_planner::profile::Profile;
use feedplan_planner::Exact as _;

fn bound<const M: usize>(case: &Case<M>, phases: &Phases) -> f64 {
    Elevated::<PADDED>::new(case, 0).problem(case).lower_bound(phases).expect("a bound")
}

#[test]
fn on_a_line_from_rest_to_rest_the_bound_is_the_time() {
    // 100 mm: at 1000 mm/s² up to 50 mm/s and down again 2.05 s; without a speed limit 2 √0.1 s.
    for (velocity, feed, time) in [(50.0, 1e3, 2.05), (1e6, 50.0, 2.05), (1e6, 1e6, 2.0 * 0.1f64.sqrt())] {
        let case = Case::new(vec![Quadratic::line([0.0], [100.0])], feed, [velocity], [1e3]);
        let bound = bound(&case, &case.plan().expect("a profile").phases);
        assert!(bound <= time && bound > time * (1.0 - 1e-12), "{bound} of {time}");
    }
}

#[test]
fn every_limit_counts() {
    // An L of two lines, 1 mm each, at 100 mm/s²: a stop in the corner, then a passage at √20 mm/s.
    let lines = || vec![Quadratic::line([0.0, 0.0], [1.0, 0.0]), Quadratic::line([1.0, 0.0], [1.0, 1.0])];
    let by_hand = |case: &Case<2>, time: f64| {
        let bound = bound(case, &case.plan().expect("a profile").phases);
        assert!(bound <= time && bound > time * (1.0 - 1e-12), "{bound} of {time}");
    };
    let mut corner = Case::new(lines(), 1e3, [1e3; 2], [100.0; 2]);
    corner.junction[1] = 0.0;
    by_hand(&corner, 0.4);
    // v² from 0 to 20 over a peak of 110: (2 √110 − √20)/100 s for each line.
    corner.junction[1] = 20f64.sqrt();
    by_hand(&corner, 2.0 * (2.0 * 110f64.sqrt() - 20f64.sqrt()) / 100.0);
    // Both end speeds and the feed are 10 mm/s: 10 mm/s everywhere.
    let mut flying = Case::new(lines(), 10.0, [1e3; 2], [100.0; 2]);
    (flying.start_speed, flying.end_speed) = (10.0, 10.0);
    by_hand(&flying, 0.2);
    // 10 mm/s everywhere, by the limits of axis velocity instead of the feed.
    flying.feed = vec![1e3; 2];
    flying.velocity = [10.0; 2];
    by_hand(&flying, 0.2);
    // Without both limits: up and down again on each line, since the junction speed of the corner is not limited.
    flying.velocity = [1e3; 2];
    by_hand(&flying, 2.0 * (300f64.sqrt() - 10.0) / 100.0);
}

#[test]
fn the_chord_error_counts() {
    // A parabola of radius 10 mm and more at its vertex, slow enough that it is nearly all at the limit
    // v² = (8 δ/T²)(ρ − δ/2), δ = 0.01 mm, T = 0.1 s: 8 mm/s² × 9.995 mm.
    let arc = Quadratic { control: [[-1.0, 0.05], [0.0, -0.05], [1.0, 0.05]], width: 2.0 };
    let mut case = Case::new(vec![arc], 1e3, [1e3; 2], [1e4; 2]);
    let free = bound(&case, &case.plan().expect("a profile").phases);
    (case.chord_tolerance, case.period) = (0.01, 0.1);
    (case.start_speed, case.end_speed) = (8.0, 8.0);
    let phases = case.plan().expect("a profile").phases;
    let bound = bound(&case, &phases);
    assert!(bound <= phases.time() && bound > 0.998 * phases.time(), "{bound} of {}", phases.time());
    assert!(bound > 2.0 / (8f64 * 10.2).sqrt() && bound > 3.0 * free, "{bound}, {free}");
}

/// The gaps of plans, and the seeds of plans that are faster than their bound.
struct Gaps {
    least: f64,
    shares: [f64; 3],
    failures: Vec<u64>,
}

/// The gaps over random cases with these seeds; the first intervals are the phases of the plan, or else the pieces.
fn gaps(seeds: std::ops::Range<u64>, with_arcs: bool) -> Gaps {
    let mut found: Vec<(f64, u64, bool)> = seeds
        .into_par_iter()
        .filter_map(|seed| {
            let count = FEW_AXES[(seed % 3) as usize];
            feedplan_checks::for_axes!(count, M, {
                let case = random_case::<M>(seed);
                let phases = case.plan().ok()?.phases;
                let time = phases.time();
                let bound = if with_arcs {
                    bound(&case, &phases)
                } else {
                    bound(&case, &whole_pieces(&phases, &case))
                };
                let gap = 1.0 - bound / time;
                // Near a cusp, rounding falsifies the durations of single phases.
                let is_sound = gap >= -1e-10 || -gap <= 2.0 * audit(&case, &phases, 1).duration;
                Some((gap, seed, is_sound))
            })
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let share = |part: f64| found[((found.len() - 1) as f64 * part) as usize].0;
    Gaps {
        least: found[0].0,
        shares: [0.5, 0.9, 1.0].map(share),
        failures: found.iter().filter(|gap| !gap.2).map(|gap| gap.1).collect(),
    }
}

/// One phase on each piece.
fn whole_pieces<const M: usize>(phases: &Phases, case: &Case<M>) -> Phases {
    let mut whole = Phases::default();
    for (i, piece) in case.pieces.iter().enumerate() {
        whole.piece.push(i as u32);
        whole.axis.push(255);
        whole.u1.push(piece.width);
        let own = phases.piece.iter().zip(&phases.duration).filter(|arc| *arc.0 == i as u32);
        whole.duration.push(own.map(|arc| arc.1).sum());
    }
    whole
}

#[test]
fn the_bound_is_never_above_the_time_and_near_it() {
    let found = gaps(seeds(10_000), true);
    println!(
        "gaps from {:.1e}, {:.1e} in the middle, 9 of 10 below {:.1e}, all below {:.1e}",
        found.least, found.shares[0], found.shares[1], found.shares[2]
    );
    assert!(found.failures.is_empty(), "above the time: seeds {:?}", found.failures);
    // Where the chord tolerance is near the radii of curvature, the plan keeps a margin to that limit, which widens the gap.
    assert!(found.shares[0] < 1e-5 && found.shares[1] < 1e-3, "{:?}", found.shares);
}

#[test]
fn any_cells_give_a_bound_and_are_refined() {
    let found = gaps(0..600, false);
    println!(
        "one cell a piece: gaps from {:.1e}, {:.1e} in the middle, 9 of 10 below {:.1e}, all below {:.1e}",
        found.least, found.shares[0], found.shares[1], found.shares[2]
    );
    assert!(found.failures.is_empty(), "above the time: seeds {:?}", found.failures);
    assert!(found.shares[0] < 1e-3 && found.shares[1] < 2e-2, "{:?}", found.shares);
}

#[test]
fn a_wrong_profile_makes_no_wrong_bound() {
    for seed in 0..2000 {
        let case = random_case::<3>(seed);
        let Ok(Profile { phases: right, .. }) = case.plan() else { continue };
        let mut random = Random(seed ^ 0x5eed);
        let mut wrong = right.clone();
        for arc in 0..wrong.len() {
            match random.below(6) {
                0 => wrong.duration[arc] = [f64::NAN, f64::INFINITY, 0.0, -1.0][random.below(4)],
                1 => wrong.u1[arc] *= random.exponential(-20.0, 2.0),
                2 => wrong.u1[arc] = [f64::NAN, f64::INFINITY, -1.0][random.below(3)],
                3 => wrong.axis[arc] = random.below(256) as u8,
                4 => wrong.piece[arc] = random.below(40) as u32,
                _ => wrong.duration[arc] *= random.exponential(-3.0, 3.0),
            }
        }
        let bound = bound(&case, &wrong);
        assert!(bound >= 0.0 && bound <= right.time() * (1.0 + 1e-9), "seed {seed}: {bound}");
    }
}
