//! Sites of a simple cubic or a face-centred cubic lattice in a region.

use glam::DVec3;

use super::Region;
use crate::tolerance::touching;

const CUBIC: [[f64; 3]; 1] = [[0.5, 0.5, 0.5]];
const FCC: [[f64; 3]; 4] = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]];

fn basis(fcc: bool) -> &'static [[f64; 3]] {
    if fcc { &FCC } else { &CUBIC }
}

/// Cells along three axes and the sites in each.
pub(super) struct Lattice {
    /// The lowest corner (m).
    low: DVec3,
    /// Lengths of a cell (m).
    cell: DVec3,
    /// Cells along each axis.
    cells: [usize; 3],
    basis: &'static [[f64; 3]],
    /// Axes that count: 2 or 3.
    axes: usize,
    /// Least distance of two sites (m), across a closed side too.
    pub nearest: f64,
}

impl Lattice {
    /// As many cells as `count` sites need, as nearly cubic as they can be, over the whole of the region; `None` if a ball of
    /// `radius` (m) does not fit in. Between walls the outer sites lie in the walls' reach, so that the spacing there is of
    /// the region itself.
    pub fn filling(region: &Region, fcc: bool, radius: f64, count: usize) -> Option<Self> {
        let (low, extent) = region.centers(radius);
        if extent.min_element() < 0.0 {
            return None;
        }
        let axes: usize = if region.dimensions == 2 { 2 } else { 3 };
        let needed = count.div_ceil(basis(fcc).len());
        let mut cells = [1usize; 3];
        while cells.iter().product::<usize>() < needed {
            let widest = (0..axes)
                .max_by(|&a, &b| (extent[a] / cells[a] as f64).total_cmp(&(extent[b] / cells[b] as f64)))
                .unwrap_or(0);
            // In leaps while far from the goal.
            let missing = libm::pow(needed as f64 / cells.iter().product::<usize>() as f64, 1.0 / axes as f64);
            cells[widest] = (cells[widest] + 1).max((cells[widest] as f64 * missing * 0.9) as usize);
        }
        let cell = extent / DVec3::new(cells[0] as f64, cells[1] as f64, cells[2] as f64);
        let nearest = nearest_sites(cell, fcc, axes, cells, region);
        Some(Self { low, cell, cells, basis: basis(fcc), axes, nearest })
    }

    /// As many whole cells as the region holds where neighbours are `spacing` (m) apart, in its middle; `None` if a ball of
    /// `radius` (m) does not fit in.
    pub fn spaced(region: &Region, fcc: bool, radius: f64, spacing: f64) -> Option<Self> {
        let (_, extent) = region.centers(radius);
        if extent.min_element() < 0.0 {
            return None;
        }
        let edge = if fcc { spacing * 2.0_f64.sqrt() } else { spacing };
        let mut cells = [1; 3];
        for axis in 0..3 {
            cells[axis] = match (region.wraps[axis], fcc) {
                (true, _) => whole(extent[axis], edge),
                // Centres may lie on the sides of what is left for them.
                (false, false) => 1 + whole(extent[axis], edge),
                (false, true) => whole(extent[axis] + 0.5 * edge, edge),
            };
        }
        let cell = DVec3::splat(edge);
        let low = region.center - 0.5 * cell * DVec3::from_array(cells.map(|count| count as f64));
        Some(Self { low, cell, cells, basis: basis(fcc), axes: 3, nearest: spacing })
    }

    /// How many sites there are.
    pub fn sites(&self) -> usize {
        self.cells.iter().product::<usize>() * self.basis.len()
    }

    /// So many of the sites (m); vacancies, if any, are spread evenly.
    pub fn spread(&self, count: usize) -> Vec<DVec3> {
        let sites = self.sites();
        let chosen = |k: usize| (k as u128 * sites as u128 / count as u128) as usize;
        (0..count).map(|k| self.site(chosen(k))).collect()
    }

    fn site(&self, index: usize) -> DVec3 {
        let offset = self.basis[index % self.basis.len()];
        let index = index / self.basis.len();
        let at =
            [index % self.cells[0], index / self.cells[0] % self.cells[1], index / (self.cells[0] * self.cells[1])];
        let mut position = self.low;
        for axis in 0..self.axes {
            position[axis] += (at[axis] as f64 + offset[axis]) * self.cell[axis];
        }
        position
    }
}

/// How many lengths of `part` there are in `whole`; one that is only by rounding too long counts.
fn whole(length: f64, part: f64) -> usize {
    let nearest = (length / part).round();
    let count = if nearest * part - length <= touching(length) { nearest } else { (length / part).floor() };
    // Beyond this the product of three no longer fits; nobody has so many bodies.
    count.clamp(0.0, f64::from(1 << 20)) as usize
}

/// Least distance (m) between two sites of the lattice, across a closed side too.
fn nearest_sites(cell: DVec3, fcc: bool, axes: usize, cells: [usize; 3], region: &Region) -> f64 {
    let mut nearest = f64::INFINITY;
    for axis in 0..axes {
        if cells[axis] > 1 || region.wraps[axis] {
            nearest = nearest.min(cell[axis]);
        }
        if fcc {
            let next = (axis + 1) % 3;
            nearest = nearest.min(0.5 * (cell[axis] * cell[axis] + cell[next] * cell[next]).sqrt());
        }
    }
    nearest
}
