//! Who can meet whom before either leaves its cell: nested grids, one level for each class of sizes.
//!
//! Level k has cells half as wide as level k - 1, and a ball lives in the finest level whose cells are a little wider.
//! A ball that is predicted looks at the cells beside its own on its own and every coarser level, and on every finer
//! level at the shell of cells that its surface can reach before it leaves its cell of that level. Each ball crosses the
//! cells of the finest level, and looks again when it does. So two balls are always predicted from each other before they
//! can touch, whatever their sizes.
//!
//! Rows of cells close on themselves. Where space does not, distant balls may share a cell: they are predicted in vain,
//! never missed.

mod kept;
mod level;
mod shell;
pub mod sweep;

use std::cmp::Ordering;

use glam::DVec3;

use self::kept::KeptRows;
use self::level::{Level, base_count, behind, levels_of, neighbours};
use super::nearby::{BLOCK, Gathered, PlaneSet};
use super::radii::Radii;
use super::{Boundary, Domain, World};
use crate::frugal::{filled, make_room};
use crate::predict::crossing;
use crate::predict::lanes::MOST;
use crate::prefetch::prefetch;
use crate::time::Time;
use crate::tolerance::CELL_MARGIN;

/// Balls that a cell holds itself; more are in further ones.
const SLOTS: usize = 3;
/// Cells are at least so many times as wide as the largest ball: room for balls that are a little outside of theirs.
const LEAST_WIDTH: f64 = 1.04;
/// Of fewer cells round a periodic box, neighbours can stand half the box apart, where rounding chooses the image.
const FEWEST_ROUND_A_BOX: i32 = 5;
/// So few balls need no cells where space is not periodic.
const FEW: usize = 32;

/// Who is in a cell: a quarter of a line of the cache, copied whole.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Cell([u32; SLOTS + 1]);

impl Cell {
    const EMPTY: Self = Self([0; SLOTS + 1]);

    /// How many, and eight times one more than the row of the further cell: in the last place.
    #[inline(always)]
    fn fill(&self) -> u32 {
        self.0[SLOTS]
    }

    #[inline(always)]
    fn len(&self) -> usize {
        (self.fill() & 7) as usize
    }

    /// The row of the further cell.
    #[inline(always)]
    fn further(&self) -> Option<usize> {
        (self.fill() >> 3).checked_sub(1).map(|row| row as usize)
    }
}

/// Where a ball lives; four of them fill a line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Place {
    /// Cell on the finest level, counted on through periodic images since the ball's last impact.
    coordinate: [i32; 3],
    level: u32,
}

/// A passage from one cell of the finest level into the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// 0, 1, 2.
    pub axis: u8,
    /// Towards larger coordinates.
    pub upward: bool,
}

impl Face {
    /// Where there are no cells.
    pub const NONE: Self = Self { axis: 0, upward: false };
}

/// The nested grids and who is in which cell.
#[derive(Clone, Debug)]
pub struct Cells {
    origin: DVec3,
    width: DVec3,
    crossed: [bool; 3],
    periodic_count: [i32; 3],
    nearest_image_reach: f64,
    interiors: bool,
    /// How far (m) balls may be outside of their cells, until `horizon`, without an event that tells.
    slack: f64,
    horizon: Time,
    /// Half a cell's width and the slack (m); infinite along axes that are not crossed.
    reach: DVec3,
    /// One over a cell's width (1/m); 0 along axes that are not crossed.
    inverse: DVec3,
    levels: Vec<Level>,
    places: Vec<Place>,
    /// The cells of all levels, and further ones of those that are full.
    cells: Vec<Cell>,
    free: Vec<u32>,
    kept: KeptRows,
    /// Empty where there are no planes.
    planes: Vec<PlaneSet>,
}

