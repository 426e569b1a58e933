//! What is true now: the balls, each with its own clock, the planes, the domain and the materials.

mod arrangement;
pub mod bins;
pub mod cells;
pub mod ids;
pub mod images;
pub mod lists;
pub mod nearby;
pub mod radii;
pub mod rings;
pub mod surroundings;
pub mod turning;

use glam::DVec3;

use crate::flight::Flight;
use crate::scene::Simultaneous;
use crate::time::{Clock, Time};

use self::ids::Ids;
use self::images::Images;
use self::radii::Radii;
use self::surroundings::Surroundings;
use self::turning::{TurningBodies, TurningBody};

/// How space ends along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boundary {
    /// It does not.
    Open,
    /// Two walls, at ± half the size.
    Walls,
    /// What leaves at one side comes in at the other.
    Periodic,
}

/// The region of a scene, centred on the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// One kind an axis.
    pub boundary: [Boundary; 3],
    /// Edge lengths (m); without meaning along open axes.
    pub size: DVec3,
}

impl Domain {
    /// Space without an end.
    pub const OPEN: Self = Self { boundary: [Boundary::Open; 3], size: DVec3::ZERO };

    /// Edge length along periodic axes, 0 along the others.
    pub fn periods(&self) -> DVec3 {
        let period = |axis: usize| if self.boundary[axis] == Boundary::Periodic { self.size[axis] } else { 0.0 };
        DVec3::new(period(0), period(1), period(2))
    }

    /// Whether any axis is periodic (angular momentum then has no meaning).
    pub fn is_periodic(&self) -> bool {
        self.boundary.contains(&Boundary::Periodic)
    }
}

/// A plane: the points with normal·x = offset at the start, moving at a constant velocity. Its mass is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Identity: as a body's; walls of the domain have -1 … -6 (x low, x high, y low, …).
    pub id: i64,
    /// Unit vector to the free side.
    pub normal: DVec3,
    /// Distance of the plane from the origin along `normal` at `start` (m).
    pub offset: f64,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// When `offset` was true.
    pub start: Time,
    /// Index of its material.
    pub material: u32,
}

impl Plane {
    /// Distance of the plane from the origin along its normal (m).
    #[inline(always)]
    pub fn offset_at(&self, time: Time) -> f64 {
        self.offset + self.velocity.dot(self.normal) * time.since(self.start)
    }
}

/// Spin of balls: a smooth impact neither changes it nor asks for it, so each ball turns at a constant rate for ever.
#[derive(Clone, Debug, PartialEq)]
pub struct Spin {
    /// Unit quaternions (w, x, y, z), body to world, at the start.
    pub orientation: Vec<[f64; 4]>,
    /// World axes (rad/s).
    pub angular_velocity: Vec<DVec3>,
    /// Moment of inertia about the centre (kg m²).
    pub inertia: Vec<f64>,
    /// When `orientation` was true.
    pub start: Time,
}

/// Restitution by pair of materials.
#[derive(Clone, Debug, PartialEq)]
pub struct RestitutionTable {
    materials: usize,
    values: Vec<f64>,
}

impl RestitutionTable {
    /// The same `restitution` for every pair of so many materials.
    pub fn uniform(materials: usize, restitution: f64) -> Self {
        Self { materials, values: vec![restitution; materials * materials] }
    }

    /// Sets the pair's coefficient, both ways round.
    pub fn set(&mut self, a: usize, b: usize, restitution: f64) {
        self.values[a * self.materials + b] = restitution;
        self.values[b * self.materials + a] = restitution;
    }

    /// The pair's coefficient of restitution.
    #[inline(always)]
    pub fn of(&self, a: u32, b: u32) -> f64 {
        self.values[a as usize * self.materials + b as usize]
    }

    /// Whether any pair loses energy.
    pub fn is_lossy(&self) -> bool {
        self.values.iter().any(|&e| e < 1.0)
    }
}

/// Whom a ball meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Partner(u32);

