//! Meshes of triangles in the world: what bodies fall into, lie on or fly around in. Their motion is prescribed.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use crate::predict::turning::motion::Body;
use crate::predict::turning::solid::Solid;
use crate::rotation::Rotation;
use crate::shape::{Bounds, TriangleMesh};
use crate::time::Time;

/// A mesh of triangles with its place. It is a surface, not a volume, and can be touched from both sides.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Identity.
    pub id: i64,
    /// The triangles, in a frame of their own.
    pub mesh: Arc<TriangleMesh>,
    /// Where the origin of that frame is at `start` (m).
    pub position: DVec3,
    /// Velocity (m/s) of that origin.
    pub velocity: DVec3,
    /// Orientation of that frame at `start`, to world.
    pub orientation: DQuat,
    /// World axes (rad/s).
    pub angular_velocity: DVec3,
    /// When position and orientation were true.
    pub start: Time,
    /// Index of its material.
    pub material: u32,
    /// How it is oriented since.
    pub rotation: Rotation,
    /// Distance (m) of the farthest vertex from the origin of the frame.
    pub reach: f64,
    /// Half the diagonal (m) of a triangle's box, on average.
    pub triangle_size: f64,
}

impl Surroundings {
    /// A mesh with its place at `start`, oriented by a unit quaternion (w, x, y, z).
    pub fn new(id: i64, mesh: Arc<TriangleMesh>, position: DVec3, orientation: [f64; 4], start: Time) -> Self {
        let [w, x, y, z] = orientation;
        let orientation = DQuat::from_xyzw(x, y, z, w).normalize();
        let sizes = (0..mesh.triangles.len() as u32).map(|triangle| Bounds::around(mesh.corners(triangle)));
        Self {
            id,
            position,
            velocity: DVec3::ZERO,
            orientation,
            angular_velocity: DVec3::ZERO,
            start,
            material: 0,
            rotation: Rotation::new(DVec3::ONE, orientation, DVec3::ZERO),
            reach: mesh.reach(),
            triangle_size: sizes.map(|bounds| bounds.half_diagonal()).sum::<f64>() / mesh.triangles.len() as f64,
            mesh,
        }
    }

    /// The same, moving at these velocities (m/s, and rad/s about the world's axes).
    pub fn moving(mut self, velocity: DVec3, angular_velocity: DVec3) -> Self {
        (self.velocity, self.angular_velocity) = (velocity, angular_velocity);
        self.rotation = Rotation::new(DVec3::ONE, self.orientation, angular_velocity);
        self
    }

    /// Where the origin of its frame is (m) at `time`.
    pub fn position_at(&self, time: Time) -> DVec3 {
        self.position + self.velocity * time.since(self.start)
    }

    /// How its frame is oriented at `time`, to world.
    pub fn orientation_at(&self, time: Time) -> DQuat {
        self.rotation.orientation_after(time.since(self.start))
    }

    /// A triangle as the search for impacts has it, to be placed by [`Self::body`].
    pub fn triangle(&self, index: u32) -> (Solid, DVec3) {
        let origin = self.origin_of(index);
        (Solid::triangle(&self.mesh, index, origin), origin)
    }

    /// What flies straight as a body: of a mesh that turns only its own origin does, otherwise the middle of each triangle.
    fn origin_of(&self, index: u32) -> DVec3 {
        if self.angular_velocity == DVec3::ZERO {
            Bounds::around(self.mesh.corners(index)).middle()
        } else {
            DVec3::ZERO
        }
    }

    /// That triangle at `time` as a body.
    pub fn body<'a>(&'a self, (solid, origin): &'a (Solid, DVec3), time: Time) -> Body<'a, Rotation> {
        let elapsed = time.since(self.start);
        let arm = if *origin == DVec3::ZERO { DVec3::ZERO } else { self.orientation * *origin };
        Body {
            solid,
            position: self.position_at(time) + arm,
            velocity: self.velocity,
            acceleration: DVec3::ZERO,
            rotation: &self.rotation,
            elapsed,
        }
    }
}
