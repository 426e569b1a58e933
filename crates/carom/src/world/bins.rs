//! Where the centres of neighbour lists are: grids of bins, one grid for each class of sizes, each bin wide enough that
//! whatever is within reach is in the bins beside.
//!
//! A bin is one line of the cache. It holds its centres side by side, each to a 256th of a bin, so that eight are compared at
//! once; what passes, with a margin for that, is looked at again in double precision by whoever asked.

use super::nearby::Gathered;
use super::rings::{Rings, Spot};
use super::{Boundary, Domain};
use crate::frugal::{filled, make_room};
use crate::predict::lanes::{Lanes, MOST};
use crate::prefetch::prefetch;
use crate::tolerance::BIN_MARGIN;

const SLOTS: usize = MOST;
/// Parts of a bin that its centres are told to.
const PARTS: f32 = 256.0;
const NONE: u32 = u32::MAX;
/// Bins at most for each ball of a grid: a few small balls in a wide space share larger ones.
const BINS_PER_BALL: usize = 2;
const FEWEST_BINS: usize = 64;
/// Bins are so much wider than they have to be, or less (pure number): the fuller, the less memory, as long as hardly any is too full.
const WIDER: f64 = 1.15;

/// Up to eight centres, and where more of the same bin are.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Bin {
    /// In which of the [`PARTS`] of the widest side; anything in empty slots.
    at: [[u8; SLOTS]; 3],
    balls: [u32; SLOTS],
    /// Row of the next bin of the same place.
    more: u32,
}

impl Bin {
    const EMPTY: Self = Self { at: [[0; SLOTS]; 3], balls: [NONE; SLOTS], more: NONE };
}

/// One grid.
#[derive(Clone, Debug)]
struct Grid {
    /// Lengths of a bin (m).
    width: [f64; 3],
    /// The same in units of the widest.
    scale: [f32; 3],
    widest: f64,
    /// Bins along each ring. One alone along axes without extent: distances along them are not counted.
    count: [i32; 3],
    flat: [bool; 3],
    first: usize,
    /// Radius (m) of its largest sphere.
    largest: f64,
}

/// All grids.
#[derive(Clone, Debug)]
pub struct Bins {
    grids: Vec<Grid>,
    bins: Vec<Bin>,
    free: Vec<u32>,
    /// Which grid each ball is in; empty if there is one grid.
    grid_of: Vec<u8>,
}

impl Bins {
    /// Empty bins for spheres of these radii (m) on `rings`; `extent`: how far (m) centres are from each other along each axis.
    pub fn new(domain: &Domain, rings: &Rings, spheres: &[f64], extent: [f64; 3]) -> Self {
        let largest = spheres.iter().copied().fold(0.0, f64::max);
        let level_of = |sphere: f64| (largest / sphere).log2().floor().clamp(0.0, 30.0) as u8;
        let levels: Vec<u8> = spheres.iter().map(|&sphere| level_of(sphere)).collect();
        let mut used = levels.clone();
        used.sort_unstable();
        used.dedup();
        let mut grids: Vec<Grid> = Vec::new();
        let mut bins = 0;
        for &level in &used {
            let of_level = || spheres.iter().zip(&levels).filter(|(_, l)| **l == level).map(|(sphere, _)| *sphere);
            let grid = Grid::new(domain, rings, of_level, largest, extent, bins);
            bins += grid.count.iter().map(|&n| n as usize).product::<usize>();
            grids.push(grid);
        }
        let row_of = |level: u8| used.iter().position(|&l| l == level).unwrap_or(0) as u8;
        Self {
            bins: filled(Bin::EMPTY, bins),
            free: Vec::new(),
            grid_of: if grids.len() > 1 { levels.iter().map(|&level| row_of(level)).collect() } else { Vec::new() },
            grids,
        }
    }

    /// The least length (m) of a ring on which no two of such spheres meet twice, and the extent (m) that an axis in open space
    /// needs at least to be divided into bins. (A bin tells its centres to a 256th: a sixteenth longer is plenty.)
    pub fn least_ring(largest_sphere: f64) -> f64 {
        4.25 * largest_sphere
    }

    #[inline(always)]
    fn grid(&self, ball: usize) -> &Grid {
        &self.grids[self.grid_of.get(ball).map_or(0, |&row| usize::from(row))]
    }

