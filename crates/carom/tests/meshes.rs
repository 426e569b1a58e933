//! Bodies and meshes of triangles: as on a plane where the mesh is one, by closed forms elsewhere, and nothing gets through.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use std::sync::Arc;

use carom::DVec3;
use carom::event::Kind;
use carom::record::Impact;
use carom::scene::{MeshBody, Scene, SolidBody};
use carom::shape::{Platonic, Shape, TriangleMesh};
use carom::simulation::Simulation;
use glam::DQuat;
use support::{Lcg, ball, plane, run_impacts, scene, start, vector};

const MESH: i64 = 1000;

fn surroundings(vertices: &[DVec3], triangles: &[[u32; 3]]) -> MeshBody {
    MeshBody {
        id: MESH,
        mesh: Arc::new(TriangleMesh::new(vertices, triangles).unwrap()),
        position: DVec3::ZERO,
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
        material: 0,
    }
}

/// The square |x|, |y| ≤ half in n × n fields of two triangles, at the heights of a function.
fn terrain(half: f64, n: u32, height: impl Fn(f64, f64) -> f64) -> MeshBody {
    let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(n) - 1.0);
    let mut vertices = Vec::new();
    for j in 0..=n {
        vertices.extend((0..=n).map(|i| vector(at(i), at(j), height(at(i), at(j)))));
    }
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    surroundings(&vertices, &triangles)
}

/// A cube of triangles, two a side.
fn closed_box(half: f64) -> MeshBody {
    let vertices: Vec<DVec3> = (0..8)
        .map(|k| DVec3::from_array([0, 1, 2].map(|axis| if k >> axis & 1 == 1 { half } else { -half })))
        .collect();
    let triangles = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ];
    surroundings(&vertices, &triangles)
}

fn solid(id: i64, shape: &Shape, position: DVec3, velocity: DVec3, angular_velocity: DVec3) -> SolidBody {
    SolidBody { velocity, angular_velocity, ..support::solid(id, shape, position) }
}

fn shapes(size: f64) -> Vec<Shape> {
    let polyhedron = |kind: Platonic| Shape::from(kind.with_edge(size).unwrap());
    vec![
        Shape::cuboid(vector(size, 0.7 * size, 1.3 * size)).unwrap(),
        Shape::Capsule { radius: 0.4 * size, half_length: 0.5 * size },
        Shape::Cylinder { radius: 0.5 * size, half_length: 0.4 * size },
        Shape::Ellipsoid { semi_axes: vector(0.4, 0.5, 0.7) * size },
        polyhedron(Platonic::Tetrahedron),
        polyhedron(Platonic::Icosahedron),
    ]
}

fn next(simulation: &mut Simulation) -> Option<Impact> {
    let far = simulation.world().clock.at(1e6);
    simulation.step(far).unwrap()
}

fn seconds(impact: &Impact) -> f64 {
    impact.time.to_pair().0
}

