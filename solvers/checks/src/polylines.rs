//! Random polylines, and measures of a fitted curve that are independent of the fit.

use super::random::Random;
use feedplan_geometry::spline::Piece;
use feedplan_path::smooth_fit::polyline::Polyline;
use feedplan_path::smooth_fit::Smooth;

/// C and its derivatives to the fourth by u at t in [0, 1].
pub fn derivatives<const D: usize>(piece: &Piece<D>, t: f64) -> [[f64; D]; 5] {
    let mut out = [[0.0; D]; 5];
    let mut points = piece.control.to_vec();
    let mut scale = 1.0;
    for row in &mut out {
        let mut c = points.clone();
        while c.len() > 1 {
            for i in 0..c.len() - 1 {
                c[i] = std::array::from_fn(|k| c[i][k] + t * (c[i + 1][k] - c[i][k]));
            }
            c.pop();
        }
        *row = c[0].map(|x| scale * x);
        scale *= (points.len() - 1) as f64 / piece.width;
        points = points.windows(2).map(|p| std::array::from_fn(|k| p[1][k] - p[0][k])).collect();
        if points.is_empty() {
            break;
        }
    }
    out
}

pub fn length<const D: usize>(a: &[f64; D]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    length(&std::array::from_fn::<f64, D, _>(|k| a[k] - b[k]))
}

pub fn to_segment<const D: usize>(a: &[f64; D], b: &[f64; D], p: &[f64; D]) -> f64 {
    let (mut way_sq, mut along) = (0.0, 0.0);
    for k in 0..D {
        way_sq += (b[k] - a[k]).powi(2);
        along += (p[k] - a[k]) * (b[k] - a[k]);
    }
    let t = if way_sq > 0.0 { (along / way_sq).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, &std::array::from_fn(|k| a[k] + t * (b[k] - a[k])))
}

/// The greatest distance of samples of the curve from the chords that they follow (or from three more chords on each side), and
/// of samples of the chords from the curve.
pub fn dense<const D: usize>(line: &Polyline<D>, smooth: &Smooth<D>) -> f64 {
    const NEAR: usize = 3;
    let (mut worst, mut samples) = (0.0f64, Vec::new());
    for (piece, covered) in smooth.curve.pieces().zip(&smooth.covered) {
        for i in 0..=24 {
            let point = derivatives(&piece, i as f64 / 24.0)[0];
            let chords = covered.first.saturating_sub(NEAR)..(covered.last + NEAR + 1).min(line.chords());
            let away = chords.map(|j| to_segment(&line.vertex[j], &line.vertex[j + 1], &point));
            worst = worst.max(away.fold(f64::INFINITY, f64::min));
            samples.push((point, covered.first, covered.last));
        }
    }
    let mut from = 0;
    for j in 0..line.chords() {
        while from + 1 < samples.len() && samples[from + 1].2 + NEAR < j {
            from += 1;
        }
        for t in [0.0, 0.5, 1.0] {
            let point =
                std::array::from_fn(|k| line.vertex[j][k] + t * (line.vertex[j + 1][k] - line.vertex[j][k]));
            let near = samples[from..].windows(2).take_while(|pair| pair[0].1 <= j + NEAR);
            let away = near.map(|pair| to_segment(&pair[0].0, &pair[1].0, &point));
            worst = worst.max(away.fold(f64::INFINITY, f64::min));
        }
    }
    worst
}

/// A walk of random steps and turns below 135°.
pub fn walk<const D: usize>(random: &mut Random, chords: usize, step: f64) -> Vec<[f64; D]> {
    let mut points = vec![[0.0; D]];
    let mut way = [0.0; D];
    while points.len() <= chords {
        let free: [f64; D] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let next = free.map(|x| x / length(&free));
        if (0..D).map(|k| way[k] * next[k]).sum::<f64>() > -0.7 {
            let (last, size) = (points[points.len() - 1], step * (0.05 + random.uniform()));
            points.push(std::array::from_fn(|k| last[k] + size * next[k]));
            way = next;
        }
    }
    points
}

/// A random polyline without reversals: a walk, a zigzag, noise on a curve, dense points, or all of them.
pub fn random_polyline<const D: usize>(random: &mut Random) -> Vec<[f64; D]> {
    let chords = 2 + (150.0 * random.uniform().powi(2)) as usize;
    let step = random.power(-2.5, 1.0);
    let kind = (5.0 * random.uniform()) as usize;
    let noise = [0.0, 0.003, 0.3][(3.0 * random.uniform()) as usize] * step;
    let phase: [f64; D] = std::array::from_fn(|_| random.uniform());
    let points: Vec<[f64; D]> = match kind {
        0 | 1 => walk(random, chords, step),
        2 => {
            let slope = 2.0 * random.uniform();
            let zig = |i: usize, k: usize| if k == 0 { i as f64 } else { slope * phase[k] * (i % 2) as f64 };
            (0..=chords).map(|i| std::array::from_fn(|k| step * zig(i, k))).collect()
        }
        _ => {
            let turn = 0.3 * random.uniform().powi(2);
            let at = |i: usize, k: usize| {
                (1.0 + phase[k]) * (turn * i as f64 + 6.0 * phase[k]).sin() / turn
                    + if k == 0 { i as f64 } else { 0.0 }
            };
            (0..=chords)
                .map(|i| std::array::from_fn(|k| step * at(i, k) + noise * random.between(-1.0, 1.0)))
                .collect()
        }
    };
    // Points at reversals are left out.
    let mut kept: Vec<[f64; D]> = Vec::with_capacity(points.len());
    for point in points {
        if kept.last().is_none_or(|last| distance(last, &point) > 1e-9) {
            let count = kept.len();
            if count < 2
                || Polyline::new(vec![kept[count - 2], kept[count - 1], point], vec![1.0; 2]).turn(1) < 2.356
            {
                kept.push(point);
            }
        }
    }
    kept
}
