//! The dict that `Scene.to_spec` makes, as the core's scene. Its form is the package's business; here it is only read, and a
//! dict of another form is a `ValueError` that names the entry.

use std::sync::Arc;

use carom::DVec3;
use carom::scene::{
    Balls, Fill, MeshBody, Placement, PlaneBody, RadiusDistribution, Scene, Simultaneous, SolidBody, SolidFill,
};
use carom::shape::BodyGeometry;
use carom::world::{Boundary, Domain};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::geometry::{Geometry, TriangleMesh};

/// A scene, when it ends, and whether its impacts are recorded.
pub struct Spec {
    pub scene: Scene,
    pub duration: f64,
    pub record: bool,
    /// The different shapes of bodies that turn, each once.
    pub geometries: Vec<Py<Geometry>>,
}

/// A dict whose entries are read by name.
struct Entries<'py> {
    dict: Bound<'py, PyDict>,
    name: &'static str,
}

impl<'py> Entries<'py> {
    fn new(value: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let dict = value.cast::<PyDict>().map_err(|_| PyValueError::new_err(format!("{name}: a dict is expected")))?;
        Ok(Self { dict: dict.clone(), name })
    }

    fn optional(&self, key: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.dict.get_item(key)?.filter(|value| !value.is_none()))
    }

    fn required(&self, key: &str) -> PyResult<Bound<'py, PyAny>> {
        self.optional(key)?.ok_or_else(|| PyValueError::new_err(format!("{}: {key} is missing", self.name)))
    }

    fn wrong(&self, key: &str, error: &PyErr) -> PyErr {
        PyValueError::new_err(format!("{}.{key}: {error}", self.name))
    }

    fn get<T: for<'a> FromPyObject<'a, 'py>>(&self, key: &str) -> PyResult<T> {
        let value = self.required(key)?;
        value.extract::<T>().map_err(|error| self.wrong(key, &error.into()))
    }

    fn find<T: for<'a> FromPyObject<'a, 'py>>(&self, key: &str) -> PyResult<Option<T>> {
        match self.optional(key)? {
            None => Ok(None),
            Some(value) => value.extract::<T>().map(Some).map_err(|error| self.wrong(key, &error.into())),
        }
    }

    fn vector(&self, key: &str) -> PyResult<DVec3> {
        Ok(DVec3::from_array(self.get::<[f64; 3]>(key)?))
    }

    fn find_vector(&self, key: &str) -> PyResult<Option<DVec3>> {
        Ok(self.find::<[f64; 3]>(key)?.map(DVec3::from_array))
    }

    fn column<T: numpy::Element + Copy>(&self, key: &str, rows: usize) -> PyResult<Vec<T>> {
        let value = self.required(key)?;
        let array = value.extract::<PyReadonlyArray1<'_, T>>().map_err(|error| self.wrong(key, &error))?;
        let values: Vec<T> = array.as_array().iter().copied().collect();
        self.whole(key, rows, values.len())?;
        Ok(values)
    }

    fn vectors<const N: usize>(&self, key: &str, rows: usize) -> PyResult<Vec<[f64; N]>> {
        let value = self.required(key)?;
        let array = value.extract::<PyReadonlyArray2<'_, f64>>().map_err(|error| self.wrong(key, &error))?;
        let array = array.as_array();
        if array.ncols() != N {
            return Err(PyValueError::new_err(format!("{}.{key}: {N} columns are expected", self.name)));
        }
        self.whole(key, rows, array.nrows())?;
        Ok(array.rows().into_iter().map(|row| std::array::from_fn(|column| row[column])).collect())
    }

    fn whole(&self, key: &str, rows: usize, found: usize) -> PyResult<()> {
        if found == rows {
            Ok(())
        } else {
            Err(PyValueError::new_err(format!("{}.{key}: {rows} rows are expected, not {found}", self.name)))
        }
    }
}

