//! Computes the limit curve of a quadratic sub-piece: the greatest p at which some s keeps every axis within its acceleration
//! limits. Zhang et al. 2010, equations 7 and 8, with absolute values.
//!
//! Two axes limit p to (A_j g_k + A_k g_j)/|W_jk|. W is constant, so this is a straight line, and the lowest pair
//! stays the lowest until an axis turns. Where the line falls, every motion on it is forced above it further on;
//! where it rises, a pass leaves it at once. So the forward pass never follows it.

/// p at the start and the end of a sub-piece, or None if all axes move in proportion. `g_start`, `g_end` ≥ 0 are the
/// tangents there, `c` their derivative, `wronskian` gives W_jk for all k.
pub fn limit_curve<const M: usize>(
    g_start: &[f64; M],
    g_end: &[f64; M],
    c: &[f64; M],
    acceleration: &[f64; M],
    wronskian: impl Fn(usize) -> [f64; M],
) -> Option<[f64; 2]> {
    let mut lowest: Option<[f64; 2]> = None;
    for j in 0..M {
        let wronskian = wronskian(j);
        for k in j + 1..M {
            if wronskian[k] == 0.0 {
                continue;
            }
            let inverse = 1.0 / wronskian[k].abs();
            let at = |g: &[f64; M]| (acceleration[j] * g[k] + acceleration[k] * g[j]) * inverse;
            let line = [at(g_start), at(g_end)];
            if lowest.is_none_or(|best| line[0] + line[1] < best[0] + best[1]) {
                lowest = Some(line);
            }
        }
    }
    // At a zero of g_k the limit is exactly A_k/|c_k|; the passes rely on its last bit.
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
