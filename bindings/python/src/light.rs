//! The display on which a picture was made, and how bright it is. Python has chromaticities as they are, and luminance
//! in cd/m²; files have whole numbers of a unit.

use image_gip::{ContentLight, MasteringDisplay};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::numbers::{Real, shown};

/// How many units of a file are a chromaticity of 1.
const CHROMATICITY: f64 = 50_000.0;
/// How many units of a file are 1 cd/m².
const LUMINANCE: f64 = 10_000.0;

/// x and y of a colour.
type Point<T> = (T, T);
/// The fields of `image_gip.MasteringDisplay`.
pub(crate) type DisplayFields<T> = (Point<T>, Point<T>, Point<T>, Point<T>, T, T);
/// The fields of `image_gip.ContentLight`.
pub(crate) type LightFields<T> = (T, T);

/// The display of what Python gives.
pub(crate) fn display(fields: DisplayFields<Real>) -> PyResult<MasteringDisplay> {
    let (red, green, blue, white, max_luminance, min_luminance) = fields;
    let point = |(x, y): Point<Real>| {
        let stored = |value| stored("a chromaticity of mastering_display", value, CHROMATICITY);
        Ok::<_, PyErr>([stored(x)?, stored(y)?])
    };
    let luminance = |value| stored("a luminance of mastering_display", value, LUMINANCE);
    Ok(MasteringDisplay {
        red: point(red)?,
        green: point(green)?,
        blue: point(blue)?,
        white: point(white)?,
        max_luminance: luminance(max_luminance)?,
        min_luminance: luminance(min_luminance)?,
    })
}

/// How bright the picture is by what Python gives.
pub(crate) fn light((max_content, max_frame_average): LightFields<Real>) -> PyResult<ContentLight> {
    let luminance = |value| stored("a luminance of content_light", value, LUMINANCE);
    Ok(ContentLight {
        max_content: luminance(max_content)?,
        max_frame_average: luminance(max_frame_average)?,
    })
}

/// The number that a file has for a value, of which `units` are 1.
fn stored<T: TryFrom<u32>>(name: &str, Real(value): Real, units: f64) -> PyResult<T> {
    let in_range = |number: &f64| (0.0..=f64::from(u32::MAX)).contains(number);
    let number = Some((value * units).round()).filter(in_range);
    number.and_then(|number| T::try_from(number as u32).ok()).ok_or_else(|| {
        let bits = 8 * size_of::<T>() as u32;
        let most = f64::from(u32::MAX >> (u32::BITS - bits)) / units;
        PyValueError::new_err(format!("{name} {}; it must be 0 to {most}", shown(value)))
    })
}

/// `image_gip.MasteringDisplay`.
pub(crate) fn display_object<'py>(
    types: &Bound<'py, PyModule>,
    display: &MasteringDisplay,
) -> PyResult<Bound<'py, PyAny>> {
    let point = |[x, y]: [u16; 2]| (f64::from(x) / CHROMATICITY, f64::from(y) / CHROMATICITY);
    let fields: DisplayFields<f64> = (
        point(display.red),
        point(display.green),
        point(display.blue),
        point(display.white),
        f64::from(display.max_luminance) / LUMINANCE,
        f64::from(display.min_luminance) / LUMINANCE,
    );
    types.getattr("MasteringDisplay")?.call1(fields)
}

/// `image_gip.ContentLight`.
pub(crate) fn light_object<'py>(
    types: &Bound<'py, PyModule>,
    light: &ContentLight,
) -> PyResult<Bound<'py, PyAny>> {
    let luminance = |stored| f64::from(stored) / LUMINANCE;
    let fields: LightFields<f64> =
        (luminance(light.max_content), luminance(light.max_frame_average));
    types.getattr("ContentLight")?.call1(fields)
}
