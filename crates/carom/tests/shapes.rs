//! The geometry of bodies: against closed forms, against brute force, and what is refused.
#![allow(missing_docs, clippy::unwrap_used)]

mod support;

use carom::DVec3;
use carom::shape::{Platonic, Polyhedron, ShapeError};
use support::{EPSILON, Lcg, vector};

/// Euler's formula, two faces an edge with loops that run against each other, every vertex under every face, unit normals.
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
    // A merged face may bulge by COPLANAR = 256ε of the size on either side of its plane; 4 of those are allowed to corners.
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
