//! One impact: advance the bodies in it, resolve it, book it.

use glam::DVec3;

use super::Simulation;
use crate::error::{Cause, CollapseError};
use crate::event::{Certificate, Kind};
use crate::flight::Flight;
use crate::ledger::gravity_moment;
use crate::record::Impact;
use crate::resolve::newton::{Contact, Outcome};
use crate::scene::Simultaneous;
use crate::time::Time;
use crate::tolerance::touching;
use crate::world::{Partner, is_zero};

/// A ball's centre (m) and velocity (m/s) at its impact, still in the image where its flight began.
#[derive(Clone, Copy)]
struct Arrival {
    position: DVec3,
    velocity: DVec3,
}

impl Simulation {
    /// Resolves the contact of `ball` with `partner` at `time`. A grazing pair that turns out not to approach has its states
    /// written unchanged, so that it is not found again.
    #[inline]
    pub(super) fn resolve(&mut self, ball: usize, partner: Partner, time: Time) -> Result<(), CollapseError> {
        // Within one instant the order of ranks may differ from that of times by rounding; the clock does not run back.
        let now = self.now.later(time);
        let turns = |row: usize| self.world.turning_body(row).is_some();
        if turns(ball) || partner.as_ball().is_some_and(turns) {
            self.resolve_turning(ball, partner, now)?;
            self.now = now;
            return Ok(());
        }
        match (partner.as_ball(), partner.as_plane()) {
            (Some(other), _) => {
                let in_order = self.world.bodies[ball].rank < self.world.bodies[other].rank;
                let (a, b) = if in_order { (ball, other) } else { (other, ball) };
                self.resolve_balls(a, b, now)?;
            }
            (None, Some(plane)) => self.resolve_ball_and_plane(ball, plane, now)?,
            (None, None) if partner.as_mesh().is_some() => self.resolve_turning(ball, partner, now)?,
            (None, None) => self.search_on(ball, now)?,
        }
        self.now = now;
        Ok(())
    }

    /// A search that was cut off goes on from here.
    #[cold]
    pub(super) fn search_on(&mut self, ball: usize, now: Time) -> Result<(), CollapseError> {
        self.counts.continued += 1;
        match self.predictor.stuck(&self.world, ball) {
            Some((a, b)) => {
                let bodies = vec![a.min(b), a.max(b)];
                Err(CollapseError { bodies, time: now.to_pair().0, cause: Cause::Search })
            }
            None => Ok(()),
        }
    }

    #[inline]
    fn resolve_balls(&mut self, a: usize, b: usize, now: Time) -> Result<(), CollapseError> {
        let (arrived_a, arrived_b) = (self.arrive(a, now), self.arrive(b, now));
        let separation = self.predictor.periods().nearest(arrived_a.position - arrived_b.position);
        let relative = arrived_a.velocity - arrived_b.velocity;
        let distance = separation.length();
        let normal = separation / distance;
        let growth = self.world.growth.map_or(0.0, |g| g.rate * (self.world.radii[a] + self.world.radii[b]));
        // By the sign of r·v, as predicted: < 0 collision imminent, otherwise grazing or parting.
        let approach = growth * distance - separation.dot(relative);
        if approach <= 0.0 {
            return self.graze(
                [(a, Partner::ball(b as u32)), (b, Partner::ball(a as u32))],
                [arrived_a, arrived_b],
                now,
            );
        }
        let bodies = [self.world.bodies[a], self.world.bodies[b]];
        let restitution = self.world.restitution.of(bodies[0].material, bodies[1].material);
        let contact = Contact {
            normal,
            velocity_a: arrived_a.velocity,
            velocity_b: arrived_b.velocity,
            mass_a: bodies[0].mass,
            mass_b: bodies[1].mass,
            restitution,
            approach_speed: approach_speed(growth - normal.dot(relative), || approach / distance),
        };
        self.refuse(&contact, a, Partner::ball(b as u32), now)?;
        let elastic = restitution == 1.0 && growth == 0.0;
        let carried = elastic.then(|| {
            self.carried_kinetic_energy(a, &arrived_a)
                + self.carried_kinetic_energy(b, &arrived_b)
                + contact.work_of_prescribed()
        });
        let outcome = contact
            .resolve(carried, |velocity_a, velocity_b| separation.dot(velocity_a - velocity_b) >= growth * distance);
        self.settle(a, Partner::ball(b as u32), arrived_a.position, outcome.velocity_a, now);
        self.settle(b, Partner::ball(a as u32), arrived_b.position, outcome.velocity_b, now);
        self.book_energy([Some(a), Some(b)], &contact, elastic);
        for (row, other, sign) in [(a, b, 1.0), (b, a, -1.0)] {
            if self.world.is_fixed(other) && !self.world.is_fixed(row) {
                let velocity = self.world.flights[other].velocity();
                self.book_impulse(row, normal * (sign * contact.impulse(&outcome)), velocity);
            }
        }
        self.counts.ball_ball += 1;
        if self.is_recorded() {
            self.record_balls([a, b], &contact, &outcome, now, arrived_a.position, separation);
        }
        Ok(())
    }

