//! Whether the arrays of a path and a profile fit together, before anything is computed from them.

use super::PathData;
use crate::motion::{ArcKind, ProfileArc};

/// The error is a sentence for the user.
pub(super) fn check<const M: usize>(
    path: &PathData<M>,
    arcs: &[ProfileArc],
    arc_runs: &[usize],
) -> Result<(), String> {
    let runs = path.dwell.len();
    let offsets = |offsets: &[usize], end: usize| {
        offsets.len() == runs + 1
            && offsets[0] == 0
            && offsets[runs] == end
            && offsets.windows(2).all(|pair| pair[0] <= pair[1])
    };
    if path.pieces.is_empty() || runs == 0 {
        return Err("the path is empty: nothing moves".into());
    }
    if path.lines.len() != path.pieces.len()
        || !offsets(&path.runs, path.pieces.len())
        || path.runs.windows(2).any(|pair| pair[0] == pair[1])
    {
        return Err("the arrays of the path do not fit together".into());
    }
    if path.dwell.iter().chain([&path.start_dwell]).any(|dwell| !(dwell.is_finite() && *dwell >= 0.0)) {
        return Err("the path has a pause that is negative or not finite".into());
    }
    if !offsets(arc_runs, arcs.len()) {
        return Err("the profile does not belong to this path: their runs differ".into());
    }
    for r in 0..runs {
        let pieces = &path.pieces[path.runs[r]..path.runs[r + 1]];
        let still =
            || pieces.iter().all(|piece| piece.control.iter().all(|point| *point == pieces[0].control[0]));
        if arc_runs[r] == arc_runs[r + 1] && !still() {
            let line = path.lines[path.runs[r]];
            return Err(format!(
                "line {line}: the profile has no arcs in run {}: plan this path again",
                r + 1
            ));
        }
        for (i, arc) in arcs[arc_runs[r]..arc_runs[r + 1]].iter().enumerate() {
            check_arc(path, r, arc).map_err(|what| {
                format!("arc {} of the profile {what}: plan this path again", arc_runs[r] + i)
            })?;
        }
    }
    Ok(())
}

fn check_arc<const M: usize>(path: &PathData<M>, run: usize, arc: &ProfileArc) -> Result<(), &'static str> {
    if !(path.runs[run]..path.runs[run + 1]).contains(&(arc.piece as usize)) {
        return Err("is on no piece of its run");
    }
    let width = path.pieces[arc.piece as usize].width;
    if !(0.0 <= arc.u0 && arc.u0 < arc.u1 && arc.u1 <= width) {
        return Err("leaves its piece");
    }
    if !(arc.duration >= 0.0 && arc.duration.is_finite()) {
        return Err("has a duration that is negative or not finite");
    }
    let of_axis = matches!(arc.kind, ArcKind::AxisAcceleration | ArcKind::AxisVelocity);
    if of_axis && arc.axis as usize >= M {
        return Err("is governed by an axis that the path lacks");
    }
    let infinite = (arc.p0 == f64::INFINITY, arc.p1 == f64::INFINITY);
    let through_cusp = of_axis || arc.kind == ArcKind::Feed;
    let signed = arc.kind == ArcKind::AxisAcceleration;
    if !(arc.p0 >= 0.0 && arc.p1 >= 0.0 && arc.value.is_finite() && (signed || arc.value >= 0.0))
        || infinite == (true, true)
        || (infinite != (false, false) && !through_cusp)
    {
        return Err("has a speed that is negative or not finite");
    }
    Ok(())
}
