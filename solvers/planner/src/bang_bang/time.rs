//! Computes the time [s] along a cap of the tool's speed, the integral of length/speed, by Gauss's quadrature.

use super::tolerance::TIME;

/// Nodes of the rule.
pub const NODES: usize = 6;
/// Greatest number of halvings for one phase; some twenty are usual.
const MOST_HALVINGS: u32 = 1000;

/// ∫ rate dx from x0 to x1 by Gauss's rule of order 12, halved until both halves agree with the whole. `rate` gives
/// length/speed at all nodes.
pub fn integral(rate: &impl Fn([f64; NODES]) -> [f64; NODES], x0: f64, x1: f64) -> f64 {
    let whole = rule(rate, x0, x1);
    gauss(rate, (x0, x1), whole, TIME * whole, &mut { MOST_HALVINGS })
}

/// The allowed `error` is the same for all sub-intervals. `left` is the number of halvings still allowed: next to a cusp the rate
/// may consist of rounding errors, and further halvings would not make the sum more accurate.
fn gauss(
    rate: &impl Fn([f64; NODES]) -> [f64; NODES],
    (a, b): (f64, f64),
    whole: f64,
    error: f64,
    left: &mut u32,
) -> f64 {
    let middle = 0.5 * (a + b);
    let halves = (rule(rate, a, middle), rule(rate, middle, b));
    if (halves.0 + halves.1 - whole).abs() <= error || *left == 0 {
        return halves.0 + halves.1;
    }
    *left -= 1;
    gauss(rate, (a, middle), halves.0, error, left) + gauss(rate, (middle, b), halves.1, error, left)
}

/// Gauss's rule.
fn rule(rate: &impl Fn([f64; NODES]) -> [f64; NODES], a: f64, b: f64) -> f64 {
    const HALF: [(f64, f64); NODES / 2] = [
        (0.238_619_186_083_196_9, 0.467_913_934_572_691_04),
        (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
        (0.932_469_514_203_152, 0.171_324_492_379_170_35),
    ];
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let node = |i: usize| {
        let (x, weight) = HALF[i / 2];
        (if i.is_multiple_of(2) { -x } else { x }, weight)
    };
    let rates = rate(std::array::from_fn(|i| middle + half * node(i).0));
    half * rates.iter().enumerate().map(|(i, rate)| node(i).1 * rate).sum::<f64>()
}
