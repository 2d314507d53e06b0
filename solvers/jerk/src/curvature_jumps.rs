//! Computes the speed cap at jumps of a path's curvature, and the tighter limits of jerk around them, with which third
//! differences of setpoints keep the limits of jerk.
//!
//! A third difference of setpoints divided by the cube of their period T is the mean of the jerk, weighted by the quadratic
//! B-spline B on 3 T, whose maximum is 3/(4 T). A jump Δ of q'', passed at the speed v, is a step Δ v² of the acceleration, which
//! the difference shows as a jerk Δ v² B, with B at the time of the jump. All differences keep the limit J if
//!
//! - Σ |Δ| v² B ≤ κ J over the jumps within any 3 T, with κ ≤ `MOST`, which caps v, and
//! - the jerk between the jumps is at most (1 − κ) J from 3/2 T before each jump to 3/2 T after it.
//!
//! A difference whose middle is x periods from a jump shows the fraction B(x)/B(0) of its step, and has the fraction I(x) of its
//! weight within 3/2 T of the jump. I(x) ≥ B(x)/B(0), so that both conditions suffice for it as well.

/// Greatest fraction κ of the limit of jerk for jumps: a greater one is faster at jumps, but slower around them.
pub const MOST: f64 = 0.65;
/// Jumps that show as less than this fraction of the limit count as rounding: half of what an audit can resolve.
const UNSEEN: f64 = 5e-7;
/// Half the time that a third difference spans, in periods.
pub const HALF: f64 = 1.5;
/// Samples of the difference's middle over its span, and their spacing in periods.
const SAMPLES: usize = 25;
const STEP: f64 = 2.0 * HALF / (SAMPLES - 1) as f64;
/// Bisection steps for the speed at jumps that show in the same differences.
const HALVINGS: u32 = 20;

/// A place where q'' jumps.
#[derive(Clone, Copy, Debug)]
pub struct Jump<const M: usize> {
    /// Arc length, in mm.
    pub s: f64,
    /// Jump of each axis's q'' in 1/mm, divided by the axis's limit of jerk in mm/s³.
    pub change: [f64; M],
    /// The greatest speed, in mm/s, and acceleration along the path, in mm/s², by all other limits.
    pub speed: f64,
    pub acceleration: f64,
}

/// The speed cap at a jump, and the tighter limits of jerk around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// The greatest speed, in mm/s; infinite where other limits are lower.
    pub speed: f64,
    /// The limits of jerk are tighter up to this distance to both sides, in mm.
    pub reach: f64,
    /// The fraction by which the limits of jerk are lower; 0 if no setpoints show a jump.
    pub share: f64,
}

/// The passages of all jumps, which must rise in s.
pub fn passages<const M: usize>(jumps: &[Jump<M>], period: f64) -> Vec<Passage> {
    let fastest: Vec<f64> = (0..jumps.len()).map(|i| greatest_speed(jumps, i, period)).collect();
    let speeds: Vec<f64> =
        jumps.iter().zip(&fastest).map(|(jump, fastest)| jump.speed.min(*fastest)).collect();
    let passage = |i: usize| {
        let jump = &jumps[i];
        // The speed of the fastest jump that shows in the same differences.
        let mut most = speeds[i];
        for near in around(jumps, i, speeds[i] * period) {
            most = most.max(speeds[near]);
        }
        let time = HALF * period;
        Passage {
            speed: if fastest[i] < jump.speed { fastest[i] } else { f64::INFINITY },
            reach: time * (speeds[i] + 0.5 * time * jump.acceleration),
            share: shown(jumps, i, most, period).min(MOST),
        }
    };
    (0..jumps.len()).map(passage).collect()
}

