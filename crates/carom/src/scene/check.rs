//! A scene becomes a world only if every number means something and no two bodies share a place.

mod solids;

use std::collections::HashMap;

use glam::DVec3;

use super::{Balls, BuildReport, Scene};
use crate::error::{CheckError, Problem};
use crate::predict::solids::{Sought, gap_above_plane, gap_of_bodies};
use crate::predict::surroundings::gap_to_mesh;
use crate::predict::turning::gap;
use crate::time::Time;
use crate::tolerance::{CELL_MARGIN, LIMITS, UNIT_LENGTH, touching};
use crate::world::cells::Cells;
use crate::world::lists::{self, HALF_BOX};
use crate::world::nearby::Gathered;
use crate::world::{Boundary, World};

/// Overlaps looked at: a file with more is in other units, or no scene.
const MOST_OVERLAPS: usize = 1_000_000;
/// Problems listed at most; a file with more is wrong as a whole.
const MOST_PROBLEMS: usize = 10_000;

/// What is wrong with a number that is not positive, not finite, or beyond the limits.
fn why(x: f64) -> &'static str {
    if x > 0.0 && x.is_finite() {
        "is beyond 1e-75 … 1e75, where squares over- or underflow"
    } else {
        "must be positive and finite"
    }
}

fn finite(v: DVec3) -> bool {
    v.abs().max_element() <= *LIMITS.end()
}

fn result(problems: Vec<Problem>) -> Result<(), CheckError> {
    if problems.is_empty() { Ok(()) } else { Err(CheckError { problems }) }
}