    /// Puts a ball whose list centre is at `centre` into its bin.
    #[inline(always)]
    pub fn insert<L: Lanes>(&mut self, lanes: L, ball: usize, centre: Spot) {
        let (coordinate, fraction) = self.grid(ball).locate(centre);
        let mut bin = self.grid(ball).bin(coordinate);
        loop {
            let here = &mut self.bins[bin];
            let empty = lanes.matches(&here.balls, NONE);
            if empty != 0 {
                let slot = empty.trailing_zeros() as usize % SLOTS;
                here.balls[slot] = ball as u32;
                for (at, fraction) in here.at.iter_mut().zip(fraction) {
                    at[slot] = (fraction * PARTS) as u8;
                }
                return;
            }
            if here.more == NONE {
                let fresh = self.free.pop().unwrap_or_else(|| {
                    make_room(&mut self.bins, 1);
                    self.bins.push(Bin::EMPTY);
                    self.bins.len() as u32 - 1
                });
                self.bins[bin].more = fresh;
            }
            bin = self.bins[bin].more as usize;
        }
    }

    /// Takes a ball whose list centre is at `centre` out of its bin.
    #[inline(always)]
    pub fn remove<L: Lanes>(&mut self, lanes: L, ball: usize, centre: Spot) {
        let (coordinate, _) = self.grid(ball).locate(centre);
        let mut before = NONE;
        let mut bin = self.grid(ball).bin(coordinate) as u32;
        while bin != NONE {
            let here = &mut self.bins[bin as usize];
            let found = lanes.matches(&here.balls, ball as u32);
            if found != 0 {
                here.balls[found.trailing_zeros() as usize % SLOTS] = NONE;
                if before != NONE && here.balls == [NONE; SLOTS] {
                    self.bins[before as usize].more = here.more;
                    self.bins[bin as usize] = Bin::EMPTY;
                    self.free.push(bin);
                }
                return;
            }
            before = bin;
            bin = here.more;
        }
    }

    /// Fetches the bins at and beside that of a point.
    pub fn prefetch(&self, ball: usize, point: Spot) {
        let grid = self.grid(ball);
        let ([x, y, z], _) = grid.locate(point);
        for z in z - 1..=z + 1 {
            for y in y - 1..=y + 1 {
                for x in x - 1..=x + 1 {
                    prefetch(&self.bins, grid.bin([x, y, z]));
                }
            }
        }
    }

    /// Adds to `found` every ball whose sphere may touch the sphere of radius `sphere` (m) around `centre`.
    #[inline(always)]
    pub fn near<L: Lanes>(&self, lanes: L, centre: Spot, sphere: f64, found: &mut Gathered) {
        for grid in &self.grids {
            self.near_in(lanes, grid, centre, sphere, found);
        }
    }

