//! GIFs whose logical screen has no pixels.

use std::borrow::Cow;

/// The file with a logical screen that the first frame fits in, if it has none, as browsers take it.
pub(super) fn of_first_frame(file: &[u8]) -> Cow<'_, [u8]> {
    let size = || {
        let screen = file.get(6..10)?;
        if screen[..2] != [0, 0] && screen[2..] != [0, 0] {
            return None;
        }
        let mut options = gif::DecodeOptions::new();
        options.skip_frame_decoding(true);
        let mut decoder = options.read_info(file).ok()?;
        let frame = decoder.next_frame_info().ok()??;
        Some([frame.left.saturating_add(frame.width), frame.top.saturating_add(frame.height)])
    };
    let Some([width, height]) = size() else { return file.into() };
    let mut file = file.to_vec();
    file[6..8].copy_from_slice(&width.to_le_bytes());
    file[8..10].copy_from_slice(&height.to_le_bytes());
    file.into()
}
