//! The bodies that turn: their shapes, and how each was oriented and turned right after its last impact.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::Plane;
use crate::predict::turning::solid::Solid;
use crate::resolve::turning::Mobility;
use crate::rotation::Rotation;
use crate::shape::BodyGeometry;

/// A body that turns. Where its centre of mass is stands with those of all others.
#[derive(Clone, Debug)]
pub struct TurningBody {
    /// Its row.
    pub row: u32,
    /// Its shape, along its principal axes.
    pub geometry: Arc<BodyGeometry>,
    /// The shape's convex parts, prepared for prediction.
    pub parts: Arc<[Solid]>,
    /// Principal moments of inertia (kg m²); all equal of a body in prescribed motion, which turns at a constant rate.
    pub moments: DVec3,
    /// Principal axes to world, right after the last impact.
    pub orientation: DQuat,
    /// World axes (rad/s), right after the last impact.
    pub angular_velocity: DVec3,
    /// The free rotation since.
    pub rotation: Rotation,
}

impl TurningBody {
    /// Writes how it turns after an impact.
    pub fn turn_on(&mut self, orientation: DQuat, angular_velocity: DVec3) {
        self.orientation = orientation;
        self.angular_velocity = angular_velocity;
        self.rotation = Rotation::new(self.moments, orientation, angular_velocity);
    }

    /// Kinetic energy (J) of rotation right after the last impact.
    #[inline(never)]
    pub fn present_rotational_energy(&self) -> f64 {
        self.rotational_energy(self.orientation, self.angular_velocity)
    }

    /// Kinetic energy (J) of rotation, ½ ω·I ω, of such an orientation and angular velocity (rad/s, world axes).
    pub fn rotational_energy(&self, orientation: DQuat, angular_velocity: DVec3) -> f64 {
        let along_axes = DMat3::from_quat(orientation).transpose() * angular_velocity;
        0.5 * along_axes.dot(self.moments * along_axes)
    }

    /// Angular momentum about the centre of mass (kg m²/s, world axes), I ω; it stays what it is between impacts.
    pub fn angular_momentum(&self) -> DVec3 {
        let axes = DMat3::from_quat(self.orientation);
        axes * (self.moments * (axes.transpose() * self.angular_velocity))
    }

    /// Its answer to an impulse, if it has this mass (kg) and orientation.
    pub fn mobility(&self, mass: f64, orientation: DQuat) -> Mobility {
        if mass.is_finite() { Mobility::new(mass, self.moments, DMat3::from_quat(orientation)) } else { Mobility::NONE }
    }

    /// Its orientation `seconds` after its last impact (w, x, y, z): the frame in which its shape was given, to world.
    pub fn users_orientation_after(&self, seconds: f64) -> [f64; 4] {
        let principal = self.rotation.orientation_after(seconds);
        self.geometry.to_users(DVec3::ZERO, [principal.w, principal.x, principal.y, principal.z]).1
    }
}

/// All bodies that turn.
#[derive(Clone, Debug)]
pub struct TurningBodies {
    /// For each row of the world, which of them it is; [`TurningBodies::NONE`] of balls.
    places: Vec<u32>,
    bodies: Vec<TurningBody>,
    /// How the half-space behind each plane stands: z to the plane's normal.
    planes: Vec<Rotation>,
    half_space: Solid,
}

impl TurningBodies {
    const NONE: u32 = u32::MAX;

    /// These, among so many rows.
    pub fn new(rows: usize, bodies: Vec<TurningBody>, planes: &[Plane]) -> Self {
        let mut all = Self {
            places: vec![Self::NONE; rows],
            bodies,
            planes: planes.iter().map(|plane| standing(plane.normal)).collect(),
            half_space: Solid::half_space(),
        };
        all.number();
        all
    }

    fn number(&mut self) {
        self.places.fill(Self::NONE);
        for (place, body) in self.bodies.iter().enumerate() {
            self.places[body.row as usize] = place as u32;
        }
    }

    /// The bodies move to other rows.
    pub(super) fn rearrange(&mut self, to: &[u32]) {
        for body in &mut self.bodies {
            body.row = to[body.row as usize];
        }
        self.number();
    }

    /// The body in this row, if it turns.
    #[inline(always)]
    pub fn at(&self, row: usize) -> Option<&TurningBody> {
        self.bodies.get(self.places[row] as usize)
    }

    /// The same, to be written.
    pub fn at_mut(&mut self, row: usize) -> Option<&mut TurningBody> {
        self.bodies.get_mut(self.places[row] as usize)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &TurningBody> {
        self.bodies.iter()
    }

    /// Bytes held, shapes aside.
    pub fn bytes(&self) -> usize {
        self.places.len() * 4 + self.bodies.len() * size_of::<TurningBody>()
    }

    /// The half-space behind the plane in this row, and how it stands.
    pub fn half_space(&self, plane: usize) -> (&Solid, &Rotation) {
        (&self.half_space, &self.planes[plane])
    }
}

/// The rest of what has z along a unit vector.
pub(crate) fn standing(normal: DVec3) -> Rotation {
    // The turn by the angle between them, about what is perpendicular to both: (1 + n·z, z × n), not yet of length 1.
    let turn = if normal.z < -0.5 {
        // Beyond, by way of -z, so that nothing cancels.
        let about = DVec3::NEG_Z.cross(normal);
        DQuat::from_xyzw(about.x, about.y, about.z, 1.0 - normal.z).normalize() * DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0)
    } else {
        let about = DVec3::Z.cross(normal);
        DQuat::from_xyzw(about.x, about.y, about.z, 1.0 + normal.z).normalize()
    };
    Rotation::new(DVec3::ONE, turn, DVec3::ZERO)
}
