//! Runs both passes over one run, piece by piece, each piece with its kernel.
//!
//! K depends on the pieces ahead only up to the point where the backward pass from rest and the one from unlimited speed meet,
//! usually a few pieces ahead. So a run is planned in blocks, whose memory stays in the processor's caches.

use super::curve::{self, Remedy};
use super::line::Line;
use super::quadratic::{self, Piece};
use super::{Junction, Task};
use crate::bang_bang::tolerance::{MET, REACHED};
use crate::problem::Fault;
use crate::profile::Profile;
use feedplan_geometry::quadratic::{lerp, sub};

/// Greatest number of attempts for a run in which rounding stops a pass; each attempt makes more cuts.
const MOST_ATTEMPTS: usize = 40;
/// Pieces of a block, and the number of pieces after it that almost always determine K at its end.
const BLOCK: usize = 2048;
const LOOK_AHEAD: usize = 32;

/// Memory for the passes, kept from run to run.
#[derive(Default)]
pub struct Workspace {
    /// One result for each piece, the last piece first.
    results: Vec<BackwardResult>,
    quadratic: quadratic::Space,
    curve: curve::Space,
}

impl Workspace {
    fn clear(&mut self) {
        self.results.clear();
        self.quadratic.clear();
        self.curve.clear();
    }
}

/// The result of the backward pass over one piece, for the forward pass.
enum BackwardResult {
    /// The greatest v² at the end [mm²/s²].
    Line(f64),
    /// Number of parts; the kernel's space holds their phases of K.
    Quadratic(usize),
    Curve(usize),
}

enum Kernel<const M: usize> {
    Line(Line),
    Quadratic(Piece<M>),
    Curve,
}

