//! Both passes over one run: pieces joined end to end, from a start speed to an end speed.

use super::arc::Arc;
use super::pass::{self, Stuck};
use super::piece::{Piece, Straight};
use super::profile::Profile;
use super::split::{Part, Splitter};
use super::{Fault, Task};
use feedplan_geometry::quadratic::{norm, sub};

/// Two directions that differ by more than this at a cusp form a corner.
const SMOOTH_TURN: f64 = 1e-9;
/// A speed asked for at an end of the path may exceed what can be had by this part, which is rounding.
const REACHED: f64 = 1e-12;

/// Pieces of a block, and how many of those after it decide K at its end almost always.
const BLOCK: usize = 2048;
const LOOK_AHEAD: usize = 32;
/// Backward passes that agree to this part have met.
const MET: f64 = 1e-15;

/// What the backward pass leaves for the forward pass on one piece.
enum Way {
    /// v² allowed at the right end.
    Straight(f64),
    /// Number of parts, their arcs following one another.
    Curved(u32),
}

/// Space for the passes, kept from run to run.
#[derive(Default)]
pub struct Workspace {
    splitter: Splitter,
    ways: Vec<Way>,
    /// Parts of curved pieces and where the arcs of K on them begin, in the order of the backward pass.
    parts: Vec<(Part, u32)>,
    bounds: Vec<Arc>,
    arcs: Vec<Arc>,
}

impl Workspace {
    pub fn clear(&mut self) {
        self.ways.clear();
        self.parts.clear();
        self.bounds.clear();
    }
}

/// Plans the pieces `first..last` of the task from one speed squared to another; appends the arcs.
///
/// K depends on what comes next only as far as the next place where the backward passes from rest and from any speed
/// meet, a few pieces ahead. So a run is planned block by block, in memory that stays near the processor.
pub fn plan_run<const M: usize>(
    task: &Task<M>,
    (first, last): (usize, usize),
    (start_sq, end_sq): (f64, f64),
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<(), Fault> {
    let mut speed_sq = start_sq;
    let mut begin = first;
    while begin < last {
        let (end, reachable_end) = block(task, (begin, last), end_sq, space)?;
        let reachable = backward_over(task, (begin, end), last, reachable_end, space)?;
        if begin == first {
            if start_sq > reachable * (1.0 + REACHED) {
                return Err(Fault::Start { piece: first, reachable: reachable.sqrt() });
            }
            speed_sq = start_sq.min(reachable);
        }
        speed_sq = forward_over(task, (begin, end), first, speed_sq, space, out)?;
        task.watch.advance(end - begin);
        begin = end;
    }
    out.end_run();
    if speed_sq < end_sq * (1.0 - REACHED) {
        return Err(Fault::End { piece: last - 1, reachable: speed_sq.sqrt() });
    }
    Ok(())
}

/// The end of the block that begins a run, and v² = D K there.
fn block<const M: usize>(
    task: &Task<M>,
    (begin, last): (usize, usize),
    end_sq: f64,
    space: &mut Workspace,
) -> Result<(usize, f64), Fault> {
    let mut size = BLOCK;
    loop {
        let end = begin + size;
        if end + LOOK_AHEAD >= last {
            return Ok((last, end_sq));
        }
        for ahead in [LOOK_AHEAD, size / 4] {
            let pieces = (end, (end + ahead).min(last));
            let least = backward_over(task, pieces, last, 0.0, space)?;
            let most = backward_over(task, pieces, last, f64::INFINITY, space)?;
            if most - least <= MET * least {
                return Ok((end, least));
            }
        }
        size *= 4;
    }
}

/// Backward over the pieces `begin..end` of a run up to `last`: v² at the start from v² at the end. Leaves the arcs of K
/// in the workspace.
fn backward_over<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    last: usize,
    end_sq: f64,
    space: &mut Workspace,
) -> Result<f64, Fault> {
    space.clear();
    let mut speed_sq = end_sq;
    let mut next = (end < last).then(|| Piece::new(&task.pieces[end]));
    for i in (begin..end).rev() {
        task.watch.check_at(i);
        let piece = Piece::new(&task.pieces[i]);
        if let Some(next) = &next {
            speed_sq = speed_sq.min(junction(&piece, next, task.junction_speed[i + 1]));
        }
        speed_sq = backward(task, i, &piece, speed_sq, space)?;
        next = Some(piece);
    }
    Ok(speed_sq)
}

