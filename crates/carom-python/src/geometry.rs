//! Shapes as Python objects: made once, shared by all bodies that have them.

use std::sync::Arc;

use carom::DVec3;
use carom::shape::{self, BodyGeometry, Compound, Part, Platonic, Polyhedron, Shape, ShapeError};
use carom::tolerance::SHAPE_LIMITS;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors;

const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// The shape of bodies that turn, with its volume, its inertia and its centre of mass.
#[pyclass(module = "carom._carom", frozen)]
pub struct Geometry {
    /// As the user gave it.
    shape: Shape,
    pub body: Arc<BodyGeometry>,
}

fn rows<T: numpy::Element + Copy, U>(
    name: &str,
    array: &PyReadonlyArray2<'_, T>,
    row: impl Fn([T; 3]) -> U,
) -> PyResult<Vec<U>> {
    let array = array.as_array();
    if array.ncols() != 3 {
        return Err(PyValueError::new_err(format!("{name}: 3 columns are expected, not {}", array.ncols())));
    }
    Ok(array.rows().into_iter().map(|values| row([values[0], values[1], values[2]])).collect())
}

fn points(name: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<DVec3>> {
    rows(name, array, DVec3::from_array)
}

fn corners(array: &PyReadonlyArray2<'_, u32>) -> PyResult<Vec<[u32; 3]>> {
    rows("triangles", array, |triangle| triangle)
}

/// Half a length (m) that is called `length` by the user.
fn half(length: f64) -> Result<f64, ShapeError> {
    let field = "length";
    if SHAPE_LIMITS.contains(&length) { Ok(0.5 * length) } else { Err(ShapeError::Length { field, value: length }) }
}

impl Geometry {
    fn new(py: Python<'_>, shape: impl FnOnce() -> Result<Shape, ShapeError> + Send) -> PyResult<Self> {
        let made = py.detach(|| {
            let shape = shape()?;
            let body = Arc::new(BodyGeometry::new(&shape)?);
            Ok(Self { shape, body })
        });
        made.map_err(|error| errors::shape(py, &error))
    }
}

#[pymethods]
impl Geometry {
    #[staticmethod]
    fn ball(py: Python<'_>, radius: f64) -> PyResult<Self> {
        Self::new(py, || Ok(Shape::Ball { radius }))
    }

    #[staticmethod]
    #[pyo3(name = "box")]
    fn cuboid(py: Python<'_>, size: [f64; 3]) -> PyResult<Self> {
        Self::new(py, || Shape::cuboid(DVec3::from_array(size)))
    }

    #[staticmethod]
    fn capsule(py: Python<'_>, radius: f64, length: f64) -> PyResult<Self> {
        Self::new(py, || Ok(Shape::Capsule { radius, half_length: half(length)? }))
    }

    #[staticmethod]
    fn cylinder(py: Python<'_>, radius: f64, length: f64) -> PyResult<Self> {
        Self::new(py, || Ok(Shape::Cylinder { radius, half_length: half(length)? }))
    }

    #[staticmethod]
    fn ellipsoid(py: Python<'_>, semi_axes: [f64; 3]) -> PyResult<Self> {
        Self::new(py, || Ok(Shape::Ellipsoid { semi_axes: DVec3::from_array(semi_axes) }))
    }

    #[staticmethod]
    fn platonic(py: Python<'_>, kind: &str, edge: f64) -> PyResult<Self> {
        let solid = match kind {
            "tetrahedron" => Platonic::Tetrahedron,
            "cube" => Platonic::Cube,
            "octahedron" => Platonic::Octahedron,
            "dodecahedron" => Platonic::Dodecahedron,
            "icosahedron" => Platonic::Icosahedron,
            other => return Err(PyValueError::new_err(format!("\"{other}\" is none of the five regular polyhedra"))),
        };
        Self::new(py, || solid.with_edge(edge).map(Shape::from))
    }

    #[staticmethod]
    #[pyo3(name = "hull")]
    fn hull(py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        let points = self::points("points", &points)?;
        Self::new(py, || Polyhedron::from_points(&points).map(Shape::from))
    }

    #[staticmethod]
    fn mesh(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Self> {
        let (vertices, triangles) = (points("vertices", &vertices)?, corners(&triangles)?);
        Self::new(py, || Polyhedron::from_mesh(&vertices, &triangles).map(Shape::from))
    }

    #[staticmethod]
    fn compound(py: Python<'_>, parts: Vec<(Py<Self>, [f64; 3], [f64; 4])>) -> PyResult<Self> {
        let part = |(geometry, position, orientation): (Py<Self>, [f64; 3], [f64; 4])| Part {
            shape: geometry.get().shape.clone(),
            position: DVec3::from_array(position),
            orientation,
        };
        let parts: Vec<Part> = parts.into_iter().map(part).collect();
        Self::new(py, || Compound::new(parts).map(Shape::from))
    }

    /// m³
    #[getter]
    fn volume(&self) -> f64 {
        self.body.volume
    }

    /// Largest distance of a point from the centre of mass (m).
    #[getter]
    fn radius(&self) -> f64 {
        self.body.radius
    }

    /// The centre of mass in the frame in which the shape was given (m).
    #[getter]
    fn centre(&self) -> [f64; 3] {
        self.body.centre.to_array()
    }

    /// Principal axes to that frame: unit quaternion (w, x, y, z).
    #[getter]
    fn principal_axes(&self) -> [f64; 4] {
        self.body.orientation
    }

    fn mass(&self, py: Python<'_>, density: f64) -> PyResult<f64> {
        self.body.mass(density).map_err(|error| errors::shape(py, &error))
    }

    fn moments(&self, py: Python<'_>, mass: f64) -> PyResult<[f64; 3]> {
        Ok(self.body.moments(mass).map_err(|error| errors::shape(py, &error))?.to_array())
    }

    /// The convex parts of which it is made, for pictures.
    #[getter]
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        let one;
        let parts = match &self.shape {
            Shape::Compound(compound) => &compound.parts,
            shape => {
                one = vec![Part { shape: shape.clone(), position: DVec3::ZERO, orientation: IDENTITY }];
                &one
            }
        };
        for part in parts {
            let entry = described(py, &part.shape)?;
            entry.set_item("position", (part.position - self.body.centre).to_array())?;
            entry.set_item("orientation", part.orientation)?;
            list.append(entry)?;
        }
        Ok(list)
    }

    /// Corners of a polyhedron (m); none of other shapes.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        match &self.shape {
            Shape::Polyhedron(body) => array(py, body.vertices.iter().map(|vertex| *vertex - self.body.centre)),
            _ => array(py, std::iter::empty()),
        }
    }

    /// The corners of each face of a polyhedron; none of other shapes.
    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<u32>>> {
        match &self.shape {
            Shape::Polyhedron(body) => faces(py, body),
            _ => Vec::new(),
        }
    }

    fn __repr__(&self) -> String {
        let kind = kind(&self.shape);
        format!("Geometry({kind}, volume {:?} m³, radius {:?} m)", self.body.volume, self.body.radius)
    }
}

fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Ball { .. } => "ball",
        Shape::Polyhedron(_) => "polyhedron",
        Shape::Capsule { .. } => "capsule",
        Shape::Cylinder { .. } => "cylinder",
        Shape::Ellipsoid { .. } => "ellipsoid",
        Shape::Compound(_) => "compound",
    }
}

fn described<'py>(py: Python<'py>, shape: &Shape) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    entry.set_item("kind", kind(shape))?;
    match shape {
        Shape::Ball { radius } => entry.set_item("radius", radius)?,
        Shape::Capsule { radius, half_length } | Shape::Cylinder { radius, half_length } => {
            entry.set_item("radius", radius)?;
            entry.set_item("length", 2.0 * half_length)?;
        }
        Shape::Ellipsoid { semi_axes } => entry.set_item("semi_axes", semi_axes.to_array())?,
        Shape::Polyhedron(body) => {
            entry.set_item("vertices", array(py, body.vertices.iter().copied())?)?;
            entry.set_item("faces", faces(py, body))?;
        }
        // A compound has none as a part.
        Shape::Compound(_) => {}
    }
    Ok(entry)
}

fn array<'py>(py: Python<'py>, points: impl Iterator<Item = DVec3>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = points.flat_map(|point| point.to_array()).collect();
    let count = flat.len() / 3;
    flat.into_pyarray(py).reshape([count, 3])
}

fn faces<'py>(py: Python<'py>, body: &Polyhedron) -> Vec<Bound<'py, PyArray1<u32>>> {
    body.faces.iter().map(|face| face.vertices.clone().into_pyarray(py)).collect()
}

/// Fixed surroundings of triangles.
#[pyclass(module = "carom._carom", frozen)]
pub struct TriangleMesh {
    pub mesh: Arc<shape::TriangleMesh>,
}

#[pymethods]
impl TriangleMesh {
    #[new]
    fn new(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Self> {
        let (vertices, triangles) = (points("vertices", &vertices)?, corners(&triangles)?);
        let mesh = py.detach(|| shape::TriangleMesh::new(&vertices, &triangles));
        Ok(Self { mesh: Arc::new(mesh.map_err(|error| errors::shape(py, &error))?) })
    }

    /// Corners (m).
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, self.mesh.vertices.iter().copied())
    }

    /// The three corners of each triangle.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let flat: Vec<u32> = self.mesh.triangles.iter().flat_map(|triangle| triangle.vertices).collect();
        flat.into_pyarray(py).reshape([self.mesh.triangles.len(), 3])
    }

    fn __repr__(&self) -> String {
        format!("TriangleMesh({} triangles)", self.mesh.triangles.len())
    }
}

/// Refuses moments of inertia (kg m²) about principal axes that no body has.
#[pyfunction]
pub fn check_inertia(py: Python<'_>, moments: [f64; 3]) -> PyResult<()> {
    shape::check_inertia(DVec3::from_array(moments)).map_err(|error| errors::shape(py, &error))
}
