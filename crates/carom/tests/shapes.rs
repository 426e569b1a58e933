//! The geometry of bodies: against closed forms, against brute force, and what is refused.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::shape::{
    BodyGeometry, BoundingTree, Bounds, Compound, Face, Fold, MassProperties, Part, Platonic, Polyhedron, Shape,
    ShapeError, TriangleMesh, check_inertia,
};
use glam::{DMat3, DQuat};
use sha2::{Digest, Sha256};
use support::{EPSILON, Lcg, vector};

/// Euler's formula, two faces an edge with loops that run against each other, every vertex under every face, unit
/// normals.
fn assert_sound(body: &Polyhedron) {
    let (v, e, f) = (body.vertices.len(), body.edges.len(), body.faces.len());
    assert_eq!(v + f, e + 2, "Euler: {v} vertices, {e} edges, {f} faces");
    assert_eq!(body.faces.iter().map(|face| face.vertices.len()).sum::<usize>(), 2 * e);
    for edge in &body.edges {
        let [a, b] = edge.vertices;
        assert!(a < b && edge.faces[0] != edge.faces[1]);
        for (face, [from, to]) in edge.faces.into_iter().zip([[a, b], [b, a]]) {
            let corners = &body.faces[face as usize].vertices;
            let k = corners.iter().position(|&k| k == from).unwrap();
            assert_eq!(corners[(k + 1) % corners.len()], to);
        }
        assert!(body.neighbours(a).contains(&b) && body.neighbours(b).contains(&a));
    }
    // A merged face may bulge by COPLANAR = 256ε of the size on either side of its plane; 4 of those are allowed to
    // corners.
    let tolerance = 1024.0 * EPSILON * body.size();
    for face in &body.faces {
        assert!((face.normal.length() - 1.0).abs() <= 4.0 * EPSILON);
        let on_plane = |&k: &u32| (face.normal.dot(body.vertices[k as usize]) - face.offset).abs() <= tolerance;
        assert!(face.vertices.len() >= 3 && face.vertices.iter().all(on_plane));
    }
    if v * f < 10_000_000 {
        for face in &body.faces {
            assert!(body.vertices.iter().all(|x| face.normal.dot(*x) <= face.offset + tolerance));
        }
    }
}

#[test]
fn a_box() {
    let body = Polyhedron::cuboid(vector(1.0, 2.0, 3.0)).unwrap();
    assert_sound(&body);
    assert_eq!((body.vertices.len(), body.edges.len(), body.faces.len()), (8, 12, 6));
    for face in &body.faces {
        assert_eq!(face.normal.abs().max_element(), 1.0);
        assert_eq!(face.offset, (face.normal.abs() * vector(0.5, 1.0, 1.5)).element_sum());
    }
    assert_eq!(body.radius, 3.5_f64.sqrt());
}

#[test]
fn the_platonic_solids() {
    let counts = [(4, 6, 4), (8, 12, 6), (6, 12, 8), (20, 30, 12), (12, 30, 20)];
    for (solid, count) in Platonic::ALL.into_iter().zip(counts) {
        let body = solid.with_edge(0.7).unwrap();
        assert_sound(&body);
        assert_eq!((body.vertices.len(), body.edges.len(), body.faces.len()), count, "{solid:?}");
        for edge in &body.edges {
            let [a, b] = edge.vertices.map(|k| body.vertices[k as usize]);
            assert!(((a - b).length() - 0.7).abs() <= 4.0 * EPSILON);
        }
        let body = solid.with_circumradius(3.0).unwrap();
        assert!((body.radius - 3.0).abs() <= 8.0 * EPSILON);
    }
}

fn sphere(count: usize, lcg: &mut Lcg) -> Vec<DVec3> {
    (0..count).map(|_| lcg.direction()).collect()
}

#[test]
fn a_hull_of_many_points_on_a_sphere() {
    let points = sphere(100_000, &mut Lcg(3));
    let start = std::time::Instant::now();
    let body = Polyhedron::from_points(&points).unwrap();
    println!("hull of 1e5 points: {:?}", start.elapsed());
    assert_sound(&body);
    assert_eq!(body.vertices.len(), points.len());
}

#[test]
fn random_hulls_hold_their_points() {
    let mut lcg = Lcg(7);
    for round in 0..300 {
        let count = 4 + round;
        let lattice = round % 3 == 0;
        let mut coordinate = || if lattice { lcg.between(-3.0, 4.0).floor() } else { lcg.between(-1.0, 1.0) };
        let points: Vec<DVec3> = (0..count).map(|_| vector(coordinate(), coordinate(), coordinate())).collect();
        let body = match Polyhedron::from_points(&points) {
            Ok(body) => body,
            Err(ShapeError::Coplanar { .. } | ShapeError::TooFewPoints { .. }) if count < 8 => continue,
            Err(error) => panic!("{error}"),
        };
        assert_sound(&body);
        let tolerance = 1024.0 * EPSILON * body.size();
        assert!(points.iter().all(|&point| body.depth(point) >= -tolerance));
        // The order of the points changes nothing, nor do copies of them.
        let mut shuffled = points.clone();
        for k in (1..shuffled.len()).rev() {
            shuffled.swap(k, (lcg.uniform() * (k + 1) as f64) as usize);
        }
        shuffled.extend_from_slice(&points[..2]);
        assert_eq!(Polyhedron::from_points(&shuffled).unwrap(), body);
    }
}

// Rotations.

/// A random rotation: a unit quaternion (w, x, y, z) and its matrix.
fn turn(lcg: &mut Lcg) -> ([f64; 4], DMat3) {
    let q = loop {
        let mut x = || lcg.between(-1.0, 1.0);
        let q = DQuat::from_xyzw(x(), x(), x(), x());
        if q.length() > 0.1 && q.length() < 1.0 {
            break q.normalize();
        }
    };
    ([q.w, q.x, q.y, q.z], DMat3::from_quat(q))
}

// Mass.

fn assert_near(value: f64, expected: f64, ulps: f64) {
    assert!((value - expected).abs() <= ulps * EPSILON * expected.abs(), "{value:e} is not {expected:e}");
}

fn assert_matrix_near(value: DMat3, expected: DMat3, tolerance: f64) {
    let scale = expected.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(value.abs_diff_eq(expected, tolerance * scale), "{value}\n{expected}");
}

