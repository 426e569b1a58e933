//! Two bodies alone, of which one turns or both, or a body and a mesh: the search, the contact and the law of a simulation,
//! without one.

use std::f64::consts::TAU;

use glam::{DMat3, DQuat, DVec3};

use super::{Body, Class, ContactError, PairImpact, PointImpulse, Shape};
use crate::error::Problem;
use crate::event::{Certificate, Form, Kind};
use crate::flight::Flight;
use crate::predict::solids::Sought;
use crate::predict::surroundings::{TriangleRoom, contact_with_mesh, first_of_triangles, gap_to_mesh};
use crate::predict::turning::contact::Contact;
use crate::predict::turning::motion::Body as Moving;
use crate::predict::turning::patch::Patch;
use crate::predict::turning::solid::Solid;
use crate::predict::turning::{Memory, STEPS, Search, contact_gap, first_impact};
use crate::resolve::turning::{Mobility, TurningContact, TurningOutcome, Twist};
use crate::rotation::Rotation;
use crate::simulation::{arms_of, form_of};
use crate::time::Time;
use crate::tolerance;
use crate::world::surroundings::Surroundings;
use crate::world::turning::standing;

/// Steps of the search after which it is given up (a count): seconds of work. Only bodies that stay near each other for some
/// thousand turns and do not touch take so many.
const MOST_STEPS: u32 = 50 * STEPS;

/// When the given states are.
const START: Time = Time { epoch: 0.0, offset: 0.0 };

/// So many seconds on.
fn time(seconds: f64) -> Time {
    Time { offset: seconds, ..START }
}

fn unit_quaternion(body: &Body) -> DQuat {
    let [w, x, y, z] = body.orientation;
    DQuat::from_xyzw(x, y, z, w).normalize()
}

/// One of the two, as the search sees it.
struct Member {
    /// Its convex parts; a mesh has none.
    parts: Vec<Solid>,
    /// Distance (m) of its farthest point from the centre; 0 of a plane.
    reach: f64,
    flight: Flight,
    rotation: Rotation,
    mass: f64,
    /// Principal axes to world, as given.
    orientation: DQuat,
    /// World axes (rad/s), as given; 0 of a ball, which no contact turns without friction.
    angular_velocity: DVec3,
    /// Principal moments of inertia (kg m²) if it turns freely.
    moments: Option<DVec3>,
    /// What it is if it is not a body that turns.
    form: Option<Form>,
}

impl Member {
    fn new(body: &Body, row: i64) -> Result<Self, Problem> {
        let flight = |position| Flight::new(position, body.velocity, START);
        Ok(match &body.shape {
            Shape::Ball { radius } => Self {
                parts: vec![Solid::ball(*radius)],
                reach: *radius,
                flight: flight(body.position),
                rotation: Rotation::REST,
                mass: body.mass,
                orientation: DQuat::IDENTITY,
                angular_velocity: DVec3::ZERO,
                moments: None,
                form: Some(Form::Ball),
            },
            Shape::Plane { normal, offset } => Self {
                parts: vec![Solid::half_space()],
                reach: 0.0,
                flight: flight(*normal * *offset),
                rotation: standing(*normal),
                mass: f64::INFINITY,
                orientation: DQuat::IDENTITY,
                angular_velocity: DVec3::ZERO,
                moments: None,
                form: Some(Form::Plane),
            },
            Shape::Solid(geometry) => {
                super::check_turning(body, row)?;
                let free = body.mass.is_finite();
                // What is prescribed keeps its angular velocity, as a body does whose moments are equal.
                let moments = if free { body.inertia } else { DVec3::ONE };
                let parts = Solid::parts(&geometry.shape);
                let orientation = unit_quaternion(body);
                Self {
                    reach: parts.iter().map(Solid::reach).fold(0.0, f64::max),
                    parts,
                    flight: flight(body.position),
                    rotation: Rotation::new(moments, orientation, body.angular_velocity),
                    mass: body.mass,
                    orientation,
                    angular_velocity: body.angular_velocity,
                    moments: free.then_some(moments),
                    form: None,
                }
            }
            Shape::Mesh(mesh) => {
                super::check_turning(body, row)?;
                let orientation = unit_quaternion(body);
                Self {
                    parts: Vec::new(),
                    reach: mesh.reach(),
                    flight: flight(body.position),
                    rotation: Rotation::new(DVec3::ONE, orientation, body.angular_velocity),
                    mass: f64::INFINITY,
                    orientation,
                    angular_velocity: body.angular_velocity,
                    moments: None,
                    form: None,
                }
            }
        })
    }

