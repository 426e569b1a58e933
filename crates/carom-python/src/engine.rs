//! One simulation.

use std::sync::Arc;

use carom::DVec3;
use carom::record::Impact;
use carom::scene::Scene;
use carom::simulation::{Simulation, Stop};
use carom::time::Time;
use carom::world::World;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::errors;
use crate::geometry::Geometry;
use crate::spec::Spec;

/// Events between two looks for Ctrl-C: some 10 ms. With bodies that turn an event may be a search of that length.
const EVENTS_AT_ONCE: u64 = 4_000;
const EVENTS_AT_ONCE_TURNING: u64 = 16;

/// Where a body of the scene is kept.
#[derive(Clone, Copy)]
enum Row {
    Ball(usize),
    Fixed(Fixed),
}

/// Surroundings that are no particles: where a plane or a mesh is kept.
#[derive(Clone, Copy)]
enum Fixed {
    Plane(usize),
    Mesh(usize),
}

/// One simulation. All arrays have one row a body, sorted by id.
#[pyclass(module = "carom._carom")]
pub struct Engine {
    simulation: Simulation,
    rows: Vec<Row>,
    end: f64,
    shrink_factor: f64,
    overlaps: usize,
    deepest_overlap: f64,
    geometries: Vec<Py<Geometry>>,
}

impl Engine {
    fn new_from(spec: Spec, py: Python<'_>, checkpoint: Option<&[u8]>) -> PyResult<Self> {
        let Spec { scene, duration, record, geometries } = spec;
        let built = py.detach(|| {
            let (world, report) = scene.build()?;
            let rows = rows(&world);
            let simulation = match checkpoint {
                None => Simulation::new(world, record),
                Some(bytes) => Simulation::restore(world, bytes, record)?,
            };
            Ok((simulation, rows, report))
        });
        let (simulation, rows, report) = built.map_err(|error| errors::check(py, &error))?;
        Ok(Self {
            simulation,
            rows,
            end: scene.start_time + duration,
            shrink_factor: report.shrink_factor,
            overlaps: report.overlaps,
            deepest_overlap: report.deepest_overlap,
            geometries,
        })
    }

    fn world(&self) -> &World {
        self.simulation.world()
    }

    fn events_at_once(&self) -> u64 {
        if self.world().turning.is_some() { EVENTS_AT_ONCE_TURNING } else { EVENTS_AT_ONCE }
    }