impl Partner {
    const PLANE: u32 = 1 << 31;
    const MESH: u32 = 3 << 30;
    /// Nobody.
    pub const NONE: Self = Self(u32::MAX);

    /// The ball in this row.
    #[inline(always)]
    pub fn ball(row: u32) -> Self {
        Self(row)
    }

    /// The plane in this row.
    #[inline(always)]
    pub fn plane(row: u32) -> Self {
        Self(row | Self::PLANE)
    }

    /// The mesh in this row.
    #[inline(always)]
    pub fn mesh(row: u32) -> Self {
        Self(row | Self::MESH)
    }

    /// The row among the planes, if it is a plane.
    #[inline(always)]
    pub fn as_plane(self) -> Option<usize> {
        (self.0 & Self::MESH == Self::PLANE).then_some((self.0 & !Self::PLANE) as usize)
    }

    /// The row among the meshes, if it is a mesh.
    #[inline(always)]
    pub fn as_mesh(self) -> Option<usize> {
        (self.0 & Self::MESH == Self::MESH && self != Self::NONE).then_some((self.0 & !Self::MESH) as usize)
    }

    /// The row among the balls, if it is a ball.
    #[inline(always)]
    pub fn as_ball(self) -> Option<usize> {
        (self.0 & Self::PLANE == 0).then_some(self.0 as usize)
    }

    /// As a number, for checkpoints.
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The same, with the row of a ball replaced.
    pub fn with_ball(self, row: impl FnOnce(u32) -> u32) -> Self {
        if self.as_ball().is_some() { Self(row(self.0)) } else { self }
    }

    /// From a number, for checkpoints.
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}

/// What an impact reads and writes of a ball beside its flight.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Body {
    /// Mass (kg); infinite for fixed balls.
    pub mass: f64,
    /// Energy carried from impact to impact (J): kinetic and in gravity. It is changed by work and loss only, never
    /// recomputed from the velocity while impacts are elastic, so that rounding cannot add up.
    pub energy: f64,
    /// Index of the material.
    pub material: u32,
    /// Partner of the last impact.
    pub last_partner: Partner,
    /// The ball's place in the order of ids.
    pub rank: u32,
}

/// All balls and planes. Balls lie in memory in any order; [`World::row`] tells the row of each in the order of ids.
#[derive(Clone, Debug)]
pub struct World {
    /// Seconds become instants by this clock.
    pub clock: Clock,
    /// When the run started.
    pub start: Time,
    /// 2: z is held at zero; 3.
    pub dimensions: u8,
    /// Acceleration of every free ball (m/s²).
    pub gravity: DVec3,
    /// The region.
    pub domain: Domain,
    /// Restitution by material.
    pub restitution: RestitutionTable,
    /// The row of each ball, in the order of ids.
    pub rows: Vec<u32>,
    /// Identities of the balls, by rank; by row: [`World::id`].
    pub ids: Ids,
    /// Their flights.
    pub flights: Vec<Flight>,
    /// Their radii (m).
    pub radii: Radii,
    /// What else an impact needs.
    pub bodies: Vec<Body>,
    /// Impacts so far, apart from the rest because predictions ask for those of others: another count, and a prediction is
    /// stale.
    pub impacts: Vec<u32>,
    /// Periodic images: how many sizes the ball has travelled beyond its stored position. Empty without periodic axes.
    pub images: Images,
    /// Planes and walls, ascending by id.
    pub planes: Vec<Plane>,
    /// Meshes of triangles, ascending by id.
    pub meshes: Vec<Surroundings>,
    /// Spin, if any ball has one or is turned.
    pub spin: Option<Spin>,
    /// The bodies that turn, if there are any, or meshes that they or balls may meet. Their `radii` are those of the spheres
    /// around them.
    pub turning: Option<TurningBodies>,
    /// What is done where several pairs touch at one instant.
    pub simultaneous: Simultaneous,
    /// While balls are placed: all radii grow.
    pub growth: Option<Growth>,
}

