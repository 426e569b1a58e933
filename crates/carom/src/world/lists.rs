//! Neighbour lists: each ball knows whom it can touch while it stays within a sphere around the point where its list was
//! made, and they within theirs. It looks around again only when it leaves that sphere.
//!
//! Two balls whose list centres are farther apart than the sum of their radii and of both spheres' radii cannot touch. Lists
//! are symmetric, so that a ball that looks around again writes itself into its neighbours' lists and nobody else has to look.
//! (Donev, Torquato and Stillinger 2005, with one sphere for all.)

use glam::DVec3;

use super::bins::Bins;
use super::nearby::{Gathered, PlaneSet};
use super::rings::{Rings, Spot};
use super::{Boundary, World};
use crate::frugal::make_room;
use crate::predict::lanes::{Lanes, MOST, Width, Work};
use crate::prefetch::prefetch;
use crate::time::Time;
use crate::tolerance::CELL_MARGIN;

/// Lists are as wide as to hold about so many: two vectors of eight, with room for the crowded.
const NEIGHBOURS: f64 = 13.5;
/// Where balls fill less than this part of space, or of a plane, cells are cheaper. (For equal balls, where both cost the same: 0.37
/// for a thousand and for a hundred thousand, 0.38 for ten thousand.)
const LEAST_PACKING: f64 = 0.37;
const LEAST_PACKING_IN_A_PLANE: f64 = 0.4;
/// So they are where fewer than so many centres would be within a contact distance of balls of middle size from a point: many
/// small ones among a few large.
const LEAST_CROWDED: f64 = 1.6;
/// So few balls are all in each other's way.
const FEWEST: usize = 64;
/// Neighbours may be this part of a periodic box apart (pure number): less than half of it, so that one image is the nearest.
pub const HALF_BOX: f64 = 0.49;
/// Places of a line of a list.
const LINE: usize = 2 * MOST;

/// A list centre is told at least so exactly: to this part of how far a ball goes from it.
const CENTRE_PRECISION: f64 = 1.0 / 16.0;

/// Where a ball's list was made, and how much is on it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Shell {
    centre: Spot,
    fill: Fill,
}

/// A list, in one line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([u32; LINE]);

/// A length and, in the highest bits, the room as a class: k for 2^k lines.
#[derive(Clone, Copy, Debug)]
struct Fill(u32);

impl Fill {
    const LEN_BITS: u32 = 27;
    const NONE: Self = Self(0);

    #[inline(always)]
    fn new(len: usize, class: u32) -> Self {
        Self(class << Self::LEN_BITS | len as u32)
    }

    #[inline(always)]
    fn len(self) -> usize {
        (self.0 & ((1 << Self::LEN_BITS) - 1)) as usize
    }

    #[inline(always)]
    fn class(self) -> u32 {
        self.0 >> Self::LEN_BITS
    }

    /// Whether it is among the long ones.
    #[inline(always)]
    fn is_long(self) -> bool {
        self.class() > 0
    }

    /// Lines there is room for.
    #[inline(always)]
    fn lines(self) -> usize {
        1 << self.class()
    }
}

/// All lists.
#[derive(Clone, Debug)]
pub struct Lists {
    width: Width,
    /// Where the list centres are.
    bins: Bins,
    rings: Rings,
    /// How far (m) a ball goes from the centre at most.
    displacement: f64,
    /// How far (m) it goes before it looks around again: that, less what its centre may be off by.
    free_way: f64,
    shells: Vec<Shell>,
    /// The lists, each in a line of its own; what is left of it holds the ball itself. Of a longer list the first place tells where
    /// among `long` it is.
    lines: Vec<Line>,
    long: Vec<[u32; LINE]>,
    /// First of lines given back, by their class.
    free: Vec<Vec<u32>>,
    planes: Vec<PlaneSet>,
    /// For each body, whoever is near if one of the two turns; empty where nobody does. Not on the lists above.
    beside: Vec<Vec<u32>>,
    /// Room to work in: whoever may be near a ball, and who of them was not before.
    found: Gathered,
    fresh: Vec<u32>,
}

