//! The geometry of bodies that turn.

mod error;
mod exact;
mod flatten;
mod hull;
mod platonic;
mod polyhedron;

pub use error::ShapeError;
pub use platonic::Platonic;
pub use polyhedron::{Edge, Face, Polyhedron};
