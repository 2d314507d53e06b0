//! Finds, for 256 consecutive setpoints at once, those that cannot raise the greatest use of any limit checked by `against_plan`;
//! only the others need the full check. Works on all setpoints in SIMD vectors.
//!
//! Computes the same values as `against_plan` for a setpoint one period after the one before and on the same piece, except the
//! distance from the program, which is left to `against_plan`.

use fearless_simd::{dispatch, Level};

use crate::curve::sagitta;
use crate::profile_reader::ACCELERATION_SHARE;
use crate::rows::Row;
use crate::setpoints::at_once::{fill, judge, ALL, BEFORE, COUNT};
use crate::tracking::Plan;
use crate::{Check, Limits, Tally, FEEDS, PLACE_TOLERANCE};

/// The tool at some rows, where the columns are joints: its position in the axes whose motion the feed limits there, and that
/// feed in mm/s, NaN where the feed limits a rotation.
#[derive(Default)]
pub struct Tool<const M: usize> {
    pub tip: Vec<[f64; M]>,
    pub feed: Vec<f64>,
}

/// Whether each row can be left unchecked, except for its distance from the program. `unsure` is the rounding error bound of the
/// position of each row in mm; where it is NaN the result is false. `rows` begins with `BEFORE` earlier rows, as in
/// `setpoints::at_once`.
pub fn settled<const M: usize>(
    (plan, tool): (&Plan, Option<&Tool<M>>),
    limits: &Limits<M>,
    rows: &[Row<M>],
    unsure: &[f64; COUNT],
    tally: &Tally<M>,
) -> [bool; COUNT] {
    dispatch!(Level::new(), _simd => settled_in_vectors((plan, tool), limits, rows, unsure, tally))
}

#[inline(always)]
fn settled_in_vectors<const M: usize>(
    (plan, tool): (&Plan, Option<&Tool<M>>),
    limits: &Limits<M>,
    rows: &[Row<M>],
    unsure: &[f64; COUNT],
    tally: &Tally<M>,
) -> [bool; COUNT] {
    let (path, period) = (&plan.path, limits.period);
    let (mut is_open, mut off, mut late, mut here) = ([0.0; ALL], [0.0; ALL], [0.0; ALL], [0.0; ALL]);
    let (mut there, mut way_sq, mut away) = ([0.0; ALL], [0.0; ALL], [0.0; ALL]);
    // Distance from the path, delay, and change of piece.
    fill(&mut off, rows, |row| row.nearest.off);
    fill(&mut late, rows, |row| row.nearest.late);
    let known = tally.most(Check::Place, 0, 1.0);
    let share = if known > 1.0 { 1.0 } else { known };
    judge(&mut is_open, |i| off[i], |_| share * PLACE_TOLERANCE);
    fill(&mut here, rows, |row| row.nearest.allowed);
    judge(&mut is_open, |i| late[i], |i| share * here[i]);
    fill(&mut here, rows, |row| row.nearest.place.piece as f64);
    judge(&mut is_open, |i| (here[i] - here[i - 1]).abs(), |_| 0.0);
    // Recorded velocity and acceleration.
    let records = |is_some: fn(&Row<M>) -> bool| plan.profile.is_some() && rows.iter().any(is_some);
    if records(|row| row.velocity.is_some()) {
        for i in BEFORE..ALL {
            away[i] = unsure[i - BEFORE] + if off[i] > 0.0 { off[i] } else { 0.0 } + late[i];
        }
        for k in 0..limits.axes {
            fill(&mut here, rows, |row| row.velocity.map_or(f64::NAN, |velocity| velocity[k]));
            fill(&mut there, rows, |row| row.nearest.velocity.value[k]);
            let unknown = 4.0 * limits.acceleration.greatest(k);
            let nothing = tally.most(Check::RecordedVelocity, k, 0.0);
            let off_sq = |i: usize| (here[i] - there[i]) * (here[i] - there[i]);
            judge(&mut is_open, off_sq, |i| unknown * away[i] + nothing);
        }
    }
    if records(|row| row.acceleration.is_some()) {
        for k in 0..limits.axes {
            fill(&mut here, rows, |row| row.nearest.acceleration_off[k]);
            let limit = ACCELERATION_SHARE * limits.acceleration.least(k);
            let most = tally.most(Check::RecordedAcceleration, k, limit);
            judge(&mut is_open, |i| here[i], |_| most);
        }
    }
    // Speed of the step.
    for feed in 0..FEEDS {
        match tool {
            None => fill(&mut here, rows, |row| path.feed[FEEDS * row.nearest.place.piece + feed]),
            Some(tool) if feed == 0 => here[..rows.len()].copy_from_slice(&tool.feed),
            Some(_) => here.fill(f64::INFINITY),
        }
        let is_limited = here[..rows.len()].iter().any(|limit| *limit != f64::INFINITY);
        let known = tally.most(Check::Feed, 0, 1.0);
        if !is_limited {
            judge(&mut is_open, |_| 0.0, |_| known);
            continue;
        }
        way_sq.fill(0.0);
        for k in 0..if tool.is_some() { path.axes } else { limits.axes } {
            let counted = if tool.is_some() { 1.0 } else { limits.feed_axes[feed][k] };
            match tool {
                None => fill(&mut there, rows, |row| row.q[k]),
                Some(tool) => {
                    for (own, tip) in there.iter_mut().zip(&tool.tip) {
                        *own = tip[k];
                    }
                }
            }
            for i in BEFORE..ALL {
                let way = counted * (there[i] - there[i - 1]);
                way_sq[i] += way * way;
            }
        }
        let most = |i: usize| known * here[i] * period + 2.0 * unsure[i - BEFORE];
        judge(&mut is_open, |i| way_sq[i], |i| most(i) * most(i));
    }
    if limits.chord_tolerance.is_finite() {
        fill(&mut here, rows, |row| row.nearest.bend);
        fill(&mut there, rows, |row| row.nearest.place.u);
        let most = tally.most(Check::Chord, 0, limits.chord_tolerance);
        judge(&mut is_open, |i| sagitta(here[i], there[i] - there[i - 1]), |_| most);
    }
    let mut settled = [false; COUNT];
    for i in 0..COUNT {
        settled[i] = is_open[BEFORE + i] == 0.0 && !unsure[i].is_nan();
    }
    settled
}
