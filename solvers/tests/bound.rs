//! The lower bound: by hand on a line and a circle, never above the time of a plan, near it, and above the times that
//! looser limits allow.

mod support;

use feedplan_solvers::bang_bang::Problem;
use feedplan_solvers::bang_bang_quadratic::Profile;
use feedplan_solvers::bound::{lower_bound, Hint};
use feedplan_solvers::quadratic::Quadratic;
use support::{random_case, Case};

/// As many seeds, or as many as FEEDPLAN_SEEDS says for a long campaign.
fn seeds(count: u64) -> std::ops::Range<u64> {
    0..std::env::var("FEEDPLAN_SEEDS").map_or(count, |text| text.parse().expect("a number of seeds"))
}

/// The case as a path of any pieces.
struct Path<const M: usize> {
    control: Vec<[f64; M]>,
    offset: Vec<usize>,
    width: Vec<f64>,
}

impl<const M: usize> Path<M> {
    fn of(case: &Case<M>) -> Self {
        Self {
            control: case.pieces.iter().flat_map(|piece| piece.control).collect(),
            offset: (0..=case.pieces.len()).map(|i| 3 * i).collect(),
            width: case.pieces.iter().map(|piece| piece.width).collect(),
        }
    }

    fn problem<'a>(&'a self, case: &'a Case<M>, runs: &'a [usize]) -> Problem<'a, M> {
        Problem {
            control: &self.control,
            weight: &[],
            offset: &self.offset,
            width: &self.width,
            tip: None,
            runs,
            feed: &case.feed,
            junction_speed: &case.junction,
            max_velocity: case.velocity,
            max_acceleration: case.acceleration,
            chord_tolerance: case.chord_tolerance,
            period: case.period,
            start_speed: case.start_speed,
            end_speed: case.end_speed,
        }
    }
}

fn hint(profile: &Profile) -> Hint<'_> {
    Hint { piece: &profile.piece, axis: &profile.axis, u1: &profile.u1, duration: &profile.duration }
}

fn bound<const M: usize>(case: &Case<M>, profile: &Profile) -> f64 {
    let path = Path::of(case);
    lower_bound(&path.problem(case, &[0, case.pieces.len()]), &hint(profile)).expect("a bound")
}

#[test]
fn on_a_line_from_rest_to_rest_the_bound_is_the_time() {
    // 100 mm: at 1000 mm/s² up to 50 mm/s and down again 2.05 s; without a limit of speed 2 √0.1 s.
    for (velocity, feed, time) in [(50.0, 1e3, 2.05), (1e6, 50.0, 2.05), (1e6, 1e6, 2.0 * 0.1f64.sqrt())] {
        let case = Case::new(vec![Quadratic::line([0.0], [100.0])], feed, [velocity], [1e3]);
        let bound = bound(&case, &case.plan().expect("a profile"));
        assert!(bound <= time && bound > time * (1.0 - 1e-12), "{bound} of {time}");
    }
}

#[test]
fn the_bound_is_never_above_the_time_and_near_it() {
    let (mut worst, mut gaps, mut failures) = (0.0_f64, vec![], vec![]);
    for seed in seeds(20_000) {
        let count = 1 + (seed % 6) as usize;
        for_axes!(count, M, {
            let case = random_case::<M>(seed);
            if let Ok(profile) = case.plan() {
                let gap = 1.0 - bound(&case, &profile) / profile.time();
                if !(gap >= -1e-9) {
                    failures.push(format!("seed {seed}: {gap:.1e}"));
                }
                worst = worst.min(gap);
                gaps.push((gap, seed, case.chord_tolerance.is_finite()));
            }
        });
    }
    gaps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let share = |part: f64| gaps[((gaps.len() - 1) as f64 * part) as usize];
    println!(
        "least {worst:.1e}, of {} gaps {:?}",
        gaps.len(),
        [0.5, 0.9, 0.95, 0.98, 0.99, 0.999, 1.0].map(share)
    );
    let smooth: Vec<_> = gaps.iter().filter(|gap| !gap.2).collect();
    println!("{:?}", &smooth[smooth.len().saturating_sub(40)..]);
    println!(
        "without chord {:?}",
        [0.5, 0.9, 0.95, 0.98, 0.99, 0.999, 1.0].map(|p| smooth[((smooth.len() - 1) as f64 * p) as usize])
    );
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(40)].join("\n")
    );
}
