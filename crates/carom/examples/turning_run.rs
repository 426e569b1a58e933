//! A run of bodies of every convex shape in a box, as JSON: how they begin, every impact, how they end. What replays runs is
//! tested with it: `cargo run --release --example turning_run > viewer/tests/turning_run.json`.

use std::sync::Arc;

use carom::DVec3;
use carom::random::Random;
use carom::record::Impact;
use carom::scene::{Ball, Scene, SolidBody};
use carom::shape::{BodyGeometry, Platonic, Polyhedron, Shape};
use carom::simulation::Simulation;
use carom::world::{Boundary, Domain};

const SIDE: usize = 3;
const SECONDS: f64 = 2.0;

fn main() {
    let mut random = Random::new(7, 0);
    // Off the origin, so that the principal axes are not those in which the shape was given.
    let points: Vec<DVec3> =
        (0..14).map(|_| random.normal_vector(3).normalize() * 0.45 + DVec3::new(0.1, 0.0, 0.0)).collect();
    let shapes = [
        Shape::cuboid(DVec3::new(0.8, 0.5, 0.3)).expect("a box"),
        Shape::from(Polyhedron::from_points(&points).expect("a hull")),
        Shape::Capsule { radius: 0.2, half_length: 0.3 },
        Shape::Cylinder { radius: 0.3, half_length: 0.3 },
        Shape::Ellipsoid { semi_axes: DVec3::new(0.45, 0.3, 0.25) },
        Shape::from(Platonic::Dodecahedron.with_edge(0.3).expect("a dodecahedron")),
    ];
    let geometries: Vec<Arc<BodyGeometry>> =
        shapes.iter().map(|shape| Arc::new(BodyGeometry::new(shape).expect("a shape"))).collect();
    let mut scene = Scene {
        gravity: DVec3::new(0.0, 0.0, -2.0),
        restitution: 0.97,
        domain: Domain { boundary: [Boundary::Walls; 3], size: DVec3::splat(5.0) },
        ..Scene::default()
    };
    for k in 0..SIDE.pow(3) {
        let id = k as i64;
        let place = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE];
        let position = DVec3::from_array(place.map(|i| (i as f64 - 1.0) * 1.6));
        let velocity = random.normal_vector(3);
        if k % 9 == 8 {
            scene.balls.push(Ball { id, position, velocity, radius: 0.3, mass: 1.0, material: 0, fixed: false }, 3);
            continue;
        }
        let [u, v] = [random.normal_vector(3), random.normal_vector(3)];
        let length = (u.length_squared() + v.x * v.x).sqrt();
        scene.solids.push(SolidBody {
            id,
            geometry: geometries[k % geometries.len()].clone(),
            position,
            orientation: [u.x, u.y, u.z, v.x].map(|x| x / length),
            velocity,
            angular_velocity: random.normal_vector(3) * 2.0,
            mass: 1.0,
            inertia: None,
            material: 0,
            fixed: false,
        });
    }
    let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
    let first = bodies(&simulation, &geometries);
    let end = simulation.world().clock.at(SECONDS);
    let mut impacts = Vec::new();
    while let Some(found) = simulation.step(end).expect("no collapse") {
        impacts.push(impact(&simulation, &found));
    }
    let last = bodies(&simulation, &geometries);
    let geometries: Vec<String> = shapes.iter().zip(&geometries).map(|(shape, body)| geometry(shape, body)).collect();
    println!(
        "{{\n\"duration\": {SECONDS:?},\n\"geometries\": [\n{}],\n\"first\": [\n{first}],\n\"impacts\": [\n{}],\n\"last\": [\n{last}]\n}}",
        geometries.join(",\n"),
        impacts.join(",\n")
    );
}

fn geometry(shape: &Shape, body: &BodyGeometry) -> String {
    let (kind, lengths) = match shape {
        Shape::Capsule { radius, half_length } => {
            ("capsule", format!("\"radius\": {radius:?}, \"length\": {:?}", 2.0 * half_length))
        }
        Shape::Cylinder { radius, half_length } => {
            ("cylinder", format!("\"radius\": {radius:?}, \"length\": {:?}", 2.0 * half_length))
        }
        Shape::Ellipsoid { semi_axes } => ("ellipsoid", format!("\"semi_axes\": {:?}", semi_axes.to_array())),
        Shape::Polyhedron(hull) => {
            let vertices: Vec<[f64; 3]> = hull.vertices.iter().map(|vertex| vertex.to_array()).collect();
            let faces: Vec<&[u32]> = hull.faces.iter().map(|face| face.vertices.as_slice()).collect();
            ("polyhedron", format!("\"vertices\": {vertices:?}, \"faces\": {faces:?}"))
        }
        Shape::Ball { .. } | Shape::Compound(_) => unreachable!("not among the shapes of this run"),
    };
    format!(
        "{{\"kind\": \"{kind}\", \"radius\": {:?}, \"principal_axes\": {:?}, \"parts\": [{{\"kind\": \"{kind}\", {lengths}, \
         \"position\": {:?}, \"orientation\": [1.0, 0.0, 0.0, 0.0]}}]}}",
        body.radius,
        body.orientation,
        (-body.centre).to_array()
    )
}

fn bodies(simulation: &Simulation, geometries: &[Arc<BodyGeometry>]) -> String {
    let (world, now) = (simulation.world(), simulation.now());
    let body = |id: usize| {
        let row = world.row_of(id as i64).expect("a body");
        let turning = world.turning_body(row);
        let shape = turning.and_then(|body| geometries.iter().position(|shape| Arc::ptr_eq(shape, &body.geometry)));
        format!(
            "{{\"shape\": {}, \"radius\": {:?}, \"moments\": {:?}, \"position\": {:?}, \"velocity\": {:?}, \"orientation\": {:?}, \
             \"angularVelocity\": {:?}}}",
            shape.map_or(-1, |shape| shape as i64),
            world.radii[row],
            turning.map_or(DVec3::ONE, |body| body.moments).to_array(),
            world.position(row, now).to_array(),
            world.velocity(row, now).to_array(),
            world.orientation(row, now),
            world.angular_velocity(row, now).to_array()
        )
    };
    (0..SIDE.pow(3)).map(body).collect::<Vec<_>>().join(",\n")
}

fn impact(simulation: &Simulation, impact: &Impact) -> String {
    let (world, now) = (simulation.world(), simulation.now());
    let turn = |id: i64| {
        let row = world.row_of(id);
        let orientation = row.map_or([1.0, 0.0, 0.0, 0.0], |row| world.orientation(row, now));
        let angular_velocity = row.map_or(DVec3::ZERO, |row| world.angular_velocity(row, now)).to_array();
        format!("{orientation:?}, {angular_velocity:?}")
    };
    format!(
        "{{\"time\": {:?}, \"a\": {}, \"b\": {}, \"kind\": \"{}\", \"point\": {:?}, \"normal\": {:?}, \"approach\": {:?}, \
         \"impulse\": {:?}, \"restitution\": {:?}, \"lost\": {:?}, \"turns\": [{}, {}]}}",
        impact.time.to_pair().0,
        impact.a,
        impact.b,
        impact.kind.name(),
        impact.point.to_array(),
        impact.normal.to_array(),
        impact.approach_speed,
        impact.impulse,
        impact.restitution,
        impact.energy_lost,
        turn(impact.a),
        turn(impact.b)
    )
}
