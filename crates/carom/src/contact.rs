//! Two bodies alone: do they touch, will they, and what then.

mod turning;

use std::fmt;
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use crate::error::{CheckError, Problem};
use crate::event::{Certificate, Kind};
use crate::predict::{ShapeKind, ball_ball, ball_plane, kind_of_pair};
use crate::resolve::newton::Contact;
use crate::resolve::turning::{Arms, Mobility, TurningContact, Twist};
use crate::shape::{BodyGeometry, TriangleMesh};
use crate::simulation::approach_speed;
use crate::tolerance::{LIMITS, RESTING, UNIT_LENGTH, touching};

/// A body's shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A ball of this radius (m).
    Ball {
        /// m
        radius: f64,
    },
    /// The points with normal·x = offset; its mass is infinite.
    Plane {
        /// Unit vector to the free side.
        normal: DVec3,
        /// Distance from the origin along the normal (m).
        offset: f64,
    },
    /// That of a body that turns.
    Solid(Arc<BodyGeometry>),
    /// Fixed surroundings of triangles, which can be touched from both sides; its mass is infinite, its position that of the
    /// origin of the triangles' frame.
    Mesh(Arc<TriangleMesh>),
}

impl Shape {
    /// Its name in the table of pairs, if it is there.
    fn kind(&self) -> Option<ShapeKind> {
        match self {
            Self::Ball { .. } => Some(ShapeKind::Ball),
            Self::Plane { .. } => Some(ShapeKind::Plane),
            Self::Solid(_) | Self::Mesh(_) => None,
        }
    }
}

/// The pair in the table, if it is there.
fn kind(a: &Body, b: &Body) -> Option<Kind> {
    kind_of_pair(a.shape.kind()?, b.shape.kind()?)
}

/// One of two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// What it looks like.
    pub shape: Shape,
    /// Mass (kg), infinite if its motion is prescribed.
    pub mass: f64,
    /// Moments of inertia about the principal axes (kg m²).
    pub inertia: DVec3,
    /// Centre of mass (m).
    pub position: DVec3,
    /// Unit quaternion (w, x, y, z), principal axes to world.
    pub orientation: [f64; 4],
    /// m/s
    pub velocity: DVec3,
    /// World axes (rad/s).
    pub angular_velocity: DVec3,
}

/// What acts at one point of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointImpulse {
    /// Where (m).
    pub point: DVec3,
    /// Its part of j (N s), not negative.
    pub impulse: f64,
}

/// The impact of two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct PairImpact {
    /// Seconds from the given states to the contact.
    pub time: f64,
    /// What kind of surfaces met; `None` where only a contact was given.
    pub kind: Option<Kind>,
    /// How the time was certified; `None` where only a contact was given.
    pub certificate: Option<Certificate>,
    /// Where they touch (m); where several points do, their mean, weighted by their impulses.
    pub point: DVec3,
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// -v_AB·n before (m/s).
    pub approach_speed: f64,
    /// v_AB·n after (m/s).
    pub separation_speed: f64,
    /// j (N s), the sum over all points: +j n acts on A, -j n on B.
    pub impulse: f64,
    /// The points that touch, all with the same normal.
    pub points: Vec<PointImpulse>,
    /// e
    pub restitution: f64,
    /// ½ (1 - e²) (v_AB·n)² / (1/m_A + 1/m_B + rotation terms) (J).
    pub energy_lost: f64,
    /// Velocities of A and B after (m/s).
    pub velocities: [DVec3; 2],
    /// Angular velocities of A and B after (rad/s).
    pub angular_velocities: [DVec3; 2],
    /// Centres of A and B at the contact (m); of a plane that a body that turns touches, the point touched; of a mesh the
    /// origin of its frame.
    pub positions: [DVec3; 2],
}

impl PairImpact {
    /// The same with A and B exchanged.
    fn swapped(mut self) -> Self {
        self.normal = -self.normal;
        self.velocities.reverse();
        self.angular_velocities.reverse();
        self.positions.reverse();
        self
    }
}

/// How two bodies stand to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// They do not touch.
    Apart,
    /// They touch, v_AB·n < 0.
    CollisionImminent,
    /// They touch, v_AB·n = 0.
    RestingContact,
    /// They touch, v_AB·n > 0.
    MovingAway,
}