impl Lists {
    /// Lists for the bodies where they are at `now`; `None` where cells serve better. Bodies that turn always have lists.
    pub fn new(world: &World, now: Time, width: Width) -> Option<Self> {
        let turning = world.turning.is_some();
        if !turning && (world.growth.is_some() || world.len() < FEWEST) {
            return None;
        }
        let [least, most] = displacements(world);
        let mut displacement = displacement(world, now, turning)?;
        if displacement > most || displacement < least {
            if !turning {
                return None;
            }
            displacement = displacement.max(least).min(most);
        }
        let spheres: Vec<f64> = world.radii.iter().map(|radius| radius + displacement * (1.0 + CELL_MARGIN)).collect();
        let (low, high) = world.extent(now);
        // Across a gap of this length between two walls nobody is near anybody.
        let gap = 4.0 * displacement * (1.0 + CELL_MARGIN);
        let least_ring = Bins::least_ring(spheres.iter().copied().fold(0.0, f64::max));
        let most_ring = CENTRE_PRECISION * displacement * Rings::STEPS;
        let rings = Rings::new(&world.domain, [low, high], gap, least_ring, most_ring);
        let mut lists = Self {
            width,
            displacement,
            free_way: displacement - 2.0 * rings.longest_step(),
            shells: vec![Shell { centre: Spot::NONE, fill: Fill::NONE }; world.len()],
            lines: (0..world.len() as u32).map(|ball| Line([ball; LINE])).collect(),
            long: Vec::new(),
            free: Vec::new(),
            planes: if world.planes.is_empty() { Vec::new() } else { vec![PlaneSet::NONE; world.len()] },
            beside: if turning { vec![Vec::new(); world.len()] } else { Vec::new() },
            bins: Bins::new(&world.domain, &rings, &spheres, (high - low).to_array()),
            rings,
            found: Gathered::default(),
            fresh: Vec::new(),
        };
        width.run(FirstLook { lists: &mut lists, world, now });
        Some(lists)
    }

    /// The ball's list, filled up with the ball itself.
    #[inline(always)]
    pub fn row(&self, ball: usize) -> &[u32] {
        let fill = self.shells[ball].fill;
        let line = &self.lines[ball].0;
        // Of almost all it is told at a glance that their list is this line, whole.
        if fill.0 as usize <= LINE {
            if fill.0 as usize > MOST { line } else { &line[..MOST] }
        } else {
            &self.places(ball, fill)[..fill.len().next_multiple_of(MOST)]
        }
    }

    /// All places of a ball's list.
    #[inline(always)]
    fn places(&self, ball: usize, fill: Fill) -> &[u32] {
        let line = &self.lines[ball].0;
        if fill.is_long() { self.long[line[0] as usize..][..fill.lines()].as_flattened() } else { line }
    }

    #[inline(always)]
    fn places_mut(&mut self, ball: usize, fill: Fill) -> &mut [u32] {
        let line = &mut self.lines[ball].0;
        if fill.is_long() { self.long[line[0] as usize..][..fill.lines()].as_flattened_mut() } else { line }
    }

    /// Whoever is near if one of the two turns.
    #[inline(always)]
    pub fn beside(&self, ball: usize) -> &[u32] {
        self.beside.get(ball).map_or(&[], Vec::as_slice)
    }

    /// Fetches where the ball's list is.
    #[inline(always)]
    pub fn prefetch(&self, ball: usize) {
        prefetch(&self.shells, ball);
    }

    /// Fetches the ball's list, or where it is.
    #[inline(always)]
    pub fn prefetch_row(&self, ball: usize) {
        prefetch(&self.lines, ball);
    }

    /// Fetches the flights of those on the ball's list.
    #[inline(always)]
    pub fn prefetch_near(&self, world: &World, ball: usize) {
        let fill = self.shells[ball].fill;
        // Whole lines, of which most lists have one: so nobody has to guess where it ends.
        for line in self.places(ball, fill).as_chunks::<LINE>().0 {
            line.iter().for_each(|&near| prefetch(&world.flights, near as usize));
            if world.radii.one().is_none() {
                line.iter().for_each(|&near| world.radii.prefetch(near as usize));
            }
        }
    }

    /// Fetches what making the ball's list anew at `time` will look through.
    #[inline(never)]
    pub fn prefetch_renewal(&self, world: &World, ball: usize, time: Time) {
        self.bins.prefetch(ball, self.rings.spot(world.position(ball, time)));
        self.row(ball).iter().for_each(|&near| self.prefetch(near as usize));
    }

    fn sphere(&self, world: &World, ball: usize) -> f64 {
        world.radii[ball] + self.displacement * (1.0 + CELL_MARGIN)
    }

    /// The planes within reach.
    #[inline(always)]
    pub fn planes(&self, ball: usize) -> PlaneSet {
        self.planes.get(ball).copied().unwrap_or(PlaneSet::NONE)
    }

