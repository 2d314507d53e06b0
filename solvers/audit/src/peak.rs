//! Between three even places, where a share of a limit is greatest: at the vertex of a parabola.

/// A peak above the places by less than this part is left out.
const NEGLIGIBLE: f64 = 1e-6;

/// Of many shares with their signs at three places, each place as far from the next: where those have peaks, up or down, that
/// are beyond the `worst` of their shares so far, from −1 at the first place to 1 at the last.
pub fn peaks(uses: [impl Iterator<Item = f64>; 3], worst: impl Iterator<Item = f64>) -> Vec<f64> {
    let [first, middle, last] = uses;
    first
        .zip(middle)
        .zip(last)
        .zip(worst)
        .filter_map(|(((a, b), c), worst)| {
            let (bend, slope) = (2.0 * b - a - c, c - a);
            let top = b + slope * slope / (8.0 * bend);
            let most = a.abs().max(b.abs()).max(c.abs()).max(worst);
            let is_peak = slope.abs() < 2.0 * bend.abs() && top.abs() > (1.0 + NEGLIGIBLE) * most;
            is_peak.then_some(0.5 * slope / bend)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_of_a_parabola_is_its_vertex() {
        // 1 − (x − 0.3)² beside what is far from its limit, and what is flat.
        let of = |x: f64| [0.5 - x * x, 1.0 - (x - 0.3).powi(2), 1.0].into_iter();
        let none = || [0.0; 3].into_iter();
        assert!((peaks([of(-1.0), of(0.0), of(1.0)], none())[0] - 0.3).abs() < 1e-15);
        assert!(peaks([of(-1.0), of(0.0), of(1.0)], [0.6, 1.1, 1.0].into_iter()).is_empty());
        let flat = |_: f64| [1.0, 0.99].into_iter();
        assert!(peaks([flat(-1.0), flat(0.0), flat(1.0)], none()).is_empty());
        // The vertex is beyond the places.
        let rises = |x: f64| [1.0 - 0.01 * (x - 3.0).powi(2)].into_iter();
        assert!(peaks([rises(-1.0), rises(0.0), rises(1.0)], none()).is_empty());
    }
}
