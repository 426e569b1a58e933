//! The simulator, seen from Python: convert, call, wrap errors. What each function means is written where it is done, in
//! the crate `carom`, and where it is used, in the package `carom`.

mod engine;
mod errors;
mod geometry;
mod pair;
mod scene_text;
mod spec;

use pyo3::prelude::*;

/// The names of the kinds of impact, by number.
#[pyfunction]
fn kinds() -> Vec<&'static str> {
    carom::event::Kind::ALL.iter().map(|kind| kind.name()).collect()
}

/// The names of how the time of an impact may be certified, by number.
#[pyfunction]
fn certificates() -> Vec<&'static str> {
    carom::event::Certificate::ALL.iter().map(|certificate| certificate.name()).collect()
}

#[pymodule]
fn _carom(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("CheckError", py.get_type::<errors::CheckError>())?;
    module.add("CollapseError", py.get_type::<errors::CollapseError>())?;
    module.add("OverlapError", py.get_type::<errors::OverlapError>())?;
    module.add("UndecidedError", py.get_type::<errors::UndecidedError>())?;
    module.add("ShapeError", py.get_type::<errors::ShapeError>())?;
    module.add("MOST_TRIANGLES", carom::tolerance::MOST_TRIANGLES)?;
    module.add_class::<engine::Engine>()?;
    module.add_class::<geometry::Geometry>()?;
    module.add_class::<scene_text::Lines>()?;
    module.add_class::<geometry::TriangleMesh>()?;
    module.add_function(wrap_pyfunction!(geometry::check_inertia, module)?)?;
    module.add_function(wrap_pyfunction!(spec::lattice_sites, module)?)?;
    module.add_function(wrap_pyfunction!(spec::placed_solids, module)?)?;
    module.add_function(wrap_pyfunction!(pair::collide, module)?)?;
    module.add_function(wrap_pyfunction!(pair::resolve, module)?)?;
    module.add_function(wrap_pyfunction!(pair::classify, module)?)?;
    module.add_function(wrap_pyfunction!(scene_text::parse_toml, module)?)?;
    module.add_function(wrap_pyfunction!(scene_text::parse_json, module)?)?;
    module.add_function(wrap_pyfunction!(kinds, module)?)?;
    module.add_function(wrap_pyfunction!(certificates, module)?)?;
    Ok(())
}
