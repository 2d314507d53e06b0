//! Computes where the grid of a plan needs short intervals, from rough plans on a coarse grid.
//!
//! The optimum uses some limit fully at each place. A cubic spline cannot: within an interval the use of that limit varies, and
//! the interval loses about Σ λ (greatest use − mean use) of time (`IntersampleCheck::losses`). The loss falls with the square of
//! the interval's length h, also where the jerk changes from one limit to another, as λ is small there. For a given total loss
//! the number of intervals is least if all intervals have the same price in s: an interval is split into one more part if that
//! saves more time than the price.

use super::constraints::Constraints;
use super::hermite;
use super::intersample_check::IntersampleCheck;
use feedplan_geometry::lanes::eight::Lanes;

/// Intervals of the even grid, which has the full resolution everywhere, in one interval of the coarse grid.
pub const COARSE: u32 = 3;
/// The greatest price of an interval: this fraction of the mean time of the coarse intervals, divided by the square of the
/// resolution.
const PRICE: f64 = 0.06;
/// The price is lowered by this factor until the grid's total loss is at most that of the even grid, at most this many times.
const LOWER: f64 = 0.93;
const TIMES: i32 = 255;
/// A total loss of at most this fraction of the time, divided by the square of the resolution, is always accepted.
const LITTLE: f64 = 0.0025;
/// Greatest number of parts of an interval.
const MOST: u32 = 8;
/// Complementarity gap of the rough plan: this fraction of the time, divided by the square of the resolution.
const GAP: f64 = 0.022;
/// A limit counts as used where the rough plan uses more than this fraction of it.
const USED: f64 = 0.97;
/// An acceleration above this fraction of its limit counts as near to it: the final plan may use more.
const NEAR: f64 = 0.9;
/// Peaks that exceed the use at the collocation points by more than this factor move on a finer grid, and are ignored.
const FIRM: f64 = 1.05;
/// On split intervals, peaks are assumed to exceed the use at the collocation points by this multiple of the expected excess.
const MARGIN: f64 = 1.1;

/// A rough optimum of a window on the coarse grid.
#[derive(Clone, Debug)]
pub struct RoughPlan {
    /// (w_0, w'_0, w_1, …)
    pub x: Vec<f64>,
    /// The time that each interval loses, in s.
    pub losses: Vec<f64>,
    /// The factors by which the uses of the limits of speed, acceleration and jerk between the collocation points exceed those at
    /// them; 1 where such a peak would move on a finer grid.
    pub peaks: Vec<[f32; 3]>,
    /// Whether the acceleration comes near to a limit, so that it needs rows.
    pub accelerates: bool,
}

/// The complementarity gap of a rough plan, as a fraction of the time.
pub fn tolerance(resolution: f64) -> f64 {
    GAP / (resolution * resolution)
}

/// The losses of a path's intervals on the coarse grid.
#[derive(Clone, Debug, Default)]
pub struct Losses {
    /// In s.
    pub each: Vec<f64>,
    /// The time of the path divided by the square of the resolution, in s.
    pub unit: f64,
}

/// The price of an interval in s for which the paths together lose no more time than on even grids, or than `LITTLE` allows.
pub fn price<'a>(paths: impl Iterator<Item = &'a Losses> + Clone) -> f64 {
    let paths = paths.filter(|path| path.unit > 0.0);
    let sum = |of: fn(&Losses) -> f64| paths.clone().map(of).sum::<f64>();
    let allowed = sum(|path| path.even().max(LITTLE * path.unit));
    let first = PRICE * sum(|path| path.unit) / sum(|path| path.each.len() as f64);
    let lowered = |times: i32| first * LOWER.powi(times);
    let fine = |times: i32| {
        let lost = |loss: &f64| loss / f64::from(parts(*loss, lowered(times)).pow(2));
        paths.clone().flat_map(|path| &path.each).map(lost).sum::<f64>() <= allowed
    };
    let (mut low, mut high) = (0, TIMES);
    while low < high {
        let middle = (low + high) / 2;
        (low, high) = if fine(middle) { (low, middle) } else { (middle + 1, high) };
    }
    lowered(low)
}