/// Radii that grow in time: radius × (initial + rate × (t - start)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Factor on the stored radii at the start.
    pub initial: f64,
    /// Growth of the factor (1/s).
    pub rate: f64,
    /// When it began.
    pub start: Time,
}

impl Growth {
    /// Factor on the stored radii.
    #[inline(always)]
    pub fn factor(&self, time: Time) -> f64 {
        self.initial + self.rate * time.since(self.start)
    }
}

impl World {
    /// How many balls there are.
    pub fn len(&self) -> usize {
        self.flights.len()
    }

    /// The row of the ball that is `rank`-th in the order of ids.
    #[inline(always)]
    pub fn row(&self, rank: usize) -> usize {
        self.rows[rank] as usize
    }

    /// The row of the ball with an id.
    pub fn row_of(&self, id: i64) -> Option<usize> {
        self.ids.rank_of(id, self.len()).map(|rank| self.row(rank))
    }

    /// The id of the ball in a row.
    #[inline(always)]
    pub fn id(&self, row: usize) -> i64 {
        self.ids.of_rank(self.bodies[row].rank as usize)
    }

    /// Whether there are no balls.
    pub fn is_empty(&self) -> bool {
        self.flights.is_empty()
    }

    /// Whether the ball's motion is prescribed.
    #[inline(always)]
    pub fn is_fixed(&self, ball: usize) -> bool {
        self.bodies[ball].mass == f64::INFINITY
    }

    /// The body in a row, if it turns.
    #[inline(always)]
    pub fn turning_body(&self, row: usize) -> Option<&TurningBody> {
        self.turning.as_ref().and_then(|turning| turning.at(row))
    }

    /// Whether there is gravity.
    #[inline(always)]
    pub fn has_gravity(&self) -> bool {
        !is_zero(self.gravity)
    }

    /// Whether a ball falls.
    #[inline(always)]
    pub fn falls(&self, ball: usize) -> bool {
        // Most scenes have no gravity: no need to look the mass up.
        self.has_gravity() && !self.is_fixed(ball)
    }

    /// A ball's acceleration (m/s²).
    #[inline(always)]
    pub fn acceleration(&self, ball: usize) -> DVec3 {
        if self.falls(ball) { self.gravity } else { DVec3::ZERO }
    }

    /// A ball's centre (m) at `time`, not wrapped.
    #[inline(always)]
    pub fn position(&self, ball: usize, time: Time) -> DVec3 {
        let flight = &self.flights[ball];
        flight.position_after(time.since(flight.start()), self.acceleration(ball))
    }

    /// A ball's velocity (m/s) at `time`.
    #[inline(always)]
    pub fn velocity(&self, ball: usize, time: Time) -> DVec3 {
        let flight = &self.flights[ball];
        flight.velocity_after(time.since(flight.start()), self.acceleration(ball))
    }

    /// The radii (m) of the largest ball and of the largest beside it.
    pub fn largest_radii(&self) -> [f64; 2] {
        self.radii.iter().fold([0.0, 0.0], |[largest, second], radius| {
            if radius > largest { [radius, largest] } else { [largest, second.max(radius)] }
        })
    }

    /// The least box (m) around all centres at `time`, not wrapped.
    pub fn extent(&self, time: Time) -> (DVec3, DVec3) {
        let positions = || (0..self.len()).map(|ball| self.position(ball, time));
        (positions().fold(DVec3::INFINITY, DVec3::min), positions().fold(DVec3::NEG_INFINITY, DVec3::max))
    }

    /// A ball's radius (m) at `time`.
    #[inline(always)]
    pub fn radius(&self, ball: usize, time: Time) -> f64 {
        match &self.growth {
            None => self.radii[ball],
            Some(growth) => self.radii[ball] * growth.factor(time),
        }
    }

    /// A free ball's potential energy (J) at a `position` of its present image: -m g·x.
    #[inline(always)]
    pub fn potential_energy(&self, ball: usize, position: DVec3) -> f64 {
        if !self.falls(ball) {
            return 0.0;
        }
        -self.bodies[ball].mass * self.gravity.dot(self.unwrapped(ball, position))
    }

