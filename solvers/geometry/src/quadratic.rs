//! Vectors, segments and quadratic Bézier pieces in M axes.

/// Scalar product.
#[inline(always)]
pub fn dot<const M: usize>(a: &[f64; M], b: &[f64; M]) -> f64 {
    let mut sum = 0.0;
    for k in 0..M {
        sum += a[k] * b[k];
    }
    sum
}

/// Euclidean length.
#[inline(always)]
pub fn norm<const M: usize>(a: &[f64; M]) -> f64 {
    dot(a, a).sqrt()
}

/// `a − b`.
#[inline(always)]
pub fn sub<const M: usize>(a: &[f64; M], b: &[f64; M]) -> [f64; M] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `a + t (b − a)`, exactly `a` at t = 0.
#[inline(always)]
pub fn lerp<const M: usize>(a: &[f64; M], b: &[f64; M], t: f64) -> [f64; M] {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// The straight segment from one point to another.
#[derive(Clone, Copy, Debug)]
pub struct Segment<const M: usize> {
    start: [f64; M],
    vector: [f64; M],
    length_sq: f64,
}

impl<const M: usize> Segment<M> {
    pub fn new(start: &[f64; M], end: &[f64; M]) -> Self {
        let vector = sub(end, start);
        // For a segment of length 0 any positive number will do.
        Self { start: *start, vector, length_sq: dot(&vector, &vector).max(f64::MIN_POSITIVE) }
    }

    /// Squared distance from `p`, also if the segment has no length.
    #[inline(always)]
    pub fn distance_sq(&self, p: &[f64; M]) -> f64 {
        let w = sub(p, &self.start);
        let t = (dot(&w, &self.vector) / self.length_sq).clamp(0.0, 1.0);
        let rest: [f64; M] = std::array::from_fn(|k| w[k] - t * self.vector[k]);
        dot(&rest, &rest)
    }
}

/// C(u) on u in [0, width], by its three control points in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadratic<const M: usize> {
    pub control: [[f64; M]; 3],
    pub width: f64,
}

impl<const M: usize> Quadratic<M> {
    /// The straight piece from `a` to `b`, parametrised by its length.
    pub fn line(a: [f64; M], b: [f64; M]) -> Self {
        Self { control: [a, lerp(&a, &b, 0.5), b], width: norm(&sub(&b, &a)) }
    }

    /// C(u).
    #[inline]
    pub fn point(&self, u: f64) -> [f64; M] {
        let t = u / self.width;
        let [a, b, c] = &self.control;
        lerp(&lerp(a, b, t), &lerp(b, c, t), t)
    }

    /// C'(0) and C'(width); C' is linear between them.
    #[inline]
    pub fn end_tangents(&self) -> ([f64; M], [f64; M]) {
        let [a, b, c] = &self.control;
        let scale = 2.0 / self.width;
        (std::array::from_fn(|k| scale * (b[k] - a[k])), std::array::from_fn(|k| scale * (c[k] - b[k])))
    }

    /// The derivatives of C with respect to t = u/width at both ends. On a line made by `line` both are set equal: the rounding
    /// of its middle point would bend a short line far from the origin.
    #[inline(always)]
    pub fn tangents(&self) -> ([f64; M], [f64; M]) {
        let [a, b, c] = &self.control;
        if *b == lerp(a, c, 0.5) {
            return (sub(c, a), sub(c, a));
        }
        (std::array::from_fn(|k| 2.0 * (b[k] - a[k])), std::array::from_fn(|k| 2.0 * (c[k] - b[k])))
    }

    /// The part on [u0, u1] as a piece of its own, on [0, u1 − u0].
    pub fn part(&self, u0: f64, u1: f64) -> Self {
        let [a, b, c] = &self.control;
        let blossom = |s: f64, t: f64| {
            let (s, t) = (s / self.width, t / self.width);
            lerp(&lerp(a, b, s), &lerp(b, c, s), t)
        };
        let first = if u0 == 0.0 { *a } else { blossom(u0, u0) };
        let last = if u1 == self.width { *c } else { blossom(u1, u1) };
        Self { control: [first, blossom(u0, u1), last], width: u1 - u0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_lies_on_the_whole() {
        let whole = Quadratic { control: [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]], width: 4.0 };
        let part = whole.part(1.0, 3.0);
        for (local, global) in [(0.0, 1.0), (0.5, 1.5), (2.0, 3.0)] {
            assert!(norm(&sub(&part.point(local), &whole.point(global))) < 1e-15);
        }
        let (_, end) = part.end_tangents();
        let (start, _) = whole.part(3.0, 4.0).end_tangents();
        assert!(norm(&sub(&end, &start)) < 1e-15);
    }
}
