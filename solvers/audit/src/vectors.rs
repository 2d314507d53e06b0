//! Vectors of M numbers, one for each axis: length, distance, curvature, and straight lines between two points.

use super::number::{inner, Number};

/// Row `i` of a table with `axes` columns; numbers beyond are 0.
#[inline(always)]
pub fn vector<const M: usize>(table: &[f64], axes: usize, i: usize) -> [f64; M] {
    // The usual case: rows of constant length are read without a branch.
    if axes == M {
        let row = &table[i * M..(i + 1) * M];
        std::array::from_fn(|k| row[k])
    } else {
        let row = &table[i * axes..(i + 1) * axes];
        std::array::from_fn(|k| if k < row.len() { row[k] } else { 0.0 })
    }
}

/// A vector from its numbers by axis. `array::from_fn` and `map` are not inlined in large functions.
#[inline(always)]
pub fn vector_of<const M: usize>(number: impl Fn(usize) -> f64) -> [f64; M] {
    let mut vector = [0.0; M];
    for k in 0..M {
        vector[k] = number(k);
    }
    vector
}

/// Length of a vector.
#[inline(always)]
pub fn length<const M: usize>(a: &[f64; M]) -> f64 {
    inner(a, a).sqrt()
}

/// The products of the components.
#[inline(always)]
pub fn times<const M: usize>(a: &[f64; M], b: &[f64; M]) -> [f64; M] {
    vector_of(|k| a[k] * b[k])
}

/// From `a` to `b`.
#[inline(always)]
pub fn from_to<const M: usize>(a: &[f64; M], b: &[f64; M]) -> [f64; M] {
    vector_of(|k| b[k] - a[k])
}

/// Distance of two points.
#[inline(always)]
pub fn distance<const M: usize>(a: &[f64; M], b: &[f64; M]) -> f64 {
    length(&from_to(a, b))
}

/// Curvature in 1/mm from C' and C'': the component of C'' normal to the path over |C'|²; 0 where C' vanishes.
#[inline(always)]
pub fn curvature<const M: usize, T: Number>(tangent: &[T; M], bend: &[T; M]) -> T {
    let square = inner(tangent, tangent);
    let along = inner(tangent, bend) / square;
    let mut across = *bend;
    for k in 0..M {
        across[k] = bend[k] - along * tangent[k];
    }
    let curvature = inner(&across, &across).root() / square;
    // 0 × C'² keeps a NaN.
    curvature.where_finite(square.filled(1.0) / square, 0.0) + square * 0.0
}

/// A straight line from one point to another, ends included.
#[derive(Clone, Copy, Debug)]
pub struct Segment<const M: usize> {
    start: [f64; M],
    /// Vector to the other end, and 1/length²; 0 if that would be infinite.
    along: [f64; M],
    per_length_sq: f64,
}

impl<const M: usize> Segment<M> {
    #[inline]
    pub fn new(a: &[f64; M], b: &[f64; M]) -> Self {
        let along = from_to(a, b);
        let length_sq = inner(&along, &along);
        let per_length_sq = Some(length_sq.recip()).filter(|inverse| inverse.is_finite()).unwrap_or(0.0);
        Self { start: *a, along, per_length_sq }
    }

    /// Square of the distance of `q` from the nearest point.
    #[inline]
    pub fn distance_sq(&self, q: &[f64; M]) -> f64 {
        let to = from_to(&self.start, q);
        let t = (inner(&to, &self.along) * self.per_length_sq).clamp(0.0, 1.0);
        let mut sum = 0.0;
        for k in 0..M {
            let d = to[k] - t * self.along[k];
            sum += d * d;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_beside_a_segment_is_as_far_as_the_nearest_end_or_foot() {
        let (a, b) = ([0.0, 0.0], [4.0, 0.0]);
        let segment = Segment::new(&a, &b);
        assert_eq!(segment.distance_sq(&[2.0, 3.0]), 9.0);
        assert_eq!(segment.distance_sq(&[7.0, 4.0]), 25.0);
        assert_eq!(segment.distance_sq(&[-3.0, 4.0]), 25.0);
        assert_eq!(Segment::new(&a, &a).distance_sq(&[3.0, 4.0]), 25.0);
    }
}
