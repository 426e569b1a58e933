//! Balls that leave their cells are moved all at once, every so often, in the order of memory. Until then they may be a
//! little way outside: cells are so much wider than balls that nobody is overlooked.
//!
//! Two balls whose cells, on the level of the larger, are not side by side are farther apart than such a cell's width less twice
//! that little way. Whoever would get farther out before the next sweep is moved, and nobody else: many a ball that is a little
//! outside turns round before. Whoever is too fast for that has an event of its own.

use std::ops::Range;

use glam::DVec3;

#[cfg(test)]
use super::Domain;
use super::{Boundary, Cells, Face};
use crate::predict::lanes::{IN_ORDER, Lanes, MOST, Work};
use crate::predict::round;
use crate::time::Time;
use crate::tolerance::CELL_MARGIN;
use crate::world::World;
use crate::world::nearby::Gathered;

/// So few balls are not worth a sweep.
const FEWEST: usize = 64;
/// The way out is at most this part of the width of a cell of the finest level: so two balls side by side stay less than half of
/// five cells apart.
const MOST_SLACK: f64 = 0.2;
/// Less than this part is not worth a sweep: it would have to follow too soon.
const LEAST_SLACK: f64 = 0.01;

/// One sweep: when it is, and how long its results have to hold.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// When.
    pub now: Time,
    /// Seconds until the next.
    pub interval: f64,
}

impl Cells {
    /// How far (m) balls may be outside of their cells between sweeps; 0 where there can be no sweeps.
    pub(super) fn room_to_stray(&self, world: &World) -> f64 {
        let crossed = || (0..3).filter(|&axis| self.crossed[axis]);
        let open = crossed().any(|axis| world.domain.boundary[axis] == Boundary::Open);
        if world.len() < FEWEST || self.interiors || open || crossed().next().is_none() {
            return 0.0;
        }
        let mut slack = crossed().map(|axis| MOST_SLACK * self.width[axis]).fold(f64::INFINITY, f64::min);
        for level in &self.levels {
            let widest_ball = 2.0 * level.largest_radius * (1.0 + CELL_MARGIN);
            // In a row of three cells, all are side by side.
            for axis in crossed().filter(|&axis| level.count[axis] > 3) {
                slack = slack.min(0.5 * (level.width[axis] - widest_ball));
            }
        }
        // Two that could touch through more than one image would have to be looked at through all of them.
        let widest_pair = world.largest_radii().iter().sum::<f64>();
        slack = slack.min((self.image_reach(&world.domain, 0.0) - widest_pair) / Self::IMAGE_REACH_PER_SLACK);
        let least = crossed().map(|axis| LEAST_SLACK * self.width[axis]).fold(0.0, f64::max);
        if slack >= least { slack } else { 0.0 }
    }

    /// Whether all balls live in cells of one size.
    #[inline(always)]
    pub fn has_one_level(&self) -> bool {
        self.levels.len() == 1
    }

    /// Whether the ball lives in the smallest cells: whoever is newly near it is then in the cells behind a face, or larger.
    #[inline(always)]
    pub fn is_on_finest_level(&self, ball: usize) -> bool {
        self.places[ball].level as usize + 1 == self.levels.len()
    }

    /// How far (m) balls may be outside of their cells.
    pub fn slack(&self) -> f64 {
        self.slack
    }

    /// Without sweeps: nobody may be outside.
    #[cfg(test)]
    pub fn forbid_straying(&mut self, domain: &Domain) {
        self.reach -= self.slack;
        self.slack = 0.0;
        self.nearest_image_reach = self.image_reach(domain, 0.0);
        self.horizon = Time::NEVER;
    }

    /// From now on, balls may stay in their cells until `horizon` as long as they are not farther outside than the slack.
    pub fn hold_until(&mut self, horizon: Time) {
        self.horizon = horizon;
    }

    /// Until when whoever is not farther outside may stay.
    pub fn horizon(&self) -> Time {
        self.horizon
    }

