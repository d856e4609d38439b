//! A region is decoded from the layers that show in it (specification, section 5.6): the same bits as
//! from all of them.

mod common;

use std::io::Read;

use common::layered::{
    BEFORE, IN_A_LAYER, LAYERS, SIZE, chunks, damaged, decoded, regions, showing,
};
use common::texture::Texture;
use common::{
    Random, bits, chunk, decode, decode_valid, kind, of_chunks, payload, without_last_word,
};
use image_gip::{DecodeError, Decoder, Region, RenderOptions};

fn rendered(file: &[u8], options: &RenderOptions) -> Result<Vec<u8>, DecodeError> {
    let mut decoder = Decoder::new(file)?;
    decoder.set_options(options.clone());
    let mut samples = vec![0; decoder.output_len().expect("it fits")];
    decoder.decode_into(&mut samples).map(|()| samples)
}

#[test]
fn a_region_is_that_part_of_the_picture() {
    a_region_of(&of_chunks(&chunks()));
}

#[test]
fn a_region_has_the_texture_of_that_part() {
    let mut chunks = chunks();
    let texture = Texture::constant(SIZE.into(), [0.2, 0.3, 0.7]).payload(SIZE.into());
    chunks.insert(BEFORE, chunk(b"tXTR", &texture));
    let bytes = of_chunks(&chunks);
    a_region_of(&bytes);
    let part = RenderOptions::new().with_region(Region { x: 1, y: 2, width: 20, height: 20 });
    let textured = rendered(&bytes, &part).expect("it decodes");
    assert_ne!(rendered(&bytes, &part.with_texture(false)).expect("it decodes"), textured);
}

#[test]
fn bounds_and_texture_may_follow_the_layers() {
    let mut chunks = chunks();
    let bounds = chunks.remove(BEFORE - 1);
    // After the first layer, and after the last.
    for place in [2, LAYERS + 1] {
        let mut chunks = chunks.clone();
        let texture = Texture::constant(SIZE.into(), [0.2, 0.3, 0.7]).payload(SIZE.into());
        drop(chunks.splice(place..place, [bounds.clone(), chunk(b"tXTR", &texture)]));
        a_region_of(&of_chunks(&chunks));
        // What does not show is not decoded all the same.
        let region = Region { x: 280, y: 180, width: 20, height: 20 };
        let options = RenderOptions::new().with_region(region);
        let showing = showing(SIZE, region);
        let layers = (1..chunks.len() - 1).filter(|&at| kind(&chunks[at]) == b"L");
        for (number, at) in layers.collect::<Vec<_>>().into_iter().enumerate() {
            let mut damaged = chunks.clone();
            damaged[at] = without_last_word(&damaged[at]);
            let found = rendered(&of_chunks(&damaged), &options);
            assert_eq!(found.is_err(), showing.contains(&number), "{number}");
        }
    }
}

/// Compares regions that are decoded by themselves with renderings of the whole file.
#[track_caller]
fn a_region_of(bytes: &[u8]) {
    let whole = decode_valid(bytes);
    let picture = whole.picture().expect("it is whole");
    let mut random = Random(6);
    for (width, height) in [SIZE, (75, 50), (20, 200), (301, 7), (1500, 1000)] {
        for _ in 0..40 {
            let mut part = |side: u32| {
                let start = random.next() as u32 % side;
                (start, 1 + random.next() as u32 % (side - start).min(40))
            };
            let ((x, width_of), (y, height_of)) = (part(width), part(height));
            let region = Region { x, y, width: width_of, height: height_of };
            let options = RenderOptions::new().with_size(width, height).with_region(region);
            let mut expected = vec![0; picture.output_len(&options).expect("it fits")];
            picture.render_u8(&options, &mut expected).expect("it renders");
            let found = rendered(bytes, &options).expect("it decodes");
            assert_eq!(found, expected, "{width}x{height}, {region:?}");
        }
    }
}

#[test]
fn the_layers_that_show_are_decoded_and_no_others() {
    for (size, region, count) in regions() {
        let options = RenderOptions::new().with_size(size.0, size.1).with_region(region);
        let expected = showing(size, region);
        assert_eq!(expected.len(), count, "{size:?}, {region:?}");
        let found = decoded(|file| rendered(file, &options).is_ok());
        assert_eq!(found, expected, "{size:?}, {region:?}");
    }
}

#[test]
fn the_whole_picture_takes_all_layers() {
    let all: Vec<usize> = (0..LAYERS).collect();
    for (width, height) in [SIZE, (30, 20), (600, 400)] {
        let options = RenderOptions::new().with_size(width, height);
        assert_eq!(decoded(|file| rendered(file, &options).is_ok()), all, "{width}x{height}");
    }
    assert_eq!(decoded(|file| image_gip::decode(file).is_ok()), all);
}

