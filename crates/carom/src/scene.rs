//! What the user describes. [`Scene::build`] checks it and makes a [`World`] of it, or says all that is wrong.

mod check;
mod fill;

use std::sync::Arc;

use glam::{DQuat, DVec3};

pub use fill::{Fill, Placement, RadiusDistribution, SolidFill};

use crate::error::{CheckError, Problem};
use crate::event::Kind;
use crate::flight::Flight;
use crate::predict::turning::solid::Solid;
use crate::rotation::Rotation;
use crate::shape::{BodyGeometry, TriangleMesh};
use crate::time::{Clock, Time};
use crate::world::ids::Ids;
use crate::world::images::Images;
use crate::world::radii::Radii;
use crate::world::surroundings::Surroundings;
use crate::world::turning::{TurningBodies, TurningBody};
use crate::world::{Body, Boundary, Domain, Partner, Plane, RestitutionTable, Spin, World};

/// Balls by column, in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Balls {
    /// Identities, unique, 0 or more.
    pub ids: Vec<i64>,
    /// Centres (m).
    pub positions: Vec<DVec3>,
    /// Velocities (m/s).
    pub velocities: Vec<DVec3>,
    /// Radii (m).
    pub radii: Vec<f64>,
    /// Masses (kg); without meaning for fixed balls.
    pub masses: Vec<f64>,
    /// Moments of inertia about the centre (kg m²); without meaning for fixed balls.
    pub inertias: Vec<f64>,
    /// Indices of the materials.
    pub materials: Vec<u32>,
    /// Whether the motion is prescribed: it keeps its velocity, whatever meets it.
    pub fixed: Vec<bool>,
    /// Unit quaternions (w, x, y, z), body to world.
    pub orientations: Vec<[f64; 4]>,
    /// World axes (rad/s).
    pub angular_velocities: Vec<DVec3>,
}

/// One ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Identity.
    pub id: i64,
    /// Centre (m).
    pub position: DVec3,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// Radius (m).
    pub radius: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Index of the material.
    pub material: u32,
    /// Whether its motion is prescribed.
    pub fixed: bool,
}

impl Balls {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Adds a ball without spin, solid and homogeneous (a disc in two dimensions).
    pub fn push(&mut self, ball: Ball, dimensions: u8) {
        self.ids.push(ball.id);
        self.positions.push(ball.position);
        self.velocities.push(ball.velocity);
        self.radii.push(ball.radius);
        self.masses.push(ball.mass);
        let gyration = if dimensions == 2 { 0.5 } else { 0.4 };
        self.inertias.push(gyration * ball.mass * ball.radius * ball.radius);
        self.materials.push(ball.material);
        self.fixed.push(ball.fixed);
        self.orientations.push([1.0, 0.0, 0.0, 0.0]);
        self.angular_velocities.push(DVec3::ZERO);
    }
}

/// What is done where several pairs touch at one instant. Several points of one pair are always resolved by reflections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Simultaneous {
    /// Pair by pair, in the order of events, until none approaches.
    #[default]
    Pairwise,
    /// All together, by [`crate::resolve::reflections`].
    Reflections,
}

/// A body that turns.
#[derive(Clone, Debug)]
pub struct SolidBody {
    /// Identity, unique among all bodies, 0 or more.
    pub id: i64,
    /// Its shape; bodies that are alike share it.
    pub geometry: Arc<BodyGeometry>,
    /// Centre of mass (m).
    pub position: DVec3,
    /// Unit quaternion (w, x, y, z): the frame in which the shape was given, to world.
    pub orientation: [f64; 4],
    /// Velocity (m/s) of the centre of mass.
    pub velocity: DVec3,
    /// World axes (rad/s).
    pub angular_velocity: DVec3,
    /// Mass (kg); without meaning for fixed bodies.
    pub mass: f64,
    /// Moments about the principal axes of the shape (kg m²) in the order of [`BodyGeometry::gyration`], if they are not those
    /// of a homogeneous body.
    pub inertia: Option<DVec3>,
    /// Index of the material.
    pub material: u32,
    /// Whether the motion is prescribed: it keeps its velocity and its angular velocity, whatever meets it.
    pub fixed: bool,
}