    /// Whether it is told at a glance that a ball stays within reach of its cell from `now` until `time`.
    #[inline(always)]
    pub fn stays_until(&self, world: &World, ball: usize, now: Time, time: Time) -> bool {
        if !time.is_reachable() {
            return false;
        }
        let acceleration = world.acceleration(ball);
        let flight = &world.flights[ball];
        let [start, end] = [now, time].map(|time| flight.position_after(time.since(flight.start()), acceleration));
        let coordinate = self.places[ball].coordinate.map(f64::from);
        let middle = self.origin + (DVec3::from_array(coordinate) + 0.5) * self.width;
        let mut reach = self.reach;
        if world.has_gravity() {
            // Between its ends the way sags by no more.
            let seconds = time.since(now);
            reach -= acceleration.abs() * (0.125 * seconds * seconds);
        }
        let farthest = (start - middle).abs().max((end - middle).abs());
        farthest.cmplt(reach).all()
    }

    /// How much (m) less far outside than it may be a ball has to be at the next sweep, along each axis, to be told never to have been
    /// too far out until then: g T² / 2. Whoever is d within the limit now, and g T² / 2 within it after T, set out against its fall at
    /// d / T at most, so never gets beyond it; on the side that it falls to, it is farthest out at either end.
    #[inline(always)]
    fn margin_of_fall(acceleration: DVec3, interval: f64) -> DVec3 {
        acceleration.abs() * (0.5 * interval * interval)
    }

    /// Moves a ball that would get too far out before the next sweep into the cell where it will be half-way to that, or is now if
    /// it is so fast that it could get too far out of that before; adds whoever is newly near to `found`, if the ball lives on the
    /// finest level. Gives how many faces it passed, and whether it is so fast.
    #[inline(always)]
    pub fn bring_home(&mut self, world: &World, ball: usize, sweep: &Sweep, found: &mut Gathered) -> (u32, bool) {
        let half = 0.5 * sweep.interval;
        let (flight, acceleration) = (&world.flights[ball], world.acceleration(ball));
        let now = sweep.now.since(flight.start());
        let velocity = flight.velocity_after(now + half, acceleration);
        let way = velocity.abs() * half + acceleration.abs() * (0.5 * half * half);
        let fast = !(way * self.inverse).cmple(self.slack * self.inverse).all();
        let coordinate = DVec3::from_array(self.places[ball].coordinate.map(f64::from));
        // In widths of a cell.
        let from_middle = |seconds: f64| {
            (flight.position_after(seconds, acceleration) - self.origin) * self.inverse - coordinate - 0.5
        };
        // Told once: at a face, where rounding could tell both ways in turn, it may be on either side.
        let steps = round(from_middle(if fast { now } else { now + half }));
        // Only along axes on which it would get too far out.
        let within = (self.reach - Self::margin_of_fall(acceleration, sweep.interval)) * self.inverse;
        let stays = from_middle(now + sweep.interval).abs().cmplt(within);
        let mut steps = DVec3::select(stays, DVec3::ZERO, steps);
        let mut passed = 0;
        loop {
            let faces = steps.cmplt(DVec3::ZERO).bitmask() | steps.cmpgt(DVec3::ZERO).bitmask() << 3;
            if faces == 0 {
                break;
            }
            let face = faces.trailing_zeros();
            let face = Face { axis: (face % 3) as u8, upward: face >= 3 };
            self.cross(ball, face);
            if self.is_on_finest_level(ball) {
                self.near_after_crossing(ball, || world.radii[ball], face, found);
            }
            steps[usize::from(face.axis)] -= if face.upward { 1.0 } else { -1.0 };
            passed += 1;
        }
        if passed > 0 {
            self.note_planes(world, ball);
        }
        (passed, fast)
    }
}

/// Finds the balls that could get too far out of their cells before the next sweep.
pub struct Strays<'a> {
    /// The cells.
    pub cells: &'a Cells,
    /// The balls.
    pub world: &'a World,
    /// When this is, and the next sweep.
    pub sweep: &'a Sweep,
    /// Rows of the balls looked at.
    pub balls: Range<usize>,
    /// Who was found, in the order of memory.
    pub found: &'a mut Vec<u32>,
}

