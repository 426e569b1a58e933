//! One impact of a body that turns: advance the bodies in it, resolve it, book it.

use glam::{DQuat, DVec3};

use super::Simulation;
use crate::error::{Cause, CollapseError};
use crate::event::{Certificate, Form, Kind};
use crate::predict::solids::{Sought, in_order, plane_at};
use crate::predict::surroundings::contact_with_mesh;
use crate::predict::turning::contact::{Contact, Feature};
use crate::predict::turning::{Memory, contact_after};
use crate::record::Impact;
use crate::resolve::newton;
use crate::resolve::turning::{Arms, MOST_POINTS, Mobility, TurningContact, TurningOutcome, Twist};
use crate::time::Time;
use crate::world::Partner;

/// One side of the contact, as it arrives.
#[derive(Clone, Copy)]
pub(super) struct Side {
    /// The same as a partner: a body in its row, a plane or a mesh.
    pub itself: Partner,
    pub id: i64,
    pub material: u32,
    pub mass: f64,
    /// Centre (m), in the image where its flight began; of a plane a point of it, of a mesh the origin of its frame.
    pub position: DVec3,
    pub twist: Twist,
    pub orientation: DQuat,
    pub mobility: Mobility,
}

impl Side {
    /// The row of a body; `None` of a plane or a mesh.
    pub(super) fn row(&self) -> Option<usize> {
        self.itself.as_ball()
    }

    pub(super) fn is_free(&self) -> bool {
        self.mass.is_finite()
    }
}

impl Simulation {
    /// As [`Simulation::resolve`], where `ball` or its partner turns.
    #[inline(never)]
    pub(super) fn resolve_turning(&mut self, ball: usize, partner: Partner, now: Time) -> Result<(), CollapseError> {
        let (sides, contact) = match (partner.as_ball(), partner.as_plane()) {
            (Some(other), _) => {
                let (a, b) = in_order(&self.world, ball, other);
                ([self.side(a, now), self.side(b, now)], self.contact_of_bodies(a, b, now))
            }
            (_, Some(plane)) => {
                let Some(contact) = self.contact_with_plane(ball, plane, now) else { return Ok(()) };
                ([self.side(ball, now), self.side_of_plane(plane, now)], contact)
            }
            (None, None) => {
                let Some(mesh) = partner.as_mesh() else { return self.search_on(ball, now) };
                let Some(contact) = self.contact_with_mesh(ball, mesh, now) else { return Ok(()) };
                ([self.side(ball, now), self.side_of_mesh(mesh, now)], contact)
            }
        };
        let points = arms_of(&contact);
        let restitution = self.world.restitution.of(sides[0].material, sides[1].material);
        let law = TurningContact {
            normal: contact.normal,
            points: &points[..contact.points().len()],
            mobilities: [sides[0].mobility, sides[1].mobility],
            twists: [sides[0].twist, sides[1].twist],
            restitution,
        };
        let outcome = law.resolve(None);
        if outcome.impulse == 0.0 {
            return self.graze_turning(&sides, now);
        }
        if contact.is_sunk {
            return Err(self.sunk([&sides[0], &sides[1]], now));
        }
        self.refuse_turning(&sides, &law, &outcome, now)?;
        let elastic = restitution == 1.0;
        let outcome = if elastic {
            let carried = self.carried_by(&sides) + law.work_of_prescribed(&outcome);
            law.resolve(Some(&|twists: &[Twist; 2]| {
                carried - self.kinetic_energy(&sides[0], &twists[0]) - self.kinetic_energy(&sides[1], &twists[1])
            }))
        } else {
            outcome
        };
        for (k, other) in [(0, 1), (1, 0)] {
            self.settle_turning(&sides[k], sides[other].itself, outcome.twists[k], now);
        }
        self.book_turning(&sides, &law, &outcome, elastic);
        match partner.as_ball() {
            Some(_) => self.counts.ball_ball += 1,
            None => self.counts.ball_plane += 1,
        }
        let certificate = self.predictor.certificate(ball);
        match certificate {
            Certificate::WithinTolerance => self.counts.within_tolerance += 1,
            _ => self.counts.transversal += 1,
        }
        if self.is_recorded() {
            let how = (self.kind(&sides, &contact), certificate);
            let impact = recorded(&sides, &contact, &outcome, restitution, now, how);
            // The lower id is A.
            self.record(if impact.a < impact.b { impact } else { impact.from_the_other_side() });
        }
        Ok(())
    }

    pub(super) fn side(&self, row: usize, now: Time) -> Side {
        let world = &self.world;
        let flight = &world.flights[row];
        let seconds = now.since(flight.start());
        let (mass, acceleration) = (world.bodies[row].mass, world.acceleration(row));
        let (orientation, angular_velocity, mobility) = match world.turning_body(row) {
            Some(body) => {
                let (orientation, angular_velocity) = body.rotation.state_after(seconds);
                (orientation, angular_velocity, body.mobility(mass, orientation))
            }
            // No contact turns a ball without friction.
            None => (DQuat::IDENTITY, DVec3::ZERO, Mobility { mass, ..Mobility::NONE }),
        };
        Side {
            itself: Partner::ball(row as u32),
            id: world.id(row),
            material: world.bodies[row].material,
            mass,
            position: flight.position_after(seconds, acceleration),
            twist: Twist { velocity: flight.velocity_after(seconds, acceleration), angular_velocity },
            orientation,
            mobility,
        }
    }

