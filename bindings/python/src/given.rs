//! Gaussians and headers that the caller gives.

use core::fmt::Display;
use core::ops::RangeInclusive;

use image_gip::{
    ColorModel, Gaussian, Header, Kernel, Limits, Parameterization, Picture, PictureError,
    SampleDepth,
};
use numpy::{
    PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::array::{self, Shape};
use crate::errors::{picture_error, vec_for};
use crate::numbers::{Integer, Real};

/// Largest width and height of a picture.
const MAX_SIDE: u32 = 1 << 20;
/// How far apart two descriptions of a covariance may be, in parts of its trace: more than numbers of 32 bits are
/// rounded, and less than anybody means.
const TOLERANCE: f64 = 1e-5;

/// Gaussians of the caller.
#[derive(Debug)]
pub(crate) struct Given {
    pub(crate) gaussians: Vec<Gaussian>,
    pub(crate) color: ColorModel,
}

impl Given {
    /// Takes those of a structured array, or of a mapping of arrays.
    pub(crate) fn new(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let fields = Fields::new(object)?;
        let required = |name: &str| {
            let missing = || PyValueError::new_err(format!("the Gaussians have no {name}"));
            fields.get(name)?.ok_or_else(missing)
        };
        let center = required("center")?;
        let &[count, 2] = center.shape() else {
            return Err(wrong_shape("center", &center, "(n, 2)"));
        };
        let color = required("color")?;
        let channels = match *color.shape() {
            // As samples without an axis for the channels are gray.
            [found] if found == count => 1,
            [found, channels @ 1..=4] if found == count => channels,
            _ => {
                let wanted = format!("({count}, channels), of 1 to 4 channels");
                return Err(wrong_shape("color", &color, &wanted));
            }
        };
        let (covariance, cholesky) = (fields.get("covariance")?, fields.get("cholesky")?);
        for (name, array, rest) in
            [("covariance", &covariance, &[2, 2][..]), ("cholesky", &cholesky, &[3])]
        {
            let wanted = [&[count], rest].concat();
            if let Some(array) = array
                && array.shape() != wanted
            {
                return Err(wrong_shape(name, array, &Shape(&wanted).to_string()));
            }
        }
        if covariance.is_none() && cholesky.is_none() {
            let message = "the Gaussians have neither covariance nor cholesky";
            return Err(PyValueError::new_err(message));
        }
        let (centers, colors) = (center.as_slice()?, color.as_slice()?);
        let covariances = covariance.as_ref().map(|array| array.as_slice()).transpose()?;
        let factors = cholesky.as_ref().map(|array| array.as_slice()).transpose()?;

        let color = match channels {
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            _ => ColorModel::Rgba,
        };
        let mut gaussians = vec_for(count)?;
        for index in 0..count {
            let covariance = covariances.map(|all| all[4 * index..][..4].try_into().expect("four"));
            let factor = factors.map(|all| all[3 * index..][..3].try_into().expect("three"));
            let cholesky = factor_of(covariance, factor).map_err(|rule| {
                // An earlier one may break another rule.
                let header = Header::new(1, 1, color);
                match Picture::from_gaussians(&header, &gaussians, &Limits::none()) {
                    Err(error) => picture_error(center.py(), &error),
                    Ok(_) => picture_error(center.py(), &PictureError::Gaussian { index, rule }),
                }
            })?;
            let mut amplitudes = [0.0; 4];
            for (amplitude, &value) in
                amplitudes.iter_mut().zip(&colors[channels * index..][..channels])
            {
                *amplitude = value as f32;
            }
            let center = [centers[2 * index] as f32, centers[2 * index + 1] as f32];
            gaussians.push(Gaussian { center, cholesky, color: amplitudes });
        }
        Ok(Self { gaussians, color })
    }
}

/// The Cholesky factor of a covariance, of itself, or of both if they agree. What the format does not draw for
/// another reason than that there is no factor passes.
fn factor_of(
    covariance: Option<[f64; 4]>,
    factor: Option<[f64; 3]>,
) -> Result<[f32; 3], &'static str> {
    let round = |factor: [f64; 3]| factor.map(|entry| entry as f32);
    let Some([xx, xy, yx, yy]) = covariance else {
        return Ok(round(factor.unwrap_or_default()));
    };
    if ![xx, xy, yx, yy].iter().all(|entry| entry.is_finite()) {
        return Err("its covariance must be finite");
    }
    let allowed = TOLERANCE * (xx + yy);
    if (xy - yx).abs() > allowed.abs() {
        return Err("its covariance must be symmetric");
    }
    let Some([l11, l21, l22]) = factor else {
        let l11 = xx.sqrt();
        let l21 = xy / l11;
        let l22 = (yy - l21 * l21).sqrt();
        // The root of a negative number is NaN.
        let is_factor = l11 > 0.0 && l22 > 0.0;
        return is_factor
            .then(|| round([l11, l21, l22]))
            .ok_or("its covariance must be positive definite");
    };
    let of_factor = [l11 * l11, l11 * l21, l21 * l21 + l22 * l22];
    let agrees = |(a, b): (f64, f64)| (a - b).abs() <= allowed;
    if !of_factor.into_iter().zip([xx, xy, yy]).all(agrees) {
        return Err("its covariance and its Cholesky factor must agree; give one of them");
    }
    Ok(round([l11, l21, l22]))
}

