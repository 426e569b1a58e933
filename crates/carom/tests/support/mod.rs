//! What the tests of physical laws share.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{Ball, Balls, Fill, Placement, PlaneBody, RadiusDistribution, Scene, SolidBody};
use carom::shape::{BodyGeometry, Shape};
use carom::simulation::{Simulation, Stop};
use carom::world::{Boundary, Domain};

pub const EPSILON: f64 = f64::EPSILON;

pub fn vector(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

pub fn ball(id: i64, position: DVec3, velocity: DVec3, radius: f64, mass: f64) -> Ball {
    Ball { id, position, velocity, radius, mass, material: 0, fixed: false }
}

pub fn fixed(id: i64, position: DVec3, velocity: DVec3, radius: f64) -> Ball {
    Ball { id, position, velocity, radius, mass: 1.0, material: 0, fixed: true }
}

pub fn balls(list: impl IntoIterator<Item = Ball>) -> Balls {
    let mut balls = Balls::default();
    for ball in list {
        balls.push(ball, 3);
    }
    balls
}

pub fn scene(list: impl IntoIterator<Item = Ball>) -> Scene {
    Scene { balls: balls(list), ..Scene::default() }
}

pub fn plane(id: i64, normal: DVec3, offset: f64) -> PlaneBody {
    PlaneBody { id, normal: normal.normalize(), offset, velocity: DVec3::ZERO, material: 0 }
}

/// A free body of mass 1 at rest.
pub fn solid(id: i64, shape: &Shape, position: DVec3) -> SolidBody {
    SolidBody {
        id,
        geometry: Arc::new(BodyGeometry::new(shape).unwrap()),
        position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        mass: 1.0,
        inertia: None,
        material: 0,
        fixed: false,
    }
}

pub fn cube(kind: Boundary, size: f64) -> Domain {
    Domain { boundary: [kind; 3], size: DVec3::splat(size) }
}

pub fn start(scene: &Scene) -> Simulation {
    Simulation::new(scene.build().unwrap().0, true)
}

/// Runs for so many impacts, however long that takes.
pub fn run_impacts(simulation: &mut Simulation, impacts: u64) {
    let far = simulation.world().clock.at(1e300);
    assert_eq!(simulation.run(far, impacts, u64::MAX).unwrap(), Stop::Impacts);
}

pub fn run_until(simulation: &mut Simulation, seconds: f64) {
    let until = simulation.world().clock.at(seconds);
    simulation.run(until, u64::MAX, u64::MAX).unwrap();
}

pub fn positions(simulation: &Simulation) -> Vec<DVec3> {
    let world = simulation.world();
    (0..world.len()).map(|rank| world.position(world.row(rank), simulation.now())).collect()
}

pub fn velocities(simulation: &Simulation) -> Vec<DVec3> {
    let world = simulation.world();
    (0..world.len()).map(|rank| world.velocity(world.row(rank), simulation.now())).collect()
}

/// A gas of equal balls of diameter 1, mass 1 and kT = 1 in a periodic box.
pub fn gas(count: u64, packing: f64, placement: Placement, seed: u64) -> Scene {
    let size = (count as f64 * std::f64::consts::PI / 6.0 / packing).cbrt();
    Scene {
        seed,
        domain: cube(Boundary::Periodic, size),
        fills: vec![Fill {
            first_id: 0,
            placement,
            count: Some(count),
            packing: None,
            radius: RadiusDistribution::Constant(0.5),
            mass: Some(1.0),
            density: None,
            temperature: 1.0,
            velocity: DVec3::ZERO,
            center: None,
            size: None,
            material: 0,
        }],
        ..Scene::default()
    }
}

/// A small generator for tests: uniform in [0, 1).
pub struct Lcg(pub u64);

impl Lcg {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = vector(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let length = v.length();
            if length > 0.1 && length < 1.0 {
                return v / length;
            }
        }
    }
}

/// The deepest overlap of any two balls, in units of the smaller radius, and of any ball with a plane. O(N²).
pub fn deepest_overlap(simulation: &Simulation) -> f64 {
    let world = simulation.world();
    let at = positions(simulation);
    let radii: Vec<f64> = (0..at.len()).map(|rank| world.radii[world.row(rank)]).collect();
    let periods = world.domain.periods();
    let mut deepest = f64::NEG_INFINITY;
    for a in 0..at.len() {
        for b in 0..a {
            let mut r = at[a] - at[b];
            for axis in 0..3 {
                if periods[axis] > 0.0 {
                    r[axis] -= (r[axis] / periods[axis]).round() * periods[axis];
                }
            }
            let smaller = radii[a].min(radii[b]);
            deepest = deepest.max((radii[a] + radii[b] - r.length()) / smaller);
        }
        for plane in &world.planes {
            let gap = plane.normal.dot(at[a]) - plane.offset_at(simulation.now()) - radii[a];
            deepest = deepest.max(-gap / radii[a]);
        }
    }
    deepest
}