#[test]
fn boxes_and_regular_solids_have_their_volume_and_inertia() {
    let (a, b, c) = (0.3, 1.7, 2.9);
    let mass = Shape::cuboid(vector(a, b, c)).unwrap().mass_properties();
    assert_near(mass.volume, a * b * c, 4.0);
    let moments = vector(b * b + c * c, c * c + a * a, a * a + b * b) * (a * b * c / 12.0);
    assert_matrix_near(mass.inertia, DMat3::from_diagonal(moments), 8.0 * EPSILON);
    // Volume over edge³, and I/(m edge²) (Wikipedia, "List of moments of inertia", and the same from integrals).
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let closed_forms = [
        (1.0 / 72.0_f64.sqrt(), 1.0 / 20.0),
        (1.0, 1.0 / 6.0),
        (2.0_f64.sqrt() / 3.0, 1.0 / 10.0),
        ((15.0 + 7.0 * 5.0_f64.sqrt()) / 4.0, (39.0 * golden + 28.0) / 150.0),
        (5.0 * (3.0 + 5.0_f64.sqrt()) / 12.0, golden * golden / 10.0),
    ];
    let edge = 1.3;
    for (solid, (volume, gyration)) in Platonic::ALL.into_iter().zip(closed_forms) {
        let body = Shape::from(solid.with_edge(edge).unwrap());
        let geometry = BodyGeometry::new(&body).unwrap();
        // Corners are rounded, each coordinate by up to a few ε.
        assert_near(geometry.volume, volume * edge * edge * edge, 16.0);
        assert_near(geometry.gyration.x, gyration * edge * edge, 16.0);
        // A spherical top, in its own frame, bit by bit.
        assert!(geometry.gyration.x == geometry.gyration.y && geometry.gyration.y == geometry.gyration.z);
        assert_eq!(geometry.orientation, [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(geometry.centre, DVec3::ZERO);
        assert_eq!(geometry.shape, body);
    }
}

#[test]
fn round_bodies_have_their_volume_and_inertia() {
    let pi = std::f64::consts::PI;
    let (r, h) = (0.7, 1.9);
    let ball = Shape::Ball { radius: r }.mass_properties();
    assert_near(ball.volume, 4.0 / 3.0 * pi * r * r * r, 4.0);
    assert_near(ball.inertia.x_axis.x, 0.4 * ball.volume * r * r, 4.0);
    let cylinder = Shape::Cylinder { radius: r, half_length: h }.mass_properties();
    assert_near(cylinder.volume, pi * r * r * 2.0 * h, 4.0);
    assert_near(cylinder.inertia.z_axis.z, 0.5 * cylinder.volume * r * r, 4.0);
    assert_near(cylinder.inertia.x_axis.x, cylinder.volume * (3.0 * r * r + 4.0 * h * h) / 12.0, 8.0);
    let ellipsoid = Shape::Ellipsoid { semi_axes: vector(1.0, 2.0, 3.0) }.mass_properties();
    assert_near(ellipsoid.volume, 8.0 * pi, 4.0);
    assert_matrix_near(
        ellipsoid.inertia,
        DMat3::from_diagonal(vector(13.0, 10.0, 5.0) * (8.0 * pi / 5.0)),
        8.0 * EPSILON,
    );
    // A capsule by slices: midpoint rule in z, whose error is about (1/1e5)^1.5 at the poles.
    let capsule = Shape::Capsule { radius: r, half_length: h }.mass_properties();
    let (mut volume, mut along, mut across, slices) = (0.0, 0.0, 0.0, 200_000);
    let step = 2.0 * (r + h) / f64::from(slices);
    for k in 0..slices {
        let z = -(r + h) + (f64::from(k) + 0.5) * step;
        let beyond = (z.abs() - h).max(0.0);
        let square = r * r - beyond * beyond;
        let slice = pi * square * step;
        volume += slice;
        along += slice * square / 2.0;
        across += slice * (square / 4.0 + z * z);
    }
    assert!((capsule.volume / volume - 1.0).abs() < 1e-9);
    assert!((capsule.inertia.z_axis.z / along - 1.0).abs() < 1e-9);
    assert!((capsule.inertia.x_axis.x / across - 1.0).abs() < 1e-9);
}

/// Six volumes, 24 first moments, 120 second moments (xx, yy, zz, xy, yz, zx), in integers.
fn exact_moments(body: &Polyhedron, scale: f64) -> (i128, [i128; 3], [i128; 6]) {
    let integer = |k: u32| (body.vertices[k as usize] * scale).to_array().map(|x| x as i128);
    let (mut volume, mut first, mut second) = (0, [0; 3], [0; 6]);
    for face in &body.faces {
        for pair in face.vertices[1..].windows(2) {
            let [a, b, c] = [face.vertices[0], pair[0], pair[1]].map(integer);
            let d = a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]);
            let s: [i128; 3] = std::array::from_fn(|k| a[k] + b[k] + c[k]);
            volume += d;
            (0..3).for_each(|k| first[k] += d * s[k]);
            for (sum, (i, j)) in second.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]) {
                *sum += d * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
            }
        }
    }
    (volume, first, second)
}

#[test]
fn inertia_of_random_hulls_against_integers() {
    let mut lcg = Lcg(11);
    let mut worst = (0.0_f64, 0.0_f64, 0.0_f64);
    for round in 0..200 {
        let mut coordinate = || lcg.between(-1000.0, 1000.0).floor();
        let points: Vec<DVec3> = (0..6 + round / 4).map(|_| vector(coordinate(), coordinate(), coordinate())).collect();
        // Shifted by 2^30: coordinates stay integers, so that the body is the same.
        let far = if round % 2 == 0 { DVec3::ZERO } else { DVec3::splat((1u64 << 30) as f64) };
        let near = Polyhedron::from_points(&points).unwrap();
        let shifted: Vec<DVec3> = points.iter().map(|&p| p + far).collect();
        let body = Polyhedron::from_points(&shifted).unwrap();
        let (volume, first, second) = exact_moments(&near, 1.0);
        let mass = MassProperties::polyhedron(&body);
        let size = near.size();
        worst.0 = worst.0.max((mass.volume / (volume as f64 / 6.0) - 1.0).abs());
        let centre = DVec3::from_array(first.map(|m| m as f64 / (4 * volume) as f64));
        worst.1 = worst.1.max((mass.centre - far - centre).length() / size / if round % 2 == 0 { 1.0 } else { 1e6 });
        // 120 volume C = second volume − 7.5 first firstᵀ/... : with C = S/120 − V c cᵀ, V = v/6, c = m/(4 v).
        let covariance = |k: usize, i: usize, j: usize| {
            // (16 v S − 20 m mᵀ)/(1920 v), the numerator exact in 128 bits for these sizes.
            let numerator = 16 * volume * second[k] - 20 * first[i] * first[j];
            numerator as f64 / (1920 * volume) as f64
        };
        let (xx, yy, zz) = (covariance(0, 0, 0), covariance(1, 1, 1), covariance(2, 2, 2));
        let (xy, yz, zx) = (covariance(3, 0, 1), covariance(4, 1, 2), covariance(5, 2, 0));
        let expected =
            DMat3::from_cols(vector(yy + zz, -xy, -zx), vector(-xy, zz + xx, -yz), vector(-zx, -yz, xx + yy));
        let difference =
            (mass.inertia - expected).to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        worst.2 = worst.2.max(difference / (xx + yy + zz));
    }
    println!("volume {:e}, centre {:e}, inertia {:e}", worst.0, worst.1, worst.2);
    // Rounding of a term is a few ε; terms are positive and their sums compensated.
    assert!(worst.0 <= 4.0 * EPSILON && worst.1 <= 4.0 * EPSILON && worst.2 <= 4.0 * EPSILON);
}

