//! Numerical integration: Kronrod's rule of 7 points (Kronrod 1965), Gauss's of 3 points inside it, and halving of the interval
//! where they differ. The rules themselves are for one function or for eight at once; see `number`.

use super::number::Number;

/// Nodes and weights of Kronrod's 7-point rule on [−1, 1], the weight of the middle node last; the weights of two rules on some
/// of its nodes: Gauss's of 3 points, exact to degree 5, and that of the outermost two and the middle, exact to degree 3.
const NODES: [f64; 3] = [0.960_491_268_708_020_3, 0.774_596_669_241_483_4, 0.434_243_749_346_802_55];
const WEIGHTS: [f64; 4] =
    [0.104_656_226_026_467_27, 0.268_488_089_868_333_44, 0.401_397_414_775_962_2, 0.450_916_538_658_474_14];
const INNER_WEIGHTS: [f64; 2] = [5.0 / 9.0, 8.0 / 9.0];
const OUTER_WEIGHTS: [f64; 2] = [0.361_326_288_494_254_1, 1.277_347_423_011_491_7];

/// Weights of the differences f(−x) − f(x) at each pair of nodes: half of the integral plus their sum is the integral over
/// the first half.
const ODD_WEIGHTS: [f64; 3] = [0.057_380_543_663_243_626, 0.117_373_057_543_216_43, 0.239_427_071_874_871_92];

/// Weights for the same sum from the outermost and the innermost pair alone, exact to degree 3.
const OUTER_ODD_WEIGHTS: [f64; 2] = [0.110_440_551_354_077, 0.331_433_244_415_378_86];

/// Gauss's rule can agree with Kronrod's by chance, so the difference of the other rule counts as well, times this: for smooth
/// functions it is then about as large as that of Gauss's rule.
const CHANCE: f64 = 3e-3;

/// If Gauss's rule differs from Kronrod's by no more than this part, the error of Kronrod's is about the square of that part for
/// smooth functions. Where both step over a thin layer, as the speed can have next to a crawl, it is about this part.
pub const RULES_AGREE: f64 = 3e-8;

/// Halvings after which an integral is given up; those of correct phases need about forty.
pub const MOST_HALVINGS: u32 = 400;

/// The nodes of Kronrod's rule around `middle`: the three below it, the middle, the three above it, and the middle once more, as
/// eight numbers fill a vector.
#[inline(always)]
pub fn nodes<T: Number>(middle: T, half: T) -> [T; 8] {
    let mut nodes = [middle; 8];
    for i in 0..NODES.len() {
        nodes[i] = middle - half * NODES[i];
        nodes[i + 4] = middle + half * NODES[i];
    }
    nodes
}

/// The nodes of Gauss's rule around `middle`.
#[inline(always)]
pub fn gauss_nodes<T: Number>(middle: T, half: T) -> [T; 3] {
    [middle - half * NODES[1], middle, middle + half * NODES[1]]
}

/// The integral of f from a to b by Kronrod's rule, and an estimate of its error from the other rules. f gets all nodes at once.
#[inline(always)]
pub fn kronrod(mut f: impl FnMut([f64; 8]) -> [f64; 8], a: f64, b: f64) -> [f64; 2] {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    by_rules(&f(nodes(middle, half)), half)
}

/// The integral of f from a to b by Gauss's rule of 3 points. f gets all of them at once, and the middle one twice, as four
/// numbers fill a vector.
#[inline(always)]
pub fn gauss(f: impl Fn([f64; 4]) -> [f64; 4], a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let [before, centre, after] = gauss_nodes(middle, half);
    let [before, centre, after, _] = f([before, centre, after, middle]);
    by_gauss([before, centre, after], half)
}

/// Gauss's rule from the values at its nodes.
#[inline(always)]
pub fn by_gauss<T: Number>([before, centre, after]: [T; 3], half: T) -> T {
    half * (centre * INNER_WEIGHTS[1] + (before + after) * INNER_WEIGHTS[0])
}

/// The integral and error estimate of `kronrod`, and the integral over the first half, by the polynomial through the values at
/// all nodes. The part of f that is odd about the middle adds nothing to the whole integral by any rule, but to that of the half:
/// its error estimate counts with the same factor `CHANCE`.
#[inline(always)]
pub fn kronrod_halves(f: impl Fn([f64; 8]) -> [f64; 8], a: f64, b: f64) -> ([f64; 2], f64) {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    halves_by_rules(&f(nodes(middle, half)), half)
}