/// Surroundings of triangles, whose motion is prescribed.
#[derive(Clone, Debug)]
pub struct MeshBody {
    /// Identity, unique among all bodies, 0 or more.
    pub id: i64,
    /// The triangles, in a frame of their own.
    pub mesh: Arc<TriangleMesh>,
    /// Where the origin of that frame is (m).
    pub position: DVec3,
    /// Unit quaternion (w, x, y, z): that frame to world.
    pub orientation: [f64; 4],
    /// Velocity (m/s) of the origin of that frame.
    pub velocity: DVec3,
    /// World axes (rad/s).
    pub angular_velocity: DVec3,
    /// Index of the material.
    pub material: u32,
}

/// A plane as a body: the points with normal·x = offset, moving at `velocity`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneBody {
    /// Identity.
    pub id: i64,
    /// Unit vector to the free side.
    pub normal: DVec3,
    /// Distance from the origin along the normal at the start (m).
    pub offset: f64,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// Index of the material.
    pub material: u32,
}

/// Everything a run starts from.
#[derive(Clone, Debug)]
pub struct Scene {
    /// 2: z is held at zero; 3.
    pub dimensions: u8,
    /// Acceleration of free bodies (m/s²).
    pub gravity: DVec3,
    /// Of the one generator.
    pub seed: u64,
    /// What the clock shows at the start (s).
    pub start_time: f64,
    /// Restitution of pairs not listed.
    pub restitution: f64,
    /// How many materials there are, at least 1.
    pub materials: usize,
    /// Restitution by pair of materials.
    pub pairs: Vec<(usize, usize, f64)>,
    /// The region.
    pub domain: Domain,
    /// Material of the domain's walls.
    pub domain_material: u32,
    /// Balls given one by one.
    pub balls: Balls,
    /// Bodies that turn.
    pub solids: Vec<SolidBody>,
    /// Surroundings of triangles.
    pub meshes: Vec<MeshBody>,
    /// Planes.
    pub planes: Vec<PlaneBody>,
    /// Balls to be placed.
    pub fills: Vec<Fill>,
    /// Bodies that turn, to be placed. Their rows, in errors and as sequences of the one generator, count on from `fills`.
    pub solid_fills: Vec<SolidFill>,
    /// Overlaps up to this depth (m) are removed by shrinking all balls by one factor; `None`: every overlap is an error.
    pub shrink_overlaps: Option<f64>,
    /// What is done where several pairs touch at one instant.
    pub simultaneous: Simultaneous,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            dimensions: 3,
            gravity: DVec3::ZERO,
            seed: 1,
            start_time: 0.0,
            restitution: 1.0,
            materials: 1,
            pairs: Vec::new(),
            domain: Domain::OPEN,
            domain_material: 0,
            balls: Balls::default(),
            solids: Vec::new(),
            meshes: Vec::new(),
            planes: Vec::new(),
            fills: Vec::new(),
            solid_fills: Vec::new(),
            shrink_overlaps: None,
            simultaneous: Simultaneous::default(),
        }
    }
}

/// What building a scene did that was not spelled out in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildReport {
    /// Factor by which all radii were shrunk to remove overlaps, 1 if none.
    pub shrink_factor: f64,
    /// Overlapping pairs that were shrunk away.
    pub overlaps: usize,
    /// The deepest of them (m).
    pub deepest_overlap: f64,
}

