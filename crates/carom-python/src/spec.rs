//! The dict that `Scene.to_spec` makes, as the core's scene. Its form is the package's business; here it is only read, and a
//! dict of another form is a `ValueError` that names the entry.

use carom::DVec3;
use carom::scene::{Balls, Fill, Placement, PlaneBody, RadiusDistribution, Scene};
use carom::world::{Boundary, Domain};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A scene, when it ends, and whether its impacts are recorded.
pub struct Spec {
    pub scene: Scene,
    pub duration: f64,
    pub record: bool,
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
            solids: Vec::new(),
            planes: planes.iter().map(plane).collect::<PyResult<_>>()?,
            fills: fills.iter().map(fill).collect::<PyResult<_>>()?,
            shrink_overlaps: entries.find("shrink_overlaps")?,
        };
        Ok(Self { scene, duration: entries.get("duration")?, record: entries.find("record_impacts")?.unwrap_or(true) })
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
        // A negative index is no material of any scene.
        materials: entries
            .column::<i64>("material", rows)?
            .into_iter()
            .map(|material| u32::try_from(material).unwrap_or(u32::MAX))
            .collect(),
        fixed: entries.column("fixed", rows)?,
        orientations: entries.vectors::<4>("orientation", rows)?,
        angular_velocities: vectors("angular_velocity")?,
        ids,
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
    let placement = match entries.get::<String>("placement")?.as_str() {
        "cubic" => Placement::Cubic,
        "fcc" => Placement::Fcc,
        "random" => Placement::Random,
        other => return Err(PyValueError::new_err(format!("fill.placement: \"{other}\" is not known"))),
    };
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
