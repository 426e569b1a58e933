//! Who can meet whom before somebody leaves the place for which that was found out: his cell, or the sphere around the centre
//! of his list. Neither ever writes a state, and no impact depends on which of the two is used.

use glam::DVec3;

use super::World;
use super::cells::{Cells, Face};
use super::lists::Lists;
use crate::event::Upcoming;
use crate::predict::lanes::{MOST, Width};
use crate::time::Time;
use crate::tolerance::CELL_MARGIN;

/// The two ways to know who is near.
#[derive(Clone, Debug)]
pub enum Nearby {
    /// Whoever is in the cells beside: where balls are few or of very different sizes, and in narrow boxes.
    Cells(Cells),
    /// Whoever is on the ball's list: where balls are many.
    Lists(Lists),
}

impl Nearby {
    /// For the balls of `world` where they are at `now`.
    pub fn lay_out(world: &World, now: Time, width: Width) -> Self {
        match Lists::new(world, now, width) {
            Some(lists) => Self::Lists(lists),
            None => Self::Cells(Cells::lay_out(world, now)),
        }
    }

    /// The rows of whoever `ball` can meet before either leaves its place, filled up with `ball` itself to a multiple of
    /// [`MOST`]. `room` is room to work in.
    #[inline(always)]
    pub fn row<'a>(&'a self, world: &World, ball: usize, room: &'a mut Gathered) -> &'a [u32] {
        match self {
            Self::Lists(lists) => lists.row(ball),
            Self::Cells(cells) => {
                if let Some(row) = cells.kept_row(ball) {
                    return row;
                }
                room.clear();
                cells.near(ball, || world.radii[ball], room);
                room.retain_partners(world, ball);
                room.filled_up(ball)
            }
        }
    }

    /// Fetches into the cache where the ball's place is noted.
    #[inline(always)]
    pub fn prefetch(&self, ball: usize) {
        match self {
            Self::Cells(cells) => cells.prefetch(ball),
            Self::Lists(lists) => lists.prefetch(ball),
        }
    }

    /// Fetches where it stands who is near, or will be when the ball `leaves` its place.
    #[inline(always)]
    pub fn prefetch_row(&self, ball: usize, leaves: Option<Face>) {
        match self {
            Self::Cells(cells) => cells.prefetch_cells(ball, leaves),
            Self::Lists(lists) => lists.prefetch_row(ball),
        }
    }

    /// Fetches those who are near, or will be when the ball leaves its place; and what making its list anew looks through.
    #[inline(always)]
    pub fn prefetch_near(&mut self, world: &World, ball: usize, next: &Upcoming, room: &mut Gathered) {
        match self {
            Self::Cells(cells) if next.is_impact() && cells.has_one_level() => cells.keep_near(world, ball, room),
            Self::Cells(cells) => cells.prefetch_near(ball, next.leaves, world, room),
            Self::Lists(lists) => {
                if !next.is_impact() {
                    lists.prefetch_renewal(world, ball, next.time);
                }
                lists.prefetch_near(world, ball);
            }
        }
    }

    /// Fetches what is known only now to be needed: for a new list, the lists of those on the old one; for an impact, those near the
    /// partner. (Its own event is mostly another one: a pair is looked after by whoever searched last.)
    #[inline(always)]
    pub fn prefetch_last(&mut self, world: &World, ball: usize, next: &Upcoming, room: &mut Gathered) {
        let partner = next.partner.as_ball().filter(|_| next.is_impact());
        match (self, partner) {
            (Self::Cells(cells), Some(other)) if cells.has_one_level() => cells.keep_near(world, other, room),
            (Self::Cells(_), _) => {}
            (Self::Lists(lists), Some(other)) => lists.prefetch_near(world, other),
            (Self::Lists(lists), None) if next.is_impact() => {}
            (Self::Lists(lists), None) => lists.row(ball).iter().for_each(|&near| lists.prefetch_row(near as usize)),
        }
    }

    /// The rows of whoever `ball` can meet before either leaves its place, if one of the two turns.
    pub fn beside(&self, ball: usize) -> &[u32] {
        match self {
            Self::Lists(lists) => lists.beside(ball),
            Self::Cells(_) => &[],
        }
    }

    /// The planes that `ball` can meet before it leaves its place.
    #[inline(always)]
    pub fn planes(&self, ball: usize) -> PlaneSet {
        match self {
            Self::Cells(cells) => cells.planes(ball),
            Self::Lists(lists) => lists.planes(ball),
        }
    }

    /// When `ball` leaves its place, and through which face if that is a cell; `None` if that is after `impact`.
    #[inline(always)]
    pub fn leaves_before(&self, world: &World, ball: usize, now: Time, impact: Time) -> Option<(Time, Face)> {
        let (time, face) = match self {
            Self::Lists(lists) if lists.stays_until(world, ball, impact) => return None,
            Self::Lists(lists) => (lists.leaves(world, ball, now), Face::NONE),
            Self::Cells(cells) => {
                let until = if impact.before(cells.horizon()) { impact } else { cells.horizon() };
                if cells.stays_until(world, ball, now, until) {
                    return None;
                }
                cells.next_crossing(world, ball, now)
            }
        };
        // At one instant bookkeeping goes first.
        (!impact.before(time) && !self.sweeps_before(time)).then_some((time, face))
    }

    /// How far (m) a ball flies at most before it leaves its place.
    pub fn longest_way(&self) -> f64 {
        match self {
            Self::Cells(cells) => cells.longest_way(),
            Self::Lists(_) => f64::INFINITY,
        }
    }