    pub(super) fn side_of_plane(&self, row: usize, now: Time) -> Side {
        let plane = &self.world.planes[row];
        Side {
            itself: Partner::plane(row as u32),
            id: plane.id,
            material: plane.material,
            mass: f64::INFINITY,
            position: plane.normal * plane.offset_at(now),
            twist: Twist { velocity: plane.velocity, angular_velocity: DVec3::ZERO },
            orientation: DQuat::IDENTITY,
            mobility: Mobility::NONE,
        }
    }

    pub(super) fn side_of_mesh(&self, row: usize, now: Time) -> Side {
        let mesh = &self.world.meshes[row];
        Side {
            itself: Partner::mesh(row as u32),
            id: mesh.id,
            material: mesh.material,
            mass: f64::INFINITY,
            position: mesh.position_at(now),
            twist: Twist { velocity: mesh.velocity, angular_velocity: mesh.angular_velocity },
            orientation: mesh.orientation_at(now),
            mobility: Mobility::NONE,
        }
    }

    pub(super) fn contact_of_bodies(&mut self, a: usize, b: usize, now: Time) -> Contact {
        let world = &self.world;
        let shift = -self.predictor.periods().shift_of(world.position(a, now) - world.position(b, now));
        let (body_a, body_b) = (Sought::new(world, a, now, shift), Sought::new(world, b, now, DVec3::ZERO));
        if let ([part_a], [part_b]) = (body_a.parts(), body_b.parts()) {
            return contact_after(&body_a.part(part_a), &body_b.part(part_b), 0.0, &Memory::default());
        }
        self.patch.clear();
        for part_a in body_a.parts() {
            body_b.parts().iter().for_each(|part_b| self.patch.consider(&body_a.part(part_a), &body_b.part(part_b)));
        }
        self.patch.of_parts().expect("a body has a part")
    }

    pub(super) fn contact_with_plane(&mut self, row: usize, plane: usize, now: Time) -> Option<Contact> {
        let body = Sought::new(&self.world, row, now, DVec3::ZERO);
        let half_space = plane_at(&self.world, plane, now)?;
        self.patch.clear();
        body.parts().iter().for_each(|part| self.patch.consider(&body.part(part), &half_space));
        self.patch.of_parts()
    }

    pub(super) fn contact_with_mesh(&mut self, row: usize, mesh: usize, now: Time) -> Option<Contact> {
        let body = Sought::new(&self.world, row, now, DVec3::ZERO);
        contact_with_mesh(&body, &self.world.meshes[mesh], now, &mut self.triangles_near, &mut self.patch)
    }

    /// Kinetic energy (J) of a free body that moves so; 0 of one in prescribed motion.
    fn kinetic_energy(&self, side: &Side, twist: &Twist) -> f64 {
        let Some(row) = side.row().filter(|_| side.is_free()) else { return 0.0 };
        let turning = self.world.turning_body(row);
        0.5 * side.mass * twist.velocity.length_squared()
            + turning.map_or(0.0, |body| body.rotational_energy(side.orientation, twist.angular_velocity))
    }

    /// Kinetic energy (J) that the free bodies bring, by what they carry.
    fn carried_by(&self, sides: &[Side; 2]) -> f64 {
        let free = sides.iter().filter(|side| side.is_free());
        free.filter_map(|side| {
            side.row().map(|row| self.world.bodies[row].energy - self.world.potential_energy(row, side.position))
        })
        .sum()
    }

    fn refuse_turning(
        &mut self,
        sides: &[Side; 2],
        law: &TurningContact,
        outcome: &TurningOutcome,
        now: Time,
    ) -> Result<(), CollapseError> {
        let contact = newton::Contact {
            normal: law.normal,
            velocity_a: law.twists[0].at(outcome.centre.a),
            velocity_b: law.twists[1].at(outcome.centre.b),
            mass_a: sides[0].mass,
            mass_b: sides[1].mass,
            restitution: law.restitution,
            approach_speed: outcome.approach_speed,
        };
        match sides[0].row() {
            Some(row) => self.refuse(&contact, row, sides[1].itself, now),
            None => Ok(()),
        }
    }

    /// The end of a run in which bodies meet again and again without parting.
    #[cold]
    pub(super) fn sunk(&self, [a, b]: [&Side; 2], now: Time) -> CollapseError {
        let cause = if self.world.has_gravity() {
            Cause::Resting
        } else if self.world.restitution.of(a.material, b.material) < 1.0 {
            Cause::Accumulation
        } else {
            Cause::Resolution
        };
        CollapseError { bodies: vec![a.id.min(b.id), a.id.max(b.id)], time: now.to_pair().0, cause }
    }

