// Shows what the shader of `gpu` has rendered in the window.

struct Place {
    // Where in the window the first rendered pixel is, and how many there are.
    corner: vec2<f32>,
    size: vec2<f32>,
}

@group(0) @binding(0) var<uniform> place: Place;
@group(0) @binding(1) var rendered: texture_2d<f32>;

// A triangle that covers the window.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2(f32(index % 2u), f32(index / 2u));
    return vec4(corner * 4.0 - 1.0, 0.0, 1.0);
}

// The rendered pixel, with its alpha premultiplied; transparent beside the picture.
@fragment
fn show(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = at.xy - place.corner;
    if (any(pixel < vec2(0.0)) || any(pixel >= place.size)) {
        return vec4(0.0);
    }
    let sample = textureLoad(rendered, vec2<u32>(pixel), 0);
    return vec4(sample.rgb * sample.a, sample.a);
}
