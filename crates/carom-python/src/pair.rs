//! Questions about two bodies alone.

use carom::DVec3;
use carom::contact::{self, Body, PairImpact, Shape};
use carom::event::Certificate;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::geometry::{Geometry, TriangleMesh};

const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

fn body(value: &Bound<'_, PyDict>) -> PyResult<Body> {
    let entry =
        |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> { Ok(value.get_item(key)?.filter(|value| !value.is_none())) };
    let vector = |key: &str| -> PyResult<DVec3> {
        entry(key)?.map_or(Ok(DVec3::ZERO), |value| Ok(DVec3::from_array(value.extract::<[f64; 3]>()?)))
    };
    let mut orientation = entry("orientation")?.map_or(Ok(IDENTITY), |value| value.extract())?;
    let shape = match (entry("radius")?, entry("plane")?, entry("geometry")?, entry("mesh")?) {
        (Some(radius), None, None, None) => Shape::Ball { radius: radius.extract()? },
        (None, Some(plane), None, None) => Shape::Plane {
            normal: DVec3::from_array(plane.get_item("normal")?.extract()?),
            offset: plane.get_item("offset")?.extract()?,
        },
        (None, None, Some(geometry), None) => {
            // The core wants the principal axes, and not those in which the shape was given.
            let geometry = &geometry.cast::<Geometry>()?.get().body;
            orientation = geometry.principal_orientation(orientation);
            Shape::Solid(geometry.clone())
        }
        (None, None, None, Some(mesh)) => Shape::Mesh(mesh.cast::<TriangleMesh>()?.get().mesh.clone()),
        _ => return Err(PyValueError::new_err("a body has either a radius, a plane, a geometry or a mesh")),
    };
    let fixed = entry("fixed")?.map_or(Ok(false), |value| value.extract::<bool>())?;
    let mass = match (entry("mass")?, fixed) {
        (_, true) => f64::INFINITY,
        (Some(mass), false) => mass.extract()?,
        (None, false) => return Err(PyValueError::new_err("a free body needs a mass")),
    };
    Ok(Body {
        shape,
        mass,
        inertia: vector("inertia")?,
        position: vector("position")?,
        orientation,
        velocity: vector("velocity")?,
        angular_velocity: vector("angular_velocity")?,
    })
}

fn impact<'py>(py: Python<'py>, found: &PairImpact, a: &Body, b: &Body) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("time", found.time)?;
    row.set_item("time_low", 0.0)?;
    row.set_item("a", 0)?;
    row.set_item("b", 1)?;
    row.set_item("kind", found.kind.map_or("contact", |kind| kind.name()))?;
    row.set_item("certificate", found.certificate.map(Certificate::name))?;
    row.set_item("point", found.point.to_array())?;
    row.set_item("normal", found.normal.to_array())?;
    row.set_item("approach_speed", found.approach_speed)?;
    row.set_item("separation_speed", found.separation_speed)?;
    row.set_item("impulse", found.impulse)?;
    row.set_item("points", found.points.iter().map(|at| at.point.to_array()).collect::<Vec<_>>())?;
    row.set_item("impulses", found.points.iter().map(|at| at.impulse).collect::<Vec<_>>())?;
    row.set_item("restitution", found.restitution)?;
    row.set_item("energy_lost", found.energy_lost)?;
    for (side, body, row_of) in [("a", a, 0), ("b", b, 1)] {
        row.set_item(format!("velocity_{side}_before"), body.velocity.to_array())?;
        row.set_item(format!("velocity_{side}"), found.velocities[row_of].to_array())?;
        row.set_item(format!("angular_velocity_{side}"), found.angular_velocities[row_of].to_array())?;
        row.set_item(format!("position_{side}"), found.positions[row_of].to_array())?;
        row.set_item(format!("mass_{side}"), body.mass)?;
    }
    Ok(row)
}

/// The first impact of two bodies in free flight without gravity, as a dict; None if they never meet.
#[pyfunction]
pub fn collide<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyDict>,
    b: &Bound<'py, PyDict>,
    restitution: f64,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let (a, b) = (body(a)?, body(b)?);
    let found = py.detach(|| contact::collide(&a, &b, restitution)).map_err(|error| errors::contact(py, &error))?;
    found.map(|found| impact(py, &found, &a, &b)).transpose()
}

/// The impact of two rigid bodies at a given contact, as a dict.
#[pyfunction]
pub fn resolve<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyDict>,
    b: &Bound<'py, PyDict>,
    point: [f64; 3],
    normal: [f64; 3],
    restitution: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (a, b) = (body(a)?, body(b)?);
    let (point, normal) = (DVec3::from_array(point), DVec3::from_array(normal));
    let found = contact::resolve(&a, &b, point, normal, restitution).map_err(|error| errors::contact(py, &error))?;
    impact(py, &found, &a, &b)
}

/// "apart", "collision imminent", "resting contact" or "moving away".
#[pyfunction]
pub fn classify(py: Python<'_>, a: &Bound<'_, PyDict>, b: &Bound<'_, PyDict>) -> PyResult<&'static str> {
    let class = contact::classify(&body(a)?, &body(b)?).map_err(|error| errors::contact(py, &error))?;
    Ok(class.name())
}
