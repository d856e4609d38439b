//! A game without a window, which loads files from a folder.

mod turned;

use std::fs;
use std::time::{Duration, Instant};

use bevy_app::{App, TaskPoolPlugin};
use bevy_asset::{AssetApp, AssetPlugin, AssetServer, Assets, Handle, LoadState};
use bevy_image::Image;
use image_gip_bevy::{GipPlugin, GipSettings};
use turned::{FILE, decoded};
use wgpu_types::TextureFormat;

/// Loads a file as a game does; an error as the message that it logs.
fn load(file: &[u8], settings: &GipSettings) -> Result<Image, String> {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("picture.gip"), file).expect("room for a file");
    let file_path = folder.path().to_str().expect("Unicode").to_owned();
    let mut app = App::new();
    app.add_plugins(TaskPoolPlugin::default());
    app.add_plugins(AssetPlugin { file_path, ..AssetPlugin::default() });
    app.init_asset::<Image>().add_plugins(GipPlugin);
    let assets = app.world().resource::<AssetServer>().clone();
    let settings = settings.clone();
    let loading = assets.load_builder().with_settings(move |given| *given = settings.clone());
    let handle: Handle<Image> = loading.load("picture.gip");
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        app.update();
        match assets.load_state(&handle) {
            LoadState::Loaded => {
                let images = app.world().resource::<Assets<Image>>();
                return Ok(images.get(&handle).expect("it is loaded").clone());
            }
            LoadState::Failed(error) => return Err(error.to_string()),
            LoadState::NotLoaded | LoadState::Loading => std::thread::yield_now(),
        }
    }
    panic!("not loaded in a minute");
}

#[test]
fn a_picture_is_loaded_upright_and_as_srgb() {
    let image = load(FILE, &GipSettings::default()).expect("a valid file");
    assert_eq!((image.width(), image.height()), (24, 40));
    assert_eq!(image.texture_descriptor.format, TextureFormat::Rgba8UnormSrgb);
    assert_eq!(image.texture_descriptor.mip_level_count, 1);
    assert_eq!(image.data, Some(decoded(image.width(), image.height())));
}

#[test]
fn each_mip_level_is_rendered_at_its_size() {
    let settings = GipSettings { size: Some((12, 5)), mip_levels: true, ..Default::default() };
    let image = load(FILE, &settings).expect("a valid file");
    assert_eq!((image.width(), image.height()), (12, 5));
    assert_eq!(image.texture_descriptor.mip_level_count, 4);
    let levels = [decoded(12, 5), decoded(6, 2), decoded(3, 1), decoded(1, 1)];
    assert_eq!(image.data, Some(levels.concat()));
}

#[test]
fn what_cannot_be_loaded_says_why() {
    let mut damaged = FILE.to_vec();
    damaged[20] ^= 1;
    let error = load(&damaged, &GipSettings::default()).expect_err("a damaged file");
    assert!(error.contains("the CRC"), "{error}");
    let error = load(&FILE[..FILE.len() - 40], &GipSettings::default()).expect_err("a cut file");
    assert!(error.contains("unexpected end"), "{error}");
    let error = load(b"GIF89a, which it is not", &GipSettings::default()).expect_err("a GIF");
    assert!(error.contains("not a .gip file"), "{error}");
    let settings = GipSettings { size: Some((0, 0)), mip_levels: true, ..Default::default() };
    let error = load(FILE, &settings).expect_err("no pixels");
    assert!(error.contains("0x0"), "{error}");
}