#[cfg(feature = "image")]
#[test]
fn the_decoder_for_image_decodes_the_layers_that_show() {
    use image::{ImageDecoder, ImageDecoderRect};
    use image_gip::GipDecoder;

    for (size, region, count) in regions() {
        let row = 3 * region.width as usize;
        // Rows that follow each other, and rows with a gap.
        for row_pitch in [row, row + 5] {
            let found = decoded(|file| {
                let mut decoder = GipDecoder::new(file).expect("it begins well");
                decoder.set_size(size.0, size.1).expect("within limits");
                let Region { x, y, width, height } = region;
                let mut samples = vec![0; row_pitch * height as usize];
                decoder.read_rect(x, y, width, height, &mut samples, row_pitch).is_ok()
            });
            assert_eq!(found, showing(size, region), "{size:?}, {region:?}");
            assert_eq!(found.len(), count, "{size:?}, {region:?}");
        }
    }
    // One rectangle after the other takes the layers of each.
    let bytes = damaged(&showing(SIZE, Region { x: 280, y: 180, width: 20, height: 20 }));
    let mut decoder = GipDecoder::new(&bytes[..]).expect("it begins well");
    let mut samples = [0; 3 * 20 * 20];
    for (x, y) in [(0, 0), (140, 90), (0, 180)] {
        decoder.read_rect(x, y, 20, 20, &mut samples, 60).expect("it is far away");
    }
    decoder.read_rect(280, 180, 20, 20, &mut samples, 60).expect_err("it shows");

    let whole = |file: &[u8]| {
        let decoder = GipDecoder::new(file).expect("it begins well");
        let mut samples = vec![0; decoder.total_bytes() as usize];
        decoder.read_image(&mut samples).is_ok()
    };
    assert_eq!(decoded(whole), (0..LAYERS).collect::<Vec<_>>());
}

#[test]
fn what_is_wrong_with_a_layer_is_told_where_it_shows() {
    let bytes = damaged(&[0]);
    let part = |x, y| RenderOptions::new().with_region(Region { x, y, width: 20, height: 20 });
    rendered(&bytes, &part(280, 180)).expect("what is not sound is far away");
    let (expected, error) = decode(&bytes);
    let error = error.expect_err("the first layer is not sound").to_string();
    for options in [part(0, 0), RenderOptions::new(), part(280, 180).with_prefix(1000)] {
        assert_eq!(rendered(&bytes, &options).expect_err("it shows").to_string(), error);
    }
    let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
    assert_eq!(decoder.read_to_end().expect_err("all are decoded").to_string(), error);
    let picture = decoder.picture().expect("what is left is sound");
    assert_eq!(bits(picture.gaussians()), bits(expected.gaussians()));
}

#[test]
fn after_a_region_there_is_still_all_else() {
    let chunks = chunks();
    let bytes = of_chunks(&chunks);
    let whole = decode_valid(&bytes);
    // Three layers come first.
    let (first, rest) = bytes.split_at(of_chunks(&chunks[..BEFORE + 3]).len());
    let mut decoder = Decoder::new(first.chain(rest)).expect("it begins well");
    decoder.read_at_least(3 * IN_A_LAYER as u32).expect("it is sound");
    let options = RenderOptions::new().with_region(Region { x: 270, y: 10, width: 30, height: 30 });
    let mut expected = vec![0; 3 * 30 * 30];
    whole.picture().expect("whole").render_u8(&options, &mut expected).expect("it renders");
    decoder.set_options(options);
    for _ in 0..2 {
        let mut samples = vec![0; expected.len()];
        decoder.decode_into(&mut samples).expect("it is sound");
        assert_eq!(samples, expected);
    }
    // The region has left out layers, which only the picture asks for.
    assert_eq!(decoder.stream().gaussians().len(), 3 * IN_A_LAYER);
    let picture = decoder.picture().expect("every layer is sound");
    assert_eq!(bits(picture.gaussians()), bits(whole.gaussians()));
    decoder.read_to_end().expect("it is sound");
    assert_eq!(bits(decoder.stream().gaussians()), bits(whole.gaussians()));
}

#[test]
fn the_picture_after_a_region_says_what_the_region_left_out() {
    let bytes = damaged(&[0]);
    let mut decoder = Decoder::new(&bytes[..]).expect("it begins well");
    let far = Region { x: 280, y: 180, width: 20, height: 20 };
    decoder.set_options(RenderOptions::new().with_region(far));
    let mut samples = vec![0; decoder.output_len().expect("it fits")];
    decoder.decode_into(&mut samples).expect("what is not sound is far away");
    let (expected, error) = decode(&bytes);
    let error = error.expect_err("the first layer is not sound").to_string();
    assert_eq!(decoder.picture().expect_err("it is not sound").to_string(), error);
    let picture = decoder.picture().expect("what is left is sound");
    assert_eq!(bits(picture.gaussians()), bits(expected.gaussians()));
}

#[test]
fn wrong_bounds_are_skipped() {
    let sound = chunks();
    let expected = decode_valid(&of_chunks(&sound));
    let check = |chunks: &[Vec<u8>], reason: &str| {
        let bytes = of_chunks(chunks);
        let decoder = decode_valid(&bytes);
        let [skipped] = decoder.skipped() else { panic!("{:?}", decoder.skipped()) };
        assert_eq!(skipped.to_string(), format!("chunk bNDS is skipped: {reason}"));
        assert_eq!(bits(decoder.gaussians()), bits(expected.gaussians()));
    };
    let entries = payload(&sound[BEFORE - 1]);
    let mut reversed = entries.to_vec();
    (reversed[4], reversed[6]) = (9, 8);
    let cases: [(&[u8], &str); 4] = [
        (&entries[..4 * LAYERS - 1], "has not as many entries as there are layers"),
        (&[entries, &[0; 4]].concat(), "has not as many entries as there are layers"),
        (&[], "has not as many entries as there are layers"),
        (&reversed, "a layer ends before it begins"),
    ];
    for (payload, reason) in cases {
        let mut chunks = sound.clone();
        chunks[BEFORE - 1] = chunk(b"bNDS", payload);
        check(&chunks, reason);
    }
    // The second of two, at the beginning and behind the layers.
    for at in [BEFORE, BEFORE + LAYERS] {
        let mut chunks = sound.clone();
        chunks.insert(at, sound[BEFORE - 1].clone());
        check(&chunks, "appears twice");
    }
}