    /// Whether it is told at a glance that the ball stays within its sphere until `time`: on a straight way, it does if it is
    /// there then.
    #[inline(always)]
    pub fn stays_until(&self, world: &World, ball: usize, time: Time) -> bool {
        if world.has_gravity() || !time.is_reachable() {
            return false;
        }
        let flight = &world.flights[ball];
        // Now it is, or it would have looked around. (Who has been put back into the box since is not, at a glance.)
        let then = flight.position() + flight.velocity() * time.since(flight.start());
        then.distance_squared(self.rings.position(self.shells[ball].centre)) < self.free_way * self.free_way
    }

    /// From the list's centre to a position of the ball (m), to less than its longest step.
    #[inline(always)]
    fn off_centre(&self, ball: usize, position: DVec3) -> DVec3 {
        self.rings.apart(self.rings.spot(position), self.shells[ball].centre)
    }

    /// When the ball leaves the sphere around its list's centre; under gravity maybe earlier, never later.
    pub fn leaves(&self, world: &World, ball: usize, now: Time) -> Time {
        // From where it is now: of a long flight, the way since its start would leave no digits for the sphere.
        let velocity = world.velocity(ball, now);
        let off_centre = self.off_centre(ball, world.position(ball, now));
        let within = self.free_way * self.free_way - off_centre.length_squared();
        let speed_squared = velocity.length_squared();
        let seconds = if !world.falls(ball) {
            // |d + v t| = D, the free way, in the form that is stable for each sign of d·v.
            let outward = off_centre.dot(velocity);
            let root = (outward * outward + speed_squared * within).max(0.0).sqrt();
            if outward > 0.0 { within / (root + outward) } else { (root - outward) / speed_squared }
        } else {
            // |d| + |v| t + |g| t²/2 = D.
            let (gap, speed) = (self.free_way - off_centre.length(), speed_squared.sqrt());
            2.0 * gap / (speed + (speed_squared + 2.0 * world.gravity.length() * gap).max(0.0).sqrt())
        };
        match (seconds.is_nan(), !world.falls(ball)) {
            // A ball at rest never leaves (0/0), unless it falls from the very rim.
            (true, true) => Time::NEVER,
            (true, false) => now,
            _ => world.clock.after(now, seconds.max(0.0)),
        }
    }

    /// Makes the ball's list anew where the ball is at `now`.
    pub fn renew(&mut self, world: &World, ball: usize, now: Time) {
        self.width.run(Renewal { lists: self, world, ball, now });
    }

    /// Whether the ball's list can be made anew without emptying it before: a list that was crowded once need not be so for ever.
    #[inline(always)]
    fn can_be_mended(&self, ball: usize) -> bool {
        let fill = self.shells[ball].fill;
        fill.len() <= u64::BITS as usize && self.beside.is_empty() && !Self::is_roomy(fill)
    }

    /// Whether a list has at least twice the room that it needs.
    #[inline(always)]
    fn is_roomy(fill: Fill) -> bool {
        fill.lines() > fill.len().div_ceil(LINE).next_power_of_two()
    }

    /// Takes the ball off its neighbours' lists, and empties its own.
    #[inline(always)]
    fn withdraw<L: Lanes>(&mut self, lanes: L, ball: usize) {
        let fill = self.shells[ball].fill;
        for place in 0..fill.len() {
            let other = self.places(ball, fill)[place];
            self.remove(lanes, other as usize, ball as u32);
        }
        if !self.beside.is_empty() {
            let mut others = std::mem::take(&mut self.beside[ball]);
            for &other in &others {
                self.beside[other as usize].retain(|&known| known as usize != ball);
            }
            others.clear();
            self.beside[ball] = others;
        }
        let mut empty = Fill::new(0, fill.class());
        if Self::is_roomy(fill) {
            self.give_back(self.lines[ball].0[0], fill.class());
            empty = Fill::NONE;
        }
        if !empty.is_long() {
            self.lines[ball] = Line([ball as u32; LINE]);
        }
        self.shells[ball].fill = empty;
    }