    #[inline(never)]
    fn record_balls(
        &mut self,
        [a, b]: [usize; 2],
        contact: &Contact,
        outcome: &Outcome,
        now: Time,
        position: DVec3,
        separation: DVec3,
    ) {
        let point = position - contact.normal * self.world.radius(a, now);
        let ids = [self.world.id(a), self.world.id(b)];
        let positions = [position, position - separation];
        self.record(recorded(contact, outcome, Kind::BallBall, now, ids, point, positions));
    }

    #[inline(never)]
    fn resolve_ball_and_plane(&mut self, ball: usize, row: usize, now: Time) -> Result<(), CollapseError> {
        let plane = self.world.planes[row];
        let partner = Partner::plane(row as u32);
        let arrived = self.arrive(ball, now);
        let n = plane.normal;
        let growth = self.world.growth.map_or(0.0, |g| g.rate * self.world.radii[ball]);
        let approach_speed = growth - n.dot(arrived.velocity - plane.velocity);
        if approach_speed <= 0.0 {
            return self.graze([(ball, partner)], [arrived], now);
        }
        let body = self.world.bodies[ball];
        let restitution = self.world.restitution.of(body.material, plane.material);
        let contact = Contact {
            normal: n,
            velocity_a: arrived.velocity,
            velocity_b: plane.velocity,
            mass_a: body.mass,
            mass_b: f64::INFINITY,
            restitution,
            approach_speed,
        };
        self.refuse(&contact, ball, partner, now)?;
        let elastic = restitution == 1.0 && growth == 0.0;
        let carried = elastic.then(|| self.carried_kinetic_energy(ball, &arrived) + contact.work_of_prescribed());
        let outcome = contact.resolve(carried, |velocity, _| n.dot(velocity - plane.velocity) >= growth);
        self.settle(ball, partner, arrived.position, outcome.velocity_a, now);
        self.book_energy([Some(ball), None], &contact, elastic);
        self.book_impulse(ball, n * contact.impulse(&outcome), plane.velocity);
        self.counts.ball_plane += 1;
        if self.is_recorded() {
            let point = arrived.position - n * self.world.radius(ball, now);
            let ids = [self.world.id(ball), plane.id];
            let of_ball = recorded(&contact, &outcome, Kind::BallPlane, now, ids, point, [arrived.position, point]);
            // The lower id is A, also where that is the plane.
            self.record(if ids[0] < ids[1] { of_ball } else { of_ball.from_the_other_side() });
        }
        Ok(())
    }

    #[inline(always)]
    fn arrive(&self, ball: usize, now: Time) -> Arrival {
        let flight = &self.world.flights[ball];
        let (seconds, acceleration) = (now.since(flight.start()), self.world.acceleration(ball));
        Arrival {
            position: flight.position_after(seconds, acceleration),
            velocity: flight.velocity_after(seconds, acceleration),
        }
    }

    /// Seconds since the ball's last impact; infinite if it had none.
    fn since_impact(&self, ball: usize, now: Time) -> f64 {
        let had_none = self.world.bodies[ball].last_partner == Partner::NONE;
        if had_none { f64::INFINITY } else { now.since(self.world.flights[ball].start()) }
    }

    /// Refuses to go on where impacts that lose energy accumulate, this one being the last straw, and where bodies have become
    /// so fast that the clock does not resolve where they are.
    #[inline(always)]
    pub(super) fn refuse(
        &mut self,
        contact: &Contact,
        ball: usize,
        partner: Partner,
        now: Time,
    ) -> Result<(), CollapseError> {
        if self.guard.is_too_fast(contact.approach_speed) {
            return Err(self.collapse(ball, partner, now, Cause::Resolution));
        }
        if contact.restitution < 1.0 && self.accumulates(contact, [Some(ball), partner.as_ball()], now) {
            return Err(self.collapse(ball, partner, now, Cause::Accumulation));
        }
        Ok(())
    }

