//! How long a velocity cap is followed: the length of the piece over its speed, or, at the chord-error limit, an
//! integral of D^(−¼).

use super::subpiece::SubPiece;
use feedplan_geometry::quadratic::{dot, norm};

/// Length of the sub-piece on [a, b].
///
/// With r = |C'| at both ends, R = r₀ + r₁, E = |C''|, t = C'·C''/E, d² = r² − t², x = E h/R:
/// (h/R) [(R² + (t₀ + t₁)²)/4 + d² atanh(x)/x].
#[inline(always)]
pub fn length<const M: usize>(sub: &SubPiece<M>, a: f64, b: f64) -> f64 {
    let (ga, gb) = (sub.tangent(a), sub.tangent(b));
    let [da, _, db] = sub.speed_form(a, b);
    // x = |gb − ga| / R with the difference taken as E h.
    let h = b - a;
    let bend_sq = dot(&sub.bend, &sub.bend);
    let r = da.sqrt() + db.sqrt();
    let x_sq = bend_sq * h * h / (r * r);
    let (ta, tb) = (dot(&ga, &sub.bend), dot(&gb, &sub.bend));
    let t_sq = (ta + tb) * (ta + tb) / bend_sq;
    let distance_sq = (0.5 * ((da - ta * ta / bend_sq) + (db - tb * tb / bend_sq))).max(0.0);
    h / r * (0.25 * (r * r + t_sq) + distance_sq * atanh_over(x_sq))
}

/// atanh(x)/x as a function of x².
#[inline(always)]
fn atanh_over(x_sq: f64) -> f64 {
    if x_sq < 0.01 {
        let odd = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0];
        odd.iter().rev().fold(0.0, |sum, n| sum * x_sq + 1.0 / n)
    } else if x_sq < 1.0 {
        let x = x_sq.sqrt();
        0.5 * ((1.0 + x) / (1.0 - x)).ln() / x
    } else {
        // The tangent reverses: d² is 0 there.
        0.0
    }
}

/// Nodes and weights of the Gauss-Legendre rule with 12 points on [−1, 1], the positive half.
const GAUSS: [(f64, f64); 6] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_4, 0.203_167_426_723_065_92),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_23),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_43),
    (0.981_560_634_246_719_2, 0.047_175_336_386_511_83),
];
/// Part of the distance to the nearest singularity that one interval covers: twelve points then leave less than
/// 1e-13 of the value.
const REACH: f64 = 0.6;

/// ∫ dx/√p on [a, b] where p = factor · √D.
#[cold]
pub fn at_chord_limit<const M: usize>(sub: &SubPiece<M>, factor: f64, a: f64, b: f64) -> f64 {
    let density = |x: f64| norm(&sub.tangent(x)).sqrt().recip();
    let bend = norm(&sub.bend);
    let (mut sum, mut x) = (0.0, a);
    while x < b {
        // D has its complex roots at this distance from x.
        let step = (REACH * norm(&sub.tangent(x)) / bend).min(b - x);
        let next = if step < b - x { x + step } else { b };
        let (middle, half) = (0.5 * (x + next), 0.5 * (next - x));
        for (node, weight) in GAUSS {
            sum += half * weight * (density(middle - half * node) + density(middle + half * node));
        }
        x = next;
    }
    sum / factor.sqrt()
}
