//! The core's errors as Python exceptions.

use carom::contact::ContactError;
use carom::error::{CheckError as CoreCheckError, CollapseError as CoreCollapseError};
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

create_exception!(_carom, CheckError, PyValueError, "The scene is wrong; `problems` lists what.");
create_exception!(_carom, OverlapError, PyValueError, "Two bodies are deeper in each other than touching.");
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

pub fn contact(py: Python<'_>, error: &ContactError) -> PyErr {
    match error {
        ContactError::Check(error) => check(py, error),
        ContactError::Overlap { .. } => OverlapError::new_err(error.to_string()),
    }
}
