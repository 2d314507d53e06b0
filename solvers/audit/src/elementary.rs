//! Computes sine, cosine and the angle of a vector, for one number or for eight at once, with the same bits.
//!
//! For sine and cosine the nearest whole number of quarter turns is subtracted from the angle. π/2 is split into parts, so that the
//! product of each part with that number is exact (Cody and Waite 1980). Polynomials then give sine and cosine of the remainder
//! (fdlibm, Sun Microsystems 1993), with an error below one rounding.

use std::f64::consts::FRAC_2_PI;

use fearless_simd::{f64x8, Simd, SimdBase, SimdMask};

use crate::number::Number;

/// Elementary functions of one number or of eight.
pub trait Elementary: Number {
    /// Sine and cosine of an angle in radians.
    fn wave(self) -> [Self; 2];
    /// The angle in radians of the vector (x, self).
    fn angle(self, x: Self) -> Self;
}

impl Elementary for f64 {
    #[inline(always)]
    fn wave(self) -> [Self; 2] {
        if self.abs() <= MOST {
            return wave(self);
        }
        let (sine, cosine) = self.sin_cos();
        [sine, cosine]
    }

    #[inline(always)]
    fn angle(self, x: Self) -> Self {
        self.atan2(x)
    }
}

impl<S: Simd> Elementary for f64x8<S> {
    #[inline(always)]
    fn wave(self) -> [Self; 2] {
        if self.abs().simd_le(self.filled(MOST)).to_bitmask() == (1 << 8) - 1 {
            return wave(self);
        }
        let (angles, mut sines, mut cosines) = (self.kept(), [0.0; 8], [0.0; 8]);
        for i in 0..8 {
            [sines[i], cosines[i]] = angles[i].wave();
        }
        [self.taken(&sines), self.taken(&cosines)]
    }

    #[inline(always)]
    fn angle(self, x: Self) -> Self {
        let (y, x) = (self.kept(), x.kept());
        let mut angles = [0.0; 8];
        for i in 0..8 {
            angles[i] = y[i].atan2(x[i]);
        }
        self.taken(&angles)
    }
}

/// The greatest angle [rad] from which quarter turns are subtracted exactly.
const MOST: f64 = 524_288.0;

/// π/2 as a sum: three parts of 33 bits, and the remainder.
const QUARTER: [f64; 4] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_711_166_5e-21,
    8.478_427_660_368_9e-32,
];

/// sin x = x + x³ (S_0 + x² (S_1 + …)).
const S: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// cos x = 1 − x²/2 + x⁴ (C_0 + x² (C_1 + …)).
const C: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine of angles in radians that are no greater than `MOST`.
#[inline(always)]
fn wave<T: Number>(angle: T) -> [T; 2] {
    let turns = (angle * FRAC_2_PI).rounded();
    // The remainder, as a sum of two numbers.
    let near = angle - turns * QUARTER[0];
    let taken = turns * QUARTER[1];
    let [rest, lost] = sum(near, taken * -1.0);
    let [x, tail] = sum(rest, lost - turns * QUARTER[2] - turns * QUARTER[3]);
    let (z, half) = (x * x, tail * 0.5);
    let inner = z * (z * (z * (z * S[5] + S[4]) + S[3]) + S[2]) + S[1];
    let cube = z * x;
    let sine = x - ((z * (half - cube * inner) - tail) - cube * S[0]);
    let inner = z * (z * (z * (z * (z * (z * C[5] + C[4]) + C[3]) + C[2]) + C[1]) + C[0]);
    let (halved, one) = (z * 0.5, x.filled(1.0));
    let most = one - halved;
    let cosine = most + (((one - most) - halved) + (z * inner - x * tail));
    // From −2 to 2 quarter turns.
    let turns = turns - (turns * 0.25).rounded() * 4.0;
    let size = turns.size();
    let (even, odd) = (one - size, turns * (x.filled(2.0) - size));
    [even * sine + odd * cosine, even * cosine - odd * sine]
}

/// The rounded sum of two numbers, and its rounding error.
#[inline(always)]
fn sum<T: Number>(a: T, b: T) -> [T; 2] {
    let sum = a + b;
    let own = sum - a;
    [sum, (a - (sum - own)) + (b - own)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EPS;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    fn assert_near(angle: f64) {
        let (sine, cosine) = angle.sin_cos();
        for (found, exact) in wave(angle).into_iter().zip([sine, cosine]) {
            assert!((found - exact).abs() <= EPS * exact.abs(), "{angle}: {found} for {exact}");
        }
    }

    #[test]
    fn next_to_whole_quarter_turns_no_digit_is_lost() {
        for quarter in -300_000..300_000 {
            assert_near(f64::from(quarter) * FRAC_PI_2);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn sine_and_cosine_are_those_of_the_standard_library_but_for_one_rounding(
            angle in -1.0..1.0_f64, power in -30..20_i32,
        ) {
            assert_near((angle * 2.0_f64.powi(power)).clamp(-MOST, MOST));
        }
    }
}