    /// A ball's orientation (w, x, y, z), body to world, at `time`: the start's, turned at the constant rate of a smooth
    /// ball, exp(ω t / 2) q.
    pub fn orientation(&self, ball: usize, time: Time) -> [f64; 4] {
        if let Some(body) = self.turning_body(ball) {
            return body.users_orientation_after(time.since(self.flights[ball].start()));
        }
        let Some(spin) = &self.spin else { return [1.0, 0.0, 0.0, 0.0] };
        let [w, x, y, z] = spin.orientation[ball];
        let rate = spin.angular_velocity[ball];
        let speed = rate.length();
        if speed == 0.0 {
            return [w, x, y, z];
        }
        let (sine, cosine) = libm::sincos(0.5 * speed * time.since(spin.start));
        let turn = rate * (sine / speed);
        let part = DVec3::new(x, y, z);
        let vector = part * cosine + turn * w + turn.cross(part);
        [cosine * w - turn.dot(part), vector.x, vector.y, vector.z]
    }

    /// A body's angular velocity (rad/s, world axes) at `time`: constant of a ball.
    pub fn angular_velocity(&self, ball: usize, time: Time) -> DVec3 {
        if let Some(body) = self.turning_body(ball) {
            return body.rotation.angular_velocity_after(time.since(self.flights[ball].start()));
        }
        self.spin.as_ref().map_or(DVec3::ZERO, |spin| spin.angular_velocity[ball])
    }

    /// Orientation (w, x, y, z), to world, and angular velocity (rad/s, world axes) of what has this id at `time`: a body or a
    /// mesh; (1, 0, 0, 0) and 0 of a plane.
    pub fn turns_of(&self, id: i64, time: Time) -> ([f64; 4], DVec3) {
        if let Some(row) = self.row_of(id) {
            return (self.orientation(row, time), self.angular_velocity(row, time));
        }
        match self.meshes.iter().find(|mesh| mesh.id == id) {
            Some(mesh) => {
                let turn = mesh.orientation_at(time);
                ([turn.w, turn.x, turn.y, turn.z], mesh.angular_velocity)
            }
            None => ([1.0, 0.0, 0.0, 0.0], DVec3::ZERO),
        }
    }

    /// Where a ball is (m) at `time` within the periodic box, and how many sizes of the box it has left behind.
    pub fn wrapped(&self, ball: usize, time: Time) -> (DVec3, [i64; 3]) {
        let mut position = self.position(ball, time);
        let mut images = self.images.get(ball).map_or([0; 3], |image| image.map(i64::from));
        let periods = self.domain.periods();
        for axis in 0..3 {
            if periods[axis] > 0.0 {
                let passed = (position[axis] / periods[axis]).round();
                position[axis] -= passed * periods[axis];
                images[axis] += passed as i64;
            }
        }
        (position, images)
    }

    /// A free body's energy (J) right after its last impact: kinetic, without the spin of balls, and in gravity.
    #[inline(always)]
    pub fn energy(&self, ball: usize) -> f64 {
        let flight = &self.flights[ball];
        0.5 * self.bodies[ball].mass * flight.velocity().length_squared()
            + self.potential_energy(ball, flight.position())
            + self.turning_body(ball).map_or(0.0, TurningBody::present_rotational_energy)
    }

    /// A position (m) as if the ball had never been put back into the box.
    pub fn unwrapped(&self, ball: usize, position: DVec3) -> DVec3 {
        match self.images.get(ball) {
            None => position,
            Some(image) => position + DVec3::from_array(image.map(f64::from)) * self.domain.size,
        }
    }
}

/// Whether all components are zero, of either sign: asked so often in an impact that one comparison for three shows.
#[inline(always)]
pub(crate) fn is_zero(v: DVec3) -> bool {
    (v.x.to_bits() | v.y.to_bits() | v.z.to_bits()) << 1 == 0
}