    /// Finds those within reach, and puts them on the ball's list; `mutual`: and the ball on theirs, and takes off those who are no
    /// longer.
    #[inline(always)]
    fn look_around<L: Lanes>(&mut self, lanes: L, world: &World, ball: usize, position: DVec3, mutual: bool) {
        let centre = self.shells[ball].centre;
        let (radius, reach) = (world.radii[ball], 2.0 * self.displacement * (1.0 + CELL_MARGIN));
        let fixed = world.is_fixed(ball);
        let (mut found, mut fresh) = (std::mem::take(&mut self.found), std::mem::take(&mut self.fresh));
        found.clear();
        fresh.clear();
        // Places of those who stay, as bits.
        let mut kept = 0u64;
        self.bins.near(lanes, centre, self.sphere(world, ball), &mut found);
        // All at once before one after the other.
        for &other in found.rows() {
            self.prefetch(other as usize);
            prefetch(&world.flights, other as usize);
        }
        for &other in found.rows() {
            let apart = self.rings.apart(centre, self.shells[other as usize].centre);
            let within = radius + world.radii[other as usize] + reach;
            if apart.length_squared() >= within * within || other as usize == ball {
                continue;
            }
            // Two bodies in prescribed motion pass through each other.
            if fixed && world.is_fixed(other as usize) {
                continue;
            }
            if !self.beside.is_empty()
                && (world.turning_body(ball).is_some() || world.turning_body(other as usize).is_some())
            {
                self.beside[ball].push(other);
                if mutual {
                    self.beside[other as usize].push(ball as u32);
                }
                continue;
            }
            match self.place_of(lanes, ball, other) {
                Some(place) => kept |= 1 << place,
                None => fresh.push(other),
            }
        }
        self.remove_all_but(lanes, ball, kept);
        for &other in &fresh {
            self.add(ball, other);
            if mutual {
                self.add(other as usize, ball as u32);
            }
        }
        (self.found, self.fresh) = (found, fresh);
        if !self.planes.is_empty() {
            let around = self.displacement * (1.0 + CELL_MARGIN) + self.rings.longest_step();
            self.planes[ball] = PlaneSet::near(world, radius, position, position, around);
        }
    }

    #[inline(always)]
    fn add(&mut self, ball: usize, other: u32) {
        let fill = self.shells[ball].fill;
        let len = fill.len();
        if len == fill.lines() * LINE {
            self.enlarge(ball);
        }
        let fill = self.shells[ball].fill;
        let places = self.places_mut(ball, fill);
        if len.is_multiple_of(LINE) {
            places[len..len + LINE].fill(ball as u32);
        }
        places[len] = other;
        self.shells[ball].fill = Fill::new(len + 1, fill.class());
    }

    #[inline(always)]
    fn place_of<L: Lanes>(&self, lanes: L, ball: usize, other: u32) -> Option<usize> {
        let fill = self.shells[ball].fill;
        let (lines, _) = self.places(ball, fill).as_chunks::<LINE>();
        for (row, line) in lines[..fill.len().div_ceil(LINE)].iter().enumerate() {
            let (halves, _) = line.as_chunks::<MOST>();
            let hits = lanes.matches(&halves[0], other) | lanes.matches(&halves[1], other) << MOST;
            if hits != 0 {
                return Some(row * LINE + hits.trailing_zeros() as usize);
            }
        }
        None
    }

    /// Takes whoever is not at one of the places that are `kept` off the ball's list, and the ball off his.
    #[inline(always)]
    fn remove_all_but<L: Lanes>(&mut self, lanes: L, ball: usize, kept: u64) {
        let fill = self.shells[ball].fill;
        let mut leaving = !kept & low_bits(fill.len());
        while leaving != 0 {
            // The last first: what moves into its place is one that stays, or is past.
            let place = leaving.ilog2() as usize;
            let other = self.places(ball, self.shells[ball].fill)[place];
            self.remove(lanes, other as usize, ball as u32);
            self.remove_at(ball, place);
            leaving &= low_bits(place);
        }
    }

    #[inline(always)]
    fn remove<L: Lanes>(&mut self, lanes: L, ball: usize, other: u32) {
        if let Some(place) = self.place_of(lanes, ball, other) {
            self.remove_at(ball, place);
        }
    }

    /// Puts the last of the list into the place of one that is taken off.
    #[inline(always)]
    fn remove_at(&mut self, ball: usize, place: usize) {
        let fill = self.shells[ball].fill;
        let last = fill.len() - 1;
        self.shells[ball].fill = Fill::new(last, fill.class());
        let places = self.places_mut(ball, fill);
        places[place] = places[last];
        places[last] = ball as u32;
    }