    /// Three numbers for each body, from a ball's row or that of a plane or mesh.
    fn vectors<'py>(
        &self,
        py: Python<'py>,
        of_ball: impl Fn(usize) -> DVec3,
        of_fixed: impl Fn(Fixed) -> DVec3,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut flat = Vec::with_capacity(3 * self.rows.len());
        for row in &self.rows {
            let vector = match *row {
                Row::Ball(rank) => of_ball(self.world().row(rank)),
                Row::Fixed(fixed) => of_fixed(fixed),
            };
            flat.extend_from_slice(&vector.to_array());
        }
        flat.into_pyarray(py).reshape([self.rows.len(), 3])
    }

    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        of_ball: impl Fn(usize) -> T,
        of_fixed: impl Fn(Fixed) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        let values: Vec<T> = self
            .rows
            .iter()
            .map(|row| match *row {
                Row::Ball(rank) => of_ball(self.world().row(rank)),
                Row::Fixed(fixed) => of_fixed(fixed),
            })
            .collect();
        values.into_pyarray(py)
    }

    fn positions_at<'py>(&self, py: Python<'py>, time: Time) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let world = self.world();
        self.vectors(
            py,
            |ball| world.wrapped(ball, time).0,
            |fixed| match fixed {
                Fixed::Plane(row) => {
                    let plane = &world.planes[row];
                    plane.normal * plane.offset + plane.velocity * time.since(plane.start)
                }
                Fixed::Mesh(row) => world.meshes[row].position_at(time),
            },
        )
    }

    fn velocities_at<'py>(&self, py: Python<'py>, time: Time) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let world = self.world();
        self.vectors(
            py,
            |ball| world.velocity(ball, time),
            |fixed| match fixed {
                Fixed::Plane(row) => world.planes[row].velocity,
                Fixed::Mesh(row) => world.meshes[row].velocity,
            },
        )
    }

    fn impact<'py>(&self, py: Python<'py>, impact: &Impact) -> PyResult<Bound<'py, PyDict>> {
        let world = self.world();
        let spin = |id: i64| world.turns_of(id, self.simulation.now()).1.to_array();
        let row = PyDict::new(py);
        let (time, time_low) = impact.time.to_pair();
        row.set_item("time", time)?;
        row.set_item("time_low", time_low)?;
        row.set_item("a", impact.a)?;
        row.set_item("b", impact.b)?;
        row.set_item("kind", impact.kind.name())?;
        row.set_item("certificate", impact.certificate.name())?;
        row.set_item("point", impact.point.to_array())?;
        row.set_item("normal", impact.normal.to_array())?;
        row.set_item("approach_speed", impact.approach_speed)?;
        row.set_item("separation_speed", impact.separation_speed)?;
        row.set_item("impulse", impact.impulse)?;
        row.set_item("restitution", impact.restitution)?;
        row.set_item("energy_lost", impact.energy_lost)?;
        let [before_a, before_b, after_a, after_b] = impact.velocities;
        row.set_item("velocity_a_before", before_a.to_array())?;
        row.set_item("velocity_b_before", before_b.to_array())?;
        row.set_item("velocity_a", after_a.to_array())?;
        row.set_item("velocity_b", after_b.to_array())?;
        row.set_item("angular_velocity_a", spin(impact.a))?;
        row.set_item("angular_velocity_b", spin(impact.b))?;
        row.set_item("position_a", impact.positions[0].to_array())?;
        row.set_item("position_b", impact.positions[1].to_array())?;
        row.set_item("mass_a", impact.masses[0])?;
        row.set_item("mass_b", impact.masses[1])?;
        Ok(row)
    }
}

/// Bodies, planes and meshes of the scene by id; walls of the domain are no bodies.
fn rows(world: &World) -> Vec<Row> {
    let balls = (0..world.len()).map(|rank| (world.ids.of_rank(rank), Row::Ball(rank)));
    let planes = world.planes.iter().enumerate().map(|(row, plane)| (plane.id, Row::Fixed(Fixed::Plane(row))));
    let meshes = world.meshes.iter().enumerate().map(|(row, mesh)| (mesh.id, Row::Fixed(Fixed::Mesh(row))));
    let mut rows: Vec<(i64, Row)> = balls.chain(planes.filter(|(id, _)| *id >= 0)).chain(meshes).collect();
    rows.sort_by_key(|(id, _)| *id);
    rows.into_iter().map(|(_, row)| row).collect()
}

fn array2<'py>(py: Python<'py>, flat: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = flat.len() / 3;
    flat.into_pyarray(py).reshape([count, 3])
}

#[pymethods]
impl Engine {
    #[new]
    fn new(py: Python<'_>, spec: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::new_from(Spec::read(spec)?, py, None)
    }

    /// The engine that wrote `checkpoint`, of the same scene.
    #[staticmethod]
    fn restore(py: Python<'_>, spec: &Bound<'_, PyAny>, checkpoint: &[u8]) -> PyResult<Self> {
        Self::new_from(Spec::read(spec)?, py, Some(checkpoint))
    }