impl Scene {
    /// Checks everything, places what has to be placed, and sets the clock.
    ///
    /// # Errors
    /// [`CheckError`] with all that is wrong: values out of range, balls outside the domain, each overlapping pair with
    /// its depth.
    pub fn build(&self) -> Result<(World, BuildReport), CheckError> {
        check::values(self)?;
        let mut balls = self.balls.clone();
        for (row, fill) in self.fills.iter().enumerate() {
            fill.place(row, self, &mut balls)?;
        }
        let drawn = if self.fills.is_empty() && self.solid_fills.is_empty() {
            None
        } else {
            let (balls, solids) = (balls.clone(), self.placed_solids()?);
            Some(Self { balls, solids, fills: Vec::new(), solid_fills: Vec::new(), ..self.clone() })
        };
        let scene = drawn.as_ref().unwrap_or(self);
        check::identities(scene, &balls)?;
        if drawn.is_some() {
            // What was drawn has to pass like what was given.
            check::values(scene)?;
        }
        let mut world = scene.world(&balls, &scene.solids);
        if !world.start.is_reachable() {
            let reason = "is too far from 0 for a clock that resolves the motion of the smallest ball";
            return Err(Problem::new("scene", None, "time", self.start_time, reason).into());
        }
        let report = check::geometry(&mut world, self.shrink_overlaps)?;
        Ok((world, report))
    }

    /// The bodies that turn: those given one by one, then those of the fills.
    ///
    /// # Errors
    /// A fill that has no room, or with a value out of range.
    pub fn placed_solids(&self) -> Result<Vec<SolidBody>, CheckError> {
        let mut solids = self.solids.clone();
        for (row, fill) in (self.fills.len()..).zip(&self.solid_fills) {
            fill.place(row, self, &mut solids)?;
        }
        Ok(solids)
    }

    /// The world of these balls and of the bodies that turn, sorted by id, not yet checked for overlaps.
    fn world(&self, balls: &Balls, solids: &[SolidBody]) -> World {
        let mut order: Vec<(i64, Row)> = balls.ids.iter().enumerate().map(|(row, &id)| (id, Row::Ball(row))).collect();
        order.extend(solids.iter().enumerate().map(|(row, solid)| (solid.id, Row::Solid(row))));
        order.sort_by_key(|&(id, _)| id);
        let mut planes = self.planes.clone();
        planes.extend(walls(&self.domain, self.domain_material));
        planes.sort_by_key(|plane| plane.id);
        let clock = self.clock(balls, solids, &planes);
        let start = clock.at(self.start_time);
        let mut restitution = RestitutionTable::uniform(self.materials, self.restitution);
        for &(a, b, e) in &self.pairs {
            restitution.set(a, b, e);
        }
        let planes: Vec<Plane> = planes
            .iter()
            .map(|plane| Plane {
                id: plane.id,
                normal: plane.normal,
                offset: plane.offset,
                velocity: plane.velocity,
                start,
                material: plane.material,
            })
            .collect();
        let meshes = self.surroundings(start);
        let rows: Vec<Member> = order.iter().map(|&(_, row)| member(balls, solids, row)).collect();
        let turns = |row: usize| balls.angular_velocities[row] != DVec3::ZERO;
        let turned = |row: usize| balls.orientations[row] != [1.0, 0.0, 0.0, 0.0];
        let spin = (0..balls.len()).any(|row| turns(row) || turned(row)).then(|| {
            let of = |row: &(i64, Row)| match row.1 {
                Row::Ball(ball) => (balls.orientations[ball], balls.angular_velocities[ball], balls.inertias[ball]),
                Row::Solid(_) => ([1.0, 0.0, 0.0, 0.0], DVec3::ZERO, 0.0),
            };
            Spin {
                orientation: order.iter().map(|row| of(row).0).collect(),
                angular_velocity: order.iter().map(|row| of(row).1).collect(),
                inertia: order.iter().map(|row| of(row).2).collect(),
                start,
            }
        });
        let mut world = World {
            clock,
            start,
            dimensions: self.dimensions,
            gravity: self.gravity,
            domain: self.domain,
            restitution,
            rows: (0..order.len() as u32).collect(),
            ids: Ids::new(order.iter().map(|&(id, _)| id).collect()),
            flights: rows.iter().map(|row| Flight::new(row.position, row.velocity, start)).collect(),
            radii: Radii::new(rows.iter().map(|row| row.radius).collect()),
            bodies: rows
                .iter()
                .enumerate()
                .map(|(rank, row)| Body {
                    rank: rank as u32,
                    mass: if row.fixed { f64::INFINITY } else { row.mass },
                    energy: 0.0,
                    material: row.material,
                    last_partner: Partner::NONE,
                })
                .collect(),
            impacts: vec![0; order.len()],
            images: Images::new(order.len(), self.domain.is_periodic()),
            turning: turning(solids, &order, &planes, !meshes.is_empty()),
            planes,
            meshes,
            spin,
            growth: None,
            simultaneous: self.simultaneous,
        };
        for ball in 0..world.len() {
            if !world.is_fixed(ball) {
                world.bodies[ball].energy = world.energy(ball);
            }
        }
        world
    }