impl Spec {
    pub fn read(spec: &Bound<'_, PyAny>) -> PyResult<Self> {
        let entries = Entries::new(spec, "spec")?;
        let materials: Vec<String> = entries.get("materials")?;
        let (domain, domain_material) = domain(&entries.required("domain")?)?;
        let planes = entries.get::<Vec<Bound<'_, PyAny>>>("planes")?;
        let fills = entries.get::<Vec<Bound<'_, PyAny>>>("fills")?;
        let many = |key| -> PyResult<Vec<Bound<'_, PyAny>>> { Ok(entries.find(key)?.unwrap_or_default()) };
        let geometries = many("geometries")?.iter().map(geometry).collect::<PyResult<Vec<_>>>()?;
        let (meshes, solid_fills) = (many("meshes")?, many("solid_fills")?);
        let scene = Scene {
            dimensions: entries.get("dimensions")?,
            gravity: entries.vector("gravity")?,
            seed: entries.get("seed")?,
            start_time: entries.get("start_time")?,
            restitution: entries.get("restitution")?,
            materials: materials.len(),
            pairs: entries.get("pairs")?,
            domain,
            domain_material,
            balls: balls(&entries.required("balls")?)?,
            solids: match entries.optional("solids")? {
                Some(table) => solids(&table, &geometries)?,
                None => Vec::new(),
            },
            meshes: meshes.iter().map(mesh).collect::<PyResult<_>>()?,
            planes: planes.iter().map(plane).collect::<PyResult<_>>()?,
            fills: fills.iter().map(fill).collect::<PyResult<_>>()?,
            solid_fills: solid_fills.iter().map(|value| solid_fill(value, &geometries)).collect::<PyResult<_>>()?,
            shrink_overlaps: entries.find("shrink_overlaps")?,
            simultaneous: simultaneous(&entries)?,
        };
        Ok(Self {
            scene,
            duration: entries.get("duration")?,
            record: entries.find("record_impacts")?.unwrap_or(true),
            geometries: entries.find("geometries")?.unwrap_or_default(),
        })
    }
}

fn simultaneous(entries: &Entries) -> PyResult<Simultaneous> {
    match entries.find::<String>("simultaneous")?.as_deref() {
        None | Some("pairwise") => Ok(Simultaneous::Pairwise),
        Some("reflections") => Ok(Simultaneous::Reflections),
        Some(other) => {
            let error = PyValueError::new_err(format!("{other:?} must be \"pairwise\" or \"reflections\""));
            Err(entries.wrong("simultaneous", &error))
        }
    }
}

fn domain(value: &Bound<'_, PyAny>) -> PyResult<(Domain, u32)> {
    let entries = Entries::new(value, "domain")?;
    let mut boundary = [Boundary::Open; 3];
    for (boundary, name) in boundary.iter_mut().zip(entries.get::<[String; 3]>("axes")?) {
        *boundary = match name.as_str() {
            "open" => Boundary::Open,
            "walls" => Boundary::Walls,
            "periodic" => Boundary::Periodic,
            other => return Err(PyValueError::new_err(format!("domain.axes: \"{other}\" is not known"))),
        };
    }
    Ok((Domain { boundary, size: entries.vector("size")? }, entries.find("material")?.unwrap_or(0)))
}

fn balls(value: &Bound<'_, PyAny>) -> PyResult<Balls> {
    let entries = Entries::new(value, "balls")?;
    let ids: Vec<i64> =
        entries.required("id")?.extract::<PyReadonlyArray1<'_, i64>>()?.as_array().iter().copied().collect();
    let rows = ids.len();
    let vectors = |key| -> PyResult<Vec<DVec3>> {
        Ok(entries.vectors::<3>(key, rows)?.into_iter().map(DVec3::from_array).collect())
    };
    Ok(Balls {
        positions: vectors("position")?,
        velocities: vectors("velocity")?,
        radii: entries.column("radius", rows)?,
        masses: entries.column("mass", rows)?,
        inertias: entries.column("inertia", rows)?,
        materials: materials(&entries, rows)?,
        fixed: entries.column("fixed", rows)?,
        orientations: entries.vectors::<4>("orientation", rows)?,
        angular_velocities: vectors("angular_velocity")?,
        ids,
    })
}