impl Cells {
    /// Grids for balls with these radii (m), empty. `low` and `high` (m) bound the centres where space is open.
    pub fn new(domain: &Domain, radii: &Radii, low: DVec3, high: DVec3) -> Self {
        let largest = radii.iter().fold(0.0, f64::max);
        let smallest = radii.iter().fold(f64::INFINITY, f64::min);
        let widest = 2.0 * largest * (1.0 + CELL_MARGIN);
        let mut origin = DVec3::ZERO;
        let mut extent = DVec3::ZERO;
        for axis in 0..3 {
            if domain.boundary[axis] == Boundary::Open {
                origin[axis] = low[axis] - largest;
                extent[axis] = high[axis] - low[axis] + 2.0 * largest;
            } else {
                origin[axis] = -0.5 * domain.size[axis];
                extent[axis] = domain.size[axis];
            }
        }
        // Along these axes all balls share one row, and nothing is crossed.
        let single: [bool; 3] = std::array::from_fn(|axis| {
            let open = domain.boundary[axis] == Boundary::Open;
            let periodic = domain.boundary[axis] == Boundary::Periodic;
            !periodic && (radii.len() <= FEW || (open && high[axis] <= low[axis]))
        });
        let mut base = base_count(extent, widest * LEAST_WIDTH, radii.len(), &single);
        if (0..3).any(|axis| domain.boundary[axis] == Boundary::Periodic && base[axis] < FEWEST_ROUND_A_BOX) {
            base = base_count(extent, widest, radii.len(), &single);
        }
        let (level_of, finest) = levels_of(radii, &base, extent, smallest, &single);
        let mut crossed = [false; 3];
        for axis in 0..3 {
            let periodic = domain.boundary[axis] == Boundary::Periodic;
            // In a row of three cells, all are neighbours.
            crossed[axis] = periodic || (!single[axis] && base[axis] << finest > 3);
            if !crossed[axis] {
                base[axis] = 1;
            }
        }
        let count_at = |level: u32| -> [i32; 3] {
            std::array::from_fn(|axis| if crossed[axis] { base[axis] << level } else { 1 })
        };
        let fine = count_at(finest);
        let mut levels: Vec<Level> = Vec::new();
        let mut level_row = vec![0u32; finest as usize + 1];
        let mut cells = 0;
        for level in 0..=finest {
            let mut members = radii.iter().zip(&level_of).filter(|(_, l)| **l == level).map(|(r, _)| r).peekable();
            if members.peek().is_none() {
                continue;
            }
            let (least, most) = members.fold((f64::INFINITY, 0.0_f64), |(least, most), r| (least.min(r), most.max(r)));
            let count = count_at(level);
            level_row[level as usize] = levels.len() as u32;
            levels.push(Level {
                shift: finest - level,
                count,
                width: extent / DVec3::from_array(count.map(f64::from)),
                first: cells,
                beside: std::array::from_fn(|axis| {
                    let stride: i32 = count[..axis].iter().product();
                    (0..count[axis]).map(|k| neighbours(k, count[axis]).map(|k| (k * stride) as u32)).collect()
                }),
                different: count.map(|n| n.min(3) as usize),
                largest_radius: most,
                smallest_radius: least,
            });
            cells += count.iter().map(|&n| n as usize).product::<usize>();
        }
        let periodic_count =
            std::array::from_fn(|axis| if domain.boundary[axis] == Boundary::Periodic { fine[axis] } else { 0 });
        let places =
            level_of.iter().map(|&level| Place { coordinate: [0; 3], level: level_row[level as usize] }).collect();
        let mut new = Self {
            origin,
            width: extent / DVec3::from_array(fine.map(f64::from)),
            crossed,
            periodic_count,
            nearest_image_reach: 0.0,
            interiors: false,
            slack: 0.0,
            horizon: Time::NEVER,
            reach: DVec3::ZERO,
            inverse: DVec3::ZERO,
            levels,
            places,
            cells: filled(Cell::EMPTY, cells),
            free: Vec::new(),
            kept: KeptRows::default(),
            planes: Vec::new(),
        };
        new.nearest_image_reach = new.image_reach(domain, 0.0);
        new
    }

