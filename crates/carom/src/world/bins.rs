//! Where the centres of neighbour lists are: grids of bins, one grid for each class of sizes, each bin wide enough that
//! whatever is within reach is in the bins beside.
//!
//! A bin is one line of the cache. It holds its centres side by side, each to a 256th of a bin, so that eight are compared at
//! once; what passes, with a margin for that, is looked at again in double precision by whoever asked.

use glam::DVec3;

use super::nearby::Gathered;
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
    origin: DVec3,
    width: DVec3,
    /// The same in units of the widest.
    scale: [f32; 3],
    widest: f64,
    count: [i32; 3],
    /// Which axes end, at walls: there are no bins beyond.
    ends: [bool; 3],
    /// Which axes have no extent: distances along them are not counted.
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
    /// Which bin each ball is in.
    bin_of: Vec<u32>,
    /// Which grid each ball is in; empty if there is one grid.
    grid_of: Vec<u8>,
}

impl Bins {
    /// Empty bins for spheres of these radii (m) with centres between `low` and `high` (m) where space is open.
    pub fn new(domain: &Domain, spheres: &[f64], low: DVec3, high: DVec3) -> Self {
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
            let grid = Grid::new(domain, of_level, largest, low, high, bins);
            bins += grid.count.iter().map(|&n| n as usize).product::<usize>();
            grids.push(grid);
        }
        let row_of = |level: u8| used.iter().position(|&l| l == level).unwrap_or(0) as u8;
        Self {
            bins: filled(Bin::EMPTY, bins),
            free: Vec::new(),
            bin_of: vec![NONE; spheres.len()],
            grid_of: if grids.len() > 1 { levels.iter().map(|&level| row_of(level)).collect() } else { Vec::new() },
            grids,
        }
    }

    #[inline(always)]
    fn grid(&self, ball: usize) -> &Grid {
        &self.grids[self.grid_of.get(ball).map_or(0, |&row| usize::from(row))]
    }

    /// Puts a ball whose list centre is at `centre` (m) into its bin.
    #[inline(always)]
    pub fn insert(&mut self, ball: usize, centre: DVec3) {
        let (coordinate, fraction) = self.grid(ball).locate(centre);
        let mut bin = self.grid(ball).bin(coordinate);
        self.bin_of[ball] = bin as u32;
        loop {
            let here = &mut self.bins[bin];
            if let Some(slot) = here.balls.iter().position(|&other| other == NONE) {
                here.balls[slot] = ball as u32;
                for (at, fraction) in here.at.iter_mut().zip(fraction) {
                    // What is beyond a wall is told to be at it: that is no farther from whoever is inside.
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

    /// Takes a ball out of its bin.
    #[inline(always)]
    pub fn remove(&mut self, ball: usize) {
        let mut before = NONE;
        let mut bin = self.bin_of[ball];
        while bin != NONE {
            let here = &mut self.bins[bin as usize];
            if let Some(slot) = here.balls.iter().position(|&other| other == ball as u32) {
                here.balls[slot] = NONE;
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
    pub fn prefetch(&self, ball: usize, point: DVec3) {
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

    /// Adds to `found` every ball whose sphere may touch the sphere of radius `sphere` (m) around `centre` (m).
    #[inline(always)]
    pub fn near<L: Lanes>(&self, lanes: L, centre: DVec3, sphere: f64, found: &mut Gathered) {
        for grid in &self.grids {
            self.near_in(lanes, grid, centre, sphere, found);
        }
    }

    #[inline(always)]
    fn near_in<L: Lanes>(&self, lanes: L, grid: &Grid, centre: DVec3, sphere: f64, found: &mut Gathered) {
        let (own, fraction) = grid.locate(centre);
        let reach = (sphere + grid.largest) * (1.0 + BIN_MARGIN);
        // In parts; a centre is up to half a part from the middle of its own along each axis.
        let within = (reach / grid.widest + BIN_MARGIN) as f32 * PARTS + 0.5 * 3f32.sqrt();
        let within = within * within;
        // From which to which bin, counted from the own one.
        let steps = [
            grid.steps(0, own[0], fraction[0], reach),
            grid.steps(1, own[1], fraction[1], reach),
            grid.steps(2, own[2], fraction[2], reach),
        ];
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
        self.bins.capacity() * size_of::<Bin>() + self.bin_of.len() * 4 + self.grid_of.len()
    }
}

impl Grid {
    fn new<I: Iterator<Item = f64>>(
        domain: &Domain,
        spheres: impl Fn() -> I,
        of_all: f64,
        low: DVec3,
        high: DVec3,
        first: usize,
    ) -> Self {
        let largest = spheres().fold(0.0, f64::max);
        let reach = 2.0 * largest * (1.0 + BIN_MARGIN);
        let (mut origin, mut extent) = (DVec3::ZERO, DVec3::ZERO);
        for axis in 0..3 {
            let open = domain.boundary[axis] == Boundary::Open;
            origin[axis] = if open { low[axis] } else { -0.5 * domain.size[axis] };
            extent[axis] = if open { high[axis] - low[axis] } else { domain.size[axis] };
        }
        // Nor is there where one ball could be met twice in a row that closes on itself, though space does not.
        let twice = 2.0 * (of_all + largest) * (1.0 + BIN_MARGIN) * (1.0 + BIN_MARGIN);
        let flat: [bool; 3] = std::array::from_fn(|axis| {
            let open = domain.boundary[axis] == Boundary::Open;
            !(extent[axis] > 0.0) || high[axis] <= low[axis] || (open && extent[axis] < twice)
        });
        let most = (spheres().count() * BINS_PER_BALL).max(FEWEST_BINS);
        let mut width = reach;
        let count = loop {
            let count: [i32; 3] = std::array::from_fn(|axis| {
                if flat[axis] { 1 } else { (extent[axis] / width).floor().clamp(1.0, most as f64) as i32 }
            });
            if count.iter().map(|&n| n as usize).product::<usize>() <= most {
                break count;
            }
            width *= 1.0625;
        };
        let width = DVec3::from_array(std::array::from_fn(|axis| {
            if flat[axis] { reach } else { (extent[axis] / f64::from(count[axis])).max(f64::MIN_POSITIVE) }
        }));
        let widest = width.max_element();
        Self {
            origin,
            width,
            scale: (width / widest).to_array().map(|x| x as f32),
            widest,
            count,
            ends: std::array::from_fn(|axis| domain.boundary[axis] == Boundary::Walls),
            flat,
            first,
            largest,
        }
    }

    /// The bin of a point, counted on beyond the ends, and where in it.
    #[inline(always)]
    fn locate(&self, point: DVec3) -> ([i32; 3], [f32; 3]) {
        let mut coordinate = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            if !self.flat[axis] {
                let bins = (point[axis] - self.origin[axis]) / self.width[axis];
                let mut whole = bins.floor();
                if self.ends[axis] {
                    // A ball in prescribed motion may be beyond a wall: it is the last bin's, and its fraction beyond it.
                    whole = whole.clamp(0.0, f64::from(self.count[axis] - 1));
                }
                // By way of 64 bits, so that far out in open space the numbers close on themselves.
                coordinate[axis] = whole as i64 as i32;
                fraction[axis] = (bins - whole) as f32 * self.scale[axis];
            }
        }
        (coordinate, fraction)
    }

    /// The steps from a bin to the first and the last one within reach (m) along an axis.
    #[inline(always)]
    fn steps(&self, axis: usize, own: i32, fraction: f32, reach: f64) -> (i32, i32) {
        if self.flat[axis] {
            return (0, 0);
        }
        let place = f64::from(fraction) * self.widest / self.width[axis];
        let bins = reach / self.width[axis] + BIN_MARGIN;
        let (low, high) = ((place - bins).floor() as i32, (place + bins).floor() as i32);
        if self.ends[axis] {
            return (low.max(-own), high.min(self.count[axis] - 1 - own));
        }
        (low, high)
    }

    #[inline(always)]
    fn bin(&self, [x, y, z]: [i32; 3]) -> usize {
        let row = self.closed(2, z) * self.count[1] as usize + self.closed(1, y);
        self.first + row * self.count[0] as usize + self.closed(0, x)
    }

    /// The coordinate of a bin in a row that closes on itself or ends.
    #[inline(always)]
    fn closed(&self, axis: usize, coordinate: i32) -> usize {
        let count = self.count[axis];
        if (0..count).contains(&coordinate) {
            coordinate as usize
        } else if self.ends[axis] {
            coordinate.clamp(0, count - 1) as usize
        } else if (-count..0).contains(&coordinate) {
            (coordinate + count) as usize
        } else {
            coordinate.rem_euclid(count) as usize
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::predict::Periods;
    use crate::predict::lanes::{Width, Work};
    use crate::random::Random;

    struct Near<'a> {
        bins: &'a Bins,
        centre: DVec3,
        sphere: f64,
        found: &'a mut Gathered,
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
            let mut bins =
                Bins::new(&domain, &spheres, DVec3::new(low, low, low * depth), DVec3::new(high, high, high * depth));
            (0..600).for_each(|ball| bins.insert(ball, centres[ball]));
            for ball in 0..300 {
                bins.remove(ball);
                // Some of them so that they just touch somebody, along an axis.
                let other = ball + 300;
                let just = (spheres[ball] + spheres[other]) * (1.0 - 1e-6);
                let axis = DVec3::AXES[ball % if depth > 0.0 { 3 } else { 2 }];
                let aside = axis * if ball % 4 == 0 { just } else { -just };
                centres[ball] = if ball % 5 == 0 { point(ball % 3 == 1) } else { centres[other] + aside };
                bins.insert(ball, centres[ball]);
            }
            let periods = Periods::of(&domain);
            let mut found = Gathered::default();
            for width in [2, 4, 8].map(Width::at_most) {
                for ball in 0..600 {
                    found.clear();
                    let (centre, sphere) = (centres[ball], spheres[ball]);
                    width.run(Near { bins: &bins, centre, sphere, found: &mut found });
                    assert!(found.rows().iter().all(|&row| row < 600));
                    for other in 0..600 {
                        let inside = boundary != Boundary::Walls
                            || [ball, other].iter().any(|&k| centres[k].abs().max_element() < 6.0);
                        let apart = periods.nearest(centre - centres[other]).length();
                        let times = found.rows().iter().filter(|&&row| row as usize == other).count();
                        let touches = apart < sphere + spheres[other];
                        assert!(times == 1 || !touches || !inside, "{boundary:?} {ball} {other}: {times} {apart}");
                        let far = apart > 1.02 * (sphere + 0.3 * spread);
                        assert!(
                            times == 0 || !far || centres[other].abs().max_element() > 6.0,
                            "{boundary:?} {ball} {other}: {apart}"
                        );
                        assert!(times <= 1);
                    }
                }
            }
        }
    }
}