fn wrong_shape(name: &str, array: &PyReadonlyArrayDyn<'_, f64>, wanted: &str) -> PyErr {
    let found = Shape(array.shape());
    PyValueError::new_err(format!("{name} has shape {found}; it must be {wanted}"))
}

/// The fields of a structured array, or a mapping.
struct Fields<'a, 'py> {
    object: &'a Bound<'py, PyAny>,
    names: Bound<'py, PyAny>,
}

impl<'a, 'py> Fields<'a, 'py> {
    fn new(object: &'a Bound<'py, PyAny>) -> PyResult<Self> {
        let names = if let Ok(array) = object.cast::<PyUntypedArray>() {
            array::refuse_masked("the array of Gaussians", array)?;
            array.dtype().names().map(|names| names.into_pyobject(object.py())).transpose()?
        } else {
            object.cast::<PyMapping>().ok().map(|_| object.clone())
        };
        let names = names.ok_or_else(|| {
            PyTypeError::new_err(
                "the Gaussians must be a structured array or a mapping of arrays, with center, covariance or \
                 cholesky, and color",
            )
        })?;
        Ok(Self { object, names })
    }

    /// The numbers of a field, one after the other; `None` without such a field.
    fn get(&self, name: &str) -> PyResult<Option<PyReadonlyArrayDyn<'py, f64>>> {
        if !self.names.contains(name)? {
            return Ok(None);
        }
        let numpy = self.object.py().import("numpy")?;
        let array = numpy.call_method1("asanyarray", (self.object.get_item(name)?,))?;
        let untyped = array.cast::<PyUntypedArray>()?;
        array::refuse_masked(name, untyped)?;
        if !matches!(untyped.dtype().kind(), b'f' | b'i' | b'u') {
            let kind = untyped.dtype();
            return Err(PyTypeError::new_err(format!(
                "{name} has dtype {kind}; it must be real numbers"
            )));
        }
        let array = numpy.call_method1("ascontiguousarray", (array, "f8"))?;
        Ok(Some(array.cast_into::<PyArrayDyn<f64>>()?.try_readonly().map_err(|_| {
            PyValueError::new_err(format!("{name} is being written by another call"))
        })?))
    }
}

/// What the caller gives of a header: the keywords that `render` and `pack` share. What is not given is that of `like`,
/// an `Info`; without that, what the mapping of the Gaussians has of it, as an exported .npz does.
#[derive(Debug)]
pub(crate) struct HeaderFields<'a, 'py> {
    pub(crate) gaussians: &'a Bound<'py, PyAny>,
    pub(crate) like: Option<&'a Bound<'py, PyAny>>,
    pub(crate) width: Option<Integer<'py>>,
    pub(crate) height: Option<Integer<'py>>,
    pub(crate) depth: Option<Integer<'py>>,
    pub(crate) kernel: Option<String>,
    pub(crate) cutoff: Option<Real>,
    pub(crate) base_color: Option<&'a Bound<'py, PyAny>>,
}

