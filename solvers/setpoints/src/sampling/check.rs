//! Checks, before anything is computed, that the arrays of a path and of a profile are valid and fit together.

use std::ops::Range;

use super::path_data::PathData;
use super::BLOCK;
use crate::phase_motion::{flaw, PiecePath, MAX_TIP};
use feedplan_geometry::parallel::find_first;
use feedplan_geometry::watch::Watch;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases};

/// Checks path and profile; the error is a sentence for the user.
pub(super) fn check<const M: usize>(
    path: &PathData<M>,
    phases: &Phases,
    phase_runs: &[usize],
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
    if !offsets(phase_runs, phases.len()) {
        return Err("the profile does not belong to this path: their runs differ".into());
    }
    // Every run has at least one part, so that a run without phases is checked as well.
    let parts: Vec<(usize, Range<usize>)> = (0..runs)
        .flat_map(|r| {
            let (from, to) = (phase_runs[r], phase_runs[r + 1]);
            (from..to.max(from + 1)).step_by(BLOCK).map(move |start| (r, start..to.min(start + BLOCK)))
        })
        .collect();
    let first = find_first(parts.len(), 1, |n| {
        let (r, part) = parts[n].clone();
        if part.is_empty() {
            return flaw_of_nothing(path, r);
        }
        let mut piece = None;
        part.into_iter().find_map(|i| {
            watch.each(phases.len()).count(i);
            let known = phases.get(i).ok_or_else(|| format!("has the unknown kind {}", phases.kind[i]));
            let flaw = known.and_then(|phase| check_phase(path, r, &phase, &mut piece)).err();
            flaw.map(|what| format!("phase {i} of the profile {what}: plan this path again"))
        })
    });
    first.map_or(Ok(()), Err)
}

/// The error if the path moves in a run without phases.
fn flaw_of_nothing<const M: usize>(path: &PathData<M>, run: usize) -> Option<String> {
    let of_run = path.curve.offsets[path.runs[run]]..path.curve.offsets[path.runs[run + 1]];
    let points = &path.curve.control[of_run];
    let moves = points.iter().any(|point| *point != points[0]);
    moves.then(|| {
        let line = path.lines[path.runs[run]];
        format!("line {line}: the profile has no phases in run {}: plan this path again", run + 1)
    })
}

/// Whether the arrays are coefficients and offsets for this number of pieces.
fn fits_pieces(values: &[f64], offsets: &[usize], pieces: usize) -> bool {
    offsets.len() == pieces + 1
        && offsets[0] == 0
        && offsets[pieces] == values.len()
        && offsets.windows(2).all(|pair| pair[0] < pair[1] && pair[1] <= pair[0] + MAX_TIP)
        && values.iter().all(|value| value.is_finite())
}

/// Checks one phase; `piece` caches the piece of the phase before.
fn check_phase<'a, const M: usize>(
    path: &'a PathData<M>,
    run: usize,
    phase: &Phase,
    piece: &mut Option<(u32, PiecePath<'a, M>)>,
) -> Result<(), String> {
    if !(path.runs[run]..path.runs[run + 1]).contains(&(phase.piece as usize)) {
        return Err("is on no piece of its run".into());
    }
    let width = path.curve.width[phase.piece as usize];
    if !(0.0 <= phase.u0 && phase.u0 < phase.u1 && phase.u1 <= width) {
        return Err("leaves its piece".into());
    }
    if !(phase.duration >= 0.0 && phase.duration.is_finite()) {
        return Err("has a duration that is negative or not finite".into());
    }
    let of_axis = matches!(phase.law, PhaseLaw::AxisAcceleration | PhaseLaw::AxisVelocity);
    if of_axis && phase.axis as usize >= path.axes {
        return Err(format!("is governed by axis {}, but the path has {}", phase.axis, path.axes));
    }
    let signed = matches!(
        phase.law,
        PhaseLaw::AxisAcceleration | PhaseLaw::ParameterAcceleration | PhaseLaw::PathJerk
    );
    let speeds = [phase.p0, phase.p1].iter().all(|p| *p >= 0.0 && p.is_finite());
    if !(speeds && phase.value.is_finite() && (signed || phase.value >= 0.0)) {
        return Err("has a speed that is negative or not finite".into());
    }
    let right = |a: f64| if phase.law.is_along() { a.is_finite() } else { a == 0.0 };
    if !(right(phase.a0) && right(phase.a1)) {
        return Err("has an acceleration along the path that is not finite, or not of its kind".into());
    }
    if !phase.law.is_along() {
        return Ok(());
    }
    if piece.as_ref().is_none_or(|(number, _)| *number != phase.piece) {
        *piece = Some((phase.piece, path.piece(phase.piece as usize)));
    }
    let flaw = piece.as_ref().and_then(|(_, piece)| flaw(piece, phase));
    flaw.map_or(Ok(()), |flaw| Err(flaw.into()))
}
