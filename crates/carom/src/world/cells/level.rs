//! One level of the nested grids, and how many there are.

use glam::DVec3;

use super::{Face, LEAST_WIDTH, Place};
use crate::world::radii::Radii;

/// Cells at most for each ball: more of them are emptier, and crossed more often.
const CELLS_PER_BALL: f64 = 2.2;
const FEWEST_CELLS: usize = 64;
/// Radii 1 : 2^20 is beyond what a run can serve.
const FINEST_LEVEL: u32 = 20;

/// One level of the grid.
#[derive(Clone, Debug)]
pub(super) struct Level {
    /// Finest coordinate >> shift = coordinate here.
    pub shift: u32,
    pub count: [i32; 3],
    pub width: DVec3,
    /// Row of its first cell.
    pub first: usize,
    /// What a coordinate along each axis and those beside it add to the row of a cell: one lower, itself, one higher.
    pub beside: [Vec<[u32; 3]>; 3],
    /// How many of these three are different.
    pub different: [usize; 3],
    pub largest_radius: f64,
    pub smallest_radius: f64,
}

impl Level {
    /// The coordinate of a ball's cell on this level.
    #[inline(always)]
    pub fn coordinate(&self, place: &Place) -> [i32; 3] {
        let [x, y, z] = place.coordinate;
        [self.closed(0, x >> self.shift), self.closed(1, y >> self.shift), self.closed(2, z >> self.shift)]
    }

    /// What the cells at and beside a coordinate add to [`Level::first`] along each axis, and how many there are.
    #[inline(always)]
    pub fn beside(&self, coordinate: [i32; 3], face: Option<Face>) -> [([u32; 3], usize); 3] {
        std::array::from_fn(|axis| {
            let beside = self.beside[axis][coordinate[axis] as usize];
            match face {
                Some(face) if usize::from(face.axis) == axis => ([behind(&beside, face.upward)[0]; 3], 1),
                _ => (beside, self.different[axis]),
            }
        })
    }

    /// A coordinate in a row that closes on itself.
    #[inline(always)]
    pub fn closed(&self, axis: usize, coordinate: i32) -> i32 {
        let count = self.count[axis];
        // Almost always within one turn of it: no division.
        if (0..count).contains(&coordinate) {
            coordinate
        } else if (-count..0).contains(&coordinate) {
            coordinate + count
        } else {
            coordinate.rem_euclid(count)
        }
    }

    #[inline(always)]
    pub fn row(&self, coordinate: [i32; 3]) -> usize {
        self.first + ((coordinate[2] * self.count[1] + coordinate[1]) * self.count[0] + coordinate[0]) as usize
    }
}

/// Of three side by side, the one behind a face.
#[inline(always)]
pub(super) fn behind(beside: &[u32; 3], upward: bool) -> &[u32; 1] {
    let [low, _, high] = beside;
    std::array::from_ref(if upward { high } else { low })
}

/// A coordinate and those beside it in a closed row: one lower, itself, one higher, where there are three; the different ones
/// first, where there are fewer.
pub(super) fn neighbours(coordinate: i32, count: i32) -> [i32; 3] {
    match count {
        1 => [0; 3],
        2 => [0, 1, 0],
        _ => [(coordinate + count - 1) % count, coordinate, (coordinate + 1) % count],
    }
}

/// Cells of the coarsest level along each axis: as many as are wider than the largest ball, but not many more than balls.
pub(super) fn base_count(extent: DVec3, widest: f64, balls: usize, single: &[bool; 3]) -> [i32; 3] {
    if balls == 0 {
        return [1; 3];
    }
    let most = ((balls as f64 * CELLS_PER_BALL) as usize).max(FEWEST_CELLS);
    let mut width = widest;
    loop {
        // One axis alone never needs more cells than all axes may have together.
        let count: [i32; 3] = std::array::from_fn(|axis| {
            if single[axis] { 1 } else { (extent[axis] / width).floor().clamp(1.0, most as f64) as i32 }
        });
        if count.iter().map(|&n| n as usize).product::<usize>() <= most {
            return count;
        }
        width *= 1.005;
    }
}

/// The level of each ball, and the finest level in use.
pub(super) fn levels_of(
    radii: &Radii,
    base: &[i32; 3],
    extent: DVec3,
    smallest: f64,
    single: &[bool; 3],
) -> (Vec<u32>, u32) {
    let axes = || (0..3).filter(|&axis| !single[axis]);
    let narrowest = axes().map(|axis| extent[axis] / f64::from(base[axis])).fold(f64::INFINITY, f64::min);
    let level_for = |radius: f64| -> u32 {
        let mut level = 0;
        let mut width = 0.5 * narrowest;
        while narrowest.is_finite() && width > 2.0 * radius * LEAST_WIDTH && level < FINEST_LEVEL {
            level += 1;
            width *= 0.5;
        }
        level
    };
    let mut finest = level_for(smallest);
    let mut level_of: Vec<u32> = radii.iter().map(level_for).collect();
    // A few small balls in a wide space share larger cells.
    while finest > 0 {
        let members = level_of.iter().filter(|&&level| level >= finest).count();
        let cells: f64 = axes().map(|axis| f64::from(base[axis]) * f64::from(1u32 << finest)).product();
        if cells <= (4.0 * members as f64 * CELLS_PER_BALL).max(FEWEST_CELLS as f64) {
            break;
        }
        finest -= 1;
        for level in &mut level_of {
            *level = (*level).min(finest);
        }
    }
    (level_of, finest)
}