    /// Moves a full list to where there is twice the room.
    #[cold]
    fn enlarge(&mut self, ball: usize) {
        let fill = self.shells[ball].fill;
        let larger = Fill::new(fill.len(), fill.class() + 1);
        let kept = self.free.get_mut(larger.class() as usize).and_then(Vec::pop);
        let fresh = kept.unwrap_or_else(|| {
            let fresh = self.long.len() as u32;
            make_room(&mut self.long, larger.lines());
            self.long.resize(self.long.len() + larger.lines(), [0; LINE]);
            fresh
        });
        if fill.is_long() {
            let start = self.lines[ball].0[0];
            self.long.copy_within(start as usize..start as usize + fill.lines(), fresh as usize);
            self.give_back(start, fill.class());
        } else {
            self.long[fresh as usize] = self.lines[ball].0;
        }
        self.lines[ball].0[0] = fresh;
        self.shells[ball].fill = larger;
    }

    #[cold]
    fn give_back(&mut self, start: u32, class: u32) {
        if self.free.len() <= class as usize {
            self.free.resize(class as usize + 1, Vec::new());
        }
        self.free[class as usize].push(start);
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bins.bytes()
            + self.shells.len() * size_of::<Shell>()
            + self.lines.capacity() * size_of::<Line>()
            + self.long.capacity() * size_of::<[u32; LINE]>()
            + self.planes.len()
            + self.beside.iter().map(|others| size_of::<Vec<u32>>() + 4 * others.capacity()).sum::<usize>()
    }
}

/// The lowest bits, so many of at most 64.
#[inline(always)]
fn low_bits(count: usize) -> u64 {
    if count < u64::BITS as usize { (1 << count) - 1 } else { u64::MAX }
}

/// The first list of everybody.
struct FirstLook<'a> {
    lists: &'a mut Lists,
    world: &'a World,
    now: Time,
}

impl Work for FirstLook<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { lists, world, now } = self;
        for ball in 0..world.len() {
            let centre = lists.rings.spot(world.position(ball, now));
            lists.shells[ball].centre = centre;
            lists.bins.insert(lanes, ball, centre);
        }
        for ball in 0..world.len() {
            lists.look_around(lanes, world, ball, world.position(ball, now), false);
        }
    }
}

/// [`Lists::renew`].
struct Renewal<'a> {
    lists: &'a mut Lists,
    world: &'a World,
    ball: usize,
    now: Time,
}

impl Work for Renewal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { lists, world, ball, now } = self;
        if !lists.can_be_mended(ball) {
            lists.withdraw(lanes, ball);
        }
        let position = world.position(ball, now);
        let centre = lists.rings.spot(position);
        let old = std::mem::replace(&mut lists.shells[ball].centre, centre);
        lists.bins.remove(lanes, ball, old);
        lists.bins.insert(lanes, ball, centre);
        lists.look_around(lanes, world, ball, position, true);
    }
}

/// The least and the most (m) that balls can be let go from the centres of their lists in a periodic box: so that those are told
/// exactly enough, and that neighbours are less than half the box apart, where near images are unique.
fn displacements(world: &World) -> [f64; 2] {
    let largest = world.largest_radii().iter().sum::<f64>();
    let (mut least, mut most) = (0f64, f64::INFINITY);
    for axis in (0..3).filter(|&axis| world.domain.boundary[axis] == Boundary::Periodic) {
        least = least.max(world.domain.size[axis] / Rings::STEPS / CENTRE_PRECISION);
        most = most.min((HALF_BOX * world.domain.size[axis] - largest) / (4.0 * (1.0 + CELL_MARGIN)));
    }
    [least, most]
}

/// Whether a periodic box is too long beside its narrowest side for lists.
pub fn is_too_long(world: &World) -> bool {
    let [least, most] = displacements(world);
    most < least
}