    /// Both of a pair may be outside of their cells, and both at either end of their ways.
    const IMAGE_REACH_PER_SLACK: f64 = 4.0;

    /// What [`Cells::nearest_image_reach`] is (m) if balls may be so far outside of their cells.
    fn image_reach(&self, domain: &Domain, slack: f64) -> f64 {
        let few = |axis: usize| self.levels.iter().any(|level| level.count[axis] < FEWEST_ROUND_A_BOX);
        (0..3)
            .filter(|&axis| domain.boundary[axis] == Boundary::Periodic && few(axis))
            .map(|axis| 0.5 * domain.size[axis] - 2.0 * self.width[axis] - Self::IMAGE_REACH_PER_SLACK * slack)
            .fold(f64::INFINITY, f64::min)
    }

    /// Cells for the balls where they are at `now`, everybody in.
    pub fn lay_out(world: &World, now: Time) -> Self {
        let (low, high) = world.extent(now);
        let mut cells = Self::new(&world.domain, &world.radii, low, high);
        if world.growth.is_some() {
            // Balls are smaller than the radii that the cells were laid out for.
            cells.visit_interiors();
        }
        cells.slack = cells.room_to_stray(world);
        cells.nearest_image_reach = cells.image_reach(&world.domain, cells.slack);
        for axis in 0..3 {
            let (width, crossed) = (cells.width[axis], cells.crossed[axis]);
            cells.reach[axis] = if crossed { 0.5 * width + cells.slack } else { f64::INFINITY };
            cells.inverse[axis] = if crossed { 1.0 / width } else { 0.0 };
        }
        if !world.planes.is_empty() {
            cells.planes = vec![PlaneSet::NONE; world.len()];
        }
        for ball in 0..world.len() {
            cells.insert(ball, world.position(ball, now));
            cells.note_planes(world, ball);
        }
        cells
    }

    /// Contact distance (m) up to which two balls can only meet through their nearest images before either leaves its
    /// cell. With five cells or more along each axis neighbours are less than half the box apart; with fewer, each may
    /// still fly one cell of the finest level, and as far outside as balls may be.
    pub fn nearest_image_reach(&self) -> f64 {
        self.nearest_image_reach
    }

    /// From now on a ball also sees smaller ones that are deep inside it: for checks, and while balls have not their size.
    pub fn visit_interiors(&mut self) {
        self.interiors = true;
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.places.len() * size_of::<Place>() + self.planes.len() + self.cells.capacity() * size_of::<Cell>()
    }

    /// Puts a ball at `position` (m) into its cell.
    pub fn insert(&mut self, ball: usize, position: DVec3) {
        self.places[ball].coordinate = self.coordinate_at(position);
        let cell = self.cell_of(ball);
        self.link(ball, cell);
    }

    fn coordinate_at(&self, position: DVec3) -> [i32; 3] {
        let relative = (position - self.origin) / self.width;
        std::array::from_fn(|axis| if self.crossed[axis] { relative[axis].floor() as i32 } else { 0 })
    }

    /// Lets the coordinates follow a ball that was put back into the box by `images` sizes.
    pub fn wrap(&mut self, ball: usize, images: [i32; 3]) {
        let coordinate = &mut self.places[ball].coordinate;
        for axis in 0..3 {
            coordinate[axis] -= images[axis] * self.periodic_count[axis];
        }
    }

    /// Moves a ball through a face of its cell.
    pub fn cross(&mut self, ball: usize, face: Face) {
        let step = if face.upward { 1 } else { -1 };
        let before = self.cell_of(ball);
        let place = &mut self.places[ball];
        // Far out in open space the row of cells has closed on itself long ago; so may its numbers.
        place.coordinate[face.axis as usize] = place.coordinate[face.axis as usize].wrapping_add(step);
        let cell = self.cell_of(ball);
        if cell != before {
            self.unlink(ball, before);
            self.link(ball, cell);
        }
    }