/// The floor, inclined, of triangles or a plane: the same bounces. Rounding grows by a factor with each bounce of a body that
/// turns, so that those are compared for a few only.
#[test]
fn an_inclined_floor_of_triangles_is_as_good_as_a_plane() {
    let tilt = DQuat::from_axis_angle(vector(0.3, 1.0, 0.1).normalize(), 0.35);
    let normal = tilt * DVec3::Z;
    for n in [1, 2, 7, 40] {
        let mut bodies = Scene { gravity: vector(0.1, 0.05, -9.81), ..scene([]) };
        bodies.balls = support::balls([ball(0, vector(0.01, 0.02, 1.0), vector(0.5, -0.3, 0.0), 0.05, 1.0)]);
        for (k, shape) in (1..).zip(shapes(0.2)) {
            let at = vector(0.9 * k as f64 - 3.0, 0.6, 1.5);
            bodies.solids.push(solid(k, &shape, at, vector(0.2, 0.3, 0.0), vector(1.0, -2.0, 0.5)));
        }
        let mut floor = terrain(20.0, n, |_, _| 0.0);
        floor.orientation = [tilt.w, tilt.x, tilt.y, tilt.z];
        let on_mesh = Scene { meshes: vec![floor], ..bodies.clone() };
        let on_plane = Scene { planes: vec![plane(MESH, normal, 0.0)], ..bodies };
        let (mut on_mesh, mut on_plane) = (start(&on_mesh), start(&on_plane));
        for impact in 0..18 {
            let (a, b) = (next(&mut on_mesh).unwrap(), next(&mut on_plane).unwrap());
            assert_eq!((a.a, a.b), (b.a, b.b), "{n} fields, impact {impact}");
            let tolerance = 1e-9;
            assert!((seconds(&a) - seconds(&b)).abs() < tolerance, "{n}, {impact}: {a:?} {b:?}");
            assert!((a.normal - b.normal).length() < 1e-14, "{n}, {impact}: {} {}", a.normal, b.normal);
            for k in 0..4 {
                assert!((a.velocities[k] - b.velocities[k]).length() < tolerance, "{n}, {impact}: {a:?} {b:?}");
            }
        }
    }
}

/// Straight down on a corner, on seams and beside them by less than rounding of the contact: the normal is the floor's, exactly.
#[test]
fn seams_are_not_felt() {
    let radius = 0.3;
    for (x, y) in
        [(0.0, 0.0), (0.25, 0.25), (0.25, 0.0), (0.25, 1e-7), (0.25, -1e-8), (0.1 + 1e-9, 0.1), (1e-12, -1e-12)]
    {
        for velocity in [vector(0.0, 0.0, -1.0), vector(0.7, -0.4, -0.5)] {
            let touch = vector(x, y, 0.0);
            let scene = Scene {
                meshes: vec![terrain(2.0, 4, |_, _| 0.0)],
                ..scene([ball(0, touch + DVec3::Z * radius - velocity * 2.0, velocity, radius, 1.0)])
            };
            let mut simulation = start(&scene);
            let impact = next(&mut simulation).unwrap();
            assert_eq!(impact.normal, DVec3::Z, "{x}, {y}");
            assert_eq!(impact.kind, Kind::BallFace, "{x}, {y}");
            assert!((seconds(&impact) - 2.0).abs() < 1e-12, "{x}, {y}: {}", seconds(&impact));
            assert!(next(&mut simulation).is_none(), "{x}, {y}");
        }
    }
}

/// A ball that slides over the floor without approaching it meets nothing at seams.
#[test]
fn a_ball_slides_over_seams() {
    let mut scene = Scene {
        meshes: vec![terrain(3.0, 12, |_, _| 0.0)],
        ..scene([ball(0, vector(-1.0, 0.013, 0.5), vector(1.0, 0.1, 0.0), 0.5, 1.0)])
    };
    assert!(next(&mut start(&scene)).is_none());
    scene.balls.positions[0].z += 1e-13;
    assert!(next(&mut start(&scene)).is_none());
}

