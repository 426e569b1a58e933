//! Whom a ball that is larger than the cells of a finer level can meet there: who is in the cells that its surface can reach.

use std::ops::Range;

use super::{Cells, Level, SLOTS};
use crate::tolerance::CELL_MARGIN;
use crate::world::nearby::Gathered;

impl Cells {
    /// The cells of a finer level in which a ball can touch this one before either leaves its cell: those that the surface
    /// reaches from anywhere in the ball's own cell of that level, both as far outside as they may be.
    pub(super) fn shell(&self, level: &Level, coordinate: [i32; 3], radius: f64, found: &mut Gathered) {
        let reach = (radius + level.largest_radius) * (1.0 + CELL_MARGIN);
        // Centres cannot come nearer than this.
        let least = if self.interiors { 0.0 } else { (radius + level.smallest_radius) * (1.0 - CELL_MARGIN) };
        let rows: [Row; 3] =
            std::array::from_fn(|axis| Row::new(reach, level.width[axis], level.count[axis], 2.0 * self.slack));
        for z in rows[2].steps() {
            let (near_z, far_z) = rows[2].distances(z);
            let plane = level.closed(2, coordinate[2] + z) * level.count[1];
            for y in rows[1].steps() {
                let (near_y, far_y) = rows[1].distances(y);
                let reach_left = reach * reach - (near_z * near_z + near_y * near_y);
                if reach_left < 0.0 {
                    continue;
                }
                let row = level.first + ((plane + level.closed(1, coordinate[1] + y)) * level.count[0]) as usize;
                let least_left = least * least - (far_z * far_z + far_y * far_y);
                let (inner, outer) = rows[0].between(least_left.max(0.0).sqrt(), reach_left.sqrt());
                let x = coordinate[0];
                if rows[0].whole {
                    self.gather_run(row..row + level.count[0] as usize, found);
                } else if inner == 0 {
                    self.gather_span(level, row, [x - outer, x + outer], found);
                } else {
                    self.gather_span(level, row, [x - outer, x - inner], found);
                    self.gather_span(level, row, [x + inner, x + outer], found);
                }
            }
        }
    }

    /// Adds whoever is in the cells from `first` to `last`, fewer than all, of the closed row that begins at `row`.
    #[inline(always)]
    fn gather_span(&self, level: &Level, row: usize, [first, last]: [i32; 2], found: &mut Gathered) {
        let (first, last) = (level.closed(0, first) as usize, level.closed(0, last) as usize);
        if first <= last {
            self.gather_run(row + first..row + last + 1, found);
        } else {
            self.gather_run(row + first..row + level.count[0] as usize, found);
            self.gather_run(row..row + last + 1, found);
        }
    }

    /// Adds whoever is in cells that lie side by side.
    #[inline(always)]
    fn gather_run(&self, cells: Range<usize>, found: &mut Gathered) {
        found.make_room((SLOTS + 1) * cells.len());
        let free = found.free();
        let mut count = 0;
        let mut fills = 0;
        for cell in &self.cells[cells.clone()] {
            free[count..count + SLOTS + 1].copy_from_slice(&cell.0);
            count += cell.len();
            fills |= cell.fill();
        }
        if fills > SLOTS as u32 {
            return self.gather_crowded(cells, found);
        }
        found.add_free(count);
    }

    /// The same where a cell holds more than it has room for.
    #[cold]
    fn gather_crowded(&self, cells: Range<usize>, found: &mut Gathered) {
        for row in cells {
            found.make_room(SLOTS + 1);
            self.gather(row, found);
        }
    }
}

/// The cells of one axis that a shell can touch, as steps from the ball's own cell.
struct Row {
    width: f64,
    inverse: f64,
    /// How far (m) both together may be outside of their cells.
    slack: f64,
    reached: i32,
    /// The shell reaches all round the closed row: every cell is taken, at any distance.
    whole: bool,
}

impl Row {
    fn new(reach: f64, width: f64, count: i32, slack: f64) -> Self {
        let reached = ((reach + slack) / width).floor() as i32 + 1;
        let whole = 2 * reached + 1 > count;
        Self { width, inverse: 1.0 / width, slack, reached: if whole { count - 1 } else { reached }, whole }
    }

    fn steps(&self) -> std::ops::RangeInclusive<i32> {
        if self.whole { 0..=self.reached } else { -self.reached..=self.reached }
    }

    /// Least and greatest distance (m) along the axis between balls of two cells `step` apart.
    fn distances(&self, step: i32) -> (f64, f64) {
        if self.whole {
            return (0.0, f64::INFINITY);
        }
        let cells = f64::from(step.abs());
        (((cells - 1.0) * self.width - self.slack).max(0.0), (cells + 1.0) * self.width + self.slack)
    }

    /// The steps (of either sign) whose cells hold balls between two distances (m) along the axis.
    fn between(&self, least: f64, most: f64) -> (i32, i32) {
        if self.whole {
            return (0, self.reached);
        }
        // Those of step n hold distances from n - 1 to n + 1 cells, and the slack at either end. (No distance is negative: to cut
        // off is to round down.)
        let inner = (least - self.slack).max(0.0) * self.inverse;
        (inner as i32, (((most + self.slack) * self.inverse) as i32 + 1).min(self.reached))
    }
}
