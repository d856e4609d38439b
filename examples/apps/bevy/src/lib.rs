//! Loads `.gip` pictures as textures of Bevy, upright and as sRGB, at any size and with mip levels, each
//! rendered at its own size.
//!
//! ```no_run
//! # use bevy_app::{App, TaskPoolPlugin};
//! # use bevy_asset::{AssetApp, AssetPlugin, AssetServer, Handle};
//! # use bevy_image::Image;
//! use image_gip_bevy::{GipPlugin, GipSettings};
//!
//! # let mut app = App::new();
//! # app.add_plugins((TaskPoolPlugin::default(), AssetPlugin::default())).init_asset::<Image>();
//! app.add_plugins(GipPlugin); // after DefaultPlugins
//! # let assets = app.world().resource::<AssetServer>();
//! let photo: Handle<Image> = assets.load("photo.gip");
//! let small = assets.load_builder().with_settings(|settings: &mut GipSettings| {
//!     settings.size = Some((256, 256));
//!     settings.mip_levels = true;
//! });
//! let bricks: Handle<Image> = small.load("bricks.gip");
//! ```

use bevy_app::{App, Plugin};
use bevy_asset::io::Reader;
use bevy_asset::{AssetApp, AssetLoader, LoadContext, RenderAssetUsages};
use bevy_image::{Image, ImageSampler};
use bevy_reflect::TypePath;
use image_gip::{ColorModel, DecodeError, Decoder, RenderOptions};
use serde::{Deserialize, Serialize};
use wgpu_types::{Extent3d, TextureDimension, TextureFormat};

/// Makes the `AssetServer` load `.gip`. Add it after Bevy's own plugins.
pub struct GipPlugin;

impl Plugin for GipPlugin {
    fn build(&self, app: &mut App) {
        app.register_asset_loader(GipLoader);
    }
}

/// How a picture becomes a texture. The default is its own size, without further mip levels.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default)]
pub struct GipSettings {
    /// Width and height of the texture in pixels, each at least 1.
    pub size: Option<(u32, u32)>,
    /// Whether the texture has all mip levels.
    pub mip_levels: bool,
    pub sampler: ImageSampler,
    pub asset_usage: RenderAssetUsages,
}

/// Loads `.gip` as an [`Image`] of the format `Rgba8UnormSrgb`.
#[derive(TypePath)]
pub struct GipLoader;

impl AssetLoader for GipLoader {
    type Asset = Image;
    type Settings = GipSettings;
    type Error = DecodeError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &GipSettings,
        _: &mut LoadContext<'_>,
    ) -> Result<Image, DecodeError> {
        let mut file = Vec::new();
        reader.read_to_end(&mut file).await.map_err(DecodeError::Io)?;
        decode(&file, settings)
    }

    fn extensions(&self) -> &[&str] {
        &["gip"]
    }
}

fn decode(file: &[u8], settings: &GipSettings) -> Result<Image, DecodeError> {
    let mut decoder = Decoder::new(file)?;
    let orientation = decoder.metadata().orientation();
    let header = decoder.header();
    let upright = orientation.turned_size(header.width, header.height);
    let (width, height) = settings.size.unwrap_or(upright);
    let levels = if settings.mip_levels { width.max(height).max(1).ilog2() + 1 } else { 1 };
    let mut texels = Vec::new();
    for level in 0..levels {
        let side = |side: u32| if level == 0 { side } else { (side >> level).max(1) };
        let (width, height) = orientation.turned_size(side(width), side(height));
        let options = RenderOptions::new().with_size(width, height);
        decoder.set_options(options.with_color(ColorModel::Rgba));
        let mut stored = vec![0; decoder.output_len()?];
        decoder.decode_into(&mut stored)?;
        texels.extend(orientation.apply(&stored, width as usize, 4));
    }
    let size = Extent3d { width, height, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_uninit(size, TextureDimension::D2, format, settings.asset_usage);
    image.data = Some(texels);
    image.texture_descriptor.mip_level_count = levels;
    image.sampler = settings.sampler.clone();
    Ok(image)
}