impl Class {
    /// Of surfaces that touch, by v_AB·n (m/s): zero is what is within rounding of the `speeds` (m/s) of both.
    fn of(speed: f64, speeds: f64) -> Self {
        if speed.abs() <= RESTING * speeds {
            Self::RestingContact
        } else if speed < 0.0 {
            Self::CollisionImminent
        } else {
            Self::MovingAway
        }
    }

    /// In the notes' words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Apart => "apart",
            Self::CollisionImminent => "collision imminent",
            Self::RestingContact => "resting contact",
            Self::MovingAway => "moving away",
        }
    }
}

/// Why a question about two bodies has no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactError {
    /// Some value is wrong.
    Check(CheckError),
    /// The bodies overlap deeper than touching.
    Overlap {
        /// How deep (m).
        depth: f64,
    },
    /// Bodies that turn stay near each other for so long that the search was given up.
    Undecided {
        /// Seconds up to which there certainly is no impact.
        clear_until: f64,
    },
}

impl fmt::Display for ContactError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Check(error) => error.fmt(f),
            Self::Overlap { depth } => write!(f, "the bodies overlap by {depth:e} m"),
            Self::Undecided { clear_until } => write!(
                f,
                "the bodies do not touch within {clear_until:e} s; whether they do later, staying near each other, was not found"
            ),
        }
    }
}

impl std::error::Error for ContactError {}

impl From<Problem> for ContactError {
    fn from(problem: Problem) -> Self {
        Self::Check(problem.into())
    }
}

/// The pair at the given instant: gap, direction, and whether it touches.
struct Geometry {
    kind: Kind,
    /// From B to A, not normalised: its product with v_AB decides the class.
    direction: DVec3,
    /// Distance of the surfaces (m), negative if they overlap.
    gap: f64,
    touching: f64,
}

fn geometry(a: &Body, b: &Body) -> Result<Geometry, ContactError> {
    let kind = kind(a, b).ok_or_else(|| {
        Problem::new("pair", None, "shape", "plane and plane", "two planes, whose motion is prescribed, cannot collide")
    })?;
    let geometry = match (&a.shape, &b.shape) {
        (Shape::Ball { radius: radius_a }, Shape::Ball { radius: radius_b }) => {
            let direction = a.position - b.position;
            if direction == DVec3::ZERO {
                return Err(ContactError::Overlap { depth: radius_a + radius_b });
            }
            let sum = radius_a + radius_b;
            let largest = a.position.abs().max(b.position.abs()).max_element().max(sum);
            Geometry { kind, direction, gap: direction.length() - sum, touching: touching(largest) }
        }
        (Shape::Ball { radius }, Shape::Plane { normal, offset }) => plane_geometry(kind, a, *radius, *normal, *offset),
        (Shape::Plane { normal, offset }, Shape::Ball { radius }) => {
            let mirrored = plane_geometry(kind, b, *radius, *normal, *offset);
            Geometry { direction: -mirrored.direction, ..mirrored }
        }
        _ => unreachable!("not in the table of pairs"),
    };
    if geometry.gap < -geometry.touching {
        return Err(ContactError::Overlap { depth: -geometry.gap });
    }
    Ok(geometry)
}

fn plane_geometry(kind: Kind, ball: &Body, radius: f64, normal: DVec3, offset: f64) -> Geometry {
    let largest = ball.position.abs().max_element().max(radius).max(offset.abs());
    Geometry { kind, direction: normal, gap: normal.dot(ball.position) - offset - radius, touching: touching(largest) }
}

fn validate(body: &Body, row: i64) -> Result<(), Problem> {
    let wrong = |field, value: String, reason: &str| Err(Problem::new("body", Some(row), field, value, reason));
    let positive = |x: f64| LIMITS.contains(&x);
    match body.shape {
        Shape::Ball { radius } if !positive(radius) => {
            return wrong("radius", radius.to_string(), "must be positive and finite");
        }
        Shape::Plane { normal, .. } if !((normal.length() - 1.0).abs() <= UNIT_LENGTH) => {
            return wrong("normal", normal.to_string(), "must be a unit vector");
        }
        Shape::Plane { offset, .. } if !offset.is_finite() => {
            return wrong("offset", offset.to_string(), "must be finite");
        }
        _ => {}
    }
    if !(positive(body.mass) || body.mass == f64::INFINITY) {
        return wrong("mass", body.mass.to_string(), "must be positive and finite");
    }
    for (field, vector) in
        [("position", body.position), ("velocity", body.velocity), ("angular_velocity", body.angular_velocity)]
    {
        if !(vector.abs().max_element() <= *LIMITS.end()) {
            return wrong(field, vector.to_string(), "must be finite");
        }
    }
    Ok(())
}