    /// The clock as (time, time_low) in seconds; their sum is exact.
    #[getter]
    fn time(&self) -> (f64, f64) {
        self.simulation.now().to_pair()
    }

    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let world = self.world();
        self.column(
            py,
            |ball| world.id(ball),
            |fixed| match fixed {
                Fixed::Plane(row) => world.planes[row].id,
                Fixed::Mesh(row) => world.meshes[row].id,
            },
        )
    }

    /// Metres; nan for planes.
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |ball| self.world().radii[ball], |_| f64::NAN)
    }

    /// Kilograms; inf for fixed bodies and planes.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |ball| self.world().bodies[ball].mass, |_| f64::INFINITY)
    }

    /// Moments of inertia of balls about the centre (kg m²); inf for fixed bodies and planes, that of a solid ball where no ball
    /// of the scene has a spin or an orientation, nan for bodies of other shapes, which have `moments`.
    #[getter]
    fn inertias<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let world = self.world();
        let gyration = if world.dimensions == 2 { 0.5 } else { 0.4 };
        let of_ball = |ball: usize| match &world.spin {
            _ if world.is_fixed(ball) => f64::INFINITY,
            _ if world.turning_body(ball).is_some() => f64::NAN,
            Some(spin) => spin.inertia[ball],
            None => gyration * world.bodies[ball].mass * world.radii[ball] * world.radii[ball],
        };
        self.column(py, of_ball, |_| f64::INFINITY)
    }

    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.column(py, |ball| self.world().is_fixed(ball), |_| true)
    }

    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let world = self.world();
        self.column(
            py,
            |ball| i64::from(world.bodies[ball].material),
            |fixed| match fixed {
                Fixed::Plane(row) => i64::from(world.planes[row].material),
                Fixed::Mesh(row) => i64::from(world.meshes[row].material),
            },
        )
    }

    #[getter]
    fn is_plane<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.column(py, |_| false, |fixed| matches!(fixed, Fixed::Plane(_)))
    }

    /// The different shapes of bodies that turn, each once.
    #[getter]
    fn geometries(&self, py: Python<'_>) -> Vec<Py<Geometry>> {
        self.geometries.iter().map(|geometry| geometry.clone_ref(py)).collect()
    }

    /// Which of them each body has; -1 for balls and planes.
    #[getter]
    fn geometry_of<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of_ball = |row: usize| {
            let body = self.world().turning_body(row);
            let shape = body.and_then(|body| {
                self.geometries.iter().position(|geometry| Arc::ptr_eq(&geometry.get().body, &body.geometry))
            });
            shape.map_or(-1, |place| place as i64)
        };
        self.column(py, of_ball, |_| -1)
    }

    /// Principal moments of inertia (kg m²); inf for fixed bodies and planes.
    #[getter]
    fn moments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let world = self.world();
        let gyration = if world.dimensions == 2 { 0.5 } else { 0.4 };
        let of_ball = |ball: usize| match (world.turning_body(ball), &world.spin) {
            _ if world.is_fixed(ball) => DVec3::INFINITY,
            (Some(body), _) => body.moments,
            (None, Some(spin)) => DVec3::splat(spin.inertia[ball]),
            (None, None) => DVec3::splat(gyration * world.bodies[ball].mass * world.radii[ball] * world.radii[ball]),
        };
        self.vectors(py, of_ball, |_| DVec3::INFINITY)
    }

    /// Meshes of triangles as they were at the start, as dicts; vertices (m) in a frame of their own.
    #[getter]
    fn meshes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for mesh in &self.world().meshes {
            let entry = PyDict::new(py);
            let turn = mesh.orientation;
            let vertices = mesh.mesh.vertices.iter().flat_map(|vertex| vertex.to_array()).collect();
            let corners: Vec<u32> = mesh.mesh.triangles.iter().flat_map(|triangle| triangle.vertices).collect();
            entry.set_item("id", mesh.id)?;
            entry.set_item("vertices", array2(py, vertices)?)?;
            entry.set_item("triangles", corners.into_pyarray(py).reshape([mesh.mesh.triangles.len(), 3])?)?;
            entry.set_item("position", mesh.position.to_array())?;
            entry.set_item("orientation", [turn.w, turn.x, turn.y, turn.z])?;
            entry.set_item("velocity", mesh.velocity.to_array())?;
            entry.set_item("angular_velocity", mesh.angular_velocity.to_array())?;
            list.append(entry)?;
        }
        Ok(list)
    }

    /// Planes of the scene and walls of the domain (negative ids), as dicts.
    #[getter]
    fn planes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for plane in &self.world().planes {
            let entry = PyDict::new(py);
            entry.set_item("id", plane.id)?;
            entry.set_item("normal", plane.normal.to_array())?;
            entry.set_item("offset", plane.offset)?;
            entry.set_item("velocity", plane.velocity.to_array())?;
            entry.set_item("material", plane.material)?;
            list.append(entry)?;
        }
        Ok(list)
    }

    /// Factor by which overlaps of an imported file shrank all radii, how many there were, and the deepest (m).
    #[getter]
    fn shrunk(&self) -> (f64, usize, f64) {
        (self.shrink_factor, self.overlaps, self.deepest_overlap)
    }

    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.positions_at(py, self.simulation.now())
    }

    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.velocities_at(py, self.simulation.now())
    }

    /// Quaternions (w, x, y, z), body to world.
    fn orientations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let now = self.simulation.now();
        let mut flat = Vec::with_capacity(4 * self.rows.len());
        for row in &self.rows {
            flat.extend_from_slice(&match *row {
                Row::Ball(rank) => self.world().orientation(self.world().row(rank), now),
                Row::Fixed(Fixed::Plane(_)) => [1.0, 0.0, 0.0, 0.0],
                Row::Fixed(Fixed::Mesh(row)) => {
                    let turn = self.world().meshes[row].orientation_at(now);
                    [turn.w, turn.x, turn.y, turn.z]
                }
            });
        }
        flat.into_pyarray(py).reshape([self.rows.len(), 4])
    }

    fn angular_velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.vectors(
            py,
            |ball| self.world().angular_velocity(ball, self.simulation.now()),
            |fixed| match fixed {
                Fixed::Plane(_) => DVec3::ZERO,
                Fixed::Mesh(row) => self.world().meshes[row].angular_velocity,
            },
        )
    }

    /// Sizes of the periodic box that each body has left behind.
    fn images<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let now = self.simulation.now();
        let mut flat = Vec::with_capacity(3 * self.rows.len());
        for row in &self.rows {
            flat.extend_from_slice(&match *row {
                Row::Ball(rank) => self.world().wrapped(self.world().row(rank), now).1,
                Row::Fixed(_) => [0; 3],
            });
        }
        flat.into_pyarray(py).reshape([self.rows.len(), 3])
    }

    /// Positions and velocities at a time between the clock and the next impact.
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn states_at<'py>(
        &self,
        py: Python<'py>,
        time: f64,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let time = self.world().clock.at(time);
        Ok((self.positions_at(py, time)?, self.velocities_at(py, time)?))
    }

    /// Runs to the absolute time `until`, or for `impacts` more impacts, whichever comes first: "time", "impacts", or
    /// "exhausted" if nothing is left to happen.
    #[pyo3(signature = (until=None, impacts=None))]
    fn run(&mut self, py: Python<'_>, until: Option<f64>, impacts: Option<u64>) -> PyResult<&'static str> {
        let limit = match until {
            None => Time::NEVER,
            Some(time) => Some(self.world().clock.at(time)).filter(|limit| limit.is_reachable()).ok_or_else(|| {
                PyValueError::new_err(format!(
                    "until = {time}: must be finite, and no farther than the clock can count"
                ))
            })?,
        };
        let mut left = impacts.unwrap_or(u64::MAX);
        let at_once = self.events_at_once();
        loop {
            let before = self.simulation.counts().impacts();
            let stop = py.detach(|| self.simulation.run(limit, left, at_once));
            left -= self.simulation.counts().impacts() - before;
            match stop.map_err(|error| errors::collapse(py, &error))? {
                Stop::Time => return Ok(if until.is_some() { "time" } else { "exhausted" }),
                Stop::Impacts => return Ok("impacts"),
                Stop::Events => py.check_signals()?,
            }
        }
    }

    /// On to the next impact, as a dict; None if there is none before the scene's duration, at which the clock then stands.
    fn step<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let limit = self.world().clock.at(self.end);
        let at_once = self.events_at_once();
        loop {
            let step = py.detach(|| self.simulation.step_within(limit, at_once));
            match step.map_err(|error| errors::collapse(py, &error))? {
                (_, Some(impact)) => return self.impact(py, &impact).map(Some),
                (Stop::Events, None) => py.check_signals()?,
                (Stop::Time | Stop::Impacts, None) => return Ok(None),
            }
        }
    }

    /// The impacts recorded since the last call, by column. The arrays take the columns over; nothing is copied.
    fn take_impacts<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let table = self.simulation.take_impacts();
        let columns = PyDict::new(py);
        columns.set_item("time", table.time.into_pyarray(py))?;
        columns.set_item("time_low", table.time_low.into_pyarray(py))?;
        columns.set_item("a", table.a.into_pyarray(py))?;
        columns.set_item("b", table.b.into_pyarray(py))?;
        columns.set_item("kind", table.kind.into_pyarray(py))?;
        columns.set_item("point", array2(py, table.point)?)?;
        columns.set_item("normal", array2(py, table.normal)?)?;
        columns.set_item("approach_speed", table.approach_speed.into_pyarray(py))?;
        columns.set_item("separation_speed", table.separation_speed.into_pyarray(py))?;
        columns.set_item("impulse", table.impulse.into_pyarray(py))?;
        columns.set_item("restitution", table.restitution.into_pyarray(py))?;
        columns.set_item("energy_lost", table.energy_lost.into_pyarray(py))?;
        if self.world().turning.is_some() {
            let names = [("orientation_a", "angular_velocity_a"), ("orientation_b", "angular_velocity_b")];
            for ((orientation, angular_velocity), turns) in names.into_iter().zip(table.turns) {
                let rows = turns.orientation.len() / 4;
                columns.set_item(orientation, turns.orientation.into_pyarray(py).reshape([rows, 4])?)?;
                columns.set_item(angular_velocity, array2(py, turns.angular_velocity)?)?;
            }
            columns.set_item("certificate", table.certificate.into_pyarray(py))?;
        }
        Ok(columns)
    }

    /// Impacts since the start.
    #[getter]
    fn impact_count(&self) -> u64 {
        self.simulation.counts().impacts()
    }

    /// Energy and momentum at the clock.
    fn ledger<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let balance = self.simulation.balance();
        let entries = PyDict::new(py);
        entries.set_item("kinetic_energy", balance.kinetic_energy)?;
        entries.set_item("potential_energy", balance.potential_energy)?;
        entries.set_item("momentum", balance.momentum.to_array())?;
        entries.set_item("angular_momentum", balance.angular_momentum.map(|l| l.to_array()))?;
        entries.set_item("dissipated", balance.dissipated)?;
        entries.set_item("work", balance.work)?;
        entries.set_item("wall_impulse", balance.wall_impulse.to_array())?;
        entries.set_item("gravity_impulse", balance.gravity_impulse.to_array())?;
        entries.set_item("energy_start", balance.energy_start)?;
        entries.set_item("energy_error", balance.energy_error)?;
        entries.set_item("momentum_error", balance.momentum_error)?;
        entries.set_item("angular_momentum_error", balance.angular_momentum_error)?;
        Ok(entries)
    }

    /// How much was done.
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counts = self.simulation.counts();
        let entries = PyDict::new(py);
        entries.set_item("impacts", counts.impacts())?;
        entries.set_item("ball_ball", counts.ball_ball)?;
        entries.set_item("ball_plane", counts.ball_plane)?;
        entries.set_item("transversal", counts.transversal)?;
        entries.set_item("within_tolerance", counts.within_tolerance)?;
        entries.set_item("continued", counts.continued)?;
        entries.set_item("grazes", counts.grazes)?;
        entries.set_item("cell_crossings", counts.crossings)?;
        entries.set_item("stale", counts.stale)?;
        entries.set_item("layouts", counts.layouts)?;
        entries.set_item("bytes_per_ball", self.simulation.bytes_per_ball())?;
        Ok(entries)
    }

    /// The state as bytes, to go on from bit for bit.
    fn checkpoint<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.simulation.checkpoint())
    }

    /// The names of the rules used.
    fn rules<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let entries = PyDict::new(py);
        for (name, rule) in Scene::rules(self.world().simultaneous) {
            entries.set_item(name, rule)?;
        }
        Ok(entries)
    }
}