    /// The meshes, ascending by id, as they are at the start.
    fn surroundings(&self, start: Time) -> Vec<Surroundings> {
        let mut meshes: Vec<Surroundings> = self
            .meshes
            .iter()
            .map(|mesh| Surroundings {
                material: mesh.material,
                ..Surroundings::new(mesh.id, mesh.mesh.clone(), mesh.position, mesh.orientation, start)
                    .moving(mesh.velocity, mesh.angular_velocity)
            })
            .collect();
        meshes.sort_by_key(|mesh| mesh.id);
        meshes
    }

    /// A clock whose span is some 64 times the time in which the fastest body crosses the smallest radius: rounding of an
    /// instant then moves nothing by more than about 1e-14 radii.
    fn clock(&self, balls: &Balls, solids: &[SolidBody], planes: &[PlaneBody]) -> Clock {
        // Of a body that turns, a thousandth of its size is a detail.
        let details = solids.iter().map(|solid| solid.geometry.in_radius.max(1e-3 * solid.geometry.radius));
        let smallest = balls.radii.iter().copied().chain(details).fold(f64::INFINITY, f64::min);
        let speeds = balls.velocities.iter().chain(planes.iter().map(|plane| &plane.velocity));
        let of_solid =
            |solid: &SolidBody| solid.velocity.length() + solid.angular_velocity.length() * solid.geometry.radius;
        let of_mesh = |body: &MeshBody| {
            let reach = body.mesh.vertices.iter().map(|vertex| vertex.length()).fold(0.0, f64::max);
            body.velocity.length() + body.angular_velocity.length() * reach
        };
        let of_bodies = solids.iter().map(of_solid).chain(self.meshes.iter().map(of_mesh));
        let fastest = speeds.map(|velocity| velocity.length()).chain(of_bodies).fold(0.0, f64::max);
        let fastest = fastest.max((self.gravity.length() * smallest).sqrt());
        let crossing = smallest / fastest;
        if crossing.is_finite() && crossing > 0.0 { Clock::with_span(32.0 * crossing) } else { Clock::with_span(1.0) }
    }

    /// The names of the rules by which the notes' and this program's choices are made, for every output.
    pub fn rules(simultaneous: Simultaneous) -> [(&'static str, &'static str); 3] {
        let several_pairs = match simultaneous {
            Simultaneous::Pairwise => {
                "pairwise: contacts of one instant are resolved pair by pair in the order of kind and ids, again until none approaches; several contacts of one pair together, by reflections"
            }
            Simultaneous::Reflections => {
                "reflections: all contacts of bodies that touch at one instant, of one pair or several, are resolved together, by reflections, until none approaches"
            }
        };
        [
            ("simultaneous", several_pairs),
            (
                "collapse",
                "stop: a run whose lossy impacts accumulate, or whose bodies come to rest on each other, ends with an error",
            ),
            ("law", "newton: v_AB·n after = -e v_AB·n before, without friction"),
        ]
    }
}