/// The number of parts into which an interval with this loss in s is to be split at a price of an interval in s.
fn parts(loss: f64, price: f64) -> u32 {
    let of = |parts: u32| 1.0 / f64::from(parts * parts);
    1 + (1..MOST).map(|parts| u32::from(loss * (of(parts) - of(parts + 1)) > price)).sum::<u32>()
}

impl Losses {
    /// The total loss of the even grid, in s.
    fn even(&self) -> f64 {
        self.each.iter().sum::<f64>() / f64::from(COARSE * COARSE)
    }

    /// The numbers of parts into which the intervals are to be split at a price of an interval, in s.
    pub fn parts(&self, price: f64) -> Vec<u32> {
        self.each.iter().map(|&loss| parts(loss, price)).collect()
    }
}

impl RoughPlan {
    /// The rough plan for the optimum x on the coarse grid and its multipliers.
    pub fn new(rows: &Constraints, check: &IntersampleCheck, x: Vec<f64>, dual: &[Lanes]) -> Self {
        let used = check.utilisation(rows, &x);
        let losses = check.losses(rows, &x, dual, &used);
        let peak =
            |used: f64, at: f64| if at > USED && used < FIRM * at { (used / at).max(1.0) } else { 1.0 };
        let peaks = used
            .iter()
            .zip(rows.utilisation(&x))
            .map(|(used, at)| std::array::from_fn(|i| peak(used[i], at[i]) as f32))
            .collect();
        let accelerates = rows.accelerates || used.iter().any(|used| used[1] > NEAR);
        Self { x, losses, peaks, accelerates }
    }