    /// Finds out which planes a ball can meet in its cell.
    #[inline]
    pub fn note_planes(&mut self, world: &World, ball: usize) {
        if self.planes.is_empty() {
            return;
        }
        let (mut low, mut high) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
        for axis in 0..3 {
            if let Some(bounds) = self.bounds(ball, axis) {
                (low[axis], high[axis]) = bounds;
            }
        }
        self.planes[ball] = PlaneSet::near(world, world.radii[ball], low, high, 0.0);
    }

    /// The planes that a ball can meet in its cell.
    #[inline(always)]
    pub fn planes(&self, ball: usize) -> PlaneSet {
        self.planes.get(ball).copied().unwrap_or(PlaneSet::NONE)
    }

    /// How far (m) a ball flies at most, corner to corner, before it leaves its cell of the finest level.
    pub fn longest_way(&self) -> f64 {
        (2.0 * self.reach).length()
    }

    /// When and through which face `ball` next leaves its cell.
    #[inline(always)]
    pub fn next_crossing(&self, world: &World, ball: usize, now: Time) -> (Time, Face) {
        let flight = &world.flights[ball];
        let elapsed = now.since(flight.start());
        let mut least = f64::INFINITY;
        let mut face = Face::NONE;
        if !world.falls(ball) {
            let (position, velocity) = (flight.position().to_array(), flight.velocity().to_array());
            for axis in 0..3 {
                let (x, v) = (position[axis], velocity[axis]);
                if !self.crossed[axis] || v == 0.0 {
                    continue;
                }
                // The face ahead; by rounding of an earlier crossing it may lie behind by now.
                let bound = self.bound(ball, axis, v > 0.0);
                let time = ((bound - x) / v).max(elapsed);
                if time < least {
                    least = time;
                    face = Face { axis: axis as u8, upward: v > 0.0 };
                }
            }
            return (world.clock.after(flight.start(), least), face);
        }
        let acceleration = world.gravity;
        for axis in 0..3 {
            let Some((low, high)) = self.bounds(ball, axis) else { continue };
            let (x, v, a) = (flight.position()[axis], flight.velocity()[axis], acceleration[axis]);
            let up = crossing::time_of_passage(x, v, a, high, elapsed);
            if up < least {
                least = up;
                face = Face { axis: axis as u8, upward: true };
            }
            let down = crossing::time_of_passage(-x, -v, -a, -low, elapsed);
            if down < least {
                least = down;
                face = Face { axis: axis as u8, upward: false };
            }
        }
        (world.clock.after(flight.start(), least), face)
    }

    /// The bounds (m) within which a ball stays in its cell, along an axis, where there are any.
    #[inline(always)]
    pub fn bounds(&self, ball: usize, axis: usize) -> Option<(f64, f64)> {
        if !self.crossed[axis] {
            return None;
        }
        Some((self.bound(ball, axis, false), self.bound(ball, axis, true)))
    }

    #[inline(always)]
    fn bound(&self, ball: usize, axis: usize, upper: bool) -> f64 {
        let (beyond, out) = if upper { (1.0, self.slack) } else { (0.0, -self.slack) };
        let coordinate = f64::from(self.places[ball].coordinate[axis]) + beyond;
        self.origin[axis] + coordinate * self.width[axis] + out
    }

    fn cell_of(&self, ball: usize) -> u32 {
        let place = &self.places[ball];
        let level = &self.levels[place.level as usize];
        level.row(level.coordinate(place)) as u32
    }

    fn link(&mut self, ball: usize, cell: u32) {
        self.kept.forget();
        let mut row = cell as usize;
        loop {
            let here = &mut self.cells[row];
            let len = here.len();
            if len < SLOTS {
                here.0[len] = ball as u32;
                here.0[SLOTS] += 1;
                return;
            }
            row = match here.further() {
                Some(further) => further,
                None => self.begin_further(row),
            };
        }
    }

