//! A window in memory, drawn by the software renderer of iced.

#[path = "../../bevy/tests/turned/mod.rs"]
mod turned;

use iced_core::renderer::{Headless, Style};
use iced_core::{Color, Font, Pixels, Size, Theme, mouse};
use iced_runtime::user_interface::{Cache, UserInterface};
use iced_tiny_skia::Renderer;
use image_gip_iced::GipPicture;
use turned::{FILE, decoded};

const BACKGROUND: [u8; 4] = [255, 255, 255, 255];

/// The pixels of a window of this size in pixels of the screen.
fn shown(picture: &GipPicture, size: Size<u32>, scale_factor: f32) -> Vec<u8> {
    let mut renderer = Renderer::new(Font::DEFAULT, Pixels(16.0));
    let room = Size::new(size.width as f32, size.height as f32) * (1.0 / scale_factor);
    let view = picture.view::<(), Theme, Renderer>(scale_factor);
    let mut window = UserInterface::build(view, room, Cache::new(), &mut renderer);
    let style = Style { text_color: Color::BLACK };
    window.draw(&mut renderer, &Theme::Light, &style, mouse::Cursor::Unavailable);
    renderer.screenshot(size, scale_factor, Color::WHITE)
}

#[test]
fn a_window_shows_what_is_rendered_at_its_size() {
    let picture = GipPicture::new(FILE).expect("a valid file");
    // The width decides, then the height, both also on a screen of twice the density.
    for (times, room, scale_factor) in
        [(3, (0, 10), 1.0), (5, (20, 0), 1.0), (4, (0, 0), 2.0), (2, (8, 0), 2.0)]
    {
        let (width, height) = (24 * times, 40 * times);
        let size = Size::new(width + room.0, height + room.1);
        let found = shown(&picture, size, scale_factor);
        let picture = decoded(width, height);
        for (index, pixel) in found.chunks_exact(4).enumerate() {
            let (x, y) = (index as u32 % size.width, index as u32 / size.width);
            let inside = (x.checked_sub(room.0 / 2), y.checked_sub(room.1 / 2));
            let expected = match inside {
                (Some(x), Some(y)) if x < width && y < height => {
                    &picture[(y * width + x) as usize * 4..][..4]
                }
                _ => &BACKGROUND,
            };
            assert_eq!(pixel, expected, "{size:?}, {scale_factor}: {x}, {y}");
        }
    }
}

#[test]
fn a_file_that_cannot_be_shown_says_why() {
    let error = GipPicture::new(&FILE[..FILE.len() - 40]).err().expect("a cut file");
    assert!(error.to_string().contains("unexpected end"), "{error}");
}