#[test]
fn sheared_and_shifted_bodies() {
    let mut lcg = Lcg(5);
    for _ in 0..100 {
        let mut x = || lcg.between(-1.0, 1.0);
        let shear = DMat3::from_cols(vector(1.0, x(), x()), vector(0.0, 1.0, x()), vector(0.0, 0.0, 1.0));
        let shift = vector(x(), x(), x()) * 3.0;
        let cube = Polyhedron::cuboid(DVec3::splat(2.0)).unwrap();
        let points: Vec<DVec3> = cube.vertices.iter().map(|&v| shear * v + shift).collect();
        let mass = MassProperties::polyhedron(&Polyhedron::from_points(&points).unwrap());
        assert_near(mass.volume, 8.0, 16.0);
        assert!((mass.centre - shift).length() < 16.0 * EPSILON);
        // ∫ x xᵀ of the cube is 8/3; under x → A x it becomes A Aᵀ 8/3 (det A = 1).
        let covariance = shear * shear.transpose() * (8.0 / 3.0);
        let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
        assert_matrix_near(mass.inertia, DMat3::from_diagonal(DVec3::splat(trace)) - covariance, 32.0 * EPSILON);
    }
}

#[test]
fn a_turned_body_has_turned_inertia_and_the_same_principal_frame() {
    let mut lcg = Lcg(17);
    for round in 0..100 {
        let points: Vec<DVec3> = (0..30).map(|_| lcg.direction() * vector(1.0, 1.5, 2.5)).collect();
        let body = Polyhedron::from_points(&points).unwrap();
        let (_, turn) = turn(&mut lcg);
        let shift = lcg.direction() * if round % 2 == 0 { 1.0 } else { 1e6 };
        // What rounding of the coordinates leaves, over the size of 2.5.
        let rounding = if round % 2 == 0 { 1e-14 } else { 1e-8 };
        let turned: Vec<DVec3> = body.vertices.iter().map(|&v| turn * v + shift).collect();
        let turned = Polyhedron::from_points(&turned).unwrap();
        let (mass, after) = (MassProperties::polyhedron(&body), MassProperties::polyhedron(&turned));
        assert!((after.volume / mass.volume - 1.0).abs() < rounding);
        assert!((after.centre - (turn * mass.centre + shift)).length() < rounding);
        assert_matrix_near(after.inertia, turn * mass.inertia * turn.transpose(), rounding);
        let (one, other) = (BodyGeometry::new(&body.into()).unwrap(), BodyGeometry::new(&turned.into()).unwrap());
        let sorted = |geometry: &BodyGeometry| {
            let mut moments = geometry.gyration.to_array();
            moments.sort_by(f64::total_cmp);
            DVec3::from_array(moments)
        };
        assert!((sorted(&one) - sorted(&other)).length() < 10.0 * rounding);
        assert!((one.radius - other.radius).abs() < 10.0 * rounding);
    }
}

#[test]
fn the_principal_frame_is_principal_and_leads_back() {
    let mut lcg = Lcg(23);
    for round in 0..100 {
        let (q, axes) = turn(&mut lcg);
        let shift = lcg.direction() * if round < 50 { 5.0 } else { 1e6 };
        let shape = if round % 2 == 0 {
            let points: Vec<DVec3> = (0..20).map(|_| shift + lcg.direction() * vector(1.0, 2.0, 3.0)).collect();
            Shape::from(Polyhedron::from_points(&points).unwrap())
        } else {
            let part = |shape, position| Part { shape, position, orientation: q };
            let ball = part(Shape::Ball { radius: 0.5 }, shift + axes * vector(0.0, 0.0, 3.0));
            let rod = part(Shape::Cylinder { radius: 0.2, half_length: 2.0 }, shift);
            Compound::new(vec![ball, rod]).unwrap().into()
        };
        let geometry = BodyGeometry::new(&shape).unwrap();
        let mass = geometry.shape.mass_properties();
        assert!(mass.centre.length() < 1e-14, "{}", mass.centre);
        assert_matrix_near(mass.inertia / mass.volume, DMat3::from_diagonal(geometry.gyration), 1e-14);
        check_inertia(geometry.gyration).unwrap();
        assert!(geometry.in_radius <= geometry.radius && geometry.in_radius >= 0.0);
        // A pose of the user's frame, there and back; and the same farthest points in both frames.
        let (orientation, to_world) = turn(&mut lcg);
        let position = lcg.direction() * 3.0;
        let (centre, principal) = geometry.to_principal(position, orientation).unwrap();
        let (back, turned_back) = geometry.to_users(centre, principal);
        // Rounding of the coordinates at which things are: 64ε of them.
        let rounding = 64.0 * EPSILON * (shift.length() + 1.0);
        assert!((back - position).length() < rounding);
        let sign = if turned_back[0] * orientation[0] < 0.0 { -1.0 } else { 1.0 };
        assert!((0..4).all(|k| (sign * turned_back[k] - orientation[k]).abs() < 1e-15));
        let principal_to_world =
            DMat3::from_quat(DQuat::from_xyzw(principal[1], principal[2], principal[3], principal[0]));
        for _ in 0..20 {
            let direction = lcg.direction();
            let user = position + to_world * shape.support(to_world.transpose() * direction);
            let ours = centre + principal_to_world * geometry.shape.support(principal_to_world.transpose() * direction);
            assert!((user - ours).dot(direction).abs() < rounding);
        }
    }
}

#[test]
fn bodies_given_in_their_principal_frame_keep_it_bit_by_bit() {
    let shapes = [
        Shape::cuboid(vector(0.1, 0.7, 1.3)).unwrap(),
        Shape::cuboid(DVec3::splat(1.0 / 3.0)).unwrap(),
        Shape::Ball { radius: 0.1 },
        Shape::Capsule { radius: 0.1, half_length: 0.3 },
        Shape::Cylinder { radius: 0.7, half_length: 0.1 },
        Shape::Ellipsoid { semi_axes: vector(3.0, 1.0, 2.0) },
    ];
    for shape in shapes {
        let geometry = BodyGeometry::new(&shape).unwrap();
        assert_eq!(geometry.shape, shape);
        assert_eq!((geometry.centre, geometry.orientation), (DVec3::ZERO, [1.0, 0.0, 0.0, 0.0]));
        let (position, orientation) = (vector(0.1, 0.2, 0.3), [0.5, 0.5, 0.5, 0.5]);
        assert_eq!(geometry.to_principal(position, orientation).unwrap(), (position, orientation));
        assert_eq!(geometry.to_users(position, orientation), (position, orientation));
    }
    let top = BodyGeometry::new(&Shape::Cylinder { radius: 0.3, half_length: 0.7 }).unwrap();
    assert_eq!(top.gyration.x, top.gyration.y);
    let cube = BodyGeometry::new(&Shape::cuboid(DVec3::splat(0.1)).unwrap()).unwrap();
    assert!(cube.gyration.x == cube.gyration.y && cube.gyration.y == cube.gyration.z);
}

