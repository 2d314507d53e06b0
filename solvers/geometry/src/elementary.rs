//! Elementary functions with the same result, bit for bit, on every processor.
//!
//! Those of the standard library call the C library. On processors with fused multiply-add it uses other instructions, which
//! round differently.

pub trait Elementary {
    fn power(self, exponent: f64) -> f64;
    fn natural_log(self) -> f64;
    fn exponential(self) -> f64;
    fn exponential_less_1(self) -> f64;
    fn hyperbolic_sine(self) -> f64;
}

impl Elementary for f64 {
    /// The exponents 3/4 and 3/2 take only a few nanoseconds.
    #[inline(always)]
    fn power(self, exponent: f64) -> f64 {
        if exponent == 0.75 {
            self.sqrt() * self.sqrt().sqrt()
        } else if exponent == 1.5 {
            self * self.sqrt()
        } else {
            libm::pow(self, exponent)
        }
    }

    fn natural_log(self) -> f64 {
        libm::log(self)
    }

    fn exponential(self) -> f64 {
        libm::exp(self)
    }

    fn exponential_less_1(self) -> f64 {
        libm::expm1(self)
    }

    fn hyperbolic_sine(self) -> f64 {
        libm::sinh(self)
    }
}

#[cfg(test)]
mod tests {
    use super::Elementary;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn they_are_those_of_the_standard_library_to_rounding(x in -20.0..20.0f64, exponent in -3.0..3.0f64) {
            let positive = x.exp();
            let pairs = [
                (positive.power(exponent), positive.powf(exponent)),
                (positive.power(0.75), positive.powf(0.75)),
                (positive.power(1.5), positive.powf(1.5)),
                (positive.natural_log(), positive.ln()),
                (x.exponential(), x.exp()),
                (x.exponential_less_1(), x.exp_m1()),
                (x.hyperbolic_sine(), x.sinh()),
            ];
            for (own, other) in pairs {
                prop_assert!((own - other).abs() <= 1e-15 * other.abs(), "{own} and {other}");
            }
        }
    }
}
