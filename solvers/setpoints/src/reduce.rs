//! Reduces millions of samples to the few points that a chart shows.

use feedplan_geometry::quadratic::Segment;

/// Numbers of each point of a line.
const D: usize = 4;
/// Thinning ends after two consecutive passes that each remove at most one point for every `FEW` that stay.
const FEW: usize = 50;

/// The extremes and the weighted sum of each bucket of `width` consecutive rows of `values`, column by column: the indices of the
/// rows with the least and the greatest value, in ascending order, and the sum of `weight` times value. NaN is never an extreme,
/// except in a bucket without other values.
pub fn buckets(values: &[f64], columns: usize, weight: &[f64], width: usize) -> (Vec<[i64; 2]>, Vec<f64>) {
    let (mut extremes, mut sums) = (Vec::new(), Vec::new());
    for column in 0..columns {
        for (bucket, (rows, weight)) in values.chunks(width * columns).zip(weight.chunks(width)).enumerate() {
            let (mut least, mut greatest, mut sum) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0), 0.0);
            for (i, (row, weight)) in rows.chunks(columns).zip(weight).enumerate() {
                let value = row[column];
                sum += weight * value;
                if value < least.0 {
                    least = (value, i);
                }
                if value > greatest.0 {
                    greatest = (value, i);
                }
            }
            let pair = [least.1.min(greatest.1), least.1.max(greatest.1)];
            extremes.push(pair.map(|i| (bucket * width + i) as i64));
            sums.push(sum);
        }
    }
    (extremes, sums)
}

/// Removes points of a line that are within `tolerance` of the segment between their neighbours. `cost` holds for each point the
/// part of the tolerance, in its unit, that is already used up between this point and the next. Returns the indices and costs of
/// the points that stay.
pub fn thin(points: &[[f64; D]], cost: &[f64], tolerance: f64) -> (Vec<i64>, Vec<f64>) {
    let mut left: Vec<(usize, f64)> = cost.iter().copied().enumerate().collect();
    let (mut idle, mut first) = (0, 1);
    while idle < 2 && left.len() > 2 {
        let (before, mut stay) = (left.len(), first);
        // Every second point is a candidate: its neighbours stay.
        for i in (first..before).step_by(2) {
            let (row, own) = left[i];
            let Some(&next) = left.get(i + 1) else {
                left[stay] = (row, own);
                stay += 1;
                break;
            };
            let last = &mut left[stay - 1];
            let segment = Segment::new(&points[last.0], &points[next.0]);
            let total = last.1.max(own) + segment.distance_sq(&points[row]).sqrt();
            if total <= tolerance {
                last.1 = total;
            } else {
                left[stay] = (row, own);
                stay += 1;
            }
            left[stay] = next;
            stay += 1;
        }
        left.truncate(stay);
        idle = if before - stay <= stay / FEW { idle + 1 } else { 0 };
        first = 3 - first;
    }
    left.into_iter().map(|(row, cost)| (row as i64, cost)).unzip()
}
