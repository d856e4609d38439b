//! Header, metadata and statistics as plain objects, which can be sent between threads.

use image_gip::{
    Coding, ColorModel, Header, Kernel, Metadata, Parameterization, QuantizationSteps,
    StreamDecoder,
};
use wasm_bindgen::prelude::*;

use crate::js::{Array, Float64Array, Object, Uint8Array};

/// An object of these properties.
fn object<const N: usize>(properties: [(&str, JsValue); N]) -> JsValue {
    let object = Object::new();
    for (name, value) in properties {
        object.set(name, value);
    }
    object.into()
}

/// The header.
pub(crate) fn header(header: &Header) -> JsValue {
    let base: Array = (header.base_color.iter().take(header.color.channels()))
        .map(|&value| JsValue::from(value))
        .collect();
    let coding = match header.coding {
        Coding::Packed => "packed",
        Coding::Entropy => "entropy",
        _ => "unknown",
    };
    let color = match header.color {
        ColorModel::Gray => "gray",
        ColorModel::GrayAlpha => "gray-alpha",
        ColorModel::Rgb => "rgb",
        ColorModel::Rgba => "rgba",
        _ => "unknown",
    };
    let kernel = match header.kernel {
        Kernel::Exponential { .. } => "exponential",
        Kernel::Quartic => "quartic",
        _ => "unknown",
    };
    let parameterization = match header.parameterization {
        Parameterization::Covariance => "covariance",
        Parameterization::Cholesky => "cholesky",
        Parameterization::RotationScale => "rotation-scale",
        _ => "unknown",
    };
    object([
        ("version", header.version.into()),
        ("coding", coding.into()),
        ("width", header.width.into()),
        ("height", header.height.into()),
        ("color", color.into()),
        ("channels", (header.color.channels() as u32).into()),
        ("depth", header.depth.bits().into()),
        ("gaussians", header.gaussians.into()),
        ("layers", header.layers.into()),
        ("kernel", kernel.into()),
        ("cutoff", header.kernel.cutoff().into()),
        ("parameterization", parameterization.into()),
        ("baseColor", base.into()),
    ])
}

/// The metadata. What is absent is `null`.
pub(crate) fn metadata(metadata: &Metadata) -> JsValue {
    let array = |bytes: &[u8]| JsValue::from(Uint8Array::new(bytes));
    let bytes = |bytes: &Option<Vec<u8>>| bytes.as_deref().map_or(JsValue::NULL, array);
    let xmp = metadata
        .xmp
        .as_ref()
        .map_or(JsValue::NULL, |xmp| String::from_utf8_lossy(xmp).into_owned().into());
    let texts: Array = (metadata.texts.iter())
        .map(|text| {
            object([("keyword", text.keyword.as_str().into()), ("text", text.text.as_str().into())])
        })
        .collect();
    let cicp = metadata.cicp.map_or(JsValue::NULL, |cicp| array(&[cicp.primaries, cicp.transfer]));
    let display = metadata.mastering_display;
    let display = display.map_or(JsValue::NULL, |display| array(&display.to_bytes()));
    let light = metadata.content_light.map_or(JsValue::NULL, |light| array(&light.to_bytes()));
    object([
        ("cicp", cicp),
        ("masteringDisplay", display),
        ("contentLight", light),
        ("iccProfile", bytes(&metadata.icc_profile)),
        ("exif", bytes(&metadata.exif)),
        ("xmp", xmp),
        ("texts", texts.into()),
    ])
}

/// The chunks that are complete, the layers, the bits of each attribute, and the steps of the
/// quantization grid.
pub(crate) fn statistics(stream: &StreamDecoder, layer_extents: &[(f64, f64)]) -> JsValue {
    let chunks: Array = (stream.chunks().iter())
        .map(|chunk| {
            object([
                ("type", chunk.kind.letters().to_string().into()),
                ("count", chunk.count.into()),
                ("bytes", (chunk.bytes as f64).into()),
            ])
        })
        .collect();
    let layers: Array = (stream.layers().iter().zip(layer_extents))
        .map(|(&gaussians, &(start, end))| {
            object([("gaussians", gaussians.into()), ("start", start.into()), ("end", end.into())])
        })
        .collect();
    let bits = stream.attribute_bits().map_or(JsValue::NULL, |bits| {
        object([
            ("position", bits.position.into()),
            ("precision", bits.precision.into()),
            ("shape", bits.shape.into()),
            ("color", bits.color.into()),
        ])
    });
    let steps = stream.quantization_steps().map_or(JsValue::NULL, |steps| {
        let QuantizationSteps { position, size, ratio, slant, color, .. } = steps;
        let color: Vec<f64> = color.into_iter().map(f64::from).collect();
        object([
            ("position", position.into()),
            ("size", size.into()),
            ("ratio", ratio.into()),
            ("slant", slant.into()),
            ("color", Float64Array::new(&color).into()),
        ])
    });
    object([
        ("chunks", chunks.into()),
        ("layers", layers.into()),
        ("attributeBits", bits),
        ("quantizationSteps", steps),
    ])
}