/// The two as bodies of which one turns or both, or a body and a mesh; `None` of balls and planes.
fn turning_pair(a: &Body, b: &Body) -> Result<Option<turning::Pair>, ContactError> {
    validate(a, 0)?;
    validate(b, 1)?;
    let plain = |body: &Body| body.shape.kind().is_some();
    Ok(if plain(a) && plain(b) { None } else { Some(turning::Pair::new(a, b)?) })
}

/// How two bodies stand to each other, by the notes' classification. Balls and planes touch within
/// [`touching`](crate::tolerance::touching), bodies that turn or meshes within δ,
/// [`contact`](crate::tolerance::contact). Of several points that touch, the one that approaches fastest decides.
///
/// # Errors
/// If a value is wrong, or if they overlap deeper than touching.
pub fn classify(a: &Body, b: &Body) -> Result<Class, ContactError> {
    if let Some(pair) = turning_pair(a, b)? {
        return pair.classify();
    }
    let geometry = geometry(a, b)?;
    if geometry.gap > geometry.touching {
        return Ok(Class::Apart);
    }
    let relative = a.velocity - b.velocity;
    let speed = geometry.direction.normalize().dot(relative);
    Ok(Class::of(speed, a.velocity.length() + b.velocity.length()))
}

/// The first impact of two bodies in free flight without gravity, or `None` if they never meet. Bodies turn freely until then,
/// as known in closed form. A compound that touches in several directions at one instant gets the impact of the one in which
/// it approaches fastest.
///
/// # Errors
/// If a value is wrong, if both motions are prescribed, if they overlap deeper than touching, or if bodies that turn stay near
/// each other for so long that whether they touch is not found.
pub fn collide(a: &Body, b: &Body, restitution: f64) -> Result<Option<PairImpact>, ContactError> {
    check_restitution(restitution)?;
    let turning = turning_pair(a, b)?;
    if let Some(pair) = turning {
        check_free(a, b)?;
        let impact = pair.collide(restitution)?;
        return Ok(impact.map(|mut impact| {
            // Smooth impacts do not ask for the spin of a ball.
            for (body, spin) in [a, b].into_iter().zip(&mut impact.angular_velocities) {
                if body.shape.kind().is_some() {
                    *spin = body.angular_velocity;
                }
            }
            impact
        }));
    }
    let geometry = geometry(a, b)?;
    check_free(a, b)?;
    let relative = a.velocity - b.velocity;
    let seconds = match (&a.shape, &b.shape) {
        (Shape::Ball { radius: radius_a }, Shape::Ball { radius: radius_b }) => {
            ball_ball::time_of_impact(geometry.direction, relative, radius_a + radius_b)
        }
        _ => ball_plane::time_of_impact(geometry.gap, geometry.direction.dot(relative), 0.0, false),
    };
    let Some(seconds) = seconds.filter(|seconds| seconds.is_finite()) else { return Ok(None) };
    let positions = [a.position + a.velocity * seconds, b.position + b.velocity * seconds];
    let direction = if geometry.kind == Kind::BallBall { positions[0] - positions[1] } else { geometry.direction };
    let length = direction.length();
    let normal = direction / length;
    let approach = -direction.dot(relative);
    if approach <= 0.0 {
        // A grazing root whose contact, by rounding, does not approach.
        return Ok(None);
    }
    let approach_speed = approach_speed(-normal.dot(relative), || approach / length);
    let contact = Contact {
        normal,
        velocity_a: a.velocity,
        velocity_b: b.velocity,
        mass_a: a.mass,
        mass_b: b.mass,
        restitution,
        approach_speed,
    };
    let kinetic =
        |body: &Body| if body.mass.is_finite() { 0.5 * body.mass * body.velocity.length_squared() } else { 0.0 };
    let carried = (restitution == 1.0).then(|| kinetic(a) + kinetic(b) + contact.work_of_prescribed());
    let outcome = contact.resolve(carried, |velocity_a, velocity_b| direction.dot(velocity_a - velocity_b) >= 0.0);
    let point = match (&a.shape, &b.shape) {
        (Shape::Ball { radius }, _) => positions[0] - normal * *radius,
        (_, Shape::Ball { radius }) => positions[1] + normal * *radius,
        _ => positions[0],
    };
    let impulse = contact.impulse(&outcome);
    Ok(Some(PairImpact {
        time: seconds,
        kind: Some(geometry.kind),
        certificate: Some(Certificate::ClosedForm),
        point,
        normal,
        approach_speed,
        separation_speed: (outcome.velocity_a - outcome.velocity_b).dot(normal),
        impulse,
        points: vec![PointImpulse { point, impulse }],
        restitution,
        energy_lost: contact.energy_lost(),
        velocities: [outcome.velocity_a, outcome.velocity_b],
        angular_velocities: [a.angular_velocity, b.angular_velocity],
        positions,
    }))
}

