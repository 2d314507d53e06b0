//! Estimates the peak of a limit's use between three equally spaced places by the vertex of the parabola through them.

/// A peak that is above the places by less than this part is ignored.
const NEGLIGIBLE: f64 = 1e-6;

/// The use of a limit at a vertex, and the place of the vertex: from −1 at the first place to 1 at the last.
pub struct Peak {
    pub at: f64,
    pub top: f64,
}

/// The peak, up or down, of a use with its sign at three equally spaced places; None if it cannot be above all three and the
/// `worst` so far.
#[inline(always)]
pub fn peak([a, b, c]: [f64; 3], worst: f64) -> Option<Peak> {
    let (bend, slope) = (2.0 * b - a - c, c - a);
    if is_far_below([a, b, c], worst) || slope.abs() >= 2.0 * bend.abs() {
        return None;
    }
    let top = b + slope * slope / (8.0 * bend);
    let most = a.abs().max(b.abs()).max(c.abs()).max(worst);
    // Terms of third order may raise the true peak above the vertex: by more, the more the three uses bend.
    let missed = bend * bend / most;
    let peak = Peak { at: 0.5 * slope / bend, top };
    (top.abs() + missed > (1.0 + NEGLIGIBLE) * most).then_some(peak)
}

/// Whether no peak can be above the `worst` so far, whatever the slope: the vertex adds at most half of the second difference
/// `bend`, the terms of third order add at most all of it.
#[inline(always)]
fn is_far_below([a, b, c]: [f64; 3], worst: f64) -> bool {
    b.abs() + 1.5 * (2.0 * b - a - c).abs() <= worst
}

/// Whether `is_far_below` holds for all axes, as it does at most places.
#[inline(always)]
pub fn are_far_below<const M: usize>([a, b, c]: [&[f64; M]; 3], worst: &[f64; M]) -> bool {
    let mut all = true;
    for k in 0..M {
        all &= is_far_below([a[k], b[k], c[k]], worst[k]);
    }
    all
}

impl Peak {
    /// Whether the use beside the vertex may be above the `worst` so far. At the vertex the use is `found`, which differs from
    /// the parabola; beside it the use is taken to exceed `found` by up to this difference.
    pub fn may_pass(&self, found: f64, worst: f64) -> bool {
        found.abs() + (found - self.top).abs() > (1.0 + NEGLIGIBLE) * worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_of_a_parabola_is_its_vertex() {
        let of = |f: fn(f64) -> f64| [f(-1.0), f(0.0), f(1.0)];
        let top = of(|x| 1.0 - 0.01 * (x - 0.3).powi(2));
        assert!((peak(top, 0.0).unwrap().at - 0.3).abs() < 1e-13);
        let found = peak(top, 0.0).unwrap();
        assert!(!found.may_pass(1.0, 1.001) && found.may_pass(1.0, 0.999) && found.may_pass(0.99, 0.999));
        assert!(peak(top, 1.0 + 1e-4).is_some(), "the third order may raise it as much");
        assert!(peak(top, 1.001).is_none());
        assert!(peak(of(|_| 1.0), 0.0).is_none());
        assert!(peak(of(|x| -1.0 - 0.01 * x * x), 0.0).is_none(), "it is less than an end");
        assert!(peak(of(|x| 1.0 - 0.01 * (x - 3.0).powi(2)), 0.0).is_none(), "it is beyond the places");
    }
}
