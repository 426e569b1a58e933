//! Fills of bodies that turn: where they stand, what they share, which energy they have; and what is refused.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use carom::scene::{MeshBody, Placement, Scene, SolidBody, SolidFill};
use carom::shape::{BodyGeometry, Shape, TriangleMesh};
use carom::world::{Boundary, Domain};
use carom::{DQuat, DVec3};

fn shape() -> Shape {
    Shape::cuboid(DVec3::new(1.0, 2.0, 3.0)).expect("a box")
}

fn geometry() -> Arc<BodyGeometry> {
    Arc::new(BodyGeometry::new(&shape()).expect("a body"))
}

fn fill() -> SolidFill {
    SolidFill {
        first_id: 10,
        geometry: geometry(),
        placement: Placement::Fcc,
        count: 100,
        spacing: None,
        mass: Some(2.0),
        density: None,
        temperature: 1.5,
        velocity: DVec3::ZERO,
        center: None,
        size: None,
        material: 0,
    }
}

fn scene(fill: SolidFill) -> Scene {
    let domain = Domain { boundary: [Boundary::Periodic; 3], size: DVec3::splat(30.0) };
    Scene { domain, solid_fills: vec![fill], ..Scene::default() }
}

fn solid(id: i64) -> SolidBody {
    support::solid(id, &shape(), DVec3::ZERO)
}

fn problem(scene: &Scene) -> String {
    scene.build().map(|_| ()).expect_err("a scene that cannot be built").to_string()
}

#[test]
fn bodies_stand_apart_and_share_their_shape() {
    let scene = scene(fill());
    let solids = scene.placed_solids().expect("room");
    assert_eq!(solids.iter().map(|solid| solid.id).collect::<Vec<_>>(), (10..110).collect::<Vec<_>>());
    let shared = &scene.solid_fills[0].geometry;
    assert!(solids.iter().all(|solid| Arc::ptr_eq(&solid.geometry, shared)));
    for (k, a) in solids.iter().enumerate() {
        for b in &solids[..k] {
            let mut apart = a.position - b.position;
            apart -= 30.0 * (apart / 30.0).round();
            assert!(apart.length() >= 2.0 * shared.radius);
        }
    }
}

#[test]
fn the_energy_is_that_of_the_temperature() {
    let scene = scene(fill());
    let solids = scene.placed_solids().expect("room");
    let translation: f64 = solids.iter().map(|solid| 0.5 * solid.mass * solid.velocity.length_squared()).sum();
    let momentum: DVec3 = solids.iter().map(|solid| solid.mass * solid.velocity).sum();
    let rotation: f64 = solids
        .iter()
        .map(|solid| {
            let (_, [w, x, y, z]) =
                solid.geometry.to_principal(solid.position, solid.orientation).expect("a unit quaternion");
            let spin = DQuat::from_xyzw(x, y, z, w).conjugate() * solid.angular_velocity;
            0.5 * solid.mass * (solid.geometry.gyration * spin).dot(spin)
        })
        .sum();
    // Sums of a hundred rounded numbers of about 1.
    assert!((translation - 1.5 * 99.0 * 1.5).abs() < 1e-11);
    assert!((rotation - 1.5 * 100.0 * 1.5).abs() < 1e-11);
    assert!(momentum.length() < 1e-12);
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let bits = |seed: u64| {
        let scene = Scene { seed, ..scene(fill()) };
        let solids = scene.placed_solids().expect("room");
        solids.iter().flat_map(|solid| solid.orientation).map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(bits(1), bits(1));
    assert_ne!(bits(1), bits(2));
}

#[test]
fn what_a_fill_cannot_be() {
    let cases = [
        (SolidFill { placement: Placement::Random, ..fill() }, "placement = random: must be \"cubic\" or \"fcc\""),
        (SolidFill { count: 0, ..fill() }, "count = 0: must be from 1"),
        (SolidFill { count: 100_000, ..fill() }, "placement = fcc: has 500 sites for 100000 bodies in this region"),
        (SolidFill { spacing: Some(3.0), ..fill() }, "spacing = 3: is less than the 3.74165"),
        (SolidFill { spacing: Some(f64::NAN), ..fill() }, "spacing = NaN"),
        (SolidFill { spacing: Some(20.0), ..fill() }, "count = 100: are more than the 4 sites"),
        (SolidFill { size: Some(DVec3::splat(3.0)), ..fill() }, "is too large for the region"),
        (SolidFill { mass: None, ..fill() }, "exactly one of mass and density"),
        (SolidFill { mass: Some(-1.0), ..fill() }, "mass = -1: must be positive"),
        (SolidFill { temperature: -1.0, ..fill() }, "temperature = -1"),
        (SolidFill { material: 7, ..fill() }, "material = 7"),
    ];
    for (fill, expected) in cases {
        let text = problem(&scene(fill));
        assert!(text.contains(expected), "{text}\n{expected}");
    }
}

#[test]
fn numbers_of_solids_are_checked() {
    let of = |solid: SolidBody| Scene { solids: vec![solid], ..Scene::default() };
    let cases = [
        (SolidBody { mass: 0.0, ..solid(1) }, "mass = 0: must be positive and finite"),
        (SolidBody { inertia: Some(DVec3::new(1.0, 1.0, 3.0)), ..solid(1) }, "more than the sum of the two others"),
        (SolidBody { position: DVec3::NAN, ..solid(1) }, "position"),
        (SolidBody { orientation: [1.0, 1.0, 0.0, 0.0], ..solid(1) }, "must be a unit quaternion"),
        (SolidBody { material: 3, ..solid(1) }, "there is no such material"),
        (SolidBody { id: -1, ..solid(1) }, "must be from 0 to"),
    ];
    for (solid, expected) in cases {
        let text = problem(&of(solid));
        assert!(text.contains(expected), "{text}\n{expected}");
    }
    let twice = Scene { solids: vec![solid(1), solid(1)], ..Scene::default() };
    assert!(problem(&twice).contains("is given twice"));
    let flat = Scene { dimensions: 2, solids: vec![solid(1)], ..Scene::default() };
    assert!(problem(&flat).contains("needs dimensions = 3"));
    let triangle = TriangleMesh::new(&[DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]).expect("a triangle");
    let mesh = MeshBody {
        id: 3,
        mesh: Arc::new(triangle),
        position: DVec3::ZERO,
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        material: 0,
    };
    let around = Scene { meshes: vec![mesh], ..Scene::default() };
    assert!(around.build().is_ok());
    let domain = Domain { boundary: [Boundary::Periodic; 3], size: DVec3::ONE };
    assert!(problem(&Scene { domain, ..around }).contains("no place in a periodic domain"));
}