    #[inline(always)]
    fn near_in<L: Lanes>(&self, lanes: L, grid: &Grid, centre: Spot, sphere: f64, found: &mut Gathered) {
        let (own, fraction) = grid.locate(centre);
        let reach = (sphere + grid.largest) * (1.0 + BIN_MARGIN);
        // In parts; a centre is up to half a part from the middle of its own along each axis.
        let within = (reach / grid.widest + BIN_MARGIN) as f32 * PARTS + 0.5 * 3f32.sqrt();
        let within = within * within;
        // From which to which bin, counted from the own one.
        let steps =
            [grid.steps(0, fraction[0], reach), grid.steps(1, fraction[1], reach), grid.steps(2, fraction[2], reach)];
        for z in steps[2].0..=steps[2].1 {
            let plane = grid.closed(2, own[2] + z) * grid.count[1] as usize;
            let from_z = fraction[2] - z as f32 * grid.scale[2];
            for y in steps[1].0..=steps[1].1 {
                let row = grid.first + (plane + grid.closed(1, own[1] + y)) * grid.count[0] as usize;
                let from_y = fraction[1] - y as f32 * grid.scale[1];
                for x in steps[0].0..=steps[0].1 {
                    let from_x = fraction[0] - x as f32 * grid.scale[0];
                    let from = [from_x * PARTS - 0.5, from_y * PARTS - 0.5, from_z * PARTS - 0.5];
                    let mut bin = &self.bins[row + grid.closed(0, own[0] + x)];
                    loop {
                        let hits = lanes.within(&bin.at, from, within) & !lanes.matches(&bin.balls, NONE);
                        found.make_room(MOST);
                        found.add(&lanes.compressed(&bin.balls, hits), hits.count_ones() as usize);
                        if bin.more == NONE {
                            break;
                        }
                        bin = &self.bins[bin.more as usize];
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bins.capacity() * size_of::<Bin>() + self.grid_of.len()
    }
}

impl Grid {
    fn new<I: Iterator<Item = f64>>(
        domain: &Domain,
        rings: &Rings,
        spheres: impl Fn() -> I,
        of_all: f64,
        extent: [f64; 3],
        first: usize,
    ) -> Self {
        let largest = spheres().fold(0.0, f64::max);
        let reach = 2.0 * largest * (1.0 + BIN_MARGIN);
        let length = rings.length().to_array();
        // There is no extent to divide, either, where one ball could be met twice on a ring that is none in space.
        let flat: [bool; 3] = std::array::from_fn(|axis| {
            let open = domain.boundary[axis] == Boundary::Open;
            !(extent[axis] > 0.0) || (open && extent[axis] < Bins::least_ring(of_all))
        });
        let most = (spheres().count() * BINS_PER_BALL).max(FEWEST_BINS);
        let mut width = reach;
        let count = loop {
            let count: [i32; 3] = std::array::from_fn(|axis| {
                if flat[axis] {
                    return 1;
                }
                let (most_bins, fewer) = (length[axis] / width, length[axis] / (WIDER * width));
                most_bins.floor().min(fewer.ceil()).clamp(1.0, most as f64) as i32
            });
            if count.iter().map(|&n| n as usize).product::<usize>() <= most {
                break count;
            }
            width *= 1.0625;
        };
        let width = std::array::from_fn(|axis| if flat[axis] { reach } else { length[axis] / f64::from(count[axis]) });
        let widest = width.into_iter().fold(0.0, f64::max);
        Self { width, scale: width.map(|width| (width / widest) as f32), widest, count, flat, first, largest }
    }

    /// The bin of a point, and where in it, in widths of the widest.
    #[inline(always)]
    fn locate(&self, point: Spot) -> ([i32; 3], [f32; 3]) {
        let mut coordinate = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            if !self.flat[axis] {
                let bins = u64::from(point.from_beginning(axis)) * self.count[axis] as u64;
                coordinate[axis] = (bins >> 32) as i32;
                fraction[axis] = bins as u32 as f32 * (1.0 / (1u64 << 32) as f32) * self.scale[axis];
            }
        }
        (coordinate, fraction)
    }

    /// The steps from a bin to the first and the last one within reach (m) along an axis.
    #[inline(always)]
    fn steps(&self, axis: usize, fraction: f32, reach: f64) -> (i32, i32) {
        if self.flat[axis] {
            return (0, 0);
        }
        // Without a look at where in its bin it is: whether that spares one is hard to foresee, and costs a processor more than a bin.
        if reach <= self.width[axis] {
            return (-1, 1);
        }
        let place = f64::from(fraction) * self.widest / self.width[axis];
        let bins = reach / self.width[axis] + BIN_MARGIN;
        ((place - bins).floor() as i32, (place + bins).floor() as i32)
    }

    #[inline(always)]
    fn bin(&self, [x, y, z]: [i32; 3]) -> usize {
        let row = self.closed(2, z) * self.count[1] as usize + self.closed(1, y);
        self.first + row * self.count[0] as usize + self.closed(0, x)
    }

    /// The coordinate of a bin in a row that closes on itself.
    #[inline(always)]
    fn closed(&self, axis: usize, coordinate: i32) -> usize {
        let count = self.count[axis];
        // Without a branch: which bins are at an end is as good as random.
        let once_round = coordinate + (count & coordinate >> 31) - (count & (count - 1 - coordinate) >> 31);
        // Small bins may be more than once round.
        (if (0..count).contains(&once_round) { once_round } else { coordinate.rem_euclid(count) }) as usize
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::predict::Periods;
    use crate::predict::lanes::{Width, Work};
    use crate::random::Random;

    struct Near<'a> {
        bins: &'a Bins,
        centre: Spot,
        sphere: f64,
        found: &'a mut Gathered,
    }

    /// Puts balls in, after taking them out of where they were.
    struct Moves<'a> {
        bins: &'a mut Bins,
        moves: &'a [(usize, Option<Spot>, Spot)],
    }

    impl Work for Moves<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) {
            for &(ball, from, to) in self.moves {
                if let Some(from) = from {
                    self.bins.remove(lanes, ball, from);
                }
                self.bins.insert(lanes, ball, to);
            }
        }
    }