    fn accumulates(&mut self, contact: &Contact, rows: [Option<usize>; 2], now: Time) -> bool {
        let speeds = contact.velocity_a.length() + contact.velocity_b.length();
        let place = |ball: usize| self.world.flights[ball].position().abs().max_element();
        let largest = rows.into_iter().flatten().map(place).fold(0.0, f64::max);
        let since = rows.into_iter().flatten().map(|ball| self.since_impact(ball, now)).fold(0.0, f64::max);
        // Resolved together, what approaches by rounding alone has not bounced so often as to come to that.
        let spent = contact.restitution > 0.0
            && self.guard.is_spent(contact.approach_speed, speeds, since, touching(largest))
            && self.world.simultaneous == Simultaneous::Pairwise;
        let mut many = false;
        for ball in rows.into_iter().flatten() {
            many |= self.guard.accumulates(self.world.bodies[ball].rank as usize, now);
        }
        spent || many
    }

    /// Writes a free ball's state after an impact, put back into the periodic box.
    #[inline(always)]
    pub(super) fn settle(&mut self, ball: usize, partner: Partner, arrived: DVec3, velocity: DVec3, now: Time) {
        if self.world.is_fixed(ball) {
            // Its one flight lasts for ever.
            return;
        }
        if self.world.has_gravity() {
            self.book_gravity(ball, now);
        }
        let mut position = arrived;
        if self.world.domain.is_periodic() {
            let passed = self.predictor.periods().images_passed(position);
            if !is_zero(passed) {
                position -= passed * self.world.domain.size;
                self.put_back(ball, passed.to_array().map(|x| x as i32));
            }
        }
        self.world.flights[ball] = Flight::new(position, velocity, now);
        self.world.bodies[ball].last_partner = partner;
        self.world.impacts[ball] = self.world.impacts[ball].wrapping_add(1);
    }

    /// Books the moment of the ball's weight since its last impact.
    #[inline(never)]
    fn book_gravity(&mut self, ball: usize, now: Time) {
        self.ledger.gravity_moment.add(gravity_moment(&self.world, ball, now));
    }

    #[cold]
    fn put_back(&mut self, ball: usize, passed: [i32; 3]) {
        if let Some(mut image) = self.world.images.get(ball) {
            for axis in 0..3 {
                image[axis] = image[axis].wrapping_add(passed[axis]);
            }
            self.world.images.set(ball, image);
        }
        self.nearby.wrap(ball, passed);
    }

    /// A contact without approach. Once is the rounding of a grazing root; twice in a row without any time between is a
    /// lasting contact.
    #[cold]
    fn graze<const N: usize>(
        &mut self,
        bodies: [(usize, Partner); N],
        arrived: [Arrival; N],
        now: Time,
    ) -> Result<(), CollapseError> {
        for ((ball, partner), arrived) in bodies.into_iter().zip(arrived) {
            let again = self.world.bodies[ball].last_partner == partner && self.world.flights[ball].start() == now;
            if again && !self.world.is_fixed(ball) {
                let resting = self.world.has_gravity();
                let cause = if resting { Cause::Resting } else { Cause::Resolution };
                return Err(self.collapse(ball, partner, now, cause));
            }
            self.settle(ball, partner, arrived.position, arrived.velocity, now);
        }
        self.counts.grazes += 1;
        Ok(())
    }

    #[cold]
    pub(super) fn collapse(&self, ball: usize, partner: Partner, now: Time, cause: Cause) -> CollapseError {
        let id = self.world.id(ball);
        let other = match (partner.as_ball(), partner.as_plane(), partner.as_mesh()) {
            (Some(other), ..) => self.world.id(other),
            (_, Some(row), _) => self.world.planes[row].id,
            (.., Some(row)) => self.world.meshes[row].id,
            _ => id,
        };
        CollapseError { bodies: vec![id.min(other), id.max(other)], time: now.to_pair().0, cause }
    }

    /// Kinetic energy (J) that a free ball brings to its impact, by the energy it carries; 0 of a fixed one.
    #[inline(always)]
    fn carried_kinetic_energy(&self, ball: usize, arrived: &Arrival) -> f64 {
        if self.world.is_fixed(ball) {
            return 0.0;
        }
        self.world.bodies[ball].energy - self.world.potential_energy(ball, arrived.position)
    }

