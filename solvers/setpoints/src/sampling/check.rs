//! Whether the arrays of a path and a profile fit together, before anything is computed from them.

use super::PathData;
use crate::motion::{flaw, ProfileArc, MAX_TIP};
use feedplan_geometry::watch::Watch;
use feedplan_planner::phase_law::PhaseLaw;

/// The error is a sentence for the user.
pub(super) fn check<const M: usize>(
    path: &PathData<M>,
    arcs: &[ProfileArc],
    arc_runs: &[usize],
    watch: Watch,
) -> Result<(), String> {
    let runs = path.dwell.len();
    let offsets = |offsets: &[usize], end: usize| {
        offsets.len() == runs + 1
            && offsets[0] == 0
            && offsets[runs] == end
            && offsets.windows(2).all(|pair| pair[0] <= pair[1])
    };
    let pieces = path.curve.len();
    if pieces == 0 || runs == 0 {
        return Err("the path is empty: nothing moves".into());
    }
    if path.lines.len() != pieces
        || !offsets(&path.runs, pieces)
        || path.runs.windows(2).any(|pair| pair[0] == pair[1])
    {
        return Err("the arrays of the path do not fit together".into());
    }
    for (name, speed) in [("tip", &path.tip_speed), ("way", &path.way_speed)] {
        if speed.as_ref().is_some_and(|(values, offsets)| !fits_pieces(values, offsets, pieces)) {
            return Err(format!(
                "the {name} speed does not fit the {pieces} pieces: give 1 to {MAX_TIP} finite coefficients for each"
            ));
        }
    }
    if path.dwell.iter().chain([&path.start_dwell]).any(|dwell| !(dwell.is_finite() && *dwell >= 0.0)) {
        return Err("the path has a pause that is negative or not finite".into());
    }
    if !offsets(arc_runs, arcs.len()) {
        return Err("the profile does not belong to this path: their runs differ".into());
    }
    for r in 0..runs {
        let of_run = path.curve.offsets[path.runs[r]]..path.curve.offsets[path.runs[r + 1]];
        let points = &path.curve.control[of_run];
        let still = || points.iter().all(|point| *point == points[0]);
        if arc_runs[r] == arc_runs[r + 1] && !still() {
            let line = path.lines[path.runs[r]];
            return Err(format!(
                "line {line}: the profile has no arcs in run {}: plan this path again",
                r + 1
            ));
        }
        for (i, arc) in arcs[arc_runs[r]..arc_runs[r + 1]].iter().enumerate() {
            watch.each(arcs.len()).count(i);
            check_arc(path, r, arc).map_err(|what| {
                format!("arc {} of the profile {what}: plan this path again", arc_runs[r] + i)
            })?;
        }
    }
    Ok(())
}

/// Whether coefficients and their offsets are those of so many pieces.
fn fits_pieces(values: &[f64], offsets: &[usize], pieces: usize) -> bool {
    offsets.len() == pieces + 1
        && offsets[0] == 0
        && offsets[pieces] == values.len()
        && offsets.windows(2).all(|pair| pair[0] < pair[1] && pair[1] <= pair[0] + MAX_TIP)
        && values.iter().all(|value| value.is_finite())
}

fn check_arc<const M: usize>(path: &PathData<M>, run: usize, arc: &ProfileArc) -> Result<(), &'static str> {
    if !(path.runs[run]..path.runs[run + 1]).contains(&(arc.piece as usize)) {
        return Err("is on no piece of its run");
    }
    let (piece, width) = (path.curve.piece(arc.piece as usize), path.curve.width[arc.piece as usize]);
    if !(0.0 <= arc.u0 && arc.u0 < arc.u1 && arc.u1 <= width) {
        return Err("leaves its piece");
    }
    if !(arc.duration >= 0.0 && arc.duration.is_finite()) {
        return Err("has a duration that is negative or not finite");
    }
    let of_axis = matches!(arc.kind, PhaseLaw::AxisAcceleration | PhaseLaw::AxisVelocity);
    if of_axis && arc.axis as usize >= M {
        return Err("is governed by an axis that the path lacks");
    }
    if arc.kind == PhaseLaw::Chord && (path.tip_speed.is_some() || piece.is_rational() || piece.degree() > 2)
    {
        return Err("keeps to the chord-error limit in a way that only quadratic pieces have");
    }
    let infinite = [arc.p0, arc.p1].iter().filter(|p| **p == f64::INFINITY).count();
    let most = match arc.kind {
        // Nothing else would tell the speed.
        PhaseLaw::SpeedLine => 1,
        PhaseLaw::ParameterAcceleration | PhaseLaw::Chord | PhaseLaw::SpeedCubic => 0,
        _ => 2,
    };
    let signed =
        matches!(arc.kind, PhaseLaw::AxisAcceleration | PhaseLaw::ParameterAcceleration | PhaseLaw::PathJerk);
    if !(arc.p0 >= 0.0 && arc.p1 >= 0.0 && arc.value.is_finite() && (signed || arc.value >= 0.0))
        || infinite > most
    {
        return Err("has a speed that is negative or not finite");
    }
    let right = |a: f64| if arc.kind.is_along() { a.is_finite() } else { a == 0.0 };
    if !(right(arc.a0) && right(arc.a1)) {
        return Err("has an acceleration along the path that is not finite, or not of its kind");
    }
    flaw(piece, path.speed_of(arc), arc).map_or(Ok(()), Err)
}
