//! For tests of the lower bound: plans of short paths, and speed profiles around them.

use fearless_simd::{dispatch, Level};

use super::columns::Columns;
use super::constraints::Constraints;
use super::forms::{motion, pace};
use super::hermite::{COUNT, MASS};
use super::interior_point::Effort;
use super::lower_bound::Planned;
use super::prepare::Prepared;
use super::window::Window;
use super::working_space::InteriorPoint;
use crate::path_problem::{End, Geometry, Limits, PathPoint, Problem};
use feedplan_geometry::lanes::eight::Register;
use feedplan_geometry::watch::Watch;

/// A plane curve that turns to both sides; `turn` is its greatest curvature, in 1/mm.
pub struct Winding {
    knots: [f64; 2],
    turn: f64,
}

impl Winding {
    pub fn new(turn: f64) -> Self {
        Self { knots: [0.0, 20.0], turn }
    }
}

impl Geometry<2> for Winding {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, _: usize, s: f64) -> PathPoint<2> {
        let (angle, rate, change) = (self.turn * s.sin(), self.turn * s.cos(), -self.turn * s.sin());
        let (sin, cos) = angle.sin_cos();
        let first = [cos, sin];
        let second = [-sin * rate, cos * rate];
        let third = [-cos * rate * rate - sin * change, -sin * rate * rate + cos * change];
        PathPoint { first, second, third, speed_cap: 200.0 }
    }
}

/// Σ c max(w^(−1/2), |L(w)|/J) on each interval: the time of the relaxation, in which jerk beyond its limit costs time.
pub fn relaxed_times(rows: &Constraints, x: &[f64]) -> Vec<f64> {
    let x = Columns::new(x);
    dispatch!(Level::new(), simd => {
        let mut times = vec![];
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let mut time = Register::all(simd, 0.0);
            for p in 0..COUNT {
                let motion = motion(p, h.inverse(), &x.local(b, h, block.live));
                let mut y = pace(motion[0]);
                for k in 0..rows.axes() {
                    y = y.max(rows.jerk_of(b, p, k, motion).abs());
                }
                time += y * h * MASS[p];
            }
            times.extend(time.values());
        }
        times
    })
}

/// Speed profiles around a plan that keep the limits of speed and acceleration. Their w differs from that of the plan by 1e-4 to
/// half of it, by noise or by a wave; at both ends w and w' are multiplied by the same factor.
pub fn around(plan: &[f64], rows: &Constraints, count: usize) -> Vec<Vec<f64>> {
    let mut random = random();
    let keeps = |x: &[f64]| {
        let within = rows.utilisation(x).iter().all(|used| used[0] <= 1.0 && used[1] <= 1.0);
        within && x.iter().step_by(2).all(|&w| w > 0.0)
    };
    let mut out = vec![];
    while out.len() < count {
        let size = 10f64.powf(-2.2 + 1.8 * random());
        let (waves, phase) = (30.0 * (1.0 + random()), 3.0 * random());
        let rough = random() > 0.0;
        let last = plan.len() / 2 - 1;
        let mut x = plan.to_vec();
        for n in 0..=last {
            let angle = waves * n as f64 / last as f64 + phase;
            let factor = 1.0 - size * (1.0 + if rough { random() } else { angle.sin() });
            x[2 * n] *= factor;
            x[2 * n + 1] *= factor;
            if !rough && n > 0 && n < last {
                let h = rows.h(n - 1) + rows.h(n);
                x[2 * n + 1] -= size * plan[2 * n] * angle.cos() * waves * 2.0 / (last as f64 * h);
            }
        }
        // Towards rest every use of a limit falls.
        while !keeps(&x) {
            x.iter_mut().for_each(|x| *x *= 0.9);
        }
        out.push(x);
    }
    out
}

/// Pseudo-random numbers from −1 to 1.
pub fn random() -> impl FnMut() -> f64 {
    let mut seed = 1u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// The problem from rest to rest, in which all axes move.
pub fn problem<const M: usize>(geometry: &dyn Geometry<M>, limits: Limits<M>) -> Problem<'_, M> {
    Problem { geometry, limits, moves: [true; M], caps: &[], ends: [End::Rest; 2] }
}

/// Plans a path in one window, and calls `work` with the input of the lower bound and the effort.
pub fn planned(geometry: &dyn Geometry<2>, work: impl Fn(&Planned, &Effort)) {
    let limits = Limits { velocity: [[250.0; 2]; 2], acceleration: [[3000.0; 2]; 2], jerk: [50_000.0; 2] };
    let problem = problem(geometry, limits);
    let prepared = Prepared::new(&problem, &Default::default()).expect("a first plan");
    let mut window = Window::new(&limits, &[true; 2]);
    prepared.fill(0..prepared.grid.pieces.len(), &mut window);
    let rows = window.rows.clone();
    let mut x = prepared.x.clone();
    let watch = Watch::default();
    let (tolerance, max_iterations, barrier) = (1e-7, 400, 1.0);
    let effort = Effort { tolerance, max_iterations, deadline: None, barrier, warm: false, watch };
    let mut exact = InteriorPoint::default();
    window.improve(prepared.ends, &mut x, None, &effort, &mut exact);
    let (tight, ends, at_ends) = (&window.rows, prepared.ends, [true; 2]);
    work(&Planned { rows: &rows, tight, ends, at_ends, x: &x, solved: &exact }, &effort);
}
