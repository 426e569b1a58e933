//! The core's errors as Python exceptions.

use carom::contact::ContactError;
use carom::error::{CheckError as CoreCheckError, CollapseError as CoreCollapseError};
use carom::shape::ShapeError as CoreShapeError;
use carom::tolerance::SHAPE_LIMITS;
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

create_exception!(_carom, CheckError, PyValueError, "The scene is wrong; `problems` lists what.");
create_exception!(_carom, OverlapError, PyValueError, "Two bodies are deeper in each other than touching.");
create_exception!(_carom, UndecidedError, PyRuntimeError, "Whether two bodies ever touch was not found.");
create_exception!(_carom, ShapeError, PyValueError, "No body has such a shape, mass or inertia.");
create_exception!(_carom, CollapseError, PyRuntimeError, "The run cannot go on by impacts alone.");

pub fn check(py: Python<'_>, error: &CoreCheckError) -> PyErr {
    let build = || -> PyResult<PyErr> {
        let problems = PyList::empty(py);
        for problem in &error.problems {
            let entry = PyDict::new(py);
            entry.set_item("what", problem.what)?;
            entry.set_item("id", problem.id)?;
            entry.set_item("field", problem.field)?;
            entry.set_item("value", &problem.value)?;
            entry.set_item("reason", &problem.reason)?;
            entry.set_item("other", problem.other)?;
            entry.set_item("depth", problem.depth)?;
            problems.append(entry)?;
        }
        let raised = CheckError::new_err(error.to_string());
        raised.value(py).setattr("problems", problems)?;
        Ok(raised)
    };
    build().unwrap_or_else(|failure| failure)
}

pub fn collapse(py: Python<'_>, error: &CoreCollapseError) -> PyErr {
    let build = || -> PyResult<PyErr> {
        let raised = CollapseError::new_err(error.to_string());
        let value = raised.value(py);
        value.setattr("bodies", &error.bodies)?;
        value.setattr("time", error.time)?;
        value.setattr("cause", error.cause_text())?;
        value.setattr("advice", error.advice())?;
        Ok(raised)
    };
    build().unwrap_or_else(|failure| failure)
}

/// With `field`, the number that is to blame (then the message does not repeat it), or None; and `concave`, whether a
/// closed mesh is wrong only in not being convex.
pub fn shape(py: Python<'_>, error: &CoreShapeError) -> PyErr {
    use CoreShapeError::{Amount, DentedEdge, DentedVertex, Length, NotItsHull};
    let build = || -> PyResult<PyErr> {
        let (field, message) = match error {
            Length { field, .. } => {
                let (least, most) = (SHAPE_LIMITS.start(), SHAPE_LIMITS.end());
                // "size x" is a number of the field size.
                let field = field.split(' ').next();
                (field, format!("must be between {least:e} and {most:e} m, where moments of inertia can be computed"))
            }
            Amount { field, .. } => (Some(*field), "must be positive and finite, and give such a mass".to_string()),
            other => (None, other.to_string()),
        };
        let raised = ShapeError::new_err(message);
        raised.value(py).setattr("field", field)?;
        let concave = matches!(error, DentedVertex { .. } | DentedEdge { .. } | NotItsHull { .. });
        raised.value(py).setattr("concave", concave)?;
        Ok(raised)
    };
    build().unwrap_or_else(|failure| failure)
}

pub fn contact(py: Python<'_>, error: &ContactError) -> PyErr {
    match error {
        ContactError::Check(error) => check(py, error),
        ContactError::Overlap { .. } => OverlapError::new_err(error.to_string()),
        ContactError::Undecided { clear_until } => {
            let raised = UndecidedError::new_err(error.to_string());
            let told = raised.value(py).setattr("clear_until", clear_until);
            told.map_or_else(|failure| failure, |()| raised)
        }
    }
}
