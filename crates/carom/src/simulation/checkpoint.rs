//! A simulation as bytes, to go on from bit for bit.
//!
//! Predictions are not stored: each depends on the states after the last impacts alone, so they come out the same.

use glam::{DQuat, DVec3};

use super::{Counts, Simulation};
use crate::error::{CheckError, Problem};
use crate::flight::Flight;
use crate::ledger::{Ledger, Sum, VectorSum};
use crate::predict::lanes::Width;
use crate::time::Time;
use crate::world::{Partner, World};

const MAGIC: u64 = u64::from_le_bytes(*b"CAROM\0\0\x02");

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn u64(&mut self) -> Option<u64> {
        let (head, tail) = self.0.split_first_chunk::<8>()?;
        self.0 = tail;
        Some(u64::from_le_bytes(*head))
    }

    fn f64(&mut self) -> Option<f64> {
        let value = f64::from_bits(self.u64()?);
        value.is_finite().then_some(value)
    }

    fn vector(&mut self) -> Option<DVec3> {
        Some(DVec3::new(self.f64()?, self.f64()?, self.f64()?))
    }

    fn time(&mut self) -> Option<Time> {
        Some(Time { epoch: self.f64()?, offset: self.f64()? })
    }

    fn floats<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }
}

#[derive(Default)]
struct Writer(Vec<u8>);

impl Writer {
    fn u64(&mut self, value: u64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    fn floats(&mut self, values: &[f64]) {
        for value in values {
            self.u64(value.to_bits());
        }
    }

    fn time(&mut self, time: Time) {
        self.floats(&[time.epoch, time.offset]);
    }
}

impl Simulation {
    /// The state as bytes, little-endian.
    pub fn checkpoint(&self) -> Vec<u8> {
        let mut out = Writer::default();
        let world = &self.world;
        out.u64(MAGIC);
        out.u64(world.len() as u64);
        out.u64(u64::from(!world.images.is_empty()));
        out.floats(&[world.clock.span()]);
        out.time(self.now);
        // An instant may be half worked off.
        let in_instant = !self.instant.is_empty();
        out.u64(u64::from(in_instant));
        out.time(if in_instant { self.instant_end } else { self.now });
        let counts = &self.counts;
        for count in [
            counts.ball_ball,
            counts.ball_plane,
            counts.transversal,
            counts.within_tolerance,
            counts.continued,
            counts.grazes,
            counts.crossings,
            counts.stale,
            counts.layouts,
        ] {
            out.u64(count);
        }
        let ledger = &self.ledger;
        out.floats(&ledger.dissipated.parts());
        out.floats(&ledger.work.parts());
        out.floats(&ledger.wall_impulse.parts());
        out.floats(&ledger.wall_moment.parts());
        out.floats(&ledger.gravity_moment.parts());
        out.floats(&[ledger.energy_start]);
        out.floats(&ledger.momentum_start.to_array());
        out.floats(&ledger.angular_momentum_start.to_array());
        out.floats(&[ledger.energy_scale, ledger.momentum_scale, ledger.angular_momentum_scale]);
        for rank in 0..world.len() {
            let ball = world.row(rank);
            let (flight, body) = (&world.flights[ball], &world.bodies[ball]);
            out.u64(world.ids.of_rank(rank) as u64);
            out.floats(&flight.position().to_array());
            out.floats(&flight.velocity().to_array());
            out.time(flight.start());
            out.floats(&[body.energy]);
            let partner = body.last_partner.with_ball(|row| world.bodies[row as usize].rank);
            out.u64(u64::from(partner.bits()) << 32 | u64::from(world.impacts[ball]));
            for count in world.images.get(ball).into_iter().flatten() {
                out.u64(count as u32 as u64);
            }
            if let Some(body) = world.turning_body(ball) {
                out.floats(&body.orientation.to_array());
                out.floats(&body.angular_velocity.to_array());
            }
        }
        out.0
    }

    /// The simulation that wrote `bytes`, of the same scene: `world` is the one built from it.
    ///
    /// # Errors
    /// If the bytes are no whole checkpoint of this scene.
    pub fn restore(world: World, bytes: &[u8], record: bool) -> Result<Self, CheckError> {
        Self::read(world, bytes, record).ok_or_else(|| {
            Problem::new(
                "scene",
                None,
                "checkpoint",
                format!("{} bytes", bytes.len()),
                "is no whole checkpoint of this scene",
            )
            .into()
        })
    }

    fn read(mut world: World, bytes: &[u8], record: bool) -> Option<Self> {
        let mut input = Reader(bytes);
        let fits = input.u64()? == MAGIC
            && input.u64()? == world.len() as u64
            && input.u64()? == u64::from(!world.images.is_empty())
            && input.f64()? == world.clock.span();
        if !fits {
            return None;
        }
        let now = input.time()?;
        let in_instant = input.u64()? != 0;
        let instant_end = input.time()?;
        let counts = Counts {
            ball_ball: input.u64()?,
            ball_plane: input.u64()?,
            transversal: input.u64()?,
            within_tolerance: input.u64()?,
            continued: input.u64()?,
            grazes: input.u64()?,
            crossings: input.u64()?,
            stale: input.u64()?,
            layouts: input.u64()?,
        };
        let ledger = Ledger {
            dissipated: Sum::from_parts(input.floats()?),
            work: Sum::from_parts(input.floats()?),
            wall_impulse: VectorSum::from_parts(input.floats()?),
            wall_moment: VectorSum::from_parts(input.floats()?),
            gravity_moment: VectorSum::from_parts(input.floats()?),
            energy_start: input.f64()?,
            momentum_start: input.vector()?,
            angular_momentum_start: input.vector()?,
            energy_scale: input.f64()?,
            momentum_scale: input.f64()?,
            angular_momentum_scale: input.f64()?,
        };
        for ball in 0..world.len() {
            if input.u64()? != world.id(ball) as u64 {
                return None;
            }
            world.flights[ball] = Flight::new(input.vector()?, input.vector()?, input.time()?);
            let body = &mut world.bodies[ball];
            body.energy = input.f64()?;
            let packed = input.u64()?;
            body.last_partner = Partner::from_bits((packed >> 32) as u32);
            world.impacts[ball] = packed as u32;
            let known = body.last_partner == Partner::NONE
                || body.last_partner.as_ball().is_some_and(|other| other < world.flights.len())
                || body.last_partner.as_plane().is_some_and(|row| row < world.planes.len())
                || body.last_partner.as_mesh().is_some_and(|row| row < world.meshes.len());
            if !known {
                return None;
            }
            if let Some(mut image) = world.images.get(ball) {
                for count in &mut image {
                    *count = input.u64()? as u32 as i32;
                }
                world.images.set(ball, image);
            }
            if let Some(body) = world.turning.as_mut().and_then(|turning| turning.at_mut(ball)) {
                body.turn_on(DQuat::from_array(input.floats()?), input.vector()?);
            }
        }
        if !input.0.is_empty() {
            return None;
        }
        let mut simulation = Self::at(world, now, ledger, counts, record, Width::of_this_machine());
        if in_instant {
            simulation.resume_instant(instant_end);
        }
        Some(simulation)
    }
}