/// Where a body stands in its scene.
#[derive(Clone, Copy, Debug)]
enum Row {
    Ball(usize),
    Solid(usize),
}

/// What all bodies have.
struct Member {
    position: DVec3,
    velocity: DVec3,
    radius: f64,
    mass: f64,
    material: u32,
    fixed: bool,
}

fn member(balls: &Balls, solids: &[SolidBody], row: Row) -> Member {
    match row {
        Row::Ball(row) => Member {
            position: balls.positions[row],
            velocity: balls.velocities[row],
            radius: balls.radii[row],
            mass: balls.masses[row],
            material: balls.materials[row],
            fixed: balls.fixed[row],
        },
        Row::Solid(row) => {
            let solid = &solids[row];
            Member {
                position: solid.position,
                velocity: solid.velocity,
                radius: solid.geometry.radius,
                mass: solid.mass,
                material: solid.material,
                fixed: solid.fixed,
            }
        }
    }
}

/// The bodies that turn, among all rows; without any, if there are none and none are `needed`.
fn turning(solids: &[SolidBody], order: &[(i64, Row)], planes: &[Plane], needed: bool) -> Option<TurningBodies> {
    // Bodies that share a shape share what is prepared of it.
    let mut prepared: Vec<(*const BodyGeometry, Arc<[Solid]>)> = Vec::new();
    let mut bodies = Vec::with_capacity(solids.len());
    for (row, &(_, member)) in order.iter().enumerate() {
        let Row::Solid(solid) = member else { continue };
        let solid = &solids[solid];
        let shape = Arc::as_ptr(&solid.geometry);
        let known = prepared.iter().rev().find(|(known, _)| *known == shape).map(|(_, parts)| parts.clone());
        let parts = known.unwrap_or_else(|| {
            let parts: Arc<[Solid]> = Solid::parts(&solid.geometry.shape).into();
            prepared.push((shape, parts.clone()));
            parts
        });
        // What is prescribed keeps its angular velocity, as a body does whose moments are equal.
        let moments =
            if solid.fixed { DVec3::ONE } else { solid.inertia.unwrap_or(solid.geometry.gyration * solid.mass) };
        let [w, x, y, z] = solid.geometry.principal_orientation(solid.orientation);
        let orientation = DQuat::from_xyzw(x, y, z, w).normalize();
        bodies.push(TurningBody {
            row: row as u32,
            geometry: solid.geometry.clone(),
            parts,
            moments,
            orientation,
            angular_velocity: solid.angular_velocity,
            rotation: Rotation::new(moments, orientation, solid.angular_velocity),
        });
    }
    (needed || !bodies.is_empty()).then(|| TurningBodies::new(order.len(), bodies, planes))
}

/// The walls of a domain as planes.
fn walls(domain: &Domain, material: u32) -> Vec<PlaneBody> {
    let mut walls = Vec::new();
    for axis in 0..3 {
        if domain.boundary[axis] == Boundary::Walls {
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                walls.push(PlaneBody {
                    id: -1 - (2 * axis as i64 + side),
                    normal: DVec3::AXES[axis] * sign,
                    offset: -0.5 * domain.size[axis],
                    velocity: DVec3::ZERO,
                    material,
                });
            }
        }
    }
    walls
}

/// Whether two shapes can meet at all, for checks before a run.
///
/// # Errors
/// If the pair is not in the table of pairs.
pub fn check_pair(a: crate::predict::ShapeKind, b: crate::predict::ShapeKind) -> Result<Kind, CheckError> {
    crate::predict::kind_of_pair(a, b).ok_or_else(|| {
        Problem::new(
            "pair",
            None,
            "shape",
            format!("{a:?} and {b:?}"),
            "these two shapes cannot collide with each other",
        )
        .into()
    })
}