    #[cold]
    fn begin_further(&mut self, row: usize) -> usize {
        let further = self.free.pop().unwrap_or_else(|| {
            make_room(&mut self.cells, 1);
            self.cells.push(Cell::EMPTY);
            self.cells.len() as u32 - 1
        });
        self.cells[row].0[SLOTS] |= (further + 1) << 3;
        further as usize
    }

    fn unlink(&mut self, ball: usize, cell: u32) {
        let mut before = None;
        let mut row = cell as usize;
        loop {
            let here = &mut self.cells[row];
            let len = here.len();
            // Which of the slots, without a branch.
            let is_in = |slot: usize| usize::from(slot < len && here.0[slot] == ball as u32);
            let slot = is_in(1) + 2 * is_in(2);
            if slot < len && here.0[slot] == ball as u32 {
                here.0[slot] = here.0[len - 1];
                here.0[SLOTS] -= 1;
                if let Some(before) = before
                    && len == 1
                {
                    self.end_further(before, row);
                }
                return;
            }
            let Some(further) = here.further() else { return };
            before = Some(row);
            row = further;
        }
    }

    /// Gives an empty further cell back.
    #[cold]
    fn end_further(&mut self, before: usize, row: usize) {
        let after = self.cells[row].fill() & !7;
        self.cells[before].0[SLOTS] = self.cells[before].fill() & 7 | after;
        self.cells[row] = Cell::EMPTY;
        self.free.push(row as u32);
    }

    /// Fetches into the cache where the ball's place is noted.
    #[inline(always)]
    pub fn prefetch(&self, ball: usize) {
        prefetch(&self.places, ball);
    }

    /// Fetches the cells of the ball's own level that it will look at next: if it goes through `face`, those behind it, the one
    /// it comes from and the one it goes to; otherwise all at and beside its own.
    #[inline(always)]
    pub fn prefetch_cells(&self, ball: usize, face: Option<Face>) {
        let (level, coordinate) = self.next_place(ball, face);
        if face.is_some() {
            prefetch(&self.cells, self.cell_of(ball) as usize);
            prefetch(&self.cells, level.row(coordinate));
        }
        let [(x, columns), (y, rows), (z, planes)] = level.beside(coordinate, face);
        for &z in &z[..planes] {
            for &y in &y[..rows] {
                let row = level.first + (z + y) as usize;
                prefetch(&self.cells, row + x[0] as usize);
                // Three cells side by side are in no more than two lines of the cache, unless the row closes on itself there.
                prefetch(&self.cells, row + x[columns - 1] as usize);
            }
        }
    }

    /// Fetches the flights of whoever is in these cells, and their radii if they differ.
    #[inline(always)]
    pub fn prefetch_near(&self, ball: usize, face: Option<Face>, world: &World, room: &mut Gathered) {
        let (level, coordinate) = self.next_place(ball, face);
        room.clear();
        self.gather_beside(level, coordinate, face, room);
        self.prefetch_bodies(world, room.rows());
    }

    #[inline(always)]
    fn prefetch_bodies(&self, world: &World, rows: &[u32]) {
        rows.iter().for_each(|&near| prefetch(&world.flights, near as usize));
        if world.radii.one().is_none() {
            rows.iter().for_each(|&near| world.radii.prefetch(near as usize));
        }
    }

    /// A ball's level, and its cell there once it has gone through `face`.
    #[inline(always)]
    fn next_place(&self, ball: usize, face: Option<Face>) -> (&Level, [i32; 3]) {
        let place = &self.places[ball];
        let level = &self.levels[place.level as usize];
        let mut coordinate = level.coordinate(place);
        // On coarser levels than the finest it may not leave its cell yet: what is fetched in vain does no harm.
        if let Some(Face { axis, upward }) = face {
            let axis = usize::from(axis);
            coordinate[axis] = level.closed(axis, coordinate[axis] + if upward { 1 } else { -1 });
        }
        (level, coordinate)
    }

