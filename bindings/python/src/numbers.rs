//! Numbers as they come from Python, where whole ones have no bounds, and as messages name them.

use core::fmt::{Display, LowerExp};
use core::ops::RangeInclusive;

use pyo3::exceptions::{PyOverflowError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyInt;

/// Most characters of a number in a message, if it can be shorter.
const MAX_LENGTH: usize = 20;

/// A whole number.
#[derive(Debug)]
pub(crate) struct Integer<'py>(Bound<'py, PyInt>);

impl<'py> FromPyObject<'_, 'py> for Integer<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let index = object.py().import("operator")?.getattr("index")?;
        Ok(Self(index.call1((object,))?.cast_into()?))
    }
}

impl<'py> Integer<'py> {
    /// The number, if it is in this range.
    pub(crate) fn within<T>(&self, name: &str, range: RangeInclusive<T>) -> PyResult<T>
    where
        T: for<'a> FromPyObject<'a, 'py> + PartialOrd + Display,
    {
        let Self(number) = self;
        number.extract().ok().filter(|number| range.contains(number)).ok_or_else(|| {
            let (least, most) = range.into_inner();
            PyValueError::new_err(format!("{name} {number}; it must be {least} to {most}"))
        })
    }
}

/// A number that may have a fraction. One that is too large is infinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Real(pub(crate) f64);

impl FromPyObject<'_, '_> for Real {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        object.extract().map(Self).or_else(|error: PyErr| {
            if !error.is_instance_of::<PyOverflowError>(object.py()) {
                return Err(error);
            }
            Ok(Self(if object.lt(0)? { f64::NEG_INFINITY } else { f64::INFINITY }))
        })
    }
}

/// A number in a message: with an exponent if it would have very many digits.
pub(crate) fn shown(number: impl Display + LowerExp) -> String {
    let digits = number.to_string();
    if digits.len() > MAX_LENGTH { format!("{number:e}") } else { digits }
}
