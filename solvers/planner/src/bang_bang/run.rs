//! Both passes over one run: from piece to piece, each by its kernel.
//!
//! K depends on what comes next only as far as the next place where the backward passes from rest and from any speed
//! meet, a few pieces ahead. So a run is planned block by block, in memory that stays near the processor.

use super::curve::{self, Remedy};
use super::line::Line;
use super::quadratic::{self, Piece};
use super::Task;
use crate::bang_bang::tolerance::{MET, REACHED};
use crate::problem::Fault;
use crate::profile::Profile;
use feedplan_geometry::quadratic::{lerp, sub};

/// A run in which rounding leaves a pass without headway is planned anew so often, with more cuts every time.
const MOST_ATTEMPTS: usize = 40;
/// Pieces of a block, and how many of those after it decide K at its end almost always.
const BLOCK: usize = 2048;
const LOOK_AHEAD: usize = 32;

/// Space for the passes, kept from run to run.
#[derive(Default)]
pub struct Workspace {
    /// What the backward pass has left of each piece, the last piece first.
    ways: Vec<Way>,
    quadratic: quadratic::Space,
    curve: curve::Space,
}

impl Workspace {
    fn clear(&mut self) {
        self.ways.clear();
        self.quadratic.clear();
        self.curve.clear();
    }
}

/// What the backward pass leaves for the forward pass on one piece.
enum Way {
    /// v² allowed at the end.
    Line(f64),
    /// Number of parts; their phases of K are in the space of the kernel.
    Quadratic(usize),
    Curve(usize),
}

/// Where a pass stands between two pieces.
#[derive(Clone, Copy)]
pub struct Between {
    /// The sum of the axes' velocities squared; v² where the axes are those of the tool.
    pub speed_sq: f64,
    /// The tool's speed squared behind the pass; ahead of it, before a piece is entered, the limit of that.
    pub tip_sq: f64,
}

impl Between {
    fn at_end_of_run(tip_sq: f64) -> Self {
        Self { speed_sq: f64::INFINITY, tip_sq }
    }

    /// Leaves a piece whose axes are those of the tool.
    fn leave(&mut self, speed_sq: f64) {
        (self.speed_sq, self.tip_sq) = (speed_sq, speed_sq);
    }
}

/// The kernel of a piece.
enum Kernel<const M: usize> {
    Line(Line),
    Quadratic(Piece<M>),
    Curve,
}

/// Plans the pieces `first..last` of the task from one speed squared of the tool to another; appends the phases.
pub fn plan_run<const M: usize>(
    task: &Task<M>,
    run: (usize, usize),
    speeds_sq: (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    let mut remedies: Vec<Remedy> = vec![];
    let rows = out.len();
    for attempt in 0..MOST_ATTEMPTS {
        space.curve.set_remedies(&remedies);
        let reached = plan_blocks(task, run, speeds_sq, space, out)?;
        let asked = space.curve.asked();
        if asked.is_empty() {
            if reached < speeds_sq.1 * (1.0 - REACHED) {
                return Err(Fault::End { piece: run.1 - 1, reachable: reached.sqrt() });
            }
            out.end_run();
            let stops = remedies.iter().filter(|remedy| remedy.stops);
            out.slowed.extend(stops.map(|remedy| remedy.piece as u32));
            return Ok(());
        }
        out.truncate(rows);
        // Other numbers may do; a stop simplifies.
        remedies.extend(asked.iter().map(|remedy| Remedy { stops: attempt > 0, ..*remedy }));
    }
    let Remedy { piece, t, .. } = remedies[remedies.len() - 1];
    Err(Fault::Stuck { piece, u: t * task.problem.width[piece] })
}

/// Both passes, block by block; the tool's speed squared at the end. Ends early where a remedy is asked for.
fn plan_blocks<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    (start_sq, end_sq): (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<f64, Fault> {
    let mut at = Between::at_end_of_run(start_sq);
    let mut begin = first;
    while begin < last && space.curve.asked().is_empty() {
        let (end, at_end) = block(task, (begin, last), end_sq, space)?;
        let reachable = backward(task, (begin, end), last, at_end, space)?.tip_sq;
        if space.curve.asked().is_empty() {
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

/// The end of the block that begins a run, and the backward pass there.
fn block<const M: usize>(
    task: &Task<M>,
    (begin, last): (usize, usize),
    end_sq: f64,
    space: &mut Workspace,
) -> Result<(usize, Between), Fault> {
    let mut size = BLOCK;
    loop {
        let end = begin + size;
        if end + LOOK_AHEAD >= last {
            return Ok((last, Between::at_end_of_run(end_sq)));
        }
        for ahead in [LOOK_AHEAD, size / 4] {
            let pieces = (end, (end + ahead).min(last));
            let least = backward(task, pieces, last, Between::at_end_of_run(0.0), space)?;
            let most = backward(task, pieces, last, Between::at_end_of_run(f64::INFINITY), space)?;
            if most.speed_sq - least.speed_sq <= MET * least.speed_sq {
                return Ok((end, least));
            }
        }
        size *= 4;
    }
}

/// Backward over the pieces `begin..end` of a run up to `last`; leaves K in the workspace.
fn backward<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    last: usize,
    mut at: Between,
    space: &mut Workspace,
) -> Result<Between, Fault> {
    space.clear();
    for i in (begin..end).rev() {
        task.watch.check_at(i);
        if i + 1 < last {
            at.tip_sq = task.problem.junction_speed[i + 1].powi(2);
        }
        let speed_sq = at.speed_sq.min(at.tip_sq);
        let way = match task.kernel(i) {
            Kernel::Line(line) => {
                at.leave(line.backward(speed_sq));
                Way::Line(speed_sq)
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
                Way::Quadratic(parts)
            }
            Kernel::Curve => Way::Curve(curve::backward(task, i, &mut at, &mut space.curve)),
        };
        space.ways.push(way);
    }
    Ok(at)
}

/// Forward over the same pieces of a run from `first` on, under K; appends the phases.
fn forward<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    first: usize,
    at: &mut Between,
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    for i in begin..end {
        task.watch.check_at(i);
        if i > first {
            at.tip_sq = task.problem.junction_speed[i].powi(2);
        }
        let (speed_sq, place) = (at.speed_sq.min(at.tip_sq), (i as u32, task.problem.width[i]));
        match (task.kernel(i), space.ways.pop()) {
            (Kernel::Line(line), Some(Way::Line(end_sq))) => {
                at.leave(line.forward((speed_sq, end_sq), place, out));
            }
            (Kernel::Quadratic(piece), Some(Way::Quadratic(parts))) => {
                let axes = &task.plain_axes;
                let end_sq =
                    quadratic::forward(&piece, axes, speed_sq, parts, &mut space.quadratic, place, out)
                        .map_err(|stuck| task.fault(i, stuck))?;
                at.leave(end_sq);
            }
            (Kernel::Curve, Some(Way::Curve(parts))) => {
                curve::forward(task, i, parts, at, &mut space.curve, out);
            }
            _ => unreachable!("the backward pass leaves a way for the kernel of each piece"),
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
        let line = |way: [f64; M]| Kernel::Line(Line::new(&way, &self.plain_axes, problem.feed[i]));
        match problem.points(i) {
            [a, b] => line(sub(b, a)),
            // The middle of a short line far from the origin is rounded, and would bend it.
            [a, b, c] if *b == lerp(a, c, 0.5) => line(sub(c, a)),
            [a, b, c] => match Piece::new(&[*a, *b, *c]) {
                piece if piece.twist > 0.0 => Kernel::Quadratic(piece),
                // Straight for all that it is of degree 2: it may stand still inside.
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