fn materials(entries: &Entries<'_>, rows: usize) -> PyResult<Vec<u32>> {
    // A negative index is no material of any scene.
    let index = |material| u32::try_from(material).unwrap_or(u32::MAX);
    Ok(entries.column::<i64>("material", rows)?.into_iter().map(index).collect())
}

fn geometry(value: &Bound<'_, PyAny>) -> PyResult<Arc<BodyGeometry>> {
    Ok(Arc::clone(&value.cast::<Geometry>()?.get().body))
}

/// The geometry at a place in the list of them.
fn shared(geometries: &[Arc<BodyGeometry>], place: i64) -> PyResult<Arc<BodyGeometry>> {
    let found = usize::try_from(place).ok().and_then(|place| geometries.get(place));
    found.cloned().ok_or_else(|| PyValueError::new_err(format!("geometry: there is no {place} in geometries")))
}

fn solids(value: &Bound<'_, PyAny>, geometries: &[Arc<BodyGeometry>]) -> PyResult<Vec<SolidBody>> {
    let entries = Entries::new(value, "solids")?;
    let ids: Vec<i64> =
        entries.required("id")?.extract::<PyReadonlyArray1<'_, i64>>()?.as_array().iter().copied().collect();
    let rows = ids.len();
    let vectors = |key| -> PyResult<Vec<DVec3>> {
        Ok(entries.vectors::<3>(key, rows)?.into_iter().map(DVec3::from_array).collect())
    };
    let (places, positions) = (entries.column::<i64>("geometry", rows)?, vectors("position")?);
    let (velocities, angular_velocities) = (vectors("velocity")?, vectors("angular_velocity")?);
    let orientations = entries.vectors::<4>("orientation", rows)?;
    let (masses, inertias) = (entries.column::<f64>("mass", rows)?, vectors("inertia")?);
    let (materials, fixed) = (materials(&entries, rows)?, entries.column::<bool>("fixed", rows)?);
    (0..rows)
        .map(|row| {
            Ok(SolidBody {
                id: ids[row],
                geometry: shared(geometries, places[row])?,
                position: positions[row],
                orientation: orientations[row],
                velocity: velocities[row],
                angular_velocity: angular_velocities[row],
                mass: masses[row],
                // Not a number: not given.
                inertia: (!inertias[row].is_nan()).then_some(inertias[row]),
                material: materials[row],
                fixed: fixed[row],
            })
        })
        .collect()
}

fn mesh(value: &Bound<'_, PyAny>) -> PyResult<MeshBody> {
    let entries = Entries::new(value, "mesh")?;
    Ok(MeshBody {
        id: entries.get("id")?,
        mesh: Arc::clone(&entries.required("mesh")?.cast::<TriangleMesh>()?.get().mesh),
        position: entries.vector("position")?,
        orientation: entries.get("orientation")?,
        velocity: entries.vector("velocity")?,
        angular_velocity: entries.vector("angular_velocity")?,
        material: entries.find("material")?.unwrap_or(0),
    })
}

fn plane(value: &Bound<'_, PyAny>) -> PyResult<PlaneBody> {
    let entries = Entries::new(value, "plane")?;
    Ok(PlaneBody {
        id: entries.get("id")?,
        normal: entries.vector("normal")?,
        offset: entries.get("offset")?,
        velocity: entries.find_vector("velocity")?.unwrap_or(DVec3::ZERO),
        material: entries.find("material")?.unwrap_or(0),
    })
}

fn fill(value: &Bound<'_, PyAny>) -> PyResult<Fill> {
    let entries = Entries::new(value, "fill")?;
    let placement = placement(&entries.get::<String>("placement")?)?;
    Ok(Fill {
        first_id: entries.get("first_id")?,
        placement,
        count: entries.find("count")?,
        packing: entries.find("packing")?,
        radius: radius_distribution(&entries.required("radius")?)?,
        mass: entries.find("mass")?,
        density: entries.find("density")?,
        temperature: entries.find("temperature")?.unwrap_or(0.0),
        velocity: entries.find_vector("velocity")?.unwrap_or(DVec3::ZERO),
        center: entries.find_vector("center")?,
        size: entries.find_vector("size")?,
        material: entries.find("material")?.unwrap_or(0),
    })
}