#[test]
fn symmetric_bodies_stay_symmetric_however_they_are_turned() {
    let mut lcg = Lcg(31);
    for round in 0..60 {
        let (_, turn) = turn(&mut lcg);
        let far = lcg.direction() * [0.0, 10.0, 1e6][round % 3];
        for solid in Platonic::ALL {
            let body = solid.with_edge(1.0).unwrap();
            let points: Vec<DVec3> = body.vertices.iter().map(|&v| turn * v + far).collect();
            let geometry = BodyGeometry::new(&Polyhedron::from_points(&points).unwrap().into()).unwrap();
            let moments = geometry.gyration;
            assert!(moments.x == moments.y && moments.y == moments.z, "{solid:?} {moments}");
            assert_eq!(geometry.orientation, [1.0, 0.0, 0.0, 0.0]);
        }
        let prism = Polyhedron::cuboid(vector(1.0, 1.0, 3.0)).unwrap();
        let points: Vec<DVec3> = prism.vertices.iter().map(|&v| turn * v + far).collect();
        let geometry = BodyGeometry::new(&Polyhedron::from_points(&points).unwrap().into()).unwrap();
        let long = geometry.gyration.min_position();
        assert_eq!(geometry.gyration[(long + 1) % 3], geometry.gyration[(long + 2) % 3]);
        // The least turn: the long axis is taken up by the frame's axis that is nearest to it.
        let axis = (turn * DVec3::Z).abs();
        assert!(axis[long] >= axis.max_element() - 1e-12);
    }
}

#[test]
fn compounds_are_the_sum_of_their_parts() {
    let half = Shape::cuboid(vector(1.0, 2.0, 3.0)).unwrap();
    let at = |x: f64| Part { shape: half.clone(), position: vector(x, 0.0, 0.0), orientation: [1.0, 0.0, 0.0, 0.0] };
    let both = Shape::from(Compound::new(vec![at(-0.5), at(0.5)]).unwrap());
    let whole = Shape::cuboid(vector(2.0, 2.0, 3.0)).unwrap();
    let (mass, expected) = (both.mass_properties(), whole.mass_properties());
    assert_near(mass.volume, expected.volume, 4.0);
    assert!(mass.centre.length() < EPSILON);
    assert_matrix_near(mass.inertia, expected.inertia, 8.0 * EPSILON);
    assert_eq!(both.radius(), whole.radius());
    assert_eq!(both.bounds([1.0, 0.0, 0.0, 0.0]), whole.bounds([1.0, 0.0, 0.0, 0.0]));
    // The same two, one of them turned by a half turn, and far away.
    let turned = Part { orientation: [0.0, 0.0, 0.0, 1.0], position: vector(1e6 + 0.5, 0.0, 0.0), ..at(0.0) };
    let far = Part { position: vector(1e6 - 0.5, 0.0, 0.0), ..at(0.0) };
    let far = Shape::from(Compound::new(vec![far, turned]).unwrap());
    assert_eq!(far.mass_properties().centre, vector(1e6, 0.0, 0.0));
    assert_matrix_near(far.mass_properties().inertia, expected.inertia, 8.0 * EPSILON);
    // Parts in one place count twice.
    let twice = Shape::from(Compound::new(vec![at(0.0), at(0.0)]).unwrap());
    assert_eq!(twice.mass_properties().volume, 2.0 * half.mass_properties().volume);
}

// Farthest points, radii, bounds.

fn all_shapes(lcg: &mut Lcg) -> Vec<Shape> {
    let (orientation, _) = turn(lcg);
    let capsule = Shape::Capsule { radius: 0.3, half_length: 0.9 };
    let cylinder = Shape::Cylinder { radius: 0.8, half_length: 0.4 };
    let ellipsoid = Shape::Ellipsoid { semi_axes: vector(0.5, 1.0, 2.0) };
    let hull = Shape::from(Polyhedron::from_points(&sphere(500, lcg)).unwrap());
    let parts = [&capsule, &cylinder, &ellipsoid, &hull].into_iter().map(|shape| Part {
        shape: shape.clone(),
        position: lcg.direction() * 1.5,
        orientation,
    });
    let compound = Shape::from(Compound::new(parts.collect()).unwrap());
    let cube = Shape::cuboid(vector(1.0, 2.0, 3.0)).unwrap();
    vec![Shape::Ball { radius: 1.5 }, cube, capsule, cylinder, ellipsoid, hull, compound]
}

/// A point of the body drawn at random from its own description, not from its farthest points.
fn point_within(shape: &Shape, lcg: &mut Lcg) -> DVec3 {
    let ball = lcg.direction() * lcg.uniform().sqrt();
    match shape {
        Shape::Ball { radius } => ball * *radius,
        Shape::Capsule { radius, half_length } => {
            ball * *radius + vector(0.0, 0.0, lcg.between(-half_length, *half_length))
        }
        Shape::Cylinder { radius, half_length } => {
            let across = ball.with_z(0.0) * *radius;
            across.with_z(lcg.between(-half_length, *half_length))
        }
        Shape::Ellipsoid { semi_axes } => ball * *semi_axes,
        Shape::Polyhedron(body) => {
            let mut pick = || body.vertices[(lcg.uniform() * body.vertices.len() as f64) as usize];
            let (a, b) = (pick(), pick());
            a + (b - a) * lcg.uniform()
        }
        Shape::Compound(body) => {
            let part = &body.parts[(lcg.uniform() * body.parts.len() as f64) as usize];
            part.position + part.axes() * point_within(&part.shape, lcg)
        }
    }
}

#[test]
fn nothing_is_farther_than_the_farthest_point() {
    let mut lcg = Lcg(41);
    for shape in all_shapes(&mut lcg) {
        let (orientation, to_world) = turn(&mut lcg);
        let (bounds, radius) = (shape.bounds(orientation), shape.radius());
        for _ in 0..200 {
            let direction = lcg.direction();
            let farthest = shape.support(direction * lcg.between(1e-200, 1e200));
            let height = direction.dot(farthest);
            assert!(farthest.length() <= radius * (1.0 + 4.0 * EPSILON));
            assert!(shape.depth(farthest).abs() < 1e-14 || matches!(shape, Shape::Compound(_)));
            for _ in 0..50 {
                let point = point_within(&shape, &mut lcg);
                assert!(direction.dot(point) <= height + 8.0 * EPSILON * radius);
                let world = to_world * point;
                let grown = bounds.grown(8.0 * EPSILON * radius);
                assert!(world.cmpge(grown.low).all() && world.cmple(grown.high).all());
            }
            assert!(height >= shape.in_radius() - 8.0 * EPSILON * radius);
        }
    }
}

#[test]
fn climbing_finds_the_vertex_that_looking_at_all_finds() {
    let mut lcg = Lcg(43);
    let mut bodies = vec![Polyhedron::from_points(&sphere(20_000, &mut lcg)).unwrap()];
    bodies.push(Polyhedron::from_points(&prism(3000, DMat3::IDENTITY)).unwrap());
    bodies.push(Polyhedron::from_points(&prism(3000, turn(&mut lcg).1)).unwrap());
    for body in bodies {
        for k in 0..1000 {
            let direction = match k % 4 {
                0 => [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z][k / 4 % 6],
                1 => body.faces[k % body.faces.len()].normal,
                _ => lcg.direction(),
            };
            let found = direction.dot(body.support(direction));
            let most = body.vertices.iter().map(|v| direction.dot(*v)).fold(f64::NEG_INFINITY, f64::max);
            // Merged faces may be uneven by 256ε of the size on either side, between rounded points.
            assert!(found >= most - 1024.0 * EPSILON * body.size(), "{:e}", most - found);
            let start = (lcg.uniform() * body.vertices.len() as f64) as u32;
            let other = body.vertices[body.support_vertex_from(start, direction) as usize];
            assert!(direction.dot(other) >= most - 1024.0 * EPSILON * body.size());
        }
    }
}