/// Checks every number of a scene by itself.
pub(super) fn values(scene: &Scene) -> Result<(), CheckError> {
    let mut problems = Vec::new();
    let mut wrong = |what, id, field, value: String, reason: &str| {
        if problems.len() < MOST_PROBLEMS {
            problems.push(Problem::new(what, id, field, value, reason));
        }
    };
    if !matches!(scene.dimensions, 2 | 3) {
        wrong("scene", None, "dimensions", scene.dimensions.to_string(), "must be 2 or 3");
    }
    let flat = scene.dimensions == 2;
    if !finite(scene.gravity) {
        wrong("scene", None, "gravity", scene.gravity.to_string(), "must be finite");
    } else if flat && scene.gravity.z != 0.0 {
        wrong("scene", None, "gravity", scene.gravity.to_string(), "z must be 0 in two dimensions");
    }
    if !scene.start_time.is_finite() {
        wrong("scene", None, "time", scene.start_time.to_string(), "must be finite");
    }
    let mut check_restitution = |what, id, e: f64| {
        if !(0.0..=1.0).contains(&e) {
            wrong(what, id, "restitution", e.to_string(), "must be from 0 to 1");
        }
    };
    check_restitution("scene", None, scene.restitution);
    for (row, &(_, _, e)) in scene.pairs.iter().enumerate() {
        check_restitution("pair", Some(row as i64), e);
    }
    let known = |material: u32| (material as usize) < scene.materials;
    for (row, &(a, b, _)) in scene.pairs.iter().enumerate() {
        if a >= scene.materials || b >= scene.materials {
            wrong("pair", Some(row as i64), "materials", format!("({a}, {b})"), "there is no such material");
        }
    }
    let domain = &scene.domain;
    for axis in 0..3 {
        let bounded = domain.boundary[axis] != Boundary::Open;
        if bounded && !LIMITS.contains(&domain.size[axis]) {
            wrong("domain", None, "size", domain.size.to_string(), "must be positive and finite");
        }
    }
    if flat && domain.boundary[2] != Boundary::Open {
        wrong("domain", None, "kind", format!("{:?}", domain.boundary[2]), "z must be open in two dimensions");
    }
    if !known(scene.domain_material) {
        wrong("domain", None, "material", scene.domain_material.to_string(), "there is no such material");
    }
    if let Some(depth) = scene.shrink_overlaps
        && !(depth.is_finite() && depth >= 0.0)
    {
        wrong("scene", None, "shrink", depth.to_string(), "must be 0 or more and finite");
    }
    let positive = |x: f64| LIMITS.contains(&x);
    let balls = &scene.balls;
    for row in 0..balls.len() {
        let id = Some(balls.ids[row]);
        let mut ball = |field, value: String, reason: &str| wrong("ball", id, field, value, reason);
        if !positive(balls.radii[row]) {
            ball("radius", balls.radii[row].to_string(), why(balls.radii[row]));
        } else if domain.periods().to_array().iter().any(|&period| period > 0.0 && period < 2.0 * balls.radii[row]) {
            ball("radius", balls.radii[row].to_string(), "is more than half the periodic box");
        }
        for (field, vector) in [
            ("position", balls.positions[row]),
            ("velocity", balls.velocities[row]),
            ("angular_velocity", balls.angular_velocities[row]),
        ] {
            if !finite(vector) {
                ball(field, vector.to_string(), "must be finite, and within 1e75");
            } else if flat && field != "angular_velocity" && vector.z != 0.0 {
                ball(field, vector.to_string(), "z must be 0 in two dimensions");
            } else if flat && field == "angular_velocity" && (vector.x != 0.0 || vector.y != 0.0) {
                ball(field, vector.to_string(), "x and y must be 0 in two dimensions");
            }
        }
        if !balls.fixed[row] {
            if !positive(balls.masses[row]) {
                ball("mass", balls.masses[row].to_string(), why(balls.masses[row]));
            }
            if !positive(balls.inertias[row]) {
                ball("inertia", balls.inertias[row].to_string(), "must be positive and finite");
            }
        }
        let norm: f64 = balls.orientations[row].iter().map(|x| x * x).sum();
        if !((norm.sqrt() - 1.0).abs() <= UNIT_LENGTH) {
            ball("orientation", format!("{:?}", balls.orientations[row]), "must be a unit quaternion (w, x, y, z)");
        }
        if !known(balls.materials[row]) {
            ball("material", balls.materials[row].to_string(), "there is no such material");
        }
    }
    solids::values(scene, &mut |what, id, field, value, reason| wrong(what, Some(id), field, value, reason));
    for plane in &scene.planes {
        let id = Some(plane.id);
        let mut plane_wrong = |field, value: String, reason: &str| wrong("plane", id, field, value, reason);
        if !((plane.normal.length() - 1.0).abs() <= UNIT_LENGTH) {
            plane_wrong("normal", plane.normal.to_string(), "must be a unit vector");
        } else if flat && plane.normal.z != 0.0 {
            plane_wrong("normal", plane.normal.to_string(), "z must be 0 in two dimensions");
        } else if (0..3).any(|axis| plane.normal[axis] != 0.0 && domain.boundary[axis] == Boundary::Periodic) {
            plane_wrong(
                "normal",
                plane.normal.to_string(),
                "has a part along a periodic axis, where a plane has no place",
            );
        }
        if !(plane.offset.abs() <= *LIMITS.end()) {
            plane_wrong("offset", plane.offset.to_string(), "must be finite");
        }
        if !finite(plane.velocity) {
            plane_wrong("velocity", plane.velocity.to_string(), "must be finite");
        }
        if !known(plane.material) {
            plane_wrong("material", plane.material.to_string(), "there is no such material");
        }
    }
    result(problems)
}

/// Checks that every id is given once.
pub(super) fn identities(scene: &Scene, balls: &Balls) -> Result<(), CheckError> {
    let mut problems = Vec::new();
    let mut seen: HashMap<i64, ()> = HashMap::with_capacity(balls.len());
    let ids = balls.ids.iter().map(|id| ("ball", *id)).chain(scene.planes.iter().map(|plane| ("plane", plane.id)));
    let solid_ids = scene.solids.iter().map(|solid| ("body", solid.id));
    let mesh_ids = scene.meshes.iter().map(|mesh| ("mesh", mesh.id));
    for (what, id) in ids.chain(solid_ids).chain(mesh_ids) {
        if !(0..1 << 31).contains(&id) {
            problems.push(Problem::new(what, Some(id), "id", id, "must be from 0 to 2147483647"));
        } else if seen.insert(id, ()).is_some() {
            problems.push(Problem::new(what, Some(id), "id", id, "is given twice"));
        }
    }
    if balls.len() >= 1 << 30 {
        problems.push(Problem::new("scene", None, "body", balls.len(), "are more balls than can be numbered"));
    }
    result(problems)
}