    /// One of its parts, `seconds` on.
    fn part<'a>(&'a self, solid: &'a Solid, seconds: f64) -> Moving<'a, Rotation> {
        Moving {
            solid,
            position: self.position_after(seconds),
            velocity: self.flight.velocity(),
            acceleration: DVec3::ZERO,
            rotation: &self.rotation,
            elapsed: seconds,
        }
    }

    /// The body, `seconds` on.
    fn sought_after(&self, seconds: f64) -> Sought<'_> {
        let (position, velocity) = (self.position_after(seconds), self.flight.velocity());
        Sought::alone(&self.parts, position, velocity, &self.rotation, seconds)
    }

    fn position_after(&self, seconds: f64) -> DVec3 {
        self.flight.position_after(seconds, DVec3::ZERO)
    }

    fn twist_after(&self, seconds: f64) -> Twist {
        Twist { velocity: self.flight.velocity(), angular_velocity: self.rotation.angular_velocity_after(seconds) }
    }

    /// Principal axes to world, as columns.
    fn axes_after(&self, seconds: f64) -> DMat3 {
        DMat3::from_quat(self.rotation.orientation_after(seconds))
    }

    fn mobility_after(&self, seconds: f64) -> Mobility {
        match self.moments {
            Some(moments) => Mobility::new(self.mass, moments, self.axes_after(seconds)),
            None => Mobility { mass: self.mass, ..Mobility::NONE },
        }
    }

    fn given_twist(&self) -> Twist {
        Twist { velocity: self.flight.velocity(), angular_velocity: self.angular_velocity }
    }

    /// Kinetic energy (J); 0 in prescribed motion.
    fn energy(&self, orientation: DQuat, twist: &Twist) -> f64 {
        if !self.mass.is_finite() {
            return 0.0;
        }
        let turning = self.moments.map_or(0.0, |moments| {
            let along = DMat3::from_quat(orientation).transpose() * twist.angular_velocity;
            0.5 * along.dot(moments * along)
        });
        0.5 * self.mass * twist.velocity.length_squared() + turning
    }

    /// Seconds (s) after which it looks as before: a turn at a constant rate, or, round about z, one turn of that axis about the
    /// angular momentum, 2π I₁/L. `None` if there is no such time, or none is known.
    fn period(&self) -> Option<f64> {
        if self.rotation.fastest_change() == 0.0 {
            return Some(TAU / self.rotation.fastest());
        }
        let moments = self.moments.filter(|moments| moments.x == moments.y)?;
        let round = self.parts.iter().all(Solid::is_round_about_z);
        round.then(|| TAU * moments.x / self.rotation.angular_momentum().length())
    }

    fn is_plane(&self) -> bool {
        self.form == Some(Form::Plane)
    }
}

/// Two bodies, of which one turns or both, or a body and a mesh.
pub(super) struct Pair {
    a: Member,
    b: Member,
    /// The triangles of B, if it is a mesh.
    mesh: Option<Surroundings>,
    /// Whether A and B were given the other way round.
    swapped: bool,
}

impl Pair {
    pub(super) fn new(a: &Body, b: &Body) -> Result<Self, Problem> {
        let swapped = matches!(a.shape, Shape::Mesh(_));
        let [(a, row_a), (b, row_b)] = if swapped { [(b, 1), (a, 0)] } else { [(a, 0), (b, 1)] };
        let members = [Member::new(a, row_a)?, Member::new(b, row_b)?];
        let mesh = if let Shape::Mesh(mesh) = &b.shape {
            if matches!(a.shape, Shape::Mesh(_) | Shape::Plane { .. }) {
                let reason = "surroundings, whose motion is prescribed, cannot collide with each other";
                return Err(Problem::new("pair", None, "shape", "mesh", reason));
            }
            let placed = Surroundings::new(row_b, mesh.clone(), b.position, b.orientation, START);
            Some(placed.moving(b.velocity, b.angular_velocity))
        } else {
            None
        };
        let [a, b] = members;
        Ok(Self { a, b, mesh, swapped })
    }