    /// Carries each free ball's energy on: by work in elastic impacts, afresh from the velocity in others.
    #[inline(always)]
    fn book_energy(&mut self, rows: [Option<usize>; 2], contact: &Contact, elastic: bool) {
        if contact.restitution < 1.0 {
            self.ledger.dissipated.add(contact.energy_lost());
        }
        let free = rows.map(|row| row.filter(|&ball| !self.world.is_fixed(ball)));
        match free {
            [Some(a), Some(b)] if elastic => {
                // The sum stays what it was. What it differs from the sum of the new velocities by is carried on in equal
                // parts.
                let sum = self.world.bodies[a].energy + self.world.bodies[b].energy;
                let (now_a, now_b) = (self.world.energy(a), self.world.energy(b));
                let energy_a = now_a + 0.5 * (sum - (now_a + now_b));
                self.world.bodies[a].energy = energy_a;
                self.world.bodies[b].energy = sum - energy_a;
            }
            [Some(ball), None] | [None, Some(ball)] if elastic => {
                self.world.bodies[ball].energy += contact.work_of_prescribed();
            }
            _ => {
                for ball in free.into_iter().flatten() {
                    self.world.bodies[ball].energy = self.world.energy(ball);
                }
            }
        }
    }

    /// Books what a body in prescribed motion gave to a free ball.
    fn book_impulse(&mut self, ball: usize, impulse: DVec3, prescribed_velocity: DVec3) {
        self.ledger.wall_impulse.add(impulse);
        self.ledger.wall_moment.add(self.world.flights[ball].position().cross(impulse));
        self.ledger.work.add(impulse.dot(prescribed_velocity));
    }
}

/// The approach speed along the rounded normal, -v_AB·n; where rounding hides that it is positive, -v_AB·r / |r|.
#[inline(always)]
pub(crate) fn approach_speed(along_normal: f64, along_separation: impl FnOnce() -> f64) -> f64 {
    if along_normal > 0.0 { along_normal } else { along_separation() }
}

/// The row of an impact.
fn recorded(
    contact: &Contact,
    outcome: &Outcome,
    kind: Kind,
    time: Time,
    [a, b]: [i64; 2],
    point: DVec3,
    positions: [DVec3; 2],
) -> Impact {
    Impact {
        time,
        a,
        b,
        kind,
        point,
        certificate: Certificate::ClosedForm,
        normal: contact.normal,
        approach_speed: contact.approach_speed,
        separation_speed: (outcome.velocity_a - outcome.velocity_b).dot(contact.normal),
        impulse: contact.impulse(outcome),
        restitution: contact.restitution,
        energy_lost: contact.energy_lost(),
        velocities: [contact.velocity_a, contact.velocity_b, outcome.velocity_a, outcome.velocity_b],
        positions,
        masses: [contact.mass_a, contact.mass_b],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::predict::turning::Search;
    use crate::scene::{Balls, Scene};

    /// Spins that the clock was made for always leave it a step; a search that is cut off at its start stands for what does not.
    #[test]
    fn a_search_that_time_cannot_bring_on_ends_the_run_with_an_error_and_leaves_the_state() {
        let position = |id: i64| DVec3::new(3.0 * id as f64, 0.0, 0.0);
        let balls = Balls {
            ids: vec![1, 2],
            positions: vec![position(1), position(2)],
            velocities: vec![DVec3::ZERO; 2],
            angular_velocities: vec![DVec3::ZERO; 2],
            radii: vec![1.0; 2],
            masses: vec![1.0; 2],
            materials: vec![0; 2],
            fixed: vec![false; 2],
            inertias: vec![0.4; 2],
            orientations: vec![[1.0, 0.0, 0.0, 0.0]; 2],
        };
        let scene = Scene { balls, ..Scene::default() };
        let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
        let (now, rows) = (simulation.now, [1, 2].map(|id| simulation.world.row_of(id).expect("a ball")));
        let nowhere = |_: Time, _: f64| Search { impact: None, clear_until: 0.0, steps: 1 };
        let again = simulation.predictor.foresee_pair(&simulation.world, rows, [now, Time::NEVER], nowhere);
        assert_eq!(again, now);
        let error = simulation.resolve(rows[0], Partner::NONE, now).expect_err("nothing can be told");
        assert_eq!((error.bodies.as_slice(), error.cause), ([1, 2].as_slice(), Cause::Search));
        assert!(error.to_string().starts_with("bodies 1 and 2 at t = 0 s: they turn so fast"), "{error}");
        assert_eq!(rows.map(|row| simulation.world.position(row, now)), [1, 2].map(position));
        // One that is brought on is none.
        let onward = |_: Time, _: f64| Search { impact: None, clear_until: 0.5, steps: 1 };
        let again = simulation.predictor.foresee_pair(&simulation.world, rows, [now, Time::NEVER], onward);
        assert_eq!(again.since(now), 0.5);
        assert_eq!(simulation.resolve(rows[0], Partner::NONE, now), Ok(()));
    }
}