fn check_restitution(restitution: f64) -> Result<(), Problem> {
    if (0.0..=1.0).contains(&restitution) {
        Ok(())
    } else {
        Err(Problem::new("pair", None, "restitution", restitution, "must be from 0 to 1"))
    }
}

fn check_free(a: &Body, b: &Body) -> Result<(), Problem> {
    if a.mass == f64::INFINITY && b.mass == f64::INFINITY {
        return Err(Problem::new("pair", None, "fixed", true, "two bodies in prescribed motion cannot collide"));
    }
    Ok(())
}

/// A body's answer to an impulse: nothing of one in prescribed motion.
fn mobility(body: &Body, row: i64) -> Result<Mobility, Problem> {
    if body.mass == f64::INFINITY {
        return Ok(Mobility::NONE);
    }
    check_turning(body, row)?;
    let [w, x, y, z] = body.orientation;
    let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    Ok(Mobility::new(body.mass, body.inertia, axes))
}

/// The numbers of how a body turns; the inertia only where it is free.
fn check_turning(body: &Body, row: i64) -> Result<(), Problem> {
    let positive = body.inertia.is_finite() && body.inertia.min_element() > 0.0;
    if body.mass.is_finite() && !positive {
        return Err(Problem::new("body", Some(row), "inertia", body.inertia, "must be positive and finite"));
    }
    let [w, x, y, z] = body.orientation;
    let norm = (w * w + x * x + y * y + z * z).sqrt();
    if !((norm - 1.0).abs() <= UNIT_LENGTH) {
        return Err(Problem::new(
            "body",
            Some(row),
            "orientation",
            format!("{:?}", body.orientation),
            "must be a unit quaternion (w, x, y, z)",
        ));
    }
    Ok(())
}

/// The impact of two rigid bodies at a given contact, without friction:
/// j = -(1 + e) v_AB·n / (1/m_A + 1/m_B + n·[(I_A⁻¹ (r_A × n)) × r_A] + n·[(I_B⁻¹ (r_B × n)) × r_B]), v_AB the relative
/// velocity v + ω × r of the points in contact. A contact that rests or moves away gets no impulse.
///
/// # Errors
/// If a value is wrong, or if both motions are prescribed.
pub fn resolve(a: &Body, b: &Body, point: DVec3, normal: DVec3, restitution: f64) -> Result<PairImpact, ContactError> {
    check_restitution(restitution)?;
    validate(a, 0)?;
    validate(b, 1)?;
    check_free(a, b)?;
    if !point.is_finite() {
        return Err(Problem::new("pair", None, "point", point, "must be finite").into());
    }
    if !((normal.length() - 1.0).abs() <= UNIT_LENGTH) {
        return Err(Problem::new("pair", None, "normal", normal, "must be a unit vector").into());
    }
    let twist = |body: &Body| Twist { velocity: body.velocity, angular_velocity: body.angular_velocity };
    let outcome = TurningContact {
        normal,
        points: &[Arms { a: point - a.position, b: point - b.position }],
        mobilities: [mobility(a, 0)?, mobility(b, 1)?],
        twists: [twist(a), twist(b)],
        restitution,
    }
    .resolve(None);
    Ok(PairImpact {
        time: 0.0,
        kind: kind(a, b),
        certificate: None,
        point,
        normal,
        approach_speed: outcome.approach_speed,
        separation_speed: outcome.separation_speed,
        impulse: outcome.impulse,
        points: vec![PointImpulse { point, impulse: outcome.impulse }],
        restitution,
        energy_lost: outcome.energy_lost,
        velocities: outcome.twists.map(|twist| twist.velocity),
        angular_velocities: outcome.twists.map(|twist| twist.angular_velocity),
        positions: [a.position, b.position],
    })
}
