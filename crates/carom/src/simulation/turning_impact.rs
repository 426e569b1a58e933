//! One impact of a body that turns: advance the bodies in it, resolve it, book it.

use glam::{DQuat, DVec3};

use super::Simulation;
use crate::error::{Cause, CollapseError};
use crate::event::{Certificate, Form, Kind};
use crate::predict::solids::{Sought, in_order, plane_at};
use crate::predict::turning::contact::{Contact, Feature};
use crate::predict::turning::motion::Body;
use crate::predict::turning::{Memory, contact_after, gap};
use crate::record::Impact;
use crate::resolve::newton;
use crate::resolve::turning::{Arms, MOST_POINTS, Mobility, TurningContact, TurningOutcome, Twist};
use crate::rotation::Rotation;
use crate::time::Time;
use crate::tolerance::contact as contact_tolerance;
use crate::world::Partner;

/// One side of the contact, as it arrives.
#[derive(Clone, Copy)]
pub(super) struct Side {
    /// Its row; `None` of a plane.
    pub row: Option<usize>,
    pub id: i64,
    pub material: u32,
    pub mass: f64,
    /// Centre (m), in the image where its flight began; of a plane a point of it.
    pub position: DVec3,
    pub twist: Twist,
    pub orientation: DQuat,
    pub mobility: Mobility,
}

impl Side {
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
            (None, None) => return self.search_on(ball, now),
        };
        let mut points = [Arms::default(); MOST_POINTS];
        for (arms, point) in points.iter_mut().zip(contact.points()) {
            *arms = Arms { a: point.from_a, b: point.from_b };
        }
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
        self.refuse_turning(&sides, &law, &outcome, now)?;
        let elastic = restitution == 1.0;
        let outcome = if elastic {
            let carried = self.carried_by(&sides) + work_of_prescribed(&sides, contact.normal, &outcome);
            law.resolve(Some(&|twists: &[Twist; 2]| {
                carried - self.kinetic_energy(&sides[0], &twists[0]) - self.kinetic_energy(&sides[1], &twists[1])
            }))
        } else {
            outcome
        };
        for (k, other) in [(0, 1), (1, 0)] {
            self.settle_turning(&sides[k], self.partner_of(&sides[other]), outcome.twists[k], now);
        }
        self.book_turning(&sides, contact.normal, &outcome, elastic);
        match partner.as_plane() {
            Some(_) => self.counts.ball_plane += 1,
            None => self.counts.ball_ball += 1,
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
            row: Some(row),
            id: world.ids[row],
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
            row: None,
            id: plane.id,
            material: plane.material,
            mass: f64::INFINITY,
            position: plane.normal * plane.offset_at(now),
            twist: Twist { velocity: plane.velocity, angular_velocity: DVec3::ZERO },
            orientation: DQuat::IDENTITY,
            mobility: Mobility::NONE,
        }
    }

    pub(super) fn contact_of_bodies(&self, a: usize, b: usize, now: Time) -> Contact {
        let world = &self.world;
        let shift = -self.predictor.periods().shift_of(world.position(a, now) - world.position(b, now));
        let (body_a, body_b) = (Sought::new(world, a, now, shift), Sought::new(world, b, now, DVec3::ZERO));
        if let ([part_a], [part_b]) = (body_a.parts(), body_b.parts()) {
            return contact_after(&body_a.part(part_a), &body_b.part(part_b), 0.0, &Memory::default());
        }
        let pairs = body_a.parts().iter().flat_map(|a| body_b.parts().iter().map(move |b| (a, b)));
        contact_of_parts(pairs.map(|(a, b)| (body_a.part(a), body_b.part(b)))).expect("a body has a part")
    }

    pub(super) fn contact_with_plane(&self, row: usize, plane: usize, now: Time) -> Option<Contact> {
        let body = Sought::new(&self.world, row, now, DVec3::ZERO);
        let half_space = plane_at(&self.world, plane, now)?;
        contact_of_parts(body.parts().iter().map(|part| (body.part(part), half_space)))
    }

    pub(super) fn partner_of(&self, side: &Side) -> Partner {
        match side.row {
            Some(row) => Partner::ball(row as u32),
            None => {
                let row = self.world.planes.iter().position(|plane| plane.id == side.id);
                Partner::plane(row.unwrap_or(0) as u32)
            }
        }
    }

    /// Kinetic energy (J) of a free body that moves so; 0 of one in prescribed motion.
    fn kinetic_energy(&self, side: &Side, twist: &Twist) -> f64 {
        let Some(row) = side.row.filter(|_| side.is_free()) else { return 0.0 };
        let turning = self.world.turning_body(row);
        0.5 * side.mass * twist.velocity.length_squared()
            + turning.map_or(0.0, |body| body.rotational_energy(side.orientation, twist.angular_velocity))
    }

    /// Kinetic energy (J) that the free bodies bring, by what they carry.
    fn carried_by(&self, sides: &[Side; 2]) -> f64 {
        let free = sides.iter().filter(|side| side.is_free());
        free.filter_map(|side| {
            side.row.map(|row| self.world.bodies[row].energy - self.world.potential_energy(row, side.position))
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
        match sides[0].row {
            Some(row) => self.refuse(&contact, row, self.partner_of(&sides[1]), now),
            None => Ok(()),
        }
    }

    /// A contact without approach, as [`Simulation::graze`].
    #[cold]
    fn graze_turning(&mut self, sides: &[Side; 2], now: Time) -> Result<(), CollapseError> {
        for (k, other) in [(0, 1), (1, 0)] {
            let (Some(row), partner) = (sides[k].row, self.partner_of(&sides[other])) else { continue };
            let again = self.world.bodies[row].last_partner == partner && self.world.flights[row].start() == now;
            if again && sides[k].is_free() {
                let resting = self.world.gravity != DVec3::ZERO;
                return Err(self.collapse(row, partner, now, if resting { Cause::Resting } else { Cause::Resolution }));
            }
            self.settle_turning(&sides[k], partner, sides[k].twist, now);
        }
        self.counts.grazes += 1;
        Ok(())
    }

    pub(super) fn settle_turning(&mut self, side: &Side, partner: Partner, twist: Twist, now: Time) {
        let Some(row) = side.row.filter(|_| side.is_free()) else { return };
        self.settle(row, partner, side.position, twist.velocity, now);
        if let Some(body) = self.world.turning.as_mut().and_then(|turning| turning.at_mut(row)) {
            body.turn_on(side.orientation, twist.angular_velocity);
        }
    }

    /// Carries the energies on, and books what bodies in prescribed motion gave.
    fn book_turning(&mut self, sides: &[Side; 2], normal: DVec3, outcome: &TurningOutcome, elastic: bool) {
        if !elastic {
            self.ledger.dissipated.add(outcome.energy_lost);
        }
        let free = [0, 1].map(|k| sides[k].row.filter(|_| sides[k].is_free()));
        let work = work_of_prescribed(sides, normal, outcome);
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
            let impulse = normal * (sign * outcome.impulse);
            self.ledger.wall_impulse.add(impulse);
            self.ledger.wall_moment.add((self.world.flights[row].position() + arm).cross(impulse));
            self.ledger.work.add(work);
        }
    }

    pub(super) fn kind(&self, sides: &[Side; 2], contact: &Contact) -> Kind {
        let form = |k: usize| match (sides[k].row, contact.features[k]) {
            (None, _) => Form::Plane,
            (Some(row), _) if self.world.turning_body(row).is_none() => Form::Ball,
            (_, Feature::Face(_) | Feature::Cap(_)) => Form::Face,
            (_, Feature::Side) => Form::Side,
            (_, Feature::Edge(_)) => Form::Edge,
            (_, Feature::Rim(_)) => Form::Rim,
            (_, Feature::Surface) => Form::Surface,
            (_, Feature::Vertex(_)) => Form::Vertex,
        };
        Kind::of(form(0), form(1)).unwrap_or(Kind::BallPlane)
    }
}

