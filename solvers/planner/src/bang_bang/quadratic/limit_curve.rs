//! The velocity limit curve (VLC) of a quadratic sub-piece: the greatest p = (dx/dt)² at which some
//! acceleration along the path keeps every axis within its limit.
//!
//! With g = q' ≥ 0 and c = q'', two axes bound p by (A_j g_k + A_k g_j)/|c_j g_k − c_k g_j|; the denominator is
//! constant along a quadratic, so the bound is a straight line, and the lowest pair stays the lowest until an
//! axis turns round (Zhang et al. 2010, eqs. 7 and 8, with absolute values). Where the line falls the path
//! ahead forces every motion on it above it; where it rises it is left at once: it is never followed forward.

/// Values of p at the start and the end of a sub-piece on which no axis turns round; None if all axes move in
/// proportion. `g_start`, `g_end` ≥ 0 are the tangents there, `c` the second derivative, `acceleration` the limits.
pub fn limit_curve<const M: usize>(
    g_start: &[f64; M],
    g_end: &[f64; M],
    c: &[f64; M],
    acceleration: &[f64; M],
    twist: impl Fn(usize) -> [f64; M],
) -> Option<[f64; 2]> {
    let mut lowest: Option<[f64; 2]> = None;
    for j in 0..M {
        let twist = twist(j);
        for k in j + 1..M {
            if twist[k] == 0.0 {
                continue;
            }
            let inverse = 1.0 / twist[k].abs();
            let at = |g: &[f64; M]| (acceleration[j] * g[k] + acceleration[k] * g[j]) * inverse;
            let line = [at(g_start), at(g_end)];
            if lowest.is_none_or(|best| line[0] + line[1] < best[0] + best[1]) {
                lowest = Some(line);
            }
        }
    }
    // At a zero of g_k the limit is exactly A_k/|c_k|; the passes rely on the last bit there.
    let mut line = lowest?;
    for k in 0..M {
        for (value, g) in line.iter_mut().zip([g_start, g_end]) {
            if g[k] == 0.0 && c[k] != 0.0 {
                *value = value.min(acceleration[k] / c[k].abs());
            }
        }
    }
    Some(line)
}
