//! Converts linear and quadratic forms of (w, w', w'') at a collocation point to the local coefficients of the intervals of a
//! block; powers of w.

use fearless_simd::Simd;
use feedplan_geometry::lanes::eight::Register;

use super::hermite::{combine, Basis, BEND, LAST, SLOPE, VALUE};

/// A symmetric quadratic form of (w, w', w''): the matrix elements 00 01 02 11 12 22.
pub type Form<S> = [Register<S>; 6];

/// The upper triangle of a matrix, and a gradient, in the local coefficients (w, h w') at both ends.
pub struct Local<S: Simd> {
    pub matrix: [[Register<S>; 4]; 4],
    pub gradient: [Register<S>; 4],
}

impl<S: Simd> Local<S> {
    #[inline(always)]
    pub fn zero(simd: S) -> Self {
        let zero = Register::all(simd, 0.0);
        Self { matrix: [[zero; 4]; 4], gradient: [zero; 4] }
    }

    /// Adds a quadratic form of (w, w', w'') at collocation point `p` of intervals of length 1/`per_h`.
    #[inline(always)]
    pub fn add(&mut self, p: usize, per_h: Register<S>, form: &Form<S>) {
        let per_h2 = per_h * per_h;
        let m = [
            form[0],
            form[1] * per_h,
            form[2] * per_h2,
            form[3] * per_h2,
            form[4] * (per_h * per_h2),
            form[5] * (per_h2 * per_h2),
        ];
        match p {
            0 => self.add_at_end::<0>(&m, &BEND[0]),
            LAST => self.add_at_end::<2>(&m, &BEND[LAST]),
            _ => self.add_inside(&m, [&VALUE[p], &SLOPE[p], &BEND[p]]),
        }
    }

    #[inline(always)]
    fn add_inside(&mut self, m: &Form<S>, [value, slope, bend]: [&Basis; 3]) {
        for j in 0..4 {
            let (v, s, b) = (value[j], slope[j], bend[j]);
            let p0 = m[0] * v + m[1] * s + m[2] * b;
            let p1 = m[1] * v + m[3] * s + m[4] * b;
            let p2 = m[2] * v + m[4] * s + m[5] * b;
            for i in 0..=j {
                self.matrix[i][j] += p0 * value[i] + p1 * slope[i] + p2 * bend[i];
            }
        }
    }

    /// Adds a quadratic form at an end of the intervals, where w and h w' are the local coefficients K and K + 1.
    #[inline(always)]
    fn add_at_end<const K: usize>(&mut self, m: &Form<S>, bend: &Basis) {
        for j in 0..4 {
            let part = m[5] * bend[j];
            for i in 0..=j {
                self.matrix[i][j] += part * bend[i];
            }
            for (k, with_bend) in [(K, m[2]), (K + 1, m[4])] {
                let part = with_bend * if j == k { 2.0 * bend[j] } else { bend[j] };
                self.matrix[j.min(k)][j.max(k)] += part;
            }
        }
        self.matrix[K][K] += m[0];
        self.matrix[K][K + 1] += m[1];
        self.matrix[K + 1][K + 1] += m[3];
    }
}

/// w, w', w'' at collocation point `p` for local coefficients u.
#[inline(always)]
pub fn motion<S: Simd>(p: usize, per_h: Register<S>, u: &[Register<S>; 4]) -> [Register<S>; 3] {
    let [w, slope] = match p {
        0 => [u[0], u[1]],
        LAST => [u[2], u[3]],
        _ => [combine(&VALUE[p], u), combine(&SLOPE[p], u)],
    };
    [w, slope * per_h, combine(&BEND[p], u) * (per_h * per_h)]
}

/// Adds a linear form of (w, w', w'') at collocation point `p` to `out`, in local coefficients.
#[inline(always)]
pub fn project<S: Simd>(p: usize, per_h: Register<S>, linear: &[Register<S>; 3], out: &mut [Register<S>; 4]) {
    let [g0, g1, g2] = [linear[0], linear[1] * per_h, linear[2] * (per_h * per_h)];
    for k in 0..4 {
        out[k] += g2 * BEND[p][k];
    }
    match p {
        0 => [out[0], out[1]] = [out[0] + g0, out[1] + g1],
        LAST => [out[2], out[3]] = [out[2] + g0, out[3] + g1],
        _ => {
            for k in 0..4 {
                out[k] += g0 * VALUE[p][k] + g1 * SLOPE[p][k];
            }
        }
    }
}

/// w^(−1/2).
#[inline(always)]
pub fn pace<S: Simd>(w: Register<S>) -> Register<S> {
    w.max(Register::all(w.simd(), f64::MIN_POSITIVE)).sqrt().inverse()
}

/// w^(−3/2)/2.
#[inline(always)]
pub fn fall<S: Simd>(pace: Register<S>) -> Register<S> {
    pace * pace * pace * 0.5
}