    /// Converts the plan to a grid where interval n was split into `splits[n]` parts; `lengths` are the lengths of all parts in
    /// mm. With k parts, the excess of peaks over the use at the collocation points falls to 1/k².
    pub fn refine(&mut self, splits: &[u32], lengths: &[f64]) {
        self.x = hermite::prolong(&self.x, splits.iter().map(|&parts| parts as usize), lengths);
        let lower = |(&parts, peak): (&u32, &[f32; 3])| {
            let share = MARGIN as f32 / (parts * parts) as f32;
            std::iter::repeat_n(peak.map(|peak| 1.0 + (peak - 1.0) * share), parts as usize)
        };
        self.peaks = splits.iter().zip(&self.peaks).flat_map(lower).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::super::hermite::duration;
    use super::super::interior_point::Effort;
    use super::super::prepare::Prepared;
    use super::super::profiles::{problem, Winding};
    use super::super::window::Window;
    use super::super::working_space::InteriorPoint;
    use super::*;
    use crate::path_problem::{self, Limits};
    use feedplan_geometry::watch::Watch;

    /// The losses of a path on an even grid of this resolution, and the time in s.
    fn losses(turn: f64, resolution: f64) -> (Vec<f64>, f64) {
        let limits =
            Limits { velocity: [[250.0; 2]; 2], acceleration: [[3000.0; 2]; 2], jerk: [50_000.0; 2] };
        let path = Winding::new(turn);
        let problem = problem(&path, limits);
        let effort = path_problem::Effort { resolution, ..Default::default() };
        let prepared = Prepared::new(&problem, &effort).expect("a first plan");
        let mut window = Window::new(&limits, &[true; 2]);
        prepared.fill(0..prepared.grid.pieces.len(), &mut window);
        window.rows.drop_at_ends(&prepared.ends);
        let (barrier, watch) = (1.0, Watch::default());
        let effort =
            Effort { tolerance: 1e-6, max_iterations: 400, deadline: None, barrier, warm: false, watch };
        let mut space = InteriorPoint::default();
        let RoughPlan { x, losses, .. } =
            window.rough(prepared.ends, &prepared.x, &effort, &mut space).expect("a plan");
        let time = (0..losses.len()).map(|n| duration(&x, n, window.rows.h(n))).sum();
        (losses, time)
    }

    #[test]
    fn short_intervals_are_few_and_more_of_them_for_a_finer_resolution() {
        for turn in [0.2, 1.0, 2.0] {
            let (losses, time) = losses(turn, 16.0 / 3.0);
            let counts = [16.0, 48.0, 144.0].map(|resolution| {
                let price = PRICE * time / (resolution * resolution) / losses.len() as f64;
                let all = losses.iter().map(|&loss| parts(loss, price));
                all.sum::<u32>() as f64 / losses.len() as f64
            });
            // The number of intervals grows with the power 2/3 of the resolution, 3^(2/3) = 2.1, except where one part is enough.
            assert!(counts[1] > 1.4 * counts[0] && counts[2] > 1.4 * counts[1], "{counts:?}");
        }
    }

    fn lost(path: &Losses, parts: &[u32]) -> f64 {
        path.each.iter().zip(parts).map(|(loss, &parts)| loss / f64::from(parts * parts)).sum()
    }

    fn alone(path: &Losses) -> Vec<u32> {
        path.parts(price(std::iter::once(path)))
    }

    #[test]
    fn one_part_more_must_save_its_price_by_hand() {
        // Of a loss of 36 s, the second part saves 27 s, the third one 5 s, the fourth one 1.75 s.
        for (price, known) in [(30.0, 1), (20.0, 2), (6.0, 2), (4.0, 3), (1.8, 3), (1.7, 4), (0.0, MOST)] {
            assert_eq!(parts(36.0, price), known, "{price} s");
        }
        assert_eq!(parts(0.0, 0.0), 1);
    }

    #[test]
    fn a_grid_loses_no_more_than_the_even_one() {
        // By hand: three parts of every interval lose 1/9. If only one of eight intervals loses time, only that one is split.
        let (all, one) = ([1e-3; 8], std::array::from_fn::<_, 8, _>(|n| if n == 3 { 8e-3 } else { 0.0 }));
        for losses in [all, one] {
            let path = Losses { each: losses.to_vec(), unit: 50.0 / 256.0 };
            let parts = alone(&path);
            assert!(lost(&path, &parts) <= path.even() * (1.0 + 1e-12), "{parts:?}");
            let expected = losses.map(|loss| if loss > 0.0 { 3 } else { 1 });
            assert_eq!(parts, expected);
        }
        for turn in [0.2, 1.0, 2.0] {
            let (each, time) = losses(turn, 16.0 / 3.0);
            let path = Losses { each, unit: time / 256.0 };
            let parts = alone(&path);
            assert!(lost(&path, &parts) <= path.even().max(LITTLE * path.unit));
            assert!(parts.iter().sum::<u32>() < 3 * parts.len() as u32);
        }
    }

    #[test]
    fn paths_together_need_fewer_intervals_for_the_same_loss() {
        let [easy, hard] = [0.2, 2.0].map(|turn| {
            let (each, time) = losses(turn, 16.0 / 3.0);
            Losses { each, unit: time / 256.0 }
        });
        // A path without a rough plan has no losses and is ignored.
        let none = Losses { each: vec![0.0; 1000], unit: 0.0 };
        let price = price([&none, &easy, &hard].into_iter());
        let paths = [&easy, &hard];
        let together = paths.map(|path| path.parts(price));
        let count = |parts: &[Vec<u32>; 2]| parts.concat().iter().sum::<u32>();
        let loss = |parts: &[Vec<u32>; 2]| lost(&easy, &parts[0]) + lost(&hard, &parts[1]);
        let allowed: f64 = paths.map(|path| path.even().max(LITTLE * path.unit)).iter().sum();
        assert!(loss(&together) <= allowed && count(&together) < count(&paths.map(alone)));
    }

    #[test]
    fn a_refined_plan_is_the_same_spline_with_lower_peaks() {
        let parts = [1, 3, 2];
        let mut plan = RoughPlan {
            x: vec![1.0, 0.0, 2.0, 0.5, 3.0, 0.0, 3.0, 0.0],
            losses: vec![],
            accelerates: true,
            peaks: vec![[1.0, 1.25, 1.5], [1.0, 1.0, 1.9], [1.0; 3]],
        };
        plan.refine(&parts, &[0.6, 0.1, 0.1, 0.1, 0.2, 0.2]);
        assert_eq!((plan.x.len(), plan.x[2], plan.x[8], plan.x[13]), (14, 2.0, 3.0, 0.0));
        let margin = MARGIN as f32;
        let lower = [1.0 + 0.25 * margin, 1.0 + 0.9 * margin / 9.0];
        assert!((plan.peaks[0][1] - lower[0]).abs() < 1e-6 && (plan.peaks[3][2] - lower[1]).abs() < 1e-6);
        assert_eq!((plan.peaks.len(), plan.peaks[5]), (6, [1.0; 3]));
    }
}