    fn parts_after(&self, seconds: f64) -> impl Iterator<Item = (Moving<'_, Rotation>, Moving<'_, Rotation>)> {
        let all = self.a.parts.iter().flat_map(|a| self.b.parts.iter().map(move |b| (a, b)));
        all.map(move |(a, b)| (self.a.part(a, seconds), self.b.part(b, seconds)))
    }

    /// Whether they touch, by δ.
    ///
    /// # Errors
    /// They overlap by more than that.
    fn touch(&self) -> Result<bool, ContactError> {
        let least = match &self.mesh {
            Some(mesh) => gap_to_mesh(&self.a.sought_after(0.0), mesh, START, contact_gap),
            None => self.parts_after(0.0).map(|(a, b)| contact_gap(&a, &b)).fold(f64::INFINITY, f64::min),
        };
        let distance = (self.a.position_after(0.0) - self.b.position_after(0.0)).length();
        let touching = tolerance::contact(self.a.reach.max(self.b.reach), distance);
        if least < -touching {
            return Err(ContactError::Overlap { depth: -least });
        }
        Ok(least <= touching)
    }

    /// What touches then; nothing if they do not touch.
    fn contact_after(&self, seconds: f64) -> Option<Contact> {
        let mut patch = Patch::default();
        if let Some(mesh) = &self.mesh {
            let body = self.a.sought_after(seconds);
            return contact_with_mesh(&body, mesh, time(seconds), &mut Vec::new(), &mut patch);
        }
        self.parts_after(seconds).for_each(|(a, b)| patch.consider(&a, &b));
        patch.of_parts()
    }

    /// By the point that approaches fastest, if there are several.
    pub(super) fn classify(&self) -> Result<Class, ContactError> {
        if !self.touch()? {
            return Ok(Class::Apart);
        }
        let speed_of = |member: &Member| {
            let twist = member.given_twist();
            twist.velocity.length() + twist.angular_velocity.length() * member.reach
        };
        let Some(contact) = self.contact_after(0.0) else { return Ok(Class::Apart) };
        Ok(Class::of(-contact.approach_speed(), speed_of(&self.a) + speed_of(&self.b)))
    }

    pub(super) fn collide(&self, restitution: f64) -> Result<Option<PairImpact>, ContactError> {
        self.touch()?;
        let mut after = 0.0;
        let mut steps = 0;
        while let Some((seconds, certificate)) = self.first_contact(after, &mut steps)? {
            if let Some(impact) = self.impact(seconds, certificate, restitution) {
                return Ok(Some(if self.swapped { impact.swapped() } else { impact }));
            }
            // A grazing root whose contact, by rounding, does not approach. From there the search follows how they part.
            if seconds == after && after > 0.0 {
                return Err(ContactError::Undecided { clear_until: seconds });
            }
            after = seconds;
        }
        Ok(None)
    }

    /// Seconds to the first contact with approach that is not before `after` (s), and how certain that is.
    fn first_contact(&self, mut after: f64, steps: &mut u32) -> Result<Option<(f64, Certificate)>, ContactError> {
        loop {
            let most = self.recurrence().map_or(f64::INFINITY, |period| period - after);
            let mut horizon = most;
            let mut found = None;
            let mut clear = f64::INFINITY;
            let mut take = |search: Search| {
                *steps = steps.saturating_add(search.steps);
                if let Some(impact) = search.impact {
                    (horizon, found) = (impact.seconds, Some(impact.certificate));
                } else if search.clear_until < horizon {
                    clear = clear.min(search.clear_until);
                }
                horizon
            };
            if let Some(mesh) = &self.mesh {
                let body = self.a.sought_after(after);
                let room = &mut TriangleRoom::default();
                take(first_of_triangles(&body, mesh, time(after), [0.0, most], room));
            }
            self.parts_after(after)
                .fold(most, |horizon, (a, b)| take(first_impact(&a, &b, horizon, &mut Memory::default())));
            if clear >= horizon {
                return Ok(found.map(|certificate| (after + horizon, certificate)));
            }
            // Cut off: taken up again where it is.
            let next = after + clear;
            if !(next > after) || *steps >= MOST_STEPS {
                return Err(ContactError::Undecided { clear_until: next });
            }
            after = next;
        }
    }

