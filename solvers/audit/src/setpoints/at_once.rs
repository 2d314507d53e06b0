//! Finds, for 256 consecutive setpoints at once, those whose difference quotients cannot raise the greatest use of any limit
//! found so far; only the others need the full check (`setpoints`). Works through one axis after the other, on all setpoints in
//! SIMD vectors.
//!
//! Values and limits are those that `setpoints` offers to the tally for steps of one period.

use std::ops::Range;

use fearless_simd::{dispatch, Level};

use crate::differences::Differences;
use crate::rows::Row;
use crate::{Check, Sided, Tally, EPS, ROUNDINGS};

/// Number of setpoints examined at once, and of those before them that the differences of the first one need.
pub const COUNT: usize = 256;
pub const BEFORE: usize = 4;
pub const ALL: usize = BEFORE + COUNT;

/// One number for each of these setpoints.
pub type Column = [f64; ALL];

/// For each row the rounding error bound of its position in mm, if no check of its difference quotients can change the tally,
/// else NaN. At least `BEFORE` rows must precede `rows`.
pub fn settled<const M: usize>(of: &Differences<M>, rows: &Range<usize>, tally: &Tally<M>) -> [f64; COUNT] {
    let rows = &of.rows[rows.start - BEFORE..rows.end];
    dispatch!(Level::new(), _simd => settled_in_vectors(of, rows, tally))
}

#[inline(always)]
fn settled_in_vectors<const M: usize>(
    of: &Differences<M>,
    rows: &[Row<M>],
    tally: &Tally<M>,
) -> [f64; COUNT] {
    let (limits, period) = (of.limits, of.limits.period);
    let (mut t, mut magnitude, mut q, mut recorded) = ([0.0; ALL], [0.0; ALL], [0.0; ALL], [0.0; ALL]);
    let (mut rounding, mut acceleration) = ([0.0; ALL], [0.0; ALL]);
    fill(&mut t, rows, |row| row.t);
    fill(&mut magnitude, rows, |row| row.nearest.magnitude);
    let records_velocity = rows.iter().any(|row| row.velocity.is_some());
    let records_acceleration = rows.iter().any(|row| row.acceleration.is_some());
    let (mut nothing, mut unsure_sq, mut is_open) = ([0.0; ALL], [0.0; ALL], [0.0; ALL]);
    // Open: rows where one of the last four time steps is not one period long.
    let grid = tally.most(Check::Grid, 0, 0.0);
    let mut is_odd = [grid; ALL];
    for i in 1..ALL {
        let slack = of.uneven() + ROUNDINGS * EPS * t[i].abs();
        is_odd[i] = if ((t[i] - t[i - 1]) - period).abs() <= slack { grid } else { 1.0 };
        nothing[i] = 0.0 * t[i];
    }
    judge(&mut is_open, |i| is_odd[i] + is_odd[i - 1] + is_odd[i - 2] + is_odd[i - 3], |_| 0.0);
    let (per, per_third) = (1.0 / period, 3.0 / (period + period + period));
    let (per_mean, per_both) = (2.0 / (period + period), 4.0 * per * per);
    for k in 0..limits.axes {
        fill(&mut q, rows, |row| row.q[k]);
        for i in 1..ALL {
            let size = if q[i].abs() > magnitude[i] { q[i].abs() } else { magnitude[i] };
            let way = (q[i] - q[i - 1]).abs() * (t[i].abs() / period);
            rounding[i] = 0.5 * of.resolution + ROUNDINGS * EPS * (size + way);
            unsure_sq[i] += rounding[i] * rounding[i];
            nothing[i] += 0.0 * q[i];
        }
        for i in 1..ALL - 1 {
            acceleration[i] = ((q[i + 1] - q[i]) * per - (q[i] - q[i - 1]) * per) * per_mean;
        }
        let [least, greatest] = of.travel_of(k, tally.get(Check::Travel, k).ratio);
        judge(&mut is_open, |i| q[i], |_| greatest);
        judge(&mut is_open, |i| -q[i], |_| -least);
        let sides = |check: Check, limit: &Sided<M>| {
            [limit.positive[k], limit.negative[k]].map(|limit| tally.most(check, k, limit))
        };
        let side = |[positive, negative]: [f64; 2], value: f64| if value < 0.0 { negative } else { positive };
        let velocity = sides(Check::Velocity, &limits.velocity);
        judge(
            &mut is_open,
            |i| ((q[i] - q[i - 1]).abs() - 2.0 * rounding[i]) * per,
            |i| side(velocity, q[i] - q[i - 1]),
        );
        let mean = sides(Check::Acceleration, &limits.acceleration);
        judge(
            &mut is_open,
            |i| acceleration[i - 3].abs() - rounding[i - 2] * per_both,
            |i| side(mean, acceleration[i - 3]),
        );
        let jerk = tally.most(Check::Jerk, k, limits.jerk[k]);
        judge(
            &mut is_open,
            |i| {
                let change = (acceleration[i - 1] - acceleration[i - 2]).abs();
                (change - rounding[i] * per_both - rounding[i - 1] * per_both) * per_third
            },
            |_| jerk,
        );
        if records_velocity {
            fill(&mut recorded, rows, |row| row.velocity.map_or(f64::NAN, |velocity| velocity[k]));
            let off = tally.most(Check::RecordedVelocity, k, limits.mean_velocity_off(k, period));
            judge(
                &mut is_open,
                |i| {
                    let mean = (q[i] - q[i - 1]) * per;
                    (mean - 0.5 * (recorded[i] + recorded[i - 1])).abs() - 2.0 * rounding[i] * per
                },
                |_| off,
            );
        }
        if records_acceleration {
            fill(&mut recorded, rows, |row| row.acceleration.map_or(f64::NAN, |recorded| recorded[k]));
            let limit = sides(Check::RecordedAcceleration, &limits.acceleration);
            judge(&mut is_open, |i| recorded[i].abs(), |i| side(limit, recorded[i]));
        }
    }
    let numbers = tally.most(Check::Numbers, 0, 0.0);
    judge(&mut is_open, |i| nothing[i], |_| numbers);
    let mut unsure = [0.0; COUNT];
    for i in 0..COUNT {
        let size = unsure_sq[BEFORE + i].sqrt();
        unsure[i] = if is_open[BEFORE + i] == 0.0 { size } else { f64::NAN };
    }
    unsure
}

/// Fills a column with one number of each row.
#[inline(always)]
pub fn fill<const M: usize>(column: &mut Column, rows: &[Row<M>], number: impl Fn(&Row<M>) -> f64) {
    for (own, row) in column.iter_mut().zip(rows) {
        *own = number(row);
    }
}

/// Marks the rows whose value is not at most `most` as open (1); a NaN is open as well.
#[inline(always)]
pub fn judge(is_open: &mut Column, value: impl Fn(usize) -> f64, most: impl Fn(usize) -> f64) {
    for i in BEFORE..ALL {
        is_open[i] = if value(i) <= most(i) { is_open[i] } else { 1.0 };
    }
}