fn largest_coordinate(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max)
}

/// Checks that every ball is on the free side of every plane and that no two balls overlap.
pub(super) fn geometry(world: &mut World, shrink: Option<f64>) -> Result<BuildReport, CheckError> {
    let start = world.start;
    let mut problems: Vec<Problem> = narrow(world).into_iter().collect();
    problems.extend(outside(world, start));
    problems.extend(crossing(world, start));
    let pairs = overlaps(world, start);
    let mut report = BuildReport { shrink_factor: 1.0, overlaps: 0, deepest_overlap: 0.0 };
    let deepest = pairs.iter().map(|pair| pair.depth).fold(0.0, f64::max);
    if let Some(most) = shrink
        && deepest <= most
        && pairs.iter().all(|pair| pair.distance > 0.0)
        && world.turning.is_none()
        && problems.is_empty()
    {
        let factor = pairs.iter().map(|pair| pair.distance / (pair.distance + pair.depth)).fold(1.0, f64::min);
        if factor < 1.0 {
            // Rounded down, so that no rounding of the product overlaps again.
            let factor = factor * (1.0 - 4.0 * f64::EPSILON);
            world.radii.scale(factor);
            report = BuildReport { shrink_factor: factor, overlaps: pairs.len(), deepest_overlap: deepest };
        }
        return Ok(report);
    }
    problems.extend(pairs.into_iter().take(MOST_PROBLEMS).map(|pair| {
        let ids = (world.id(pair.a), world.id(pair.b));
        let other = noun(world, pair.b);
        let reason = if pair.distance == 0.0 {
            format!("has the same centre as {other} {}", ids.1)
        } else {
            format!("overlaps {other} {} by {:e} m", ids.1, pair.depth)
        };
        Problem {
            other: Some(ids.1),
            depth: Some(pair.depth),
            ..Problem::new(noun(world, pair.a), Some(ids.0), "position", world.flights[pair.a].position(), reason)
        }
    }));
    if problems.is_empty() { Ok(report) } else { Err(CheckError { problems }) }
}

/// What a body is called in messages.
fn noun(world: &World, row: usize) -> &'static str {
    if world.turning_body(row).is_some() { "body" } else { "ball" }
}

/// Bodies that turn need a periodic box in which one image of a neighbour is the nearest whatever way they are turned, and places can
/// be told.
fn narrow(world: &World) -> Option<Problem> {
    world.turning.as_ref()?;
    let [largest, second] = world.largest_radii();
    let least = (largest + second) * (1.0 + CELL_MARGIN) / (0.999 * HALF_BOX);
    let periodic = |axis: &usize| world.domain.boundary[*axis] == Boundary::Periodic;
    let reason = if let Some(axis) = (0..3).filter(periodic).find(|&axis| world.domain.size[axis] < least) {
        format!(
            "is too small along {} for bodies that turn: they need {least} m, so that the spheres around two of them meet in one image only",
            ["x", "y", "z"][axis]
        )
    } else if lists::is_too_long(world) {
        "has too long a side beside the shortest for bodies that turn: where they are is not told exactly enough to find who is near"
            .into()
    } else {
        return None;
    };
    Some(Problem::new("domain", None, "size", world.domain.size, reason))
}