    impl Work for Near<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) {
            self.bins.near(lanes, self.centre, self.sphere, self.found);
        }
    }

    /// Whoever's sphere touches is found, and nobody who is a fiftieth farther, wherever they are: in crowded bins, at walls and
    /// beyond, in a plane, after others have left. (Half a part of a bin along its diagonal is 1/150 of the least reach here.)
    #[test]
    fn whoever_touches_is_found() {
        let mut random = Random::new(7, 0);
        for (boundary, low, high, depth, spread) in [
            (Boundary::Periodic, -6.0, 6.0, 1.0, 1.0),
            (Boundary::Walls, -6.5, 6.5, 1.0, 1.0),
            (Boundary::Open, -9.0, 9.0, 1.0, 1.0),
            (Boundary::Periodic, -6.0, 6.0, 1.0, 4.0),
            (Boundary::Open, -9.0, 9.0, 0.0, 1.0),
        ] {
            let domain = Domain { boundary: [boundary; 3], size: DVec3::splat(12.0) };
            let spheres: Vec<f64> = (0..600).map(|_| 0.3 * f64::powf(spread, random.uniform())).collect();
            let mut point = |crowded: bool| {
                let at = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * (high - low) + low;
                let at = at * DVec3::new(1.0, 1.0, depth);
                if crowded { at * 0.1 } else { at }
            };
            let mut centres: Vec<DVec3> = (0..600).map(|k| point(k % 3 == 0)).collect();
            let (low, high) = (DVec3::new(low, low, low * depth), DVec3::new(high, high, high * depth));
            let largest = spheres.iter().copied().fold(0.0, f64::max);
            let rings = Rings::new(&domain, [low, high], 0.0, Bins::least_ring(largest), f64::INFINITY);
            let mut bins = Bins::new(&domain, &rings, &spheres, (high - low).to_array());
            let width = Width::at_most(8);
            let moves: Vec<_> = (0..600).map(|ball| (ball, None, rings.spot(centres[ball]))).collect();
            width.run(Moves { bins: &mut bins, moves: &moves });
            for ball in 0..300 {
                let before = rings.spot(centres[ball]);
                // Some of them so that they just touch somebody, along an axis.
                let other = ball + 300;
                let just = (spheres[ball] + spheres[other]) * (1.0 - 1e-6);
                let axis = DVec3::AXES[ball % if depth > 0.0 { 3 } else { 2 }];
                let aside = axis * if ball % 4 == 0 { just } else { -just };
                centres[ball] = if ball % 5 == 0 { point(ball % 3 == 1) } else { centres[other] + aside };
                let moves = [(ball, Some(before), rings.spot(centres[ball]))];
                Width::at_most([2, 4, 8][ball % 3]).run(Moves { bins: &mut bins, moves: &moves });
            }
            let periods = Periods::of(&domain);
            let mut found = Gathered::default();
            for width in [2, 4, 8].map(Width::at_most) {
                for ball in 0..600 {
                    found.clear();
                    let (centre, sphere) = (rings.spot(centres[ball]), spheres[ball]);
                    width.run(Near { bins: &bins, centre, sphere, found: &mut found });
                    assert!(found.rows().iter().all(|&row| row < 600));
                    for other in 0..600 {
                        let times = found.rows().iter().filter(|&&row| row as usize == other).count();
                        let apart = periods.nearest(centres[ball] - centres[other]).length();
                        let touches = apart < sphere + spheres[other];
                        assert!(times == 1 || !touches, "{boundary:?} {ball} {other}: {times} {apart}");
                        // What is near the short way round may be found, whether space closes there or not.
                        let apart = rings.apart(centre, rings.spot(centres[other])).length();
                        let far = apart > 1.02 * (sphere + 0.3 * spread);
                        assert!(times == 0 || !far, "{boundary:?} {ball} {other}: {apart}");
                        assert!(times <= 1);
                    }
                }
            }
        }
    }
}