/// Where two bodies of several parts touch: the pair of parts that is nearest, with the points of all others that touch in the
/// same direction. Those that touch in another are found again, at the same instant, after this impact.
fn contact_of_parts<'a>(pairs: impl Iterator<Item = (Body<'a, Rotation>, Body<'a, Rotation>)>) -> Option<Contact> {
    let mut found: Vec<(f64, f64, Contact)> = pairs
        .map(|(a, b)| {
            let size = a.solid.reach().max(b.solid.reach());
            let tolerance = contact_tolerance(size, (a.position - b.position).length());
            (gap(&a, &b), tolerance, contact_after(&a, &b, 0.0, &Memory::default()))
        })
        .collect();
    let nearest = found.iter().map(|&(gap, ..)| gap).fold(f64::INFINITY, f64::min);
    found.retain(|&(gap, tolerance, _)| gap <= nearest.max(0.0) + tolerance);
    let fastest =
        |best: Contact, next: Contact| if next.approach_speed() > best.approach_speed() { next } else { best };
    let mut contact = found.iter().map(|&(.., contact)| contact).reduce(fastest)?;
    let (first, features) = (contact.points().to_vec(), contact.features);
    for (_, tolerance, other) in &found {
        let same = other.features == features && other.points() == first;
        if !same && other.normal.dot(contact.normal) >= 1.0 - ONE_DIRECTION {
            contact.add_points(other.points(), 2.0 * tolerance);
        }
    }
    Some(contact)
}

/// Parts touch in one direction if the cosine of the angle between their normals differs from 1 by no more (pure number, 8ε).
const ONE_DIRECTION: f64 = 8.0 * f64::EPSILON;

/// Work (J) that a partner in prescribed motion does: J·V at the centre of the impulse; 0 if both are free.
fn work_of_prescribed(sides: &[Side; 2], normal: DVec3, outcome: &TurningOutcome) -> f64 {
    let [a, b] = sides;
    match (a.is_free(), b.is_free()) {
        (true, false) => outcome.impulse * normal.dot(b.twist.at(outcome.centre.b)),
        (false, true) => -outcome.impulse * normal.dot(a.twist.at(outcome.centre.a)),
        _ => 0.0,
    }
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
    let centre_b = if sides[1].row.is_some() { point - outcome.centre.b } else { point };
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