fn outside(world: &World, start: Time) -> Vec<Problem> {
    let mut problems = Vec::new();
    for ball in 0..world.len() {
        let position = world.position(ball, start);
        for axis in 0..3 {
            let half = 0.5 * world.domain.size[axis];
            if world.domain.boundary[axis] == Boundary::Periodic && position[axis].abs() > half {
                problems.push(Problem::new(
                    noun(world, ball),
                    Some(world.id(ball)),
                    "position",
                    position,
                    format!("lies outside the periodic box, which ends at ±{half} m"),
                ));
            }
        }
        if world.is_fixed(ball) {
            continue;
        }
        for (row, plane) in world.planes.iter().enumerate() {
            let mut gap = plane.normal.dot(position) - plane.offset_at(start) - world.radii[ball];
            if gap < 0.0 && world.turning_body(ball).is_some() {
                gap = gap_above_plane(world, ball, row, start);
            }
            let largest = largest_coordinate(&[position]).max(world.radii[ball]).max(plane.offset.abs());
            if gap < -touching(largest) && problems.len() < MOST_PROBLEMS {
                let name = if plane.id < 0 { format!("wall {}", plane.id) } else { format!("plane {}", plane.id) };
                problems.push(Problem {
                    other: Some(plane.id),
                    depth: Some(-gap),
                    ..Problem::new(
                        noun(world, ball),
                        Some(world.id(ball)),
                        "position",
                        position,
                        format!("reaches {:e} m beyond {name}", -gap),
                    )
                });
            }
        }
    }
    problems
}

/// Bodies that cross the surface of a mesh, which has no inside.
fn crossing(world: &World, start: Time) -> Vec<Problem> {
    let mut problems = Vec::new();
    for mesh in 0..world.meshes.len() {
        for row in (0..world.len()).filter(|&row| !world.is_fixed(row)) {
            let (surroundings, position) = (&world.meshes[mesh], world.flights[row].position());
            let body = Sought::new(world, row, start, DVec3::ZERO);
            let gap = gap_to_mesh(&body, surroundings, start, gap);
            let reach = surroundings.position.abs().max_element() + surroundings.reach;
            let largest = largest_coordinate(&[position]).max(world.radii[row]).max(reach);
            if gap < -touching(largest) && problems.len() < MOST_PROBLEMS {
                let reason = format!("crosses the surface of mesh {} by {:e} m", surroundings.id, -gap);
                problems.push(Problem {
                    other: Some(surroundings.id),
                    depth: Some(-gap),
                    ..Problem::new(noun(world, row), Some(world.id(row)), "position", position, reason)
                });
            }
        }
    }
    problems
}

struct Overlap {
    a: usize,
    b: usize,
    distance: f64,
    depth: f64,
}

/// All overlapping pairs, by row.
fn overlaps(world: &World, start: Time) -> Vec<Overlap> {
    let positions: Vec<DVec3> = (0..world.len()).map(|ball| world.position(ball, start)).collect();
    let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let mut cells = Cells::new(&world.domain, &world.radii, low, high);
    cells.visit_interiors();
    for (ball, position) in positions.iter().enumerate() {
        cells.insert(ball, *position);
    }
    let periods = world.domain.periods();
    let mut found = Vec::new();
    let mut near = Gathered::default();
    for a in 0..world.len() {
        let first = found.len();
        near.clear();
        cells.near(a, || world.radii[a], &mut near);
        for b in near.rows().iter().map(|&b| b as usize) {
            if b <= a || (world.is_fixed(a) && world.is_fixed(b)) {
                continue;
            }
            let mut r = positions[a] - positions[b];
            for axis in 0..3 {
                if periods[axis] > 0.0 {
                    r[axis] -= (r[axis] / periods[axis]).round() * periods[axis];
                }
            }
            let (distance, sum) = (r.length(), world.radii[a] + world.radii[b]);
            let largest = largest_coordinate(&[positions[a], positions[b], periods]).max(sum);
            let mut depth = sum - distance;
            if depth > touching(largest) && (world.turning_body(a).is_some() || world.turning_body(b).is_some()) {
                depth = -gap_of_bodies(world, a, b, start);
            }
            if depth > touching(largest) && found.len() < MOST_OVERLAPS {
                found.push(Overlap { a, b, distance, depth });
            }
        }
        found[first..].sort_by_key(|pair| pair.b);
    }
    found
}
