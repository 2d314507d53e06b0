//! Loops over blocks on all cores, and what is told of their progress. The loop itself is compiled once, not for each kind of
//! work and each number of axes.

use std::ops::Range;
use std::sync::Mutex;

use rayon::prelude::*;

use super::Tally;

/// Told of how many more phases, pieces or moves have been looked at; it may end the audit by unwinding.
pub type Seen<'a> = &'a (dyn Fn(usize) + Sync);

/// It is told of so many at a time.
const TOLD: usize = 64;

/// Tells of number `i` of a loop.
pub fn tell(seen: Seen, i: usize) {
    if i.is_multiple_of(TOLD) {
        seen(TOLD);
    }
}

/// Threads that work on a loop.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

fn each_block(blocks: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..blocks).into_par_iter().for_each(work);
}

/// Calls `work` with the number of every part of so many items, and the part.
pub fn each_part<T: Send>(items: &mut [T], size: usize, work: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let parts: Vec<Mutex<&mut [T]>> = items.chunks_mut(size).map(Mutex::new).collect();
    each_block(parts.len(), &|number| {
        // Nobody else ever has it.
        if let Ok(mut part) = parts[number].lock() {
            work(number, &mut part);
        }
    });
}

/// What `work` finds in blocks of so many of `count` things, in their order, beside what is known.
pub fn tally<const M: usize>(
    known: &Tally<M>,
    count: usize,
    size: usize,
    work: &(dyn Fn(Range<usize>, &mut Tally<M>) + Sync),
) -> Tally<M> {
    let mut found = vec![Tally { samples: 0, ..known.clone() }; count.div_ceil(size)];
    each_part(&mut found, 1, &|number, part| {
        work(number * size..((number + 1) * size).min(count), &mut part[0]);
    });
    found.into_iter().fold(Tally::default(), Tally::merge)
}