/// The corners of a prism with so many sides.
fn prism(sides: usize, turn: DMat3) -> Vec<DVec3> {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (k / 2) as f64 / sides as f64;
        turn * vector(libm::cos(angle), libm::sin(angle), if k.is_multiple_of(2) { -0.5 } else { 0.5 })
    };
    (0..2 * sides).map(corner).collect()
}

// Faces.

#[test]
fn prisms_have_their_faces_however_they_are_turned() {
    let mut lcg = Lcg(47);
    for sides in [3, 4, 5, 6, 7, 12, 100, 1000] {
        for _ in 0..5 {
            let body = Polyhedron::from_points(&prism(sides, turn(&mut lcg).1)).unwrap();
            assert_sound(&body);
            assert_eq!((body.vertices.len(), body.faces.len(), body.edges.len()), (2 * sides, sides + 2, 3 * sides));
        }
    }
}

/// The six faces of a cube as grids of so many squares a side.
fn cube_of_squares(n: usize) -> Vec<DVec3> {
    let at = |k: usize| k as f64 / n as f64 - 0.5;
    let mut points = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            for side in [-0.5, 0.5] {
                points.extend([vector(side, at(i), at(j)), vector(at(i), side, at(j)), vector(at(i), at(j), side)]);
            }
        }
    }
    points
}

#[test]
fn points_on_faces_and_edges_are_left_out() {
    let mut lcg = Lcg(53);
    for n in [1, 2, 3, 10, 50] {
        for round in 0..6 {
            let (_, turn) = if round == 0 { ([0.0; 4], DMat3::IDENTITY) } else { turn(&mut lcg) };
            let shift = lcg.direction() * if round % 2 == 0 { 0.0 } else { 1.0 };
            let points: Vec<DVec3> = cube_of_squares(n).into_iter().map(|p| turn * p + shift).collect();
            let body = Polyhedron::from_points(&points).unwrap();
            assert_sound(&body);
            assert_eq!((body.vertices.len(), body.edges.len(), body.faces.len()), (8, 12, 6), "{n} {round}");
            // What was left out sticks out by no more than was allowed.
            assert!(points.iter().all(|&point| body.depth(point) >= -1024.0 * EPSILON * body.size()));
        }
    }
}

/// Points disturbed by all sizes from below rounding to far above the tolerance: a sound body, or a refusal.
#[test]
fn details_of_every_size() {
    let mut lcg = Lcg(59);
    let (mut sound, mut refused, mut deepest) = (0, 0, 0.0_f64);
    for round in 0..400 {
        let noise = libm::exp2(-f64::from(20 + round % 37));
        let points: Vec<DVec3> = match round / 37 % 4 {
            0 => cube_of_squares(6),
            1 => prism(50, turn(&mut lcg).1),
            2 => Platonic::Dodecahedron.with_edge(1.0).unwrap().vertices.repeat(8),
            _ => (0..500)
                .map(|_| vector(lcg.between(-1.0, 1.0), lcg.between(-1.0, 1.0), 0.0))
                .chain([DVec3::Z])
                .collect(),
        };
        let points: Vec<DVec3> = points.into_iter().map(|p| p + lcg.direction() * (noise * lcg.uniform())).collect();
        match Polyhedron::from_points(&points) {
            Ok(body) => {
                sound += 1;
                assert_sound(&body);
                let out = points.iter().map(|&p| -body.depth(p) / body.size()).fold(0.0, f64::max);
                deepest = deepest.max(out);
                assert!(out <= 3072.0 * EPSILON, "{round}: {out:e}");
            }
            Err(ShapeError::TooFine { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
        }
    }
    println!("{sound} sound, {refused} refused, deepest {deepest:e}");
    assert!(refused <= 4);
}

// Meshes.

/// A cube of edge 2 as 12 triangles, counter-clockwise seen from outside.
fn cube_mesh() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let vertices = (0..8_u32).map(|k| vector(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - 1.0);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    (vertices.collect(), triangles.collect())
}

/// The triangles of a polyhedron, as a mesh.
fn mesh_of(body: &Polyhedron) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let fan = |face: &Face| -> Vec<[u32; 3]> {
        face.vertices[1..].windows(2).map(|pair| [face.vertices[0], pair[0], pair[1]]).collect()
    };
    (body.vertices.clone(), body.faces.iter().flat_map(fan).collect())
}

/// A grid of (n + 1)² points over the square from −1 to 1, lifted by a function.
fn terrain(n: u32, height: impl Fn(f64, f64) -> f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (2.0 * f64::from(i) / f64::from(n) - 1.0, 2.0 * f64::from(j) / f64::from(n) - 1.0);
            vertices.push(vector(x, y, height(x, y)));
            if i < n && j < n {
                let a = j * (n + 1) + i;
                triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
            }
        }
    }
    (vertices, triangles)
}