/// The displacement (m) with which a ball of middle size has about [`NEIGHBOURS`] on its list; `None` where lists do not pay,
/// unless they are `needed`.
fn displacement(world: &World, now: Time, needed: bool) -> Option<f64> {
    let (low, high) = world.extent(now);
    let mut volume = 1.0;
    let mut axes = 0;
    for axis in 0..3 {
        let size = if world.domain.boundary[axis] == Boundary::Open {
            high[axis] - low[axis]
        } else {
            world.domain.size[axis]
        };
        if size > 0.0 && !(world.dimensions == 2 && axis == 2) {
            volume *= size;
            axes += 1;
        }
    }
    let count = world.len() as f64;
    let ball = |radius: f64| match axes {
        3 => 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius,
        2 => std::f64::consts::PI * radius * radius,
        _ => 2.0 * radius,
    };
    let mean = world.radii.iter().sum::<f64>() / count;
    let packing = world.radii.iter().map(ball).sum::<f64>() / volume;
    let least_packing = if axes == 3 { LEAST_PACKING } else { LEAST_PACKING_IN_A_PLANE };
    let crowded = ball(2.0 * mean) * count / volume;
    if !needed && (axes < 2 || packing < least_packing || crowded < LEAST_CROWDED) {
        return None;
    }
    if axes < 2 {
        return Some(mean);
    }
    let within = (NEIGHBOURS + 1.0) * volume / count;
    let reach = if axes == 3 { (within / ball(1.0)).cbrt() } else { (within / ball(1.0)).sqrt() };
    Some((0.5 * reach - mean).max(0.05 * mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Flight;
    use crate::predict::lanes::Width;
    use crate::random::Random;
    use crate::scene::{Fill, Placement, RadiusDistribution, Scene};
    use crate::world::Domain;

    const COUNT: u64 = 400;
    const SIDE: f64 = 8.0;

    fn lattice(boundary: Boundary) -> World {
        let fill = Fill {
            first_id: 0,
            placement: Placement::Fcc,
            count: Some(COUNT),
            packing: None,
            radius: RadiusDistribution::Constant(0.49),
            mass: Some(1.0),
            density: None,
            temperature: 0.0,
            velocity: DVec3::ZERO,
            center: None,
            size: None,
            material: 0,
        };
        let domain = Domain { boundary: [boundary; 3], size: DVec3::splat(SIDE) };
        Scene { domain, fills: vec![fill], ..Scene::default() }.build().expect("a scene").0
    }

    /// Who is on a ball's list, sorted, and who should be.
    fn listed_and_near(lists: &Lists, world: &World, ball: usize) -> (Vec<u32>, Vec<u32>) {
        let mut listed = lists.row(ball)[..lists.shells[ball].fill.len()].to_vec();
        listed.sort_unstable();
        let is_near = |other: usize| {
            let apart = lists.rings.apart(lists.shells[ball].centre, lists.shells[other].centre).length();
            other != ball && apart < world.radii[ball] + world.radii[other] + 2.0 * lists.displacement
        };
        (listed, (0..world.len()).filter(|&other| is_near(other)).map(|other| other as u32).collect())
    }

    /// Whoever looks around again, a little way off or elsewhere: after that all who are near are on each other's lists, once, and
    /// nobody else; in crowds, too, that gather in one place and go again, and whoever is no longer near has forgotten.
    #[test]
    fn lists_made_anew_hold_whoever_is_near() {
        for boundary in [Boundary::Periodic, Boundary::Walls] {
            for width in [2, 4, 8].map(Width::at_most) {
                let mut world = lattice(boundary);
                let now = world.start;
                let mut lists = Lists::new(&world, now, width).expect("dense enough");
                let mut random = Random::new(5, 0);
                let mut longest = 0;
                for step in 0..6000 {
                    let ball = (random.uniform() * COUNT as f64) as usize;
                    let anywhere = DVec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5;
                    // Together in the second third, apart again in the last.
                    let position = match step * 3 / 6000 {
                        _ if step % 2 == 0 => {
                            lists.rings.position(lists.shells[ball].centre) + anywhere * lists.displacement
                        }
                        1 => anywhere * 0.8,
                        _ => anywhere * SIDE,
                    };
                    world.flights[ball] = Flight::new(position, DVec3::ZERO, now);
                    lists.renew(&world, ball, now);
                    longest = longest.max(lists.shells[ball].fill.len());
                    let (listed, near) = listed_and_near(&lists, &world, ball);
                    assert_eq!(listed, near, "{boundary:?} {step} {ball}");
                    if step % 500 == 0 {
                        for ball in 0..world.len() {
                            let (listed, near) = listed_and_near(&lists, &world, ball);
                            assert_eq!(listed, near, "{boundary:?} {step} {ball}");
                            let rest = &lists.row(ball)[listed.len()..];
                            assert!(
                                rest.iter().all(|&row| row as usize == ball),
                                "{boundary:?} {step} {ball}: {rest:?}"
                            );
                        }
                    }
                }
                assert!(longest > u64::BITS as usize, "{longest}");
                // Room that was needed in the crowd is given back by those who have looked around since.
                (0..2 * world.len()).for_each(|k| lists.renew(&world, k % COUNT as usize, now));
                // (Since then, others may have left a list.)
                for shell in &lists.shells {
                    let (room, needed) = (shell.fill.lines(), shell.fill.len().div_ceil(LINE).next_power_of_two());
                    assert!(room <= 2 * needed, "{room} lines for {}", shell.fill.len());
                }
            }
        }
    }
}