impl<'py> HeaderFields<'_, 'py> {
    /// The header for Gaussians of a colour model.
    pub(crate) fn header(&self, color: ColorModel) -> PyResult<Header> {
        if let Some(like) = self.like {
            let class = like.py().import("image_gip._types")?.getattr("Info")?;
            if !like.is_instance(&class)? {
                let found = like.get_type().name()?;
                return Err(PyTypeError::new_err(format!(
                    "like must be an image_gip.Info, not {found}"
                )));
            }
        }
        let (width, height) =
            (self.side("width", &self.width)?, self.side("height", &self.height)?);
        let mut header = Header::new(width, height, color);
        let depth = match &self.depth {
            Some(depth) => depth.within("depth", 8..=16)?,
            None => self.integer("depth", 8..=16)?.unwrap_or(8_u8),
        };
        header.depth = match depth {
            8 => SampleDepth::Eight,
            16 => SampleDepth::Sixteen,
            depth => {
                return Err(PyValueError::new_err(format!("depth {depth}; it must be 8 or 16")));
            }
        };
        header.kernel = self.kernel()?;
        let base = match self.base_color {
            Some(base) => Some(base.clone()),
            None => self.otherwise("base_color")?,
        };
        if let Some(base) = base {
            let channels = color.channels();
            header.base_color[..channels].copy_from_slice(&base_color(&base, channels)?);
        }
        Ok(header)
    }

    /// What stands for a keyword that is not given.
    fn otherwise(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        match self.like {
            Some(like) => like.getattr(name).map(Some),
            None => header_field(self.gaussians, name),
        }
    }

    /// The whole number that stands for a keyword.
    fn integer<T>(&self, name: &str, range: RangeInclusive<T>) -> PyResult<Option<T>>
    where
        T: for<'a> FromPyObject<'a, 'py> + PartialOrd + Display,
    {
        let number = self.otherwise(name)?;
        number.map(|number| number.extract::<Integer<'_>>()?.within(name, range)).transpose()
    }

    fn side(&self, name: &str, given: &Option<Integer<'py>>) -> PyResult<u32> {
        if let Some(side) = given {
            return side.within(name, 1..=MAX_SIDE);
        }
        self.integer(name, 1..=MAX_SIDE)?.ok_or_else(|| {
            PyTypeError::new_err(
                "width and height of the picture must be given, or like, which has them",
            )
        })
    }

    fn kernel(&self) -> PyResult<Kernel> {
        let (name, mut cutoff) = match (&self.kernel, self.otherwise("kernel")?) {
            (Some(name), _) => (name.clone(), None),
            (None, Some(name)) => {
                let cutoff = self.otherwise("cutoff")?.map(|cutoff| cutoff.extract());
                (name.extract()?, cutoff.transpose()?)
            }
            (None, None) => ("quartic".into(), None),
        };
        if let Some(Real(given)) = self.cutoff {
            cutoff = Some(given);
        }
        match (&*name, cutoff) {
            ("exponential", None) => Ok(Kernel::PAPER),
            ("exponential", Some(cutoff)) => Ok(Kernel::Exponential { cutoff: cutoff as f32 }),
            ("quartic", None) => Ok(Kernel::Quartic),
            ("quartic", Some(cutoff)) if cutoff as f32 == Kernel::Quartic.cutoff() => {
                Ok(Kernel::Quartic)
            }
            ("quartic", Some(_)) => {
                Err(PyValueError::new_err("the cutoff of the quartic kernel is 4; give none"))
            }
            _ => Err(PyValueError::new_err(format!(
                "kernel {name:?}; it must be \"quartic\" or \"exponential\""
            ))),
        }
    }
}

/// What a mapping of Gaussians says of their header under this name, in objects of Python.
pub(crate) fn header_field<'py>(
    gaussians: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let Ok(mapping) = gaussians.cast::<PyMapping>() else { return Ok(None) };
    if !mapping.contains(name)? {
        return Ok(None);
    }
    let types = gaussians.py().import("image_gip._types")?;
    types.call_method1("header_field", (mapping.get_item(name)?,)).map(Some)
}

/// The base colour of so many channels: one number for all, or one for each.
pub(crate) fn base_color(object: &Bound<'_, PyAny>, channels: usize) -> PyResult<Vec<u16>> {
    let within = |number: Integer<'_>| number.within("base_color", 0..=u16::MAX);
    if let Ok(number) = object.extract() {
        return Ok(vec![within(number)?; channels]);
    }
    let wrong = |_| PyTypeError::new_err("base_color must be an integer, or one for each channel");
    let numbers =
        object.try_iter().map_err(wrong)?.map(|item| within(item?.extract().map_err(wrong)?));
    let numbers: Vec<u16> = numbers.collect::<PyResult<_>>()?;
    if numbers.len() != channels {
        let found = numbers.len();
        return Err(PyValueError::new_err(format!(
            "base_color has {found} numbers; it must be one, or one for each channel: {channels}"
        )));
    }
    Ok(numbers)
}

/// The parameterization of this name.
pub(crate) fn parameterization(name: &str) -> PyResult<Parameterization> {
    match name {
        "cholesky" => Ok(Parameterization::Cholesky),
        "covariance" => Ok(Parameterization::Covariance),
        "rotation-scale" => Ok(Parameterization::RotationScale),
        _ => Err(PyValueError::new_err(format!(
            "parameterization {name:?}; it must be \"cholesky\", \"covariance\" or \"rotation-scale\""
        ))),
    }
}