fn placement(name: &str) -> PyResult<Placement> {
    match name {
        "cubic" => Ok(Placement::Cubic),
        "fcc" => Ok(Placement::Fcc),
        "random" => Ok(Placement::Random),
        other => Err(PyValueError::new_err(format!("fill.placement: \"{other}\" is not known"))),
    }
}

fn solid_fill(value: &Bound<'_, PyAny>, geometries: &[Arc<BodyGeometry>]) -> PyResult<SolidFill> {
    let entries = Entries::new(value, "solid_fill")?;
    Ok(SolidFill {
        first_id: entries.get("first_id")?,
        geometry: shared(geometries, entries.get("geometry")?)?,
        placement: placement(&entries.get::<String>("placement")?)?,
        count: entries.get("count")?,
        spacing: entries.find("spacing")?,
        mass: entries.find("mass")?,
        density: entries.find("density")?,
        temperature: entries.find("temperature")?.unwrap_or(0.0),
        velocity: entries.find_vector("velocity")?.unwrap_or(DVec3::ZERO),
        center: entries.find_vector("center")?,
        size: entries.find_vector("size")?,
        material: entries.find("material")?.unwrap_or(0),
    })
}

/// How many sites of a lattice with this spacing a region has for bodies of this geometry.
#[pyfunction]
pub fn lattice_sites(
    placement: &str,
    size: [f64; 3],
    wraps: [bool; 3],
    geometry: &Geometry,
    spacing: f64,
) -> PyResult<usize> {
    let placement = self::placement(placement)?;
    Ok(SolidFill::sites(placement, DVec3::from_array(size), wraps, geometry.body.radius, spacing))
}

/// The bodies that turn of a scene, those of its fills too, by column.
#[pyfunction]
pub fn placed_solids<'py>(py: Python<'py>, spec: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let solids = Spec::read(spec)?.scene.placed_solids().map_err(|error| errors::check(py, &error))?;
    let table = PyDict::new(py);
    let rows = solids.len();
    let vectors = |of: fn(&SolidBody) -> DVec3| {
        solids.iter().flat_map(|solid| of(solid).to_array()).collect::<Vec<f64>>().into_pyarray(py).reshape([rows, 3])
    };
    table.set_item("id", solids.iter().map(|solid| solid.id).collect::<Vec<i64>>().into_pyarray(py))?;
    table.set_item("position", vectors(|solid| solid.position)?)?;
    table.set_item("velocity", vectors(|solid| solid.velocity)?)?;
    table.set_item("angular_velocity", vectors(|solid| solid.angular_velocity)?)?;
    let turned: Vec<f64> = solids.iter().flat_map(|solid| solid.orientation).collect();
    table.set_item("orientation", turned.into_pyarray(py).reshape([rows, 4])?)?;
    table.set_item("mass", solids.iter().map(|solid| solid.mass).collect::<Vec<f64>>().into_pyarray(py))?;
    let moments = |solid: &SolidBody| solid.inertia.unwrap_or(solid.geometry.gyration * solid.mass).to_array();
    table.set_item(
        "inertia",
        solids.iter().flat_map(moments).collect::<Vec<f64>>().into_pyarray(py).reshape([rows, 3])?,
    )?;
    Ok(table)
}

fn radius_distribution(value: &Bound<'_, PyAny>) -> PyResult<RadiusDistribution> {
    let entries = Entries::new(value, "fill.radius")?;
    Ok(match entries.get::<String>("kind")?.as_str() {
        "constant" => RadiusDistribution::Constant(entries.get("value")?),
        "uniform" => RadiusDistribution::Uniform { low: entries.get("low")?, high: entries.get("high")? },
        "normal" => RadiusDistribution::Normal { mean: entries.get("mean")?, deviation: entries.get("deviation")? },
        "lognormal" => {
            RadiusDistribution::Lognormal { mean: entries.get("mean")?, deviation: entries.get("deviation")? }
        }
        "mixture" => RadiusDistribution::Mixture { radii: entries.get("radii")?, shares: entries.get("shares")? },
        other => return Err(PyValueError::new_err(format!("fill.radius.kind: \"{other}\" is not known"))),
    })
}