/// `kronrod_halves` from the values at the nodes.
#[inline(always)]
pub fn halves_by_rules<T: Number>(values: &[T; 8], half: T) -> ([T; 2], T) {
    let [fine, doubt] = by_rules(values, half);
    let (outer, gauss, inner) = (values[0] - values[4], values[1] - values[5], values[2] - values[6]);
    let odd = outer * ODD_WEIGHTS[0] + gauss * ODD_WEIGHTS[1] + inner * ODD_WEIGHTS[2];
    let rough = outer * OUTER_ODD_WEIGHTS[0] + inner * OUTER_ODD_WEIGHTS[1];
    ([fine, doubt.greater(half * CHANCE * (rough - odd).size())], fine * 0.5 + half * odd)
}

/// The integral and its error estimate from the values at the nodes.
#[inline(always)]
pub fn by_rules<T: Number>(values: &[T; 8], half: T) -> [T; 2] {
    let (outer, gauss, inner) = (values[0] + values[4], values[1] + values[5], values[2] + values[6]);
    let centre = values[3];
    let fine = outer * WEIGHTS[0] + gauss * WEIGHTS[1] + inner * WEIGHTS[2] + centre * WEIGHTS[3];
    let miss = (gauss * INNER_WEIGHTS[0] + centre * INNER_WEIGHTS[1] - fine).size();
    let rough = (outer * OUTER_WEIGHTS[0] + centre * OUTER_WEIGHTS[1] - fine).size();
    [half * fine, half * miss.greater(rough * CHANCE)]
}

/// The integral from a to b, halved where the rules differ; NaN if more than `halvings` would be needed.
pub fn integral(f: &mut impl FnMut([f64; 8]) -> [f64; 8], a: f64, b: f64, halvings: &mut u32) -> f64 {
    let [fine, doubt] = kronrod(&mut *f, a, b);
    let middle = 0.5 * (a + b);
    if doubt.abs() <= RULES_AGREE * fine.abs() || !(a < middle && middle < b) {
        return fine;
    }
    if *halvings == 0 || !fine.is_finite() {
        return f64::NAN;
    }
    *halvings -= 1;
    integral(f, a, middle, halvings) + integral(f, middle, b, halvings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_degree_eleven_exactly() {
        for degree in 0..=11 {
            let mut sum = WEIGHTS[3] * if degree == 0 { 1.0 } else { 0.0 };
            for i in 0..3 {
                sum += WEIGHTS[i] * (NODES[i].powi(degree) + (-NODES[i]).powi(degree));
            }
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-15, "degree {degree}: {sum} instead of {exact}");
        }
    }

    #[test]
    fn the_first_half_of_the_rule_is_that_of_a_polynomial() {
        for degree in 0..=6 {
            let ([whole, _], half) = kronrod_halves(|x| x.map(|x| (x - 0.3_f64).powi(degree)), 1.0, 4.0);
            let exact = |x: f64| (x - 0.3).powi(degree + 1) / f64::from(degree + 1);
            assert!((whole / (exact(4.0) - exact(1.0)) - 1.0).abs() < 1e-14, "{degree}");
            assert!((half / (exact(2.5) - exact(1.0)) - 1.0).abs() < 1e-14, "{degree}");
        }
    }

    #[test]
    fn a_rule_that_agrees_by_chance_is_not_believed() {
        // For 2 + cos kx Gauss's rule and Kronrod's agree at some k, where both are wrong.
        let rules = |k: f64| {
            let f = |x: f64| 2.0 + (k * x).cos();
            let gauss = INNER_WEIGHTS[0] * 2.0 * f(NODES[1]) + INNER_WEIGHTS[1] * f(0.0);
            let [fine, doubt] = kronrod(|x| x.map(f), -1.0, 1.0);
            (gauss - fine, doubt, (fine - 4.0 - 2.0 * k.sin() / k).abs())
        };
        let mut met = 0;
        for step in 10..400 {
            let (mut low, mut high) = (0.05 * f64::from(step), 0.05 * f64::from(step + 1));
            if rules(low).0 * rules(high).0 > 0.0 {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if rules(low).0 * rules(middle).0 > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let (_, doubt, error) = rules(low);
            met += i32::from(error > 1e-6);
            assert!(
                error <= 1e-10 || doubt > 4.0 * RULES_AGREE,
                "off by {error} at {low}, in doubt by {doubt}"
            );
        }
        assert!(met > 0);
    }

    #[test]
    fn what_is_odd_about_the_middle_is_not_missed_in_half_of_it() {
        // The error allowed is relative to the whole integral, which is 4.
        let (mut met, agree) = (0, 4.0 * RULES_AGREE);
        for step in 1..400 {
            let k = 0.05 * f64::from(step);
            let ([_, doubt], half) = kronrod_halves(|x| x.map(|x| 2.0 + (k * x).sin()), -1.0, 1.0);
            let error = (half - 2.0 + (1.0 - k.cos()) / k).abs();
            met += i32::from(error > 1e-6);
            assert!(error <= agree || doubt > agree, "off by {error} at {k}, in doubt by {doubt}");
        }
        assert!(met > 0);
    }
}