#[test]
fn a_cube_of_triangles_is_a_cube() {
    let (vertices, triangles) = cube_mesh();
    let cube = Polyhedron::cuboid(DVec3::splat(2.0)).unwrap();
    assert_eq!(Polyhedron::from_mesh(&vertices, &triangles).unwrap(), cube);
    // Each triangle with corners of its own, as in STL files, and a vertex that no triangle uses.
    let mut soup: Vec<DVec3> = triangles.iter().flatten().map(|&k| vertices[k as usize]).collect();
    soup.push(vector(9.0, 9.0, 9.0));
    let separate: Vec<[u32; 3]> = (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    assert_eq!(Polyhedron::from_mesh(&soup, &separate).unwrap(), cube);
    // A zero with a sign is a zero.
    let signed: Vec<DVec3> = vertices.iter().map(|&v| (v + 1.0) * -0.5).collect();
    let inside_out: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let small = Polyhedron::from_mesh(&signed, &inside_out).unwrap();
    assert!(small.vertices.iter().all(|v| v.to_array().into_iter().all(|x| x.to_bits() != (-0.0_f64).to_bits())));
}

#[test]
fn meshes_of_convex_bodies_are_taken_in_single_precision_too() {
    let mut lcg = Lcg(61);
    let mut bodies: Vec<Polyhedron> = Platonic::ALL.into_iter().map(|solid| solid.with_edge(1.0).unwrap()).collect();
    bodies.extend([10, 100, 3000].map(|count| Polyhedron::from_points(&sphere(count, &mut lcg)).unwrap()));
    bodies.extend([5, 60].map(|sides| Polyhedron::from_points(&prism(sides, turn(&mut lcg).1)).unwrap()));
    for body in bodies {
        let (_, turn) = turn(&mut lcg);
        let (vertices, triangles) = mesh_of(&body);
        assert_eq!(Polyhedron::from_mesh(&vertices, &triangles).unwrap(), body);
        let single: Vec<DVec3> = vertices.iter().map(|&v| (turn * v).as_vec3().as_dvec3()).collect();
        let read = Polyhedron::from_mesh(&single, &triangles).unwrap();
        assert_sound(&read);
        let (volume, expected) = (MassProperties::polyhedron(&read).volume, MassProperties::polyhedron(&body).volume);
        assert!((volume / expected - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_dent_is_named_with_its_depth() {
    let mut lcg = Lcg(67);
    for round in 0..40 {
        let body = Polyhedron::from_points(&sphere(300, &mut lcg)).unwrap();
        let (mut vertices, triangles) = mesh_of(&body);
        let dented = (lcg.uniform() * 300.0) as usize;
        let factor = 1.0 - libm::exp2(-f64::from(round % 15));
        vertices[dented] *= factor;
        let without: Vec<DVec3> = (0..300).filter(|&k| k != dented).map(|k| vertices[k]).collect();
        let depth = Polyhedron::from_points(&without).unwrap().depth(vertices[dented]);
        match Polyhedron::from_mesh(&vertices, &triangles) {
            Err(ShapeError::DentedVertex { vertex, depth: found, .. }) => {
                assert_eq!(vertex as usize, dented);
                assert!((found - depth).abs() <= 1e-14);
            }
            Err(ShapeError::DentedEdge { depth: found, .. }) => assert!(found > 1e-6 && depth < found + 1e-14),
            Err(error) => panic!("{error}"),
            Ok(_) => assert!(depth <= 0.0, "{depth}"),
        }
    }
    // A valley between two ridges: vertices are on the hull, an edge is not.
    let (mut vertices, triangles) = cube_mesh();
    vertices[1] += vector(0.1, -0.1, -0.1);
    vertices[2] += vector(-0.1, 0.1, -0.1);
    let error = Polyhedron::from_mesh(&vertices, &triangles).unwrap_err();
    let ShapeError::DentedEdge { edge, .. } = error else { panic!("{error}") };
    assert!(edge == [0, 3] || edge == [0, 7], "{edge:?}");
}

fn octahedron(scale: f64, shift: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let triangles = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    (axes.map(|v| v * scale + shift).to_vec(), triangles.to_vec())
}

/// Bad meshes and points, each with a part of the sentence that says what is wrong.
#[test]
fn what_is_refused_and_why() {
    let (cube, faces) = cube_mesh();
    let mesh = |vertices: &[DVec3], triangles: &[[u32; 3]]| Polyhedron::from_mesh(vertices, triangles).map(|_| ());
    let points = |points: &[DVec3]| Polyhedron::from_points(points).map(|_| ());
    let surface = |vertices: &[DVec3], triangles: &[[u32; 3]]| TriangleMesh::new(vertices, triangles).map(|_| ());
    let changed = |k: usize, v: DVec3| {
        let mut vertices = cube.clone();
        vertices[k] = v;
        vertices
    };
    let replaced = |k: usize, triangle: [u32; 3]| {
        let mut triangles = faces.clone();
        triangles[k] = triangle;
        triangles
    };
    let flipped: Vec<[u32; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let twice = |offset: DVec3| {
        let mut vertices = cube.clone();
        vertices.extend(cube.iter().map(|&v| v + offset));
        let mut triangles = faces.clone();
        triangles.extend(faces.iter().map(|t| t.map(|k| k + 8)));
        (vertices, triangles)
    };
    let (apart, apart_faces) = twice(DVec3::splat(5.0));
    let (nested, nested_faces) = twice(DVec3::splat(0.1));
    let line: Vec<DVec3> = (0..9).map(|k| vector(0.1, 0.7, -0.3) * f64::from(k * k)).collect();
    let on_line: Vec<DVec3> = (0..9).map(|k| vector(1.0, 2.0, -3.0) * f64::from(k * k)).collect();
    let sheet: Vec<DVec3> = (0..9).map(|k| vector(f64::from(k * k), f64::from(k), 2.0)).collect();
    let thin: Vec<DVec3> = cube.iter().map(|&v| v * vector(1.0, 1.0, 1e-11)).collect();
    let needle: Vec<DVec3> = cube.iter().map(|&v| v * vector(1.0, 1e-11, 1e-11)).collect();
    let (mut pit, (eight, eight_faces)) = (cube.clone(), octahedron(1.0, DVec3::ZERO));
    pit.push(vector(0.0, 0.0, 0.5));
    let mut pit_faces = faces.clone();
    // The top of the cube (triangles 2 and 3) becomes a pit.
    pit_faces.splice(2..4, [[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]);
    let mut valley = eight.clone();
    valley[4] = vector(0.0, 0.0, -0.2);
    // Twice around: a bipyramid over a pentagram.
    let star = |k: u32| libm::sincos(f64::from(k) * 2.0 * std::f64::consts::TAU / 5.0);
    let mut pentagram: Vec<DVec3> = (0..5).map(|k| vector(star(k).1, star(k).0, 0.0)).collect();
    pentagram.extend([DVec3::Z, DVec3::NEG_Z]);
    let pentagram_faces: Vec<[u32; 3]> = (0..5).flat_map(|k| [[k, (k + 1) % 5, 5], [(k + 1) % 5, k, 6]]).collect();
    let sheet_faces = [[0, 1, 2], [0, 2, 1]];
    let mut fan = faces.clone();
    fan.push([0, 1, 7]);
    let far = vec![DVec3::splat(1e60); 4];
    let part = |shape: Shape, orientation: [f64; 4]| Part { shape, position: DVec3::ZERO, orientation };
    let compound = |parts: Vec<Part>| Compound::new(parts).map(|_| ());
    let ball = Shape::Ball { radius: 1.0 };
    let straight = [1.0, 0.0, 0.0, 0.0];
    let inner = Shape::from(Compound::new(vec![part(ball.clone(), straight)]).unwrap());
    let geometry = BodyGeometry::new(&ball).unwrap();
    let cases: Vec<(Result<(), ShapeError>, &str)> = vec![
        (points(&[]), "there are no points"),
        (points(&cube[..3]), "only 3 different points"),
        (points(&[DVec3::ONE; 50]), "only 1 different points"),
        (points(&on_line), "all 9 points lie on one line"),
        (points(&sheet), "all 9 points lie in one plane (normal [0, 0, "),
        (points(&thin), "too thin"),
        (points(&needle), "too thin"),
        (points(&line), "too thin"),
        (points(&changed(3, vector(0.0, f64::NAN, 0.0))), "vertex 3 is at [0, NaN, 0], which is not finite"),
        (points(&changed(7, vector(0.0, 0.0, f64::INFINITY))), "vertex 7 is at [0, 0, inf], which is not finite"),
        (points(&far), "coordinates up to 1e50 m"),
        (points(&vec![DVec3::ZERO; carom::tolerance::MOST_POINTS + 1]), "4194305 points are more than 4194304"),
        (points(&cube.iter().map(|&v| v * 1e-60).collect::<Vec<_>>()), "has to be a length between"),
        (mesh(&[], &[]), "there are no points"),
        (mesh(&cube, &[]), "there are no triangles"),
        (mesh(&cube, &vec![[0, 1, 2]; carom::tolerance::MOST_TRIANGLES + 1]), "8388609 triangles are more"),
        (mesh(&cube, &replaced(5, [0, 5, 8])), "triangle 5 names vertex 8, but there are 8 vertices"),
        (mesh(&cube, &replaced(5, [0, 5, 5])), "triangle 5 (0, 5, 5) is degenerate: two of its corners are the same"),
        (mesh(&changed(4, cube[0]), &faces), "is degenerate: two of its corners are the same point"),
        (
            mesh(&changed(2, vector(1.0, 1.0, -3.0)), &faces),
            "triangle 7 (2, 7, 3) is degenerate: its corners lie on one line",
        ),
        (mesh(&cube, &faces[..11]), "the mesh is open: edge 1–5 belongs to triangle 4 only (3 such edges)"),
        (mesh(&cube, &faces[..10]), "(4 such edges)"),
        (mesh(&cube, &faces[..1]), "(3 such edges)"),
        (mesh(&cube, &replaced(0, [0, 3, 2])), "run along edge 0–2 in the same direction: one of them is turned over"),
        (mesh(&cube, &flipped), "the mesh is inside out: its volume is -8e0 m³"),
        (mesh(&cube, &fan), "3 triangles share edge 0–1; at most two can"),
        (mesh(&cube, &[&faces[..], &faces[..]].concat()), "4 triangles share edge 0–1"),
        (mesh(&cube, &[&faces[..], &faces[..1]].concat()), "3 triangles share edge 0–2"),
        (mesh(&apart, &apart_faces), "the mesh has 2 separate pieces (vertices 0 and 8 are not connected)"),
        (mesh(&nested, &nested_faces), "the mesh has 2 separate pieces"),
        (mesh(&pit, &pit_faces), "not convex: vertex 8 lies 5.000e-1 m (2.887e-1 of the size) under its convex hull"),
        (mesh(&valley, &eight_faces), "not convex: vertex 4 lies"),
        (mesh(&changed(1, vector(1.3, -1.0, -1.3)), &faces), "not convex: the middle of edge 0–3 lies"),
        (mesh(&pentagram, &pentagram_faces), "not convex"),
        (mesh(&sheet, &sheet_faces), "only 3 different points"),
        (mesh(&sheet, &[[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]), "4 triangles share edge 0–2"),
        (mesh(&thin, &faces), "too thin"),
        (mesh(&changed(0, vector(f64::NAN, 0.0, 0.0)), &faces), "not finite"),
        (surface(&sheet, &[]), "there are no triangles"),
        (surface(&on_line, &[[0, 1, 2]]), "its corners lie on one line"),
        (surface(&cube, &[[0, 1, 2], [0, 1, 4]]), "triangles 0 and 1 run along edge 0–1 in the same direction"),
        (surface(&cube, &[[0, 1, 2], [1, 0, 4], [0, 1, 7]]), "3 triangles share edge 0–1"),
        (Polyhedron::cuboid(vector(1.0, -2.0, 1.0)).map(|_| ()), "size y = -2: has to be a length"),
        (Polyhedron::cuboid(vector(1.0, 1.0, f64::NAN)).map(|_| ()), "size z = NaN"),
        (Platonic::Cube.with_edge(0.0).map(|_| ()), "edge = 0: has to be a length"),
        (Shape::Capsule { radius: 1.0, half_length: f64::INFINITY }.check(), "half_length = inf"),
        (Shape::Ellipsoid { semi_axes: vector(1.0, 0.0, 1.0) }.check(), "semi_axes = 0"),
        (compound(vec![]), "there are no parts"),
        (compound(vec![part(ball.clone(), [1.0, 0.1, 0.0, 0.0])]), "(1, 0.1, 0, 0) of 0 is not a unit quaternion"),
        (compound(vec![part(ball.clone(), [f64::NAN; 4])]), "not a unit quaternion"),
        (compound(vec![part(ball.clone(), straight), part(inner, straight)]), "part 1 is itself a compound"),
        (compound(vec![part(Shape::Ball { radius: -1.0 }, straight)]), "radius = -1"),
        (
            compound(vec![Part { position: vector(0.0, f64::NAN, 0.0), ..part(ball.clone(), straight) }]),
            "part 0 is at [0, NaN, 0]: coordinates have to be finite",
        ),
        (
            check_inertia(vector(1.0, 1.0, 2.1)),
            "the moment of inertia about z is 2.1, more than the sum of the two others",
        ),
        (check_inertia(vector(1.0, 0.0, 1.0)), "the moment of inertia about y is 0: has to be positive"),
        (check_inertia(vector(f64::NAN, 1.0, 1.0)), "the moment of inertia about x is NaN"),
        (geometry.mass(-1.0).map(|_| ()), "density = -1: has to be positive and finite"),
        (geometry.moments(f64::INFINITY).map(|_| ()), "mass = inf: has to be positive and finite"),
    ];
    for (k, (result, sentence)) in cases.into_iter().enumerate() {
        let error = result.expect_err(sentence).to_string();
        assert!(error.contains(sentence), "{k}: expected “{sentence}”, found “{error}”");
    }
    // What is allowed: a flat body's inertia to twelve digits; a compound's part that is turned.
    check_inertia(vector(1.0 / 3.0, 2.0 / 3.0, 1.000000000001)).unwrap();
}

#[test]
fn a_bowl_has_its_edges() {
    let (vertices, triangles) = terrain(8, |x, y| x * x + y * y);
    let bowl = TriangleMesh::new(&vertices, &triangles).unwrap();
    assert_eq!((bowl.vertices.len(), bowl.triangles.len(), bowl.edges.len()), (81, 128, 208));
    assert!(!bowl.is_closed());
    for edge in &bowl.edges {
        // Inside a bowl there are valleys only, and flat diagonals where the surface is a saddle along them.
        assert_eq!(edge.fold == Fold::Boundary, edge.triangles.contains(&None));
        assert_ne!(edge.fold, Fold::Convex);
    }
    let inner = (0..81).filter(|&k| !bowl.vertex_touchable_from_front(k)).count();
    assert_eq!(inner, 49);
    assert!((0..81).all(|k| bowl.vertex_touchable_from_back(k)));
    let hill = TriangleMesh::new(&vertices, &triangles.iter().map(|&[a, b, c]| [a, c, b]).collect::<Vec<_>>()).unwrap();
    assert!(hill.edges.iter().zip(&bowl.edges).all(|(h, b)| {
        h.touchable_from_front() == b.touchable_from_back() && h.touchable_from_back() == b.touchable_from_front()
    }));
    let plain = terrain(4, |_, _| 0.25);
    let plain = TriangleMesh::new(&plain.0, &plain.1).unwrap();
    assert!(plain.edges.iter().all(|edge| edge.fold == Fold::Flat || edge.triangles.contains(&None)));
    let (vertices, triangles) = cube_mesh();
    let cube = TriangleMesh::new(&vertices, &triangles).unwrap();
    assert!(cube.is_closed());
    assert_eq!(cube.edges.iter().filter(|edge| edge.fold == Fold::Convex).count(), 12);
    assert_eq!(cube.edges.iter().filter(|edge| edge.fold == Fold::Flat).count(), 6);
    // Two triangles back to back are a sheet: every edge is a rim.
    let sheet = TriangleMesh::new(&vertices, &[[0, 1, 2], [0, 2, 1]]).unwrap();
    assert!(sheet.edges.iter().all(|edge| edge.fold == Fold::Boundary && edge.touchable_from_front()));
}

#[test]
fn edges_and_triangles_of_a_mesh_know_each_other() {
    let mut lcg = Lcg(71);
    let (vertices, triangles) =
        terrain(30, |x, y| 0.1 * libm::sin(9.0 * x) * libm::cos(7.0 * y) + 1e-3 * lcg_noise(x, y));
    let mesh = TriangleMesh::new(&vertices, &triangles).unwrap();
    for (k, triangle) in (0..).zip(&mesh.triangles) {
        let [a, b, c] = mesh.corners(k);
        assert!(((b - a).cross(c - a).normalize() - triangle.normal).length() < 1e-14);
        for (side, &edge) in triangle.edges.iter().enumerate() {
            let (from, to) = (triangle.vertices[side], triangle.vertices[(side + 1) % 3]);
            let edge = &mesh.edges[edge as usize];
            assert_eq!(edge.vertices, [from.min(to), from.max(to)]);
            assert_eq!(edge.triangles[usize::from(from > to)], Some(k));
        }
    }
    for vertex in 0..mesh.vertices.len() as u32 {
        let expected = (0..).zip(&mesh.edges).filter(|(_, edge)| edge.vertices.contains(&vertex)).map(|(k, _)| k);
        assert_eq!(mesh.edges_at(vertex), expected.collect::<Vec<u32>>());
    }
    for _ in 0..300 {
        let (middle, size) = (lcg.direction(), lcg.between(0.0, 0.4));
        let bounds = Bounds::around([middle]).grown(size);
        let expected = (0..mesh.triangles.len() as u32)
            .filter(|&k| Bounds::around(mesh.corners(k)).overlaps(&bounds))
            .collect::<Vec<_>>();
        assert_eq!(mesh.near(&bounds), expected);
    }
}

fn lcg_noise(x: f64, y: f64) -> f64 {
    Lcg((x * 1e3) as i64 as u64 ^ ((y * 1e3) as i64 as u64) << 20).uniform()
}

#[test]
fn a_tree_of_equal_boxes_is_still_a_tree() {
    let same = vec![Bounds::around([DVec3::ZERO, DVec3::ONE]); 1000];
    let tree = BoundingTree::new(&same);
    let mut found = Vec::new();
    tree.visit(&Bounds::around([DVec3::ONE]), |k| found.push(k));
    found.sort_unstable();
    assert_eq!(found, (0..1000).collect::<Vec<_>>());
    tree.visit(&Bounds::around([DVec3::splat(1.1)]), |_| panic!());
    BoundingTree::new(&[]).visit(&same[0], |_| panic!());
}

/// Cubes with corners moved or triangles changed, and triangles at random: a sound body or a sentence, never a panic.
#[test]
fn no_mesh_is_too_bad_for_a_sentence() {
    let mut lcg = Lcg(73);
    let (mut sound, mut refused) = (0, 0);
    for round in 0..20_000 {
        let (mut vertices, mut triangles) = if round % 2 == 0 { cube_mesh() } else { octahedron(1.0, DVec3::ONE) };
        let pick = |lcg: &mut Lcg, count: usize| (lcg.uniform() * count as f64) as usize;
        for _ in 0..1 + round % 3 {
            let size = libm::exp2(-lcg.between(0.0, 60.0));
            let moved = pick(&mut lcg, vertices.len());
            match pick(&mut lcg, 5) {
                0 => vertices[moved] = vertices[pick(&mut lcg, vertices.len())],
                1 => triangles.push([0, 1, 2].map(|_| pick(&mut lcg, vertices.len() + 1) as u32)),
                2 => triangles[pick(&mut lcg, 8)].swap(0, 1),
                3 => vertices[moved] *= [0.0, -1.0, 1e300, 0.5, f64::NAN][pick(&mut lcg, 5)],
                _ => vertices[moved] += lcg.direction() * size,
            }
        }
        match Polyhedron::from_mesh(&vertices, &triangles) {
            Ok(body) => {
                assert_sound(&body);
                BodyGeometry::new(&body.into()).unwrap();
                sound += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
        if let Err(error) = TriangleMesh::new(&vertices, &triangles) {
            assert!(!error.to_string().is_empty());
        }
    }
    assert!(sound > 1000 && refused > 1000, "{sound} {refused}");
}

// Scale.

#[test]
fn nothing_has_a_length_scale() {
    let mut lcg = Lcg(79);
    let points: Vec<DVec3> = sphere(200, &mut lcg).into_iter().map(|p| p * vector(1.0, 2.0, 3.0)).collect();
    let body = Polyhedron::from_points(&points).unwrap();
    let geometry = BodyGeometry::new(&body.clone().into()).unwrap();
    for exponent in [-160, -40, 0, 40, 160] {
        // A power of two: everything is the same number times a power of it, bit by bit.
        let factor = libm::exp2(f64::from(exponent));
        let scaled: Vec<DVec3> = points.iter().map(|&p| p * factor).collect();
        let large = Polyhedron::from_points(&scaled).unwrap();
        assert_eq!(large.edges, body.edges);
        for (a, b) in large.faces.iter().zip(&body.faces) {
            assert_eq!((&a.vertices, a.normal, a.offset), (&b.vertices, b.normal, b.offset * factor));
        }
        let large = BodyGeometry::new(&large.into()).unwrap();
        assert_eq!(large.volume, geometry.volume * factor * factor * factor);
        assert_eq!(large.gyration, geometry.gyration * factor * factor);
        assert_eq!(large.orientation, geometry.orientation);
    }
}

#[test]
fn coordinates_of_all_sizes() {
    let mut lcg = Lcg(83);
    for round in 0..200 {
        // A cube, all of whose zeros are numbers down to the smallest there are.
        let tiny = libm::exp2(-lcg.between(100.0, 1074.0));
        let corner = |k: u32, lcg: &mut Lcg| {
            vector(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) + lcg.direction() * tiny
        };
        let points: Vec<DVec3> = (0..8 + round).map(|k| corner(k % 8, &mut lcg)).collect();
        let body = Polyhedron::from_points(&points).unwrap();
        assert_sound(&body);
        assert_eq!((body.vertices.len(), body.faces.len()), (8, 6), "{tiny:e}");
        assert_near(BodyGeometry::new(&body.into()).unwrap().volume, 1.0, 4.0);
    }
}

/// The bits of bodies of all kinds, by their digest: the same at every level of optimisation and on every platform.
#[test]
fn the_same_bits_everywhere() {
    let mut lcg = Lcg(89);
    let mut bits = Sha256::new();
    let mut take = |x: f64| bits.update(x.to_bits().to_le_bytes());
    let mut shapes = all_shapes(&mut lcg);
    shapes.push(Polyhedron::from_points(&prism(7, turn(&mut lcg).1)).unwrap().into());
    for shape in shapes {
        let geometry = BodyGeometry::new(&shape).unwrap();
        [geometry.volume, geometry.radius, geometry.in_radius].into_iter().for_each(&mut take);
        [geometry.gyration, geometry.centre].into_iter().flat_map(|v| v.to_array()).for_each(&mut take);
        geometry.orientation.into_iter().for_each(&mut take);
        if let Shape::Polyhedron(body) = &geometry.shape {
            for face in &body.faces {
                face.normal.to_array().into_iter().chain([face.offset]).for_each(&mut take);
            }
        }
        for _ in 0..100 {
            geometry.shape.support(lcg.direction()).to_array().into_iter().for_each(&mut take);
        }
    }
    let digest: String = bits.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(digest, "99357bc60287e7fdb8d4c1caf566df64d8e11dcb4daef1e3753175d4052d3c56");
}
