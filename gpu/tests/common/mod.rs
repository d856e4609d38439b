//! The GPU against the decoder.

#![allow(dead_code, reason = "every test binary uses a part of this")]

#[path = "../../examples/adapter/mod.rs"]
pub(crate) mod adapter;
pub(crate) mod scene;

use std::sync::OnceLock;

use image_gip::{ColorModel, Picture, Region, RenderOptions, StreamDecoder};
use image_gip_gpu::{GpuRenderer, View};

/// The renderer of all tests of a binary; `None` where there is no GPU, not even in software.
pub(crate) fn renderer() -> Option<&'static GpuRenderer> {
    static RENDERER: OnceLock<Option<GpuRenderer>> = OnceLock::new();
    let renderer = RENDERER.get_or_init(|| match adapter::device() {
        Ok((device, queue, name)) => {
            println!("adapter: {name}");
            Some(GpuRenderer::new(device, queue).expect("enough for the shader"))
        }
        Err(error) => {
            println!("skipped: no GPU: {error}");
            None
        }
    });
    renderer.as_ref()
}

/// Decodes a file, which must be valid.
pub(crate) fn decode(file: &[u8]) -> StreamDecoder {
    let mut decoder = StreamDecoder::new();
    decoder.feed(file).expect("a valid file");
    decoder.finish().expect("a whole file");
    decoder
}

/// What to render, in the words of both renderers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    pub(crate) size: Option<(u32, u32)>,
    pub(crate) region: Option<Region>,
    pub(crate) prefix: Option<u32>,
    pub(crate) texture: bool,
}

impl Request {
    pub(crate) const WHOLE: Self = Self { size: None, region: None, prefix: None, texture: true };

    pub(crate) fn sized(width: u32, height: u32) -> Self {
        Self { size: Some((width, height)), ..Self::WHOLE }
    }

    pub(crate) fn region(self, x: u32, y: u32, width: u32, height: u32) -> Self {
        Self { region: Some(Region { x, y, width, height }), ..self }
    }

    pub(crate) fn without_texture(self) -> Self {
        Self { texture: false, ..self }
    }

    pub(crate) fn view(&self) -> View {
        let mut view = View::new().with_texture(self.texture);
        if let Some((width, height)) = self.size {
            view = view.with_size(width, height);
        }
        if let Some(region) = self.region {
            view = view.with_region(region);
        }
        if let Some(count) = self.prefix {
            view = view.with_prefix(count);
        }
        view
    }

    pub(crate) fn options(&self) -> RenderOptions {
        let mut options =
            RenderOptions::new().with_color(ColorModel::Rgba).with_texture(self.texture);
        if let Some((width, height)) = self.size {
            options = options.with_size(width, height);
        }
        if let Some(region) = self.region {
            options = options.with_region(region);
        }
        if let Some(count) = self.prefix {
            options = options.with_prefix(count);
        }
        options
    }
}

/// How far the GPU is from the decoder.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Differences {
    samples: usize,
    /// Samples that differ by more than one step.
    large: usize,
    different: usize,
    largest: u8,
}

impl Differences {
    /// Renders a view with both.
    #[track_caller]
    pub(crate) fn of(renderer: &GpuRenderer, picture: &Picture<'_>, request: &Request) -> Self {
        let texture = renderer.render(picture, &request.view()).expect("a sound view");
        let size = request.options().output_size(picture.header());
        assert_eq!((texture.width(), texture.height()), size);
        let found = renderer.read(&texture).expect("a texture of the renderer");
        Self::from_decoder(found, picture, request)
    }

    /// Compares samples of the GPU with the decoder's.
    #[track_caller]
    pub(crate) fn from_decoder(found: Vec<u8>, picture: &Picture<'_>, request: &Request) -> Self {
        let options = request.options();
        let mut expected = vec![0; picture.output_len(&options).expect("a sound request")];
        picture.render_u8(&options, &mut expected).expect("a sound request");
        assert_eq!(found.len(), expected.len());
        let mut all = Self::default();
        for (found, expected) in found.into_iter().zip(expected) {
            let difference = found.abs_diff(expected);
            all.samples += 1;
            all.different += usize::from(difference > 0);
            all.large += usize::from(difference > 1);
            all.largest = all.largest.max(difference);
        }
        all
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.samples += other.samples;
        self.different += other.different;
        self.large += other.large;
        self.largest = self.largest.max(other.largest);
    }

    /// At most one step in 99.9 % of the samples, and two in all.
    #[track_caller]
    pub(crate) fn assert_close(&self, what: &str) {
        let holds = self.largest <= 2 && self.large * 1000 <= self.samples;
        assert!(holds, "{what}: {self:?}");
    }
}

/// Compares a view of a picture.
#[track_caller]
pub(crate) fn assert_close(renderer: &GpuRenderer, picture: &Picture<'_>, request: &Request) {
    Differences::of(renderer, picture, request).assert_close(&format!("{request:?}"));
}
