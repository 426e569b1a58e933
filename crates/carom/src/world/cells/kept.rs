//! Rows gathered ahead of the events that need them, when whoever is in them is fetched into the cache.

use super::Cells;
use crate::predict::lanes::MOST;
use crate::world::World;
use crate::world::nearby::Gathered;

/// So many are kept, each in the place that the row of its ball tells: more than there are events soon.
const KEPT: usize = 64;
/// Longer ones are not.
const LONGEST: usize = 3 * MOST;

/// One row, filled up with the ball itself.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(128))]
struct KeptRow {
    ball: u32,
    len: u32,
    /// It holds while nobody has changed cells.
    moves: u64,
    rows: [u32; LONGEST],
}

/// All that are kept.
#[derive(Clone, Debug)]
pub struct KeptRows {
    rows: Vec<KeptRow>,
    /// How often somebody has changed cells.
    moves: u64,
}

impl Default for KeptRows {
    fn default() -> Self {
        let nothing = KeptRow { ball: 0, len: 0, moves: 0, rows: [0; LONGEST] };
        Self { rows: vec![nothing; KEPT], moves: 1 }
    }
}

impl KeptRows {
    /// None of them holds any longer.
    #[inline(always)]
    pub fn forget(&mut self) {
        self.moves += 1;
    }
}

impl Cells {
    /// Fetches the flights of whoever is in the cells at and beside the ball's, and keeps who they are.
    #[inline(always)]
    pub fn keep_near(&mut self, world: &World, ball: usize, room: &mut Gathered) {
        room.clear();
        self.near(ball, || world.radii[ball], room);
        self.prefetch_bodies(world, room.rows());
        let row = room.filled_up(ball);
        let kept = &mut self.kept.rows[ball % KEPT];
        // Bodies in prescribed motion are not near each other.
        if let Some(rows) = kept.rows.get_mut(..row.len())
            && !world.is_fixed(ball)
        {
            rows.copy_from_slice(row);
            (kept.ball, kept.len, kept.moves) = (ball as u32, row.len() as u32, self.kept.moves);
        }
    }

    /// The row of a ball, if it was kept and still holds.
    #[inline(always)]
    pub fn kept_row(&self, ball: usize) -> Option<&[u32]> {
        let kept = &self.kept.rows[ball % KEPT];
        let holds = kept.ball == ball as u32 && kept.moves == self.kept.moves;
        holds.then(|| &kept.rows[..kept.len as usize])
    }
}