/// The greatest speed at jump `i`, in mm/s, at which no difference shows more than `MOST`.
fn greatest_speed<const M: usize>(jumps: &[Jump<M>], i: usize, period: f64) -> f64 {
    let jump = &jumps[i];
    let change = jump.change.iter().copied().fold(0.0, f64::max);
    let alone = (MOST * period / (weight(0.0) * change)).sqrt();
    let high = alone.min(jump.speed);
    if shown(jumps, i, high, period) <= MOST {
        return alone;
    }
    let (mut low, mut high) = (0.0, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if shown(jumps, i, middle, period) <= MOST {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The greatest fraction of a limit of jerk that differences show of jump `i` and the jumps around it, all passed at `speed` in
/// mm/s; 0 if this is only rounding.
fn shown<const M: usize>(jumps: &[Jump<M>], i: usize, speed: f64, period: f64) -> f64 {
    let (per_period, near) = (speed * period, around(jumps, i, speed * period));
    let per_weight = speed * speed / period;
    let mut all = [0.0; M];
    for jump in &jumps[near.clone()] {
        for k in 0..M {
            all[k] += jump.change[k];
        }
    }
    let at_once = weight(0.0) * all.iter().copied().fold(0.0, f64::max) * per_weight;
    if at_once <= UNSEEN {
        return 0.0;
    }
    if near.len() == 1 {
        return at_once;
    }
    let mut most = 0.0_f64;
    for sample in 0..SAMPLES {
        let centre = STEP * sample as f64 - HALF;
        let mut sum = [0.0; M];
        for jump in &jumps[near.clone()] {
            let x = (jump.s - jumps[i].s) / per_period - centre;
            // The weight's second derivative is −2 in its middle, so that between samples it may exceed them by this much.
            let between = if x.abs() < 0.5 + STEP { 0.25 * STEP * STEP } else { 0.0 };
            let part = weight(x) + between;
            for k in 0..M {
                sum[k] += part * jump.change[k];
            }
        }
        most = sum.iter().copied().fold(most, f64::max);
    }
    most * per_weight
}

/// The jumps that a difference may show together with jump `i`, if all are passed at this many mm per period.
fn around<const M: usize>(jumps: &[Jump<M>], i: usize, per_period: f64) -> std::ops::Range<usize> {
    let (s, reach) = (jumps[i].s, 2.0 * HALF * per_period);
    let before = jumps[..i].iter().rev().take_while(|jump| s - jump.s < reach).count();
    let after = jumps[i + 1..].iter().take_while(|jump| jump.s - s < reach).count();
    i - before..i + after + 1
}

/// The weight of a third difference at x periods from its middle, times the period.
fn weight(x: f64) -> f64 {
    let x = x.abs();
    if x < 0.5 {
        0.75 - x * x
    } else if x < HALF {
        0.5 * (HALF - x) * (HALF - x)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1e-3;

    fn jump(s: f64, change: f64) -> Jump<1> {
        Jump { s, change: [change], speed: 100.0, acceleration: 1000.0 }
    }

    /// The third difference of x at setpoints over the cube of the period.
    fn third(x: impl Fn(f64) -> f64, t: f64) -> f64 {
        (x(t + 1.5 * PERIOD) - 3.0 * x(t + 0.5 * PERIOD) + 3.0 * x(t - 0.5 * PERIOD) - x(t - 1.5 * PERIOD))
            / PERIOD.powi(3)
    }

    #[test]
    fn the_weight_is_what_a_third_difference_shows_of_a_step_of_the_acceleration() {
        for i in -20..=20 {
            let t = 0.1 * f64::from(i) * PERIOD;
            let step = |time: f64| 0.5 * time.max(0.0).powi(2);
            assert!((third(step, t) * PERIOD - weight(t / PERIOD)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_single_jump_uses_its_whole_part_of_the_limit_at_its_greatest_speed() {
        // Limit 1: 3/4 · 2 v² = MOST · T.
        let [passage] = passages(&[jump(5.0, 2.0)], PERIOD)[..] else { panic!() };
        assert!((passage.speed / (MOST * PERIOD / 1.5).sqrt() - 1.0).abs() < 1e-12);
        assert!((passage.share - MOST).abs() < 1e-12);
        assert!((passage.reach - 1.5e-3 * (passage.speed + 0.75)).abs() < 1e-12);
        // A jump that is passed slowly because of other limits uses less.
        let slow = Jump { speed: 0.5 * passage.speed, ..jump(5.0, 2.0) };
        let [passage] = passages(&[slow], PERIOD)[..] else { panic!() };
        assert_eq!(passage.speed, f64::INFINITY);
        assert!((passage.share - 0.25 * MOST).abs() < 1e-12);
    }

    #[test]
    fn jumps_and_the_lowered_jerk_between_them_keep_the_limit() {
        // Jumps at equal distances, with the jerk between them at its lowered limit, all of one sign.
        let mut most = 0.0_f64;
        for spacing in [1e-6, 3e-6, 1e-5, 2e-5, 3e-5, 5e-5, 1e-4, 1.0] {
            let jumps: Vec<_> = (0..200).map(|i| jump(spacing * f64::from(i), 2.0)).collect();
            let found = passages(&jumps, PERIOD);
            let Passage { speed, share, .. } = found[100];
            assert!(speed < 100.0 && share <= MOST);
            let step = spacing / speed;
            for i in 0..1000 {
                let t = 0.001 * f64::from(i) * step;
                let at = |n: i32| weight((t - f64::from(n) * step) / PERIOD);
                let steps = 2.0 * speed * speed / PERIOD * (-99..100).map(at).sum::<f64>();
                let all = 1.0 - share + steps;
                assert!(all <= 1.0 + 1e-9, "{all} at jumps {spacing} mm apart");
                most = most.max(all);
            }
        }
        assert!(most > 0.99, "{most}");
    }
}