/// Plans the pieces `run.0..run.1` and appends the phases. `speeds_sq` are the squares of the tool's speed at both ends
/// [mm²/s²]. Fails if they cannot be reached, or if rounding stops the passes in all attempts.
pub fn plan_run<const M: usize>(
    task: &Task<M>,
    run: (usize, usize),
    speeds_sq: (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    let mut remedies: Vec<Remedy> = vec![];
    let rows = out.phases.len();
    for attempt in 0..MOST_ATTEMPTS {
        space.curve.set_remedies(&remedies);
        let reached = plan_blocks(task, run, speeds_sq, space, out)?;
        let requested = space.curve.requested();
        if requested.is_empty() {
            if reached < speeds_sq.1 * (1.0 - REACHED) {
                return Err(Fault::End { piece: run.1 - 1, reachable: reached.sqrt() });
            }
            out.end_run();
            let stops = remedies.iter().filter(|remedy| remedy.stops);
            out.slowed.extend(stops.map(|remedy| remedy.piece as u32));
            return Ok(());
        }
        out.truncate(rows);
        // The remedies of the first attempt are only cuts, since a pass may succeed with other numbers. Later ones are stops,
        // which make the plan simpler.
        remedies.extend(requested.iter().map(|remedy| Remedy { stops: attempt > 0, ..*remedy }));
    }
    let Remedy { piece, t, .. } = remedies[remedies.len() - 1];
    Err(Fault::Stuck { piece, u: t * task.problem.width[piece] })
}

/// Runs both passes, block by block; returns v² of the tip at the end. Returns early if a remedy is requested.
fn plan_blocks<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    (start_sq, end_sq): (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<f64, Fault> {
    let mut at = Junction::at_end_of_run(start_sq);
    let mut begin = first;
    while begin < last && space.curve.requested().is_empty() {
        let (end, at_end) = block(task, (begin, last), end_sq, space)?;
        let reachable = backward(task, (begin, end), last, at_end, space)?.tip_sq;
        if space.curve.requested().is_empty() {
            if begin == first {
                if start_sq > reachable * (1.0 + REACHED) {
                    return Err(Fault::Start { piece: first, reachable: reachable.sqrt() });
                }
                at.tip_sq = start_sq.min(reachable);
            }
            forward(task, (begin, end), first, &mut at, space, out)?;
            task.watch.advance(end - begin);
        }
        begin = end;
    }
    Ok(at.tip_sq)
}

/// The end of the block that starts at `begin`, and the state of the backward pass there.
fn block<const M: usize>(
    task: &Task<M>,
    (begin, last): (usize, usize),
    end_sq: f64,
    space: &mut Workspace,
) -> Result<(usize, Junction), Fault> {
    let mut size = BLOCK;
    loop {
        let end = begin + size;
        if end + LOOK_AHEAD >= last {
            return Ok((last, Junction::at_end_of_run(end_sq)));
        }
        for ahead in [LOOK_AHEAD, size / 4] {
            let pieces = (end, (end + ahead).min(last));
            let least = backward(task, pieces, last, Junction::at_end_of_run(0.0), space)?;
            let most = backward(task, pieces, last, Junction::at_end_of_run(f64::INFINITY), space)?;
            if most.speed_sq - least.speed_sq <= MET * least.speed_sq {
                return Ok((end, least));
            }
        }
        size *= 4;
    }
}

/// Backward pass over the pieces `begin..end` of a run that ends at `last`, from the state `at`: stores K in the workspace and
/// returns the state at the start.
fn backward<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    last: usize,
    mut at: Junction,
    space: &mut Workspace,
) -> Result<Junction, Fault> {
    space.clear();
    for i in (begin..end).rev() {
        task.watch.check_at(i);
        if i + 1 < last {
            at.tip_sq = task.problem.junction_speed[i + 1].powi(2);
        }
        let speed_sq = at.speed_sq.min(at.tip_sq);
        let result = match task.kernel(i) {
            Kernel::Line(line) => {
                at.leave(line.backward(speed_sq));
                BackwardResult::Line(speed_sq)
            }
            Kernel::Quadratic(piece) => {
                let (feed, chord) = (task.problem.feed[i], task.chord.as_ref());
                let (start_sq, parts) = quadratic::backward(
                    &piece,
                    &task.plain_axes,
                    (feed, chord),
                    speed_sq,
                    &mut space.quadratic,
                )
                .map_err(|stuck| task.fault(i, stuck))?;
                at.leave(start_sq);
                BackwardResult::Quadratic(parts)
            }
            Kernel::Curve => BackwardResult::Curve(curve::backward(task, i, &mut at, &mut space.curve)),
        };
        space.results.push(result);
    }
    Ok(at)
}

/// Forward pass under K over the pieces `begin..end` of a run that starts at `first`; updates `at` and appends the phases.
fn forward<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    first: usize,
    at: &mut Junction,
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    for i in begin..end {
        task.watch.check_at(i);
        if i > first {
            at.tip_sq = task.problem.junction_speed[i].powi(2);
        }
        let (speed_sq, number_and_width) = (at.speed_sq.min(at.tip_sq), (i as u32, task.problem.width[i]));
        match (task.kernel(i), space.results.pop()) {
            (Kernel::Line(line), Some(BackwardResult::Line(end_sq))) => {
                at.leave(line.forward((speed_sq, end_sq), number_and_width, out));
            }
            (Kernel::Quadratic(piece), Some(BackwardResult::Quadratic(parts))) => {
                let axes = &task.plain_axes;
                let end_sq = quadratic::forward(
                    &piece,
                    axes,
                    speed_sq,
                    parts,
                    &mut space.quadratic,
                    number_and_width,
                    out,
                )
                .map_err(|stuck| task.fault(i, stuck))?;
                at.leave(end_sq);
            }
            (Kernel::Curve, Some(BackwardResult::Curve(parts))) => {
                curve::forward(task, i, parts, at, &mut space.curve, out);
            }
            _ => unreachable!("the backward pass leaves a result for the kernel of each piece"),
        }
    }
    Ok(())
}

impl<const M: usize> Task<'_, M> {
    /// The kernel of piece `i`.
    #[inline(always)]
    fn kernel(&self, i: usize) -> Kernel<M> {
        let problem = self.problem;
        let weights = problem.weights(i);
        if !self.plain || problem.share(i).is_some() || weights.windows(2).any(|pair| pair[0] != pair[1]) {
            return Kernel::Curve;
        }
        let line = |chord: [f64; M]| Kernel::Line(Line::new(&chord, &self.plain_axes, problem.feed[i]));
        match problem.points(i) {
            [a, b] => line(sub(b, a)),
            // A line given with degree 2: far from the origin, the rounding of the middle control point would bend a short line.
            [a, b, c] if *b == lerp(a, c, 0.5) => line(sub(c, a)),
            [a, b, c] => match Piece::new(&[*a, *b, *c]) {
                piece if piece.cross > 0.0 => Kernel::Quadratic(piece),
                // Straight although of degree 2: its tangent may be 0 inside.
                _ => Kernel::Curve,
            },
            _ => Kernel::Curve,
        }
    }

    #[cold]
    fn fault(&self, piece: usize, quadratic::Stuck(t): quadratic::Stuck) -> Fault {
        Fault::Stuck { piece, u: t * self.problem.width[piece] }
    }
}
