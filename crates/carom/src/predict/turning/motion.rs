//! Where a freely flying and turning body is, and how much its motion can bend.

use glam::{DMat3, DQuat, DVec3};

use super::solid::Solid;
use crate::rotation::Rotation;

/// A free rotation known in closed form. Seconds count from the body's last impact.
pub trait Turning {
    /// Orientation (body to world) and angular velocity (rad/s, world axes).
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3);
    /// A bound of |ω| (rad/s) at all times.
    fn fastest(&self) -> f64;
    /// A bound of |dω/dt| (rad/s²) at all times; 0 where ω is constant.
    fn fastest_change(&self) -> f64;
}

impl Turning for Rotation {
    #[inline]
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        Rotation::state_after(self, seconds)
    }

    #[inline(always)]
    fn fastest(&self) -> f64 {
        Rotation::fastest(self)
    }

    #[inline(always)]
    fn fastest_change(&self) -> f64 {
        Rotation::fastest_change(self)
    }
}

/// Rotation with constant angular velocity: spherical tops, bodies in prescribed motion. R(t) = exp(ω t) R(0).
#[derive(Clone, Copy, Debug)]
pub struct SteadyRotation {
    /// Orientation at the start, body to world.
    pub orientation: DQuat,
    /// Angular velocity (rad/s), world axes.
    pub angular_velocity: DVec3,
}

impl Turning for SteadyRotation {
    #[inline]
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        (turn(self.angular_velocity, seconds) * self.orientation, self.angular_velocity)
    }

    #[inline(always)]
    fn fastest(&self) -> f64 {
        self.angular_velocity.length()
    }

    #[inline(always)]
    fn fastest_change(&self) -> f64 {
        0.0
    }
}

/// The rotation by the vector `rate` (rad/s) times `seconds`.
#[inline]
fn turn(rate: DVec3, seconds: f64) -> DQuat {
    let speed = rate.length();
    if speed == 0.0 || seconds == 0.0 {
        return DQuat::IDENTITY;
    }
    let (sine, cosine) = libm::sincos(0.5 * speed * seconds);
    let v = rate * (sine / speed);
    DQuat::from_xyzw(v.x, v.y, v.z, cosine)
}

/// Free rotation of a symmetric top with the figure axis z: R(t) = exp(L/I₁ t) R(0) exp(ω₃ (1 − I₃/I₁) t z).
#[derive(Clone, Copy, Debug)]
pub struct SymmetricRotation {
    orientation: DQuat,
    angular_velocity: DVec3,
    precession: DVec3,
    spin: DVec3,
}

impl SymmetricRotation {
    /// From the state at the start and I₃/I₁ (pure number).
    pub fn new(orientation: DQuat, angular_velocity: DVec3, ratio: f64) -> Self {
        let axis = orientation * DVec3::Z;
        let along = axis.dot(angular_velocity);
        let precession = angular_velocity + axis * (along * (ratio - 1.0));
        Self { orientation, angular_velocity, precession, spin: DVec3::Z * (along * (1.0 - ratio)) }
    }
}

impl Turning for SymmetricRotation {
    fn state_after(&self, seconds: f64) -> (DQuat, DVec3) {
        let precessed = turn(self.precession, seconds);
        (precessed * self.orientation * turn(self.spin, seconds), precessed * self.angular_velocity)
    }

    fn fastest(&self) -> f64 {
        self.angular_velocity.length()
    }

    fn fastest_change(&self) -> f64 {
        self.precession.cross(self.angular_velocity).length()
    }
}

/// A body in free flight at the instant from which a prediction counts.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a, R> {
    /// Its shape.
    pub solid: &'a Solid,
    /// Centre of mass (m).
    pub position: DVec3,
    /// Velocity (m/s) of the centre.
    pub velocity: DVec3,
    /// Acceleration (m/s²) of the centre, constant.
    pub acceleration: DVec3,
    /// Its free rotation.
    pub rotation: &'a R,
    /// Seconds from the start of `rotation` to the instant from which the prediction counts.
    pub elapsed: f64,
}

/// How a body stands and turns at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Pose<'a> {
    /// Its shape.
    pub solid: &'a Solid,
    /// Body to world.
    pub to_world: DMat3,
    /// Angular velocity (rad/s), world axes.
    pub angular_velocity: DVec3,
}

impl<'a> Pose<'a> {
    /// Of a body, `seconds` after the instant from which the prediction counts.
    #[inline(always)]
    pub fn of<R: Turning>(body: &Body<'a, R>, seconds: f64) -> Self {
        let (orientation, angular_velocity) = body.rotation.state_after(body.elapsed + seconds);
        Self { solid: body.solid, to_world: DMat3::from_quat(orientation), angular_velocity }
    }

    /// A world direction in the frame of the body.
    #[inline(always)]
    pub fn to_body(&self, d: DVec3) -> DVec3 {
        let m = &self.to_world;
        DVec3::new(m.x_axis.dot(d), m.y_axis.dot(d), m.z_axis.dot(d))
    }

    /// A vector of the body in world axes.
    #[inline(always)]
    pub fn to_world(&self, p: DVec3) -> DVec3 {
        let m = &self.to_world;
        m.x_axis * p.x + m.y_axis * p.y + m.z_axis * p.z
    }
}
