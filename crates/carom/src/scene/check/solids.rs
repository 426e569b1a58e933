//! The numbers of bodies that turn, and of meshes.

use glam::DVec3;

use super::{finite, why};
use crate::scene::{Scene, SolidBody};
use crate::shape::check_inertia;
use crate::tolerance::{LIMITS, UNIT_LENGTH};

/// Where something is and how it moves.
struct State {
    position: DVec3,
    orientation: [f64; 4],
    velocity: DVec3,
    angular_velocity: DVec3,
    material: u32,
}

/// Checks every number of a scene's bodies that turn and of its meshes; `wrong` takes what, id, field, value and reason.
pub(super) fn values(scene: &Scene, wrong: &mut dyn FnMut(&'static str, i64, &'static str, String, &str)) {
    for solid in &scene.solids {
        if scene.dimensions != 3 {
            wrong("body", solid.id, "shape", String::new(), "needs dimensions = 3");
        }
        if !solid.fixed {
            mass(solid, &mut |field, value, reason| wrong("body", solid.id, field, value, reason));
        }
        let state = State {
            position: solid.position,
            orientation: solid.orientation,
            velocity: solid.velocity,
            angular_velocity: solid.angular_velocity,
            material: solid.material,
        };
        state.check(scene, &mut |field, value, reason| wrong("body", solid.id, field, value, reason));
    }
    for mesh in &scene.meshes {
        let state = State {
            position: mesh.position,
            orientation: mesh.orientation,
            velocity: mesh.velocity,
            angular_velocity: mesh.angular_velocity,
            material: mesh.material,
        };
        if scene.dimensions != 3 {
            wrong("mesh", mesh.id, "shape", String::new(), "needs dimensions = 3");
        }
        if scene.domain.is_periodic() {
            wrong(
                "mesh",
                mesh.id,
                "shape",
                String::new(),
                "has no place in a periodic domain, where it would have images",
            );
        }
        state.check(scene, &mut |field, value, reason| wrong("mesh", mesh.id, field, value, reason));
    }
}

fn mass(solid: &SolidBody, wrong: &mut dyn FnMut(&'static str, String, &str)) {
    if !LIMITS.contains(&solid.mass) {
        wrong("mass", solid.mass.to_string(), why(solid.mass));
    }
    if let Some(Err(error)) = solid.inertia.map(check_inertia) {
        wrong("inertia", solid.inertia.unwrap_or_default().to_string(), &error.to_string());
    }
}

impl State {
    fn check(&self, scene: &Scene, wrong: &mut dyn FnMut(&'static str, String, &str)) {
        for (field, vector) in
            [("position", self.position), ("velocity", self.velocity), ("angular_velocity", self.angular_velocity)]
        {
            if !finite(vector) {
                wrong(field, vector.to_string(), "must be finite, and within 1e75");
            }
        }
        let norm: f64 = self.orientation.iter().map(|x| x * x).sum();
        if !((norm.sqrt() - 1.0).abs() <= UNIT_LENGTH) {
            wrong("orientation", format!("{:?}", self.orientation), "must be a unit quaternion (w, x, y, z)");
        }
        if self.material as usize >= scene.materials {
            wrong("material", self.material.to_string(), "there is no such material");
        }
    }
}
