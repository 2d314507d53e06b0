//! Tests that the kernel computes the same numbers, bit for bit, with every SIMD instruction set of this processor.

use fearless_simd::{dispatch, Level, Simd};

use super::constraints::{Block, Constraints};
use super::exact::Exact;
use super::interior_point::Effort;
use super::intersample_check::IntersampleCheck;
use super::lower_bound::lagrangian_on;
use super::model::Model;
use super::prepare::Prepared;
use super::profiles::problem;
use super::relaxed::Relaxed;
use super::window::Window;
use super::working_space::InteriorPoint;
use crate::path_problem::{Geometry, Limits, PathPoint};
use feedplan_geometry::lanes::eight::Lanes;
use feedplan_geometry::watch::Watch;

/// A space curve that turns to both sides, with known derivatives by its arc length.
struct Winding([f64; 2]);

impl Geometry<3> for Winding {
    fn knots(&self) -> &[f64] {
        &self.0
    }

    fn at(&self, _: usize, s: f64) -> PathPoint<3> {
        let (x, slope) = (0.6 * s, 0.3f64);
        let (turn, rate, change) = (1.5 * x.sin(), 0.9 * x.cos(), -0.54 * x.sin());
        let (sin, cos, flat) = (turn.sin(), turn.cos(), slope.cos());
        let first = [flat * cos, flat * sin, slope.sin()];
        let second = [-flat * sin * rate, flat * cos * rate, 0.0];
        let third =
            [-flat * (sin * change + cos * rate * rate), flat * (cos * change - sin * rate * rate), 0.0];
        PathPoint { first, second, third, speed_cap: 200.0 }
    }
}

fn levels() -> Vec<Level> {
    #[cfg(target_arch = "x86_64")]
    {
        let best = Level::new();
        let wider = [best.as_avx2().map(Level::Avx2), best.as_avx512().map(Level::Avx512)];
        std::iter::once(Level::baseline()).chain(wider.into_iter().flatten()).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    vec![Level::new()]
}

/// All numbers that the interior-point method leaves after a solution, as bits.
fn solved<X: Model>(level: Level, prepared: &Prepared<'_, 3>, rows: &Constraints) -> Vec<u64> {
    let effort = Effort {
        tolerance: 1e-7,
        max_iterations: 60,
        deadline: None,
        barrier: 1.0,
        warm: false,
        watch: Watch::default(),
    };
    let mut space = InteriorPoint::<X> { level, ..InteriorPoint::default() };
    let mut x: Vec<f64> = prepared.x.iter().map(|x| 0.97 * x).collect();
    let report = space.solve(rows, prepared.ends, &mut x, &effort);
    assert!(report.iterations > 5, "{report:?}");
    let state = space.state;
    let rows = [state.slack, state.dual, state.step].concat();
    let all = rows.iter().flat_map(|row| *row.values()).chain(x).chain([report.time, report.excess]);
    all.map(f64::to_bits).collect()
}

/// The results of the checks of a plan and of its lower bound on each interval.
#[inline(always)]
fn checked<S: Simd>(simd: S, x: &[f64], rows: &Constraints, between: &IntersampleCheck) -> Vec<f64> {
    let mut out = rows.utilisation_on(simd, x).concat();
    out.extend(between.utilisation_on(simd, rows, x).concat());
    let row = |h: &Lanes| h.map(|h| 0.3 * h);
    let all_rows = |block: &Block| vec![row(&block.h); rows.layout().all()];
    let mut dual: Vec<Lanes> = rows.blocks.iter().flat_map(all_rows).collect();
    for terms in lagrangian_on(simd, rows, x, x, &mut dual, &[]) {
        out.extend([terms.time, terms.fastest, terms.value]);
        out.extend(terms.slope.into_iter().chain(terms.most.concat()).chain(terms.moves));
    }
    out
}

#[test]
fn results_are_the_same_on_every_level() {
    let limits = Limits { velocity: [[250.0; 3]; 2], acceleration: [[3000.0; 3]; 2], jerk: [50_000.0; 3] };
    let geometry = Winding([0.0, 60.0]);
    let problem = problem(&geometry, limits);
    let prepared = Prepared::new(&problem, &Default::default()).expect("a first plan");
    let mut window = Window::new(&limits, &[true; 3]);
    prepared.fill(0..prepared.grid.pieces.len(), &mut window);
    let (rows, between) = (&window.rows, &window.check);
    let found = |level: Level| {
        let checks: Vec<f64> = dispatch!(level, simd => checked(simd, &prepared.x, rows, between));
        let checks = checks.into_iter().map(f64::to_bits).collect();
        [solved::<Exact>(level, &prepared, rows), solved::<Relaxed>(level, &prepared, rows), checks]
    };
    let all = levels();
    let first = found(all[0]);
    for &level in &all[1..] {
        assert!(found(level) == first, "{level:?} differs from {:?}", all[0]);
    }
}