/// |x + v t + g t²/2 − p| = r for a corner, and the same across an edge, solved by bisection.
fn first_contact(gap: impl Fn(f64) -> f64, end: f64) -> f64 {
    let steps = 100_000;
    let k = (0..steps).find(|k| gap(end * f64::from(k + 1) / f64::from(steps)) < 0.0).unwrap();
    let (mut low, mut high) = (end * f64::from(k) / f64::from(steps), end * f64::from(k + 1) / f64::from(steps));
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if gap(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn a_ball_meets_ridges_and_corners_when_the_closed_form_says() {
    let (x, v, g, radius) = (vector(0.1, 0.03, 2.0), vector(0.02, 0.05, 0.0), vector(0.0, 0.0, -9.81), 0.4);
    let at = |t: f64| x + v * t + 0.5 * g * t * t;
    // A roof with its ridge along y, and a pyramid.
    let roof = surroundings(
        &[
            vector(-2.0, -2.0, -1.0),
            vector(0.0, -2.0, 0.0),
            vector(2.0, -2.0, -1.0),
            vector(-2.0, 2.0, -1.0),
            vector(0.0, 2.0, 0.0),
            vector(2.0, 2.0, -1.0),
        ],
        &[[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
    );
    let pyramid = surroundings(
        &[
            vector(-2.0, -2.0, -2.0),
            vector(2.0, -2.0, -2.0),
            vector(2.0, 2.0, -2.0),
            vector(-2.0, 2.0, -2.0),
            DVec3::ZERO,
        ],
        &[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    );
    let flat = |p: DVec3| vector(p.x, 0.0, p.z);
    for (mesh, kind, across) in [(roof, Kind::BallEdge, true), (pyramid, Kind::BallVertex, false)] {
        let from = |t: f64| if across { flat(at(t)) } else { at(t) };
        let expected = first_contact(|t| from(t).length() - radius, 1.0);
        let scene = Scene { gravity: g, meshes: vec![mesh], ..scene([ball(0, x, v, radius, 1.0)]) };
        let impact = next(&mut start(&scene)).unwrap();
        assert_eq!(impact.kind, kind);
        assert!((seconds(&impact) - expected).abs() < 1e-12, "{} {expected}", seconds(&impact));
        assert!((impact.normal - from(expected).normalize()).length() < 1e-11);
    }
}

/// In a right-angled valley, along its axis of symmetry: both sides at one instant, and back the way it came.
#[test]
fn a_ball_in_a_valley_comes_back() {
    let valley = surroundings(
        &[
            vector(-2.0, -3.0, 2.0),
            vector(0.0, -3.0, 0.0),
            vector(2.0, -3.0, 2.0),
            vector(-2.0, 3.0, 2.0),
            vector(0.0, 3.0, 0.0),
            vector(2.0, 3.0, 2.0),
        ],
        &[[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
    );
    let radius = 0.5;
    let scene =
        Scene { meshes: vec![valley], ..scene([ball(0, vector(0.0, 0.1, 3.0), vector(0.0, 0.2, -1.0), radius, 1.0)]) };
    let mut simulation = start(&scene);
    let (first, second) = (next(&mut simulation).unwrap(), next(&mut simulation).unwrap());
    let expected = 3.0 - radius * 2.0_f64.sqrt();
    for impact in [first, second] {
        assert!((seconds(&impact) - expected).abs() < 1e-12);
        assert!((impact.normal.x.abs() - 0.5_f64.sqrt()).abs() < 1e-14);
    }
    assert!((second.velocities[2] - vector(0.0, 0.2, 1.0)).length() < 1e-14);
    assert!(next(&mut simulation).is_none());
}

/// A box that lands flat on a floor of however many triangles bounces as on a plane, to the last bit.
#[test]
fn a_box_lands_flat_on_many_triangles() {
    for n in [1, 2, 9, 64] {
        for (x, y) in [(0.0, 0.0), (0.137, -0.22)] {
            let shape = Shape::cuboid(vector(1.0, 0.8, 0.5)).unwrap();
            let body = solid(0, &shape, vector(x, y, 1.0), vector(0.3, 0.1, -1.0), vector(0.0, 0.0, 0.7));
            let mesh = Scene { meshes: vec![terrain(4.0, n, |_, _| 0.0)], solids: vec![body.clone()], ..scene([]) };
            let flat = Scene { planes: vec![plane(MESH, DVec3::Z, 0.0)], solids: vec![body], ..scene([]) };
            let (on_mesh, on_plane) = (next(&mut start(&mesh)).unwrap(), next(&mut start(&flat)).unwrap());
            assert_eq!(on_mesh.velocities, on_plane.velocities, "{n}");
            assert_eq!(on_mesh.kind, Kind::FaceFace);
            assert!((seconds(&on_mesh) - seconds(&on_plane)).abs() < 1e-15);
        }
    }
}

/// A gas of every shape and of balls between walls, or in a box of twelve triangles.
fn gas(seed: u64, mesh: bool) -> Scene {
    let mut random = Lcg(seed);
    let mut gas = scene([]);
    let forms = shapes(0.5);
    for k in 0..27 {
        let at = vector(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) * 1.3 - DVec3::splat(1.3);
        let velocity = random.direction() * random.between(0.5, 1.5);
        if k % 7 == 6 {
            gas.balls.push(ball(i64::from(k), at, velocity, 0.3, 1.0), 3);
        } else {
            let spin = random.direction() * random.between(0.0, 4.0);
            gas.solids.push(solid(i64::from(k), &forms[k as usize % 7], at, velocity, spin));
        }
    }
    if mesh {
        gas.meshes = vec![closed_box(2.0)];
    } else {
        let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        gas.planes = (0..).zip(sides).map(|(k, normal)| plane(MESH + k, normal, -2.0)).collect();
    }
    gas
}

#[test]
fn a_box_of_triangles_is_as_good_as_six_planes() {
    let (mut on_mesh, mut on_planes) = (start(&gas(5, true)), start(&gas(5, false)));
    // Chaos multiplies a difference by about ten with each impact of a body: 27 bodies, some eight impacts each.
    for impact in 0..150 {
        let (a, b) = (next(&mut on_mesh).unwrap(), next(&mut on_planes).unwrap());
        assert_eq!((a.a, a.b.min(MESH)), (b.a, b.b.min(MESH)), "impact {impact}");
        assert!((seconds(&a) - seconds(&b)).abs() < 1e-6, "impact {impact}: {} {}", seconds(&a), seconds(&b));
    }
}

/// How far (m) the bodies reach beyond |x| = `half` along any axis, by their own farthest points.
fn deepest_beyond(simulation: &Simulation, half: f64) -> f64 {
    let (world, now) = (simulation.world(), simulation.now());
    let mut deepest = f64::NEG_INFINITY;
    for row in 0..world.len() {
        let at = world.position(row, now);
        for axis in 0..3 {
            for side in [DVec3::AXES[axis], -DVec3::AXES[axis]] {
                let reach = match world.turning_body(row) {
                    None => world.radii[row],
                    Some(body) => {
                        let principal = body.rotation.orientation_after(now.since(world.flights[row].start()));
                        let direction = principal.inverse() * side;
                        body.geometry.shape.support(direction).dot(direction)
                    }
                };
                deepest = deepest.max(side.dot(at) + reach - half);
            }
        }
    }
    deepest
}

#[test]
fn nothing_escapes_from_a_closed_mesh_and_energy_is_kept() {
    let mut simulation = Simulation::new(gas(6, true).build().unwrap().0, false);
    let mut deepest = f64::NEG_INFINITY;
    for _ in 0..100 {
        run_impacts(&mut simulation, 1000);
        deepest = deepest.max(deepest_beyond(&simulation, 2.0));
    }
    let balance = simulation.balance();
    println!("{:?}, deepest {deepest:e} m, energy {:e}", simulation.counts(), balance.energy_error);
    // δ of triangles whose farthest corner is 2√2 m from their middle.
    assert!(deepest <= carom::tolerance::contact(8.0_f64.sqrt(), 6.0), "{deepest:e}");
    assert!(balance.energy_error.abs() < 1e-12);
    // Each impact with a wall books an impulse rounded to ε.
    assert!(balance.momentum_error < 1e-10, "{}", balance.momentum_error);
}

/// The same scene turned, and seen from a moving frame.
#[test]
fn turned_and_moving_surroundings_give_the_same_impacts() {
    let mut scene =
        Scene { meshes: vec![terrain(3.0, 10, |x, y| 0.2 * (3.0 * x).sin() * (2.0 * y).cos())], ..scene([]) };
    scene.solids = (0..)
        .zip(shapes(0.3))
        .map(|(k, shape)| {
            solid(k, &shape, vector(0.8 * k as f64 - 2.0, 0.1, 1.5), vector(0.1, 0.2, -1.0), vector(1.0, 2.0, 3.0))
        })
        .collect();
    let turn = DQuat::from_axis_angle(vector(1.0, -2.0, 0.5).normalize(), 2.0);
    let boost = vector(0.7, -0.3, 0.4);
    let mut other = scene.clone();
    for body in &mut other.solids {
        body.orientation = [turn.w, turn.x, turn.y, turn.z];
        (body.position, body.angular_velocity) = (turn * body.position, turn * body.angular_velocity);
        body.velocity = turn * body.velocity + boost;
    }
    other.meshes[0].orientation = [turn.w, turn.x, turn.y, turn.z];
    other.meshes[0].velocity = boost;
    let (mut first, mut second) = (start(&scene), start(&other));
    for _ in 0..6 {
        let (a, b) = (next(&mut first).unwrap(), next(&mut second).unwrap());
        assert_eq!((a.a, a.b, a.kind), (b.a, b.b, b.kind));
        assert!((seconds(&a) - seconds(&b)).abs() < 1e-11, "{} {}", seconds(&a), seconds(&b));
        assert!((turn * a.normal - b.normal).length() < 1e-11);
        assert!((turn * a.velocities[2] + boost - b.velocities[2]).length() < 1e-10);
    }
}

/// A wall of triangles that turns about the z axis hits a ball at rest: when it has come round, with the speed of that point.
#[test]
fn a_turning_paddle_hits_a_ball_at_rest() {
    let mut paddle = surroundings(
        &[vector(0.0, 0.0, -1.0), vector(2.0, 0.0, -1.0), vector(2.0, 0.0, 1.0), vector(0.0, 0.0, 1.0)],
        &[[0, 1, 2], [0, 2, 3]],
    );
    paddle.angular_velocity = vector(0.0, 0.0, 0.5);
    let radius = 0.2;
    let scene = Scene { meshes: vec![paddle], ..scene([ball(0, vector(0.0, 1.2, 0.1), DVec3::ZERO, radius, 1.0)]) };
    let mut simulation = start(&scene);
    let impact = next(&mut simulation).unwrap();
    let angle = std::f64::consts::FRAC_PI_2 - (radius / 1.2).asin();
    assert!((seconds(&impact) - angle / 0.5).abs() < 1e-11, "{}", seconds(&impact));
    let arm = (1.2 * 1.2 - radius * radius).sqrt();
    // e = 1 off what is infinitely heavy: twice the speed of the point touched, along the normal.
    assert!((impact.velocities[2].length() - 2.0 * 0.5 * arm).abs() < 1e-11);
    assert!(simulation.balance().energy_error.abs() < 1e-13);
}

#[test]
fn a_body_across_the_surface_is_an_overlap_and_one_inside_is_not() {
    let across =
        Scene { meshes: vec![closed_box(2.0)], ..scene([ball(3, vector(1.9, 0.3, 0.0), DVec3::ZERO, 0.25, 1.0)]) };
    let error = across.build().unwrap_err();
    let problem = &error.problems[0];
    assert_eq!((problem.id, problem.other), (Some(3), Some(MESH)));
    assert!((problem.depth.unwrap() - 0.35).abs() < 1e-6 || (problem.depth.unwrap() - 0.15).abs() < 1e-6, "{error}");
    for at in [DVec3::ZERO, vector(5.0, 0.0, 0.0), vector(1.75, 0.0, 0.0)] {
        let scene = Scene { meshes: vec![closed_box(2.0)], ..scene([ball(3, at, DVec3::ZERO, 0.25, 1.0)]) };
        assert!(scene.build().is_ok(), "{at}");
    }
}

#[test]
fn a_run_goes_on_from_a_checkpoint_bit_for_bit() {
    let scene = gas(7, true);
    let mut whole = start(&scene);
    run_impacts(&mut whole, 300);
    let bytes = whole.checkpoint();
    let mut resumed = Simulation::restore(scene.build().unwrap().0, &bytes, true).unwrap();
    for _ in 0..300 {
        assert_eq!(next(&mut whole), next(&mut resumed));
    }
}