    /// A contact without approach, as [`Simulation::graze`].
    #[cold]
    fn graze_turning(&mut self, sides: &[Side; 2], now: Time) -> Result<(), CollapseError> {
        for (k, other) in [(0, 1), (1, 0)] {
            let (Some(row), partner) = (sides[k].row(), sides[other].itself) else { continue };
            let again = self.world.bodies[row].last_partner == partner && self.world.flights[row].start() == now;
            if again && sides[k].is_free() {
                let resting = self.world.has_gravity();
                return Err(self.collapse(row, partner, now, if resting { Cause::Resting } else { Cause::Resolution }));
            }
            self.settle_turning(&sides[k], partner, sides[k].twist, now);
        }
        self.counts.grazes += 1;
        Ok(())
    }

    pub(super) fn settle_turning(&mut self, side: &Side, partner: Partner, twist: Twist, now: Time) {
        let Some(row) = side.row().filter(|_| side.is_free()) else { return };
        self.settle(row, partner, side.position, twist.velocity, now);
        if let Some(body) = self.world.turning.as_mut().and_then(|turning| turning.at_mut(row)) {
            body.turn_on(side.orientation, twist.angular_velocity);
        }
    }

    /// Carries the energies on, and books what bodies in prescribed motion gave.
    fn book_turning(&mut self, sides: &[Side; 2], law: &TurningContact, outcome: &TurningOutcome, elastic: bool) {
        if !elastic {
            self.ledger.dissipated.add(outcome.energy_lost);
        }
        let free = [0, 1].map(|k| sides[k].row().filter(|_| sides[k].is_free()));
        let work = law.work_of_prescribed(outcome);
        match free {
            [Some(a), Some(b)] if elastic => {
                let sum = self.world.bodies[a].energy + self.world.bodies[b].energy;
                let (now_a, now_b) = (self.world.energy(a), self.world.energy(b));
                let energy_a = now_a + 0.5 * (sum - (now_a + now_b));
                self.world.bodies[a].energy = energy_a;
                self.world.bodies[b].energy = sum - energy_a;
            }
            [Some(row), None] | [None, Some(row)] if elastic => self.world.bodies[row].energy += work,
            _ => {
                for row in free.into_iter().flatten() {
                    self.world.bodies[row].energy = self.world.energy(row);
                }
            }
        }
        if let ([Some(row), None], sign, arm) | ([None, Some(row)], sign, arm) =
            if free[0].is_some() { (free, 1.0, outcome.centre.a) } else { (free, -1.0, outcome.centre.b) }
        {
            let impulse = law.normal * (sign * outcome.impulse);
            self.ledger.wall_impulse.add(impulse);
            self.ledger.wall_moment.add((self.world.flights[row].position() + arm).cross(impulse));
            self.ledger.work.add(work);
        }
    }

    pub(super) fn kind(&self, sides: &[Side; 2], contact: &Contact) -> Kind {
        let form = |k: usize| match sides[k].row() {
            None if sides[k].itself.as_plane().is_some() => Form::Plane,
            Some(row) if self.world.turning_body(row).is_none() => Form::Ball,
            _ => form_of(contact.features[k]),
        };
        Kind::of(form(0), form(1)).unwrap_or(Kind::BallPlane)
    }
}

/// The form of what touches, of a body that turns.
pub(crate) fn form_of(feature: Feature) -> Form {
    match feature {
        Feature::Face(_) | Feature::Cap(_) => Form::Face,
        Feature::Side => Form::Side,
        Feature::Edge(_) => Form::Edge,
        Feature::Rim(_) => Form::Rim,
        Feature::Surface => Form::Surface,
        Feature::Vertex(_) => Form::Vertex,
    }
}

/// The points of a contact as the law takes them; of no account beyond their number.
pub(crate) fn arms_of(contact: &Contact) -> [Arms; MOST_POINTS] {
    let mut points = [Arms::default(); MOST_POINTS];
    for (arms, point) in points.iter_mut().zip(contact.points()) {
        *arms = Arms { a: point.from_a, b: point.from_b };
    }
    points
}

fn recorded(
    sides: &[Side; 2],
    contact: &Contact,
    outcome: &TurningOutcome,
    restitution: f64,
    time: Time,
    (kind, certificate): (Kind, Certificate),
) -> Impact {
    let point = sides[0].position + outcome.centre.a;
    // B's centre in the image that A touched; of a plane, the point touched.
    let centre_b = if sides[1].itself.as_plane().is_some() { point } else { point - outcome.centre.b };
    Impact {
        time,
        a: sides[0].id,
        b: sides[1].id,
        kind,
        point,
        certificate,
        normal: contact.normal,
        approach_speed: outcome.approach_speed,
        separation_speed: outcome.separation_speed,
        impulse: outcome.impulse,
        restitution,
        energy_lost: outcome.energy_lost,
        velocities: [
            sides[0].twist.velocity,
            sides[1].twist.velocity,
            outcome.twists[0].velocity,
            outcome.twists[1].velocity,
        ],
        positions: [sides[0].position, centre_b],
        masses: [sides[0].mass, sides[1].mass],
    }
}