    /// Adds to `found` every ball that `ball`, of `radius` (m), can meet before either leaves its cell; and the ball itself.
    #[inline]
    pub fn near(&self, ball: usize, radius: impl Fn() -> f64, found: &mut Gathered) {
        self.near_place(&self.places[ball], radius, found);
    }

    /// As [`Cells::near`], were the ball at `position` (m).
    pub fn near_point(&self, ball: usize, position: DVec3, radius: impl Fn() -> f64, found: &mut Gathered) {
        let place = Place { coordinate: self.coordinate_at(position), ..self.places[ball] };
        self.near_place(&place, radius, found);
    }

    #[inline(always)]
    fn near_place(&self, place: &Place, radius: impl Fn() -> f64, found: &mut Gathered) {
        for (row, level) in self.levels.iter().enumerate() {
            let coordinate = level.coordinate(place);
            if row as u32 <= place.level {
                self.gather_beside(level, coordinate, None, found);
            } else {
                self.shell(level, coordinate, radius(), found);
            }
        }
    }

    /// As [`Cells::near`], after a passage through `face`: of balls of its own class, only those in the cells behind it.
    #[inline]
    pub fn near_after_crossing(&self, ball: usize, radius: impl Fn() -> f64, face: Face, found: &mut Gathered) {
        let place = &self.places[ball];
        for (row, level) in self.levels.iter().enumerate() {
            let coordinate = level.coordinate(place);
            let all_new = level.shift > 0 || level.count[face.axis as usize] < 4;
            match (row as u32).cmp(&place.level) {
                Ordering::Equal if !all_new => self.gather_beside(level, coordinate, Some(face), found),
                Ordering::Less | Ordering::Equal => self.gather_beside(level, coordinate, None, found),
                Ordering::Greater => self.shell(level, coordinate, radius(), found),
            }
        }
    }

    /// Adds whoever is in the cells at and beside a coordinate; only in those behind `face`, if there is one.
    #[inline(always)]
    fn gather_beside(&self, level: &Level, coordinate: [i32; 3], face: Option<Face>, found: &mut Gathered) {
        let first = level.first;
        if level.different != [3; 3] {
            let [(x, columns), (y, rows), (z, planes)] = level.beside(coordinate, face);
            return self.gather_block(first, [&x[..columns], &y[..rows], &z[..planes]], found);
        }
        // Almost always: loops of known length.
        let beside = |axis: usize| &level.beside[axis][coordinate[axis] as usize];
        match face {
            None => self.gather_block(first, [beside(0), beside(1), beside(2)], found),
            // Cells that are side by side along the first axis are side by side in memory.
            Some(Face { axis: 0, upward }) => {
                self.gather_block(first, [behind(beside(0), upward), beside(1), beside(2)], found);
            }
            Some(Face { axis: 1, upward }) => {
                self.gather_block(first, [beside(0), behind(beside(1), upward), beside(2)], found);
            }
            Some(Face { upward, .. }) => {
                self.gather_block(first, [beside(0), beside(1), behind(beside(2), upward)], found);
            }
        }
    }

    /// Adds whoever is in the cells whose rows are `first` and one of each axis.
    #[inline(always)]
    fn gather_block(&self, first: usize, [x, y, z]: [&[u32]; 3], found: &mut Gathered) {
        // While no cell is crowded, its fill is how many are in it. The fill of one that is crowded tells of a further cell, which
        // comes after all of the grid: eight times its row is more than all of these can hold.
        let mut count = 0;
        // 27 cells hold less than a block: the remainder only tells the compiler so.
        let mut copy = |free: &mut [u32; BLOCK + MOST], cell: &Cell| {
            let place = count % BLOCK;
            free[place..place + SLOTS + 1].copy_from_slice(&cell.0);
            count += cell.fill() as usize;
        };
        let free = found.block();
        let side_by_side = x.len() == 3 && x[0] + 2 == x[2];
        for &z in z {
            for &y in y {
                let row = first + (z + y) as usize;
                if side_by_side {
                    if let Some((cells, _)) = self.cells[row + x[0] as usize..].split_first_chunk::<3>() {
                        cells.iter().for_each(|cell| copy(free, cell));
                    }
                } else {
                    x.iter().for_each(|&x| copy(free, &self.cells[row + x as usize]));
                }
            }
        }
        if count > SLOTS * x.len() * y.len() * z.len() {
            return self.gather_crowded_block(first, [x, y, z], found);
        }
        found.add_free(count);
    }

