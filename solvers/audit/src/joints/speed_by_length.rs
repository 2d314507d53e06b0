//! The motion along the path on phases of limited jerk, from the length of the way from the start of each phase.
//!
//! At constant jerk the time of a length is found by Newton's method within a bracket that is halved; where v² is a cubic
//! polynomial of the length the time is integrated.

use super::path::Piece;
use crate::phases::{Phases, PATH_JERK};
use crate::EPS;

/// Nodes and weights of Gauss's rule with 8 places on [−1, 1], by halves.
pub const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// ∫ f from a to b by Gauss's rule.
pub fn gauss(a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * GAUSS
        .iter()
        .map(|(node, weight)| weight * (f(middle - half * node) + f(middle + half * node)))
        .sum::<f64>()
}

/// The same in two parts.
pub fn gauss_halved(a: f64, b: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let middle = 0.5 * (a + b);
    gauss(a, middle, &mut f) + gauss(middle, b, &mut f)
}

/// Steps of Newton's method and halvings: a bracket of doubles is closed by then. A step by so small a share of the time is
/// rounding.
const ROUNDS: usize = 100;
const SETTLED: f64 = 4.0 * EPS;

/// Speed along the path, its change, that one's change; the time since the phase's start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    pub v: f64,
    pub a: f64,
    pub j: f64,
    pub time: f64,
}

/// The motion at places of a phase from end to end.
pub fn paces<const M: usize>(piece: &Piece<M>, phases: &Phases, phase: usize, u: &[f64]) -> Vec<Pace> {
    let mut way = 0.0;
    let mut ways = vec![0.0];
    for pair in u.windows(2) {
        way += gauss_halved(pair[0], pair[1], |u| piece.way_slope(u));
        ways.push(way);
    }
    let v0 = piece.way_slope(phases.u0[phase]) * phases.p0[phase].sqrt();
    let v1 = piece.way_slope(phases.u1[phase]) * phases.p1[phase].sqrt();
    let (v, a) = ([v0, v1], [phases.a0[phase], phases.a1[phase]]);
    if phases.kind[phase] == PATH_JERK {
        constant_jerk(&ways, v, a, phases.value[phase], phases.duration[phase])
    } else {
        cubic(&ways, v, a)
    }
}

/// At constant jerk, counted from the slower end, where nothing cancels: from the end time runs back.
fn constant_jerk(way: &[f64], v: [f64; 2], a: [f64; 2], j: f64, duration: f64) -> Vec<Pace> {
    let back = v[1] < v[0];
    let (v, a) = if back { (v[1], -a[1]) } else { (v[0], a[0]) };
    let last = way[way.len() - 1];
    let length = |t: f64| t * (v + t * (a / 2.0 + t * j / 6.0));
    let whole = length(duration);
    way.iter()
        .map(|way| {
            let wanted = if back { last - way } else { *way };
            let (mut low, mut high) = (0.0, duration);
            let mut t = duration * (wanted / whole).clamp(0.0, 1.0).cbrt();
            for _ in 0..ROUNDS {
                let miss = length(t) - wanted;
                if miss > 0.0 {
                    high = t;
                } else {
                    low = t;
                }
                let newton = t - miss / (v + t * (a + t * j / 2.0));
                let new = if low <= newton && newton <= high { newton } else { 0.5 * (low + high) };
                let settled = (new - t).abs() <= SETTLED * new;
                t = new;
                if settled {
                    break;
                }
            }
            // A way beyond the phase's own at its mean speed.
            if wanted >= whole {
                t = duration * wanted / whole;
            }
            let pull = a + t * j;
            Pace {
                v: v + t * (a + t * j / 2.0),
                a: if back { -pull } else { pull },
                j,
                time: if back { duration - t } else { t },
            }
        })
        .collect()
}

/// With v² a cubic of the length.
fn cubic(way: &[f64], v: [f64; 2], a: [f64; 2]) -> Vec<Pace> {
    let length = way[way.len() - 1];
    let (w0, w1) = (v[0] * v[0], v[1] * v[1]);
    let [slope0, slope1] = a.map(|a| 2.0 * a * length);
    let (c2, c3) = (3.0 * (w1 - w0) - 2.0 * slope0 - slope1, slope0 + slope1 - 2.0 * (w1 - w0));
    let speed = |x: f64| (w0 + x * (slope0 + x * (c2 + x * c3))).sqrt();
    let (mut time, mut before) = (0.0, 0.0);
    way.iter()
        .map(|way| {
            let x = way / length;
            if x > before {
                time += length * gauss_halved(before, x, |x| 1.0 / speed(x));
            }
            before = x;
            let v = speed(x);
            Pace {
                v,
                a: (slope0 + x * (2.0 * c2 + x * 3.0 * c3)) / (2.0 * length),
                j: v * (c2 + 3.0 * x * c3) / (length * length),
                time,
            }
        })
        .collect()
}