    /// Seconds after which bodies that do not get nearer stand to each other as they did, where that can be told: one does not
    /// turn, and the other comes round. What has not touched until then never does.
    fn recurrence(&self) -> Option<f64> {
        let relative = self.a.flight.velocity() - self.b.flight.velocity();
        let plane = [&self.a, &self.b].into_iter().find(|member| member.is_plane());
        let approach = plane.map_or(relative, |plane| {
            let normal = plane.axes_after(0.0).z_axis;
            normal * normal.dot(relative)
        });
        let stands = |member: &Member| member.rotation.fastest() == 0.0;
        let (rest, turning) = if stands(&self.a) { (&self.a, &self.b) } else { (&self.b, &self.a) };
        if approach != DVec3::ZERO || !stands(rest) || stands(turning) {
            return None;
        }
        turning.period().map(|period| period * (1.0 + tolerance::PERIOD_MARGIN))
    }

    /// The impact at a contact; nothing if it does not approach.
    fn impact(&self, seconds: f64, certificate: Certificate, restitution: f64) -> Option<PairImpact> {
        let members = [&self.a, &self.b];
        let contact = self.contact_after(seconds)?;
        let arms = arms_of(&contact);
        let law = TurningContact {
            normal: contact.normal,
            points: &arms[..contact.points().len()],
            mobilities: members.map(|member| member.mobility_after(seconds)),
            twists: members.map(|member| member.twist_after(seconds)),
            restitution,
        };
        let mut outcome = law.resolve(None);
        if outcome.impulse == 0.0 {
            return None;
        }
        if restitution == 1.0 {
            // What they were given, in spite of the rounding on the way.
            let [given_a, given_b] = members.map(|member| member.energy(member.orientation, &member.given_twist()));
            let carried = given_a + given_b + law.work_of_prescribed(&outcome);
            let [orientation_a, orientation_b] = members.map(|member| member.rotation.orientation_after(seconds));
            outcome = law.resolve(Some(&|twists: &[Twist; 2]| {
                carried - self.a.energy(orientation_a, &twists[0]) - self.b.energy(orientation_b, &twists[1])
            }));
        }
        let told = self.told(seconds, &contact, &outcome, restitution);
        Some(PairImpact { certificate: Some(certificate), ..told })
    }

    fn told(&self, seconds: f64, contact: &Contact, outcome: &TurningOutcome, restitution: f64) -> PairImpact {
        let form = |member: &Member, k: usize| member.form.unwrap_or_else(|| form_of(contact.features[k]));
        let centre = |member: &Member| member.position_after(seconds);
        let (from_a, from_b) = (|arm| centre(&self.a) + arm, |arm| centre(&self.b) + arm);
        // Seen from A's centre as in a run, but where A is a plane, whose point is any.
        let place = |a: DVec3, b: DVec3| if self.a.is_plane() { from_b(b) } else { from_a(a) };
        let point = place(outcome.centre.a, outcome.centre.b);
        let position = |member: &Member| if member.is_plane() { point } else { centre(member) };
        let points = contact.points().iter().zip(outcome.impulses);
        PairImpact {
            time: seconds,
            kind: Kind::of(form(&self.a, 0), form(&self.b, 1)),
            certificate: None,
            point,
            normal: contact.normal,
            approach_speed: outcome.approach_speed,
            separation_speed: outcome.separation_speed,
            impulse: outcome.impulse,
            points: points.map(|(at, impulse)| PointImpulse { point: place(at.from_a, at.from_b), impulse }).collect(),
            restitution,
            energy_lost: outcome.energy_lost,
            velocities: outcome.twists.map(|twist| twist.velocity),
            angular_velocities: outcome.twists.map(|twist| twist.angular_velocity),
            positions: [position(&self.a), position(&self.b)],
        }
    }
}