/// Forward over the same pieces of a run from `first` on, their arcs taken from the end of the stack; v² at the end.
fn forward_over<const M: usize>(
    task: &Task<M>,
    (begin, end): (usize, usize),
    first: usize,
    start_sq: f64,
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<f64, Fault> {
    let mut speed_sq = start_sq;
    let mut previous = (begin > first).then(|| Piece::new(&task.pieces[begin - 1]));
    for i in begin..end {
        task.watch.check_at(i);
        let piece = Piece::new(&task.pieces[i]);
        if let Some(previous) = &previous {
            speed_sq = speed_sq.min(junction(previous, &piece, task.junction_speed[i]));
        }
        speed_sq = forward(task, i, &piece, speed_sq, space, out)?;
        previous = Some(piece);
    }
    Ok(speed_sq)
}

#[inline(always)]
pub fn backward<const M: usize>(
    task: &Task<M>,
    i: usize,
    piece: &Piece<M>,
    speed_sq: f64,
    space: &mut Workspace,
) -> Result<f64, Fault> {
    let feed = task.feed[i];
    if piece.is_straight(feed, task.axes.least) {
        space.ways.push(Way::Straight(speed_sq));
        return Ok(pass_straight(task, i, piece, speed_sq));
    }
    let axes = &task.axes;
    space.splitter.split(piece, axes, feed * feed, task.chord);
    space.ways.push(Way::Curved(space.splitter.parts.len() as u32));
    let mut p = speed_sq / piece.speed[2];
    for part in space.splitter.parts.iter().rev() {
        space.parts.push((*part, space.bounds.len() as u32));
        let placed = part.place(piece, axes, true);
        p = pass::backward(&placed.sub, axes, p, &mut space.bounds)
            .map_err(|Stuck(x)| Fault::Stuck { piece: i, u: (placed.to - x) * task.pieces[i].width })?;
    }
    Ok(p * piece.speed[0])
}

#[inline(always)]
fn pass_straight<const M: usize>(task: &Task<M>, i: usize, piece: &Piece<M>, speed_sq: f64) -> f64 {
    let line = Straight::new(piece, &task.axes, task.feed[i] * task.feed[i]);
    super::straight::backward(&line, speed_sq)
}

#[inline(always)]
pub fn forward<const M: usize>(
    task: &Task<M>,
    i: usize,
    piece: &Piece<M>,
    speed_sq: f64,
    space: &mut Workspace,
    out: &mut Profile,
) -> Result<f64, Fault> {
    let axes = &task.axes;
    let (number, width) = (i as u32, task.pieces[i].width);
    let parts = match space.ways.pop() {
        Some(Way::Straight(end_sq)) => {
            let line = Straight::new(piece, axes, task.feed[i] * task.feed[i]);
            return Ok(super::straight::forward(&line, axes, (speed_sq, end_sq), (number, width), out));
        }
        Some(Way::Curved(parts)) => parts,
        None => 0,
    };
    let mut p = speed_sq / piece.speed[0];
    for _ in 0..parts {
        let Some((part, bounds)) = space.parts.pop() else { break };
        let placed = part.place(piece, axes, false);
        space.arcs.clear();
        p = pass::forward(&placed.sub, axes, p, &space.bounds[bounds as usize..], &mut space.arcs)
            .map_err(|Stuck(x)| Fault::Stuck { piece: i, u: (placed.from + x) * width })?;
        space.bounds.truncate(bounds as usize);
        out.push_arcs(number, width, &part, &placed, axes, &space.arcs);
    }
    Ok(p * piece.speed[2])
}

/// The greatest v² where two pieces meet: the square of `limit`, and a stop in the corner of a cusp.
#[inline(always)]
fn junction<const M: usize>(before: &Piece<M>, after: &Piece<M>, limit: f64) -> f64 {
    if before.speed[2] == 0.0 || after.speed[0] == 0.0 {
        let turn = norm(&sub(&before.direction(true), &after.direction(false)));
        if turn > SMOOTH_TURN {
            return 0.0;
        }
    }
    limit * limit
}