impl Work for Strays<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, l: L) {
        let Self { cells, world, sweep, balls, found } = self;
        found.clear();
        let end = world.clock.after(sweep.now, sweep.interval);
        let (epoch, offset) = (l.all(end.epoch), l.all(end.offset));
        let axes = [
            Stray::new(l, cells, world, sweep.interval, 0),
            Stray::new(l, cells, world, sweep.interval, 1),
            Stray::new(l, cells, world, sweep.interval, 2),
        ];
        let last = world.len() - 1;
        for first in balls.clone().step_by(L::COUNT) {
            let count = L::COUNT.min(balls.end - first);
            let mut rows = [0; MOST];
            for (k, row) in rows[..L::COUNT].iter_mut().enumerate() {
                *row = (first + k).min(last) as u32;
            }
            let rows = &rows[..L::COUNT];
            let [x, y, z, vx, vy, vz, their_epoch, their_offset] = l.columns(&world.flights, rows);
            let seconds = l.add(l.sub(epoch, their_epoch), l.sub(offset, their_offset));
            let of_x = axes[0].is_out(l, cells, world, rows, [x, vx, seconds]);
            let of_y = axes[1].is_out(l, cells, world, rows, [y, vy, seconds]);
            let of_z = axes[2].is_out(l, cells, world, rows, [z, vz, seconds]);
            let mut bits = l.bits(l.either(l.either(of_x, of_y), of_z)) & ((1 << count) - 1);
            while bits != 0 {
                found.push(first as u32 + bits.trailing_zeros());
                bits &= bits - 1;
            }
        }
    }
}

/// What tells of balls, in each lane one, whether they stray along one axis.
struct Stray<L: Lanes> {
    axis: usize,
    crossed: bool,
    origin: L::Numbers,
    inverse: L::Numbers,
    /// Between which places in a cell a ball may be at the next sweep, in cells' widths.
    low: L::Numbers,
    high: L::Numbers,
}

impl<L: Lanes> Stray<L> {
    #[inline(always)]
    fn new(l: L, cells: &Cells, world: &World, interval: f64, axis: usize) -> Self {
        let slack = (cells.slack - Cells::margin_of_fall(world.gravity, interval)[axis]) * cells.inverse[axis];
        Self {
            axis,
            crossed: cells.crossed[axis],
            origin: l.all(cells.origin[axis]),
            inverse: l.all(cells.inverse[axis]),
            low: l.all(-slack),
            high: l.all(1.0 + slack),
        }
    }

    /// Whether balls at `position` (m) and `velocity` (m/s) at their start, so many `seconds` before the next sweep, could get too far
    /// out before that.
    #[inline(always)]
    fn is_out(
        &self,
        l: L,
        cells: &Cells,
        world: &World,
        rows: &[u32],
        [mut position, velocity, seconds]: [L::Numbers; 3],
    ) -> L::Mask {
        let (axis, zero) = (self.axis, l.all(0.0));
        if !self.crossed {
            return l.below(zero, zero);
        }
        position = l.add(position, l.mul(velocity, seconds));
        if world.has_gravity() {
            let mut falls = [0.0; MOST];
            for (falls, &row) in falls.iter_mut().zip(rows) {
                *falls = world.acceleration(row as usize)[axis];
            }
            let fall = l.mul(l.gather(&falls, &IN_ORDER), seconds);
            position = l.add(position, l.mul(l.all(0.5), l.mul(fall, seconds)));
        }
        let mut coordinates = [0.0; MOST];
        for (coordinate, &row) in coordinates.iter_mut().zip(rows) {
            *coordinate = f64::from(cells.places[row as usize].coordinate[axis]);
        }
        let out = l.sub(l.mul(l.sub(position, self.origin), self.inverse), l.gather(&coordinates, &IN_ORDER));
        l.either(l.below(out, self.low), l.below(self.high, out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Whoever falls, is not too far out, and is not by the margin later, was not in between.
    #[test]
    fn what_falls_is_told_never_to_have_been_too_far_out_only_if_it_was_not() {
        let mut random = Random::new(11, 4);
        let mut told = 0;
        for _ in 0..1_000_000 {
            let reach = 1.0;
            let interval = 0.5 + random.uniform();
            let (gravity, start) = (2.0 * random.uniform(), 2.0 * random.uniform() - 1.0);
            // Most turn round.
            let velocity = gravity * interval * (1.2 * random.uniform() - 0.1);
            let after = |seconds: f64| start + velocity * seconds - 0.5 * gravity * seconds * seconds;
            let margin = Cells::margin_of_fall(DVec3::new(0.0, 0.0, -gravity), interval).z;
            if after(interval).abs() < reach - margin {
                let highest = after((velocity / gravity).clamp(0.0, interval));
                // Three roundings of numbers of order one.
                assert!(highest <= reach + 1e-15, "{start} {velocity} {gravity} {interval}");
                told += 1;
            }
        }
        assert!(told > 100_000, "{told}");
    }
}