    /// The earlier of `time` and of when `ball`, which has no event before that, has left its place all the same, and was moved by
    /// a sweep.
    #[inline(always)]
    pub fn moved_by(&self, world: &World, ball: usize, now: Time, time: Time) -> Time {
        match self {
            Self::Cells(cells) if cells.slack() > 0.0 => {
                let (leaves, _) = cells.next_crossing(world, ball, now);
                if leaves.before(time) { leaves } else { time }
            }
            _ => time,
        }
    }

    /// Whether all balls are moved to where they are by `time`.
    #[inline(always)]
    fn sweeps_before(&self, time: Time) -> bool {
        matches!(self, Self::Cells(cells) if cells.horizon().before(time))
    }

    /// Follows a ball that was put back into the box by `images` sizes.
    pub fn wrap(&mut self, ball: usize, images: [i32; 3]) {
        match self {
            Self::Cells(cells) => cells.wrap(ball, images),
            // Their rings close where the box does.
            Self::Lists(_) => {}
        }
    }

    /// Contact distance (m) up to which two balls that are near can only meet through their nearest images.
    pub fn nearest_image_reach(&self) -> f64 {
        match self {
            Self::Cells(cells) => cells.nearest_image_reach(),
            // Lists are made only where a box is wide enough for them.
            Self::Lists(_) => f64::INFINITY,
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Cells(cells) => cells.bytes(),
            Self::Lists(lists) => lists.bytes(),
        }
    }
}

/// Places of a block of free ones.
pub const BLOCK: usize = 256;

/// Rows of balls, gathered without a branch for each: whole cells are copied, and what is too much is written over.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    rows: Vec<u32>,
    len: usize,
}

impl Gathered {
    /// Forgets all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// How many were gathered.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.len
    }

    /// Who was gathered.
    #[inline(always)]
    pub fn rows(&self) -> &[u32] {
        &self.rows[..self.len]
    }

    /// Who was gathered, filled up as [`Gathered::filled_up`] has done.
    #[inline(always)]
    pub fn whole_rows(&self) -> &[u32] {
        &self.rows[..self.len.next_multiple_of(MOST)]
    }

    /// Takes back what was gathered since there were so many.
    #[inline(always)]
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// Makes room for so many more.
    #[inline(always)]
    pub fn make_room(&mut self, more: usize) {
        if self.len + more > self.rows.len() {
            self.grow(more);
        }
    }

    #[cold]
    fn grow(&mut self, more: usize) {
        self.rows.resize(2 * (self.len + more).max(128), 0);
    }

    /// Adds one, making room.
    #[inline(always)]
    pub fn push(&mut self, row: u32) {
        self.make_room(1);
        self.rows[self.len] = row;
        self.len += 1;
    }

    /// Adds the first `count` of a cell's; there must be room for all.
    #[inline(always)]
    pub fn add<const N: usize>(&mut self, rows: &[u32; N], count: usize) {
        self.rows[self.len..self.len + N].copy_from_slice(rows);
        self.len += count;
    }

    /// Free places, to be written to in order: [`BLOCK`], and a few more to be written over.
    #[inline(always)]
    pub fn block(&mut self) -> &mut [u32; BLOCK + MOST] {
        self.make_room(BLOCK + MOST);
        let Some((block, _)) = self.rows[self.len..].split_first_chunk_mut() else { unreachable!("room was made") };
        block
    }

    /// All free places, those for which room was made at least.
    #[inline(always)]
    pub fn free(&mut self) -> &mut [u32] {
        &mut self.rows[self.len..]
    }

    /// Adds those that were written to the first so many free places.
    #[inline(always)]
    pub fn add_free(&mut self, count: usize) {
        self.len += count;
    }

    /// Keeps those whom `ball` can meet: two bodies in prescribed motion pass through each other.
    #[inline(always)]
    pub fn retain_partners(&mut self, world: &World, ball: usize) {
        if world.is_fixed(ball) {
            self.retain_free(world);
        }
    }

    #[cold]
    fn retain_free(&mut self, world: &World) {
        let mut kept = 0;
        for k in 0..self.len {
            let row = self.rows[k];
            self.rows[kept] = row;
            kept += usize::from(!world.is_fixed(row as usize));
        }
        self.len = kept;
    }

    /// Fills up with the ball itself, which never approaches itself.
    #[inline(always)]
    pub fn filled_up(&mut self, ball: usize) -> &[u32] {
        self.make_room(MOST);
        self.rows[self.len..self.len + MOST].fill(ball as u32);
        &self.rows[..self.len.next_multiple_of(MOST)]
    }
}

/// Some of the planes: the first seven by their rows, the others only together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaneSet(u8);

impl PlaneSet {
    /// None of them.
    pub const NONE: Self = Self(0);

    #[inline(always)]
    fn bit(row: usize) -> u8 {
        1 << row.min(7)
    }

    /// Whether the plane in this row may be one of them.
    #[inline(always)]
    pub fn contains(self, row: usize) -> bool {
        self.0 & Self::bit(row) != 0
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Those that a ball of `radius` (m) can touch while its centre is between `low` and `high` (m; either may be infinite)
    /// and that distance (m) around.
    pub fn near(world: &World, radius: f64, low: DVec3, high: DVec3, around: f64) -> Self {
        let mut set = Self::NONE;
        for (row, plane) in world.planes.iter().enumerate() {
            let mut nearest = 0.0;
            let mut largest = plane.offset.abs() + radius + around;
            for axis in 0..3 {
                let n = plane.normal[axis];
                let x = if n > 0.0 { low[axis] } else { high[axis] };
                if n != 0.0 {
                    nearest += n * x;
                    largest += x.abs();
                }
            }
            let gap = nearest - plane.offset - radius - around;
            if !(gap > CELL_MARGIN * largest) || plane.velocity != DVec3::ZERO {
                set.0 |= Self::bit(row);
            }
        }
        set
    }
}