    /// The same where a cell holds more than it has room for.
    #[cold]
    fn gather_crowded_block(&self, first: usize, [x, y, z]: [&[u32]; 3], found: &mut Gathered) {
        for &z in z {
            for &y in y {
                for &x in x {
                    found.make_room(SLOTS + 1);
                    self.gather(first + (z + y + x) as usize, found);
                }
            }
        }
    }

    /// Adds whoever is in a cell.
    #[inline(always)]
    fn gather(&self, row: usize, found: &mut Gathered) {
        let cell = &self.cells[row];
        found.add(&cell.0, cell.len());
        if cell.fill() > 7 {
            self.gather_further(cell, found);
        }
    }

    #[cold]
    fn gather_further(&self, cell: &Cell, found: &mut Gathered) {
        let mut further = cell.further();
        while let Some(row) = further {
            let cell = &self.cells[row];
            found.make_room(4 * SLOTS);
            found.add(&cell.0, cell.len());
            further = cell.further();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Balls heaped in one place: full, crowded and empty cells, in grids of one cell a side and more.
    #[test]
    fn whoever_is_in_the_cells_beside_is_gathered_once() {
        let mut found = Gathered::default();
        for size in [1.5, 2.5, 3.5, 4.5, 8.5] {
            let domain = Domain { boundary: [Boundary::Periodic; 3], size: DVec3::splat(size) };
            let mut cells = Cells::new(&domain, &Radii::new(vec![0.49; 40]), DVec3::ZERO, DVec3::ZERO);
            // Squares of fractions heap up at zero.
            let fraction = |k: usize, a: f64| (k as f64 * a).fract() * (k as f64 * a).fract();
            let position = |k: usize| DVec3::new(fraction(k, 0.618), fraction(k, 0.414), fraction(k, 0.732)) * size;
            let positions: Vec<DVec3> = (0..40).map(|k| position(k) - 0.5 * domain.size).collect();
            (0..40).for_each(|ball| cells.insert(ball, positions[ball]));
            let count = cells.levels[0].count;
            let place = |ball: usize| cells.places[ball].coordinate;
            let steps = |a: i32, b: i32, count: i32| (a - b).rem_euclid(count).min((b - a).rem_euclid(count));
            for ball in 0..40 {
                found.clear();
                cells.near(ball, || 0.49, &mut found);
                let mut rows = found.rows().to_vec();
                rows.sort_unstable();
                let is_beside = |other: usize| (0..3).all(|k| steps(place(ball)[k], place(other)[k], count[k]) <= 1);
                let expected: Vec<u32> = (0..40).filter(|&other| is_beside(other)).map(|other| other as u32).collect();
                assert_eq!(rows, expected, "{count:?}");
                if count[0] >= 4 {
                    let behind = |other: usize| (place(other)[0] - place(ball)[0]).rem_euclid(count[0]) == 1;
                    found.clear();
                    cells.near_after_crossing(ball, || 0.49, Face { axis: 0, upward: true }, &mut found);
                    let mut rows = found.rows().to_vec();
                    rows.sort_unstable();
                    let expected: Vec<u32> = expected.into_iter().filter(|&other| behind(other as usize)).collect();
                    assert_eq!(rows, expected, "behind a face of {count:?}");
                }
            }
        }
    }
}
