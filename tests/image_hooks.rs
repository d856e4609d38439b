//! `.gip` through the `image` crate: hooks, decoder, encoder.

mod common;
mod pictures;

use std::io::Cursor;
use std::path::PathBuf;

use common::{SIGNATURE, chunk};
use image::error::{LimitErrorKind, UnsupportedErrorKind};
use image::metadata::Orientation;
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageDecoderRect, ImageEncoder,
    ImageError, ImageReader,
};
use image_gip::{
    ColorModel, Decoder, Encoder, GipDecoder, GipEncoder, Limits, RenderOptions, SampleDepth,
    Target,
};
use pictures::EXIF_ROTATE_90;

const WIDTH: u32 = 37;
const HEIGHT: u32 = 29;

/// The shared picture at the size of these tests.
fn picture(color: ColorType) -> DynamicImage {
    pictures::picture((WIDTH, HEIGHT), color)
}

fn encoder() -> Encoder {
    Encoder::new().with_target(Target::Gaussians(20)).with_effort(1)
}

fn encode(color: ColorType) -> Vec<u8> {
    let mut file = Vec::new();
    let gip = GipEncoder::with_encoder(&mut file, encoder());
    picture(color).write_with_encoder(gip).expect("the colour type is one of the eight");
    file
}

/// What the crate's own decoder makes of a file, as native-endian bytes.
fn reference(file: &[u8]) -> Vec<u8> {
    let mut decoder = Decoder::new(file).expect("the file is sound");
    let length = decoder.output_len().expect("small");
    if decoder.header().depth == SampleDepth::Eight {
        let mut samples = vec![0; length];
        decoder.decode_into(&mut samples).expect("the file is sound");
        samples
    } else {
        let mut samples = vec![0; length];
        decoder.decode_into_u16(&mut samples).expect("the file is sound");
        samples.into_iter().flat_map(u16::to_ne_bytes).collect()
    }
}

/// Puts a file where a test alone can find it.
fn on_disk(name: &str, file: &[u8]) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, file).expect("the directory for temporary files is writable");
    path
}

fn read_all(decoder: impl ImageDecoder) -> Vec<u8> {
    let mut samples = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut samples).expect("the file is sound");
    samples
}

#[test]
fn registering_again_is_harmless() {
    assert!(image_gip::register());
    assert!(image_gip::register());
    let file = encode(ColorType::Rgb8);
    assert_eq!(image::load_from_memory(&file).unwrap().as_bytes(), reference(&file));
}

#[test]
fn opens_by_path_by_extension_by_content_and_from_memory() {
    image_gip::register();
    let file = encode(ColorType::Rgb8);
    let expected = reference(&file);

    for name in ["hooks_lower.gip", "HOOKS_UPPER.GIP"] {
        let opened = image::open(on_disk(name, &file)).unwrap();
        assert_eq!((opened.width(), opened.height()), (WIDTH, HEIGHT));
        assert_eq!(opened.as_bytes(), expected, "{name}");
    }
    let path = on_disk("hooks_wrong_extension.png", &file);
    let guessed = ImageReader::open(path).unwrap().with_guessed_format().unwrap();
    assert_eq!(guessed.decode().unwrap().as_bytes(), expected);
    let guessed = ImageReader::new(Cursor::new(&file)).with_guessed_format().unwrap();
    assert_eq!(guessed.into_dimensions().unwrap(), (WIDTH, HEIGHT));
    assert_eq!(image::load_from_memory(&file).unwrap().as_bytes(), expected);
}

#[test]
fn every_color_type_survives() {
    for color in [
        ColorType::L8,
        ColorType::La8,
        ColorType::Rgb8,
        ColorType::Rgba8,
        ColorType::L16,
        ColorType::La16,
        ColorType::Rgb16,
        ColorType::Rgba16,
    ] {
        let file = encode(color);
        let decoder = GipDecoder::new(&file[..]).unwrap();
        assert_eq!(decoder.color_type(), color);
        assert_eq!(decoder.dimensions(), (WIDTH, HEIGHT));
        assert_eq!(read_all(decoder), reference(&file), "{color:?}");
    }
}

#[test]
fn other_color_types_are_refused() {
    let mut file = Vec::new();
    let error = picture(ColorType::Rgb32F)
        .write_with_encoder(GipEncoder::new(&mut file))
        .expect_err("32-bit floats are not a depth of the format");
    let ImageError::Unsupported(error) = error else { panic!("{error:?}") };
    assert_eq!(error.kind(), UnsupportedErrorKind::Color(ExtendedColorType::Rgba32F));
    assert!(file.is_empty());
}

#[test]
fn a_buffer_of_the_wrong_length_is_not_encoded() {
    for (length, color) in [(11, ExtendedColorType::Rgb8), (23, ExtendedColorType::Rgb16)] {
        let mut file = Vec::new();
        let error = GipEncoder::with_encoder(&mut file, encoder())
            .write_image(&vec![0; length], 2, 2, color)
            .expect_err("2 x 2 x 3 samples are needed");
        assert!(matches!(error, ImageError::Parameter(_)), "{error:?}");
        assert!(file.is_empty());
    }
}

#[test]
fn limits_are_honoured() {
    image_gip::register();
    let file = encode(ColorType::Rgba16);
    let decode = |limits| {
        let mut reader = ImageReader::new(Cursor::new(&file)).with_guessed_format().unwrap();
        reader.limits(limits);
        match reader.decode() {
            Ok(picture) => Ok(picture),
            Err(ImageError::Limits(error)) => Err(error.kind()),
            Err(error) => panic!("{error:?}"),
        }
    };
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(WIDTH);
    limits.max_image_height = Some(HEIGHT);
    assert!(decode(limits.clone()).is_ok());

    limits.max_image_width = Some(WIDTH - 1);
    assert_eq!(decode(limits.clone()).unwrap_err(), LimitErrorKind::DimensionError);

    // Room for the output, but for nothing else.
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(u64::from(WIDTH * HEIGHT * 8));
    assert_eq!(decode(limits).unwrap_err(), LimitErrorKind::InsufficientMemory);
}

#[test]
fn metadata_is_carried() {
    let profile = b"a profile is opaque bytes".to_vec();
    let mut file = Vec::new();
    let mut gip = GipEncoder::with_encoder(&mut file, encoder());
    gip.set_icc_profile(profile.clone()).unwrap();
    gip.set_exif_metadata(EXIF_ROTATE_90.to_vec()).unwrap();
    picture(ColorType::L8).write_with_encoder(gip).unwrap();

    let mut decoder = GipDecoder::new(&file[..]).unwrap();
    assert_eq!(decoder.icc_profile().unwrap(), Some(profile));
    assert_eq!(decoder.exif_metadata().unwrap().as_deref(), Some(EXIF_ROTATE_90));
    assert_eq!(decoder.xmp_metadata().unwrap(), None);
    assert_eq!(decoder.orientation().unwrap(), Orientation::Rotate90);
}

#[test]
fn colour_spaces_are_carried_in_codes() {
    use image::metadata::{
        Cicp, CicpColorPrimaries, CicpMatrixCoefficients, CicpTransferCharacteristics,
    };

    let encode = |color_space| {
        let mut file = Vec::new();
        let gip = GipEncoder::with_encoder(&mut file, encoder());
        picture(ColorType::Rgb16).write_with_encoder(gip.with_color_space(color_space)?)?;
        Ok::<_, ImageError>(file)
    };
    let pq = Cicp {
        primaries: CicpColorPrimaries::Rgb2020,
        transfer: CicpTransferCharacteristics::Smpte2084,
        ..Cicp::SRGB
    };
    for color_space in [Cicp::DISPLAY_P3, pq] {
        let file = encode(color_space).unwrap();
        let found = GipDecoder::new(&file[..]).unwrap().color_space().unwrap();
        assert_eq!(found, color_space);
        let mut picture = DynamicImage::from_decoder(GipDecoder::new(&file[..]).unwrap()).unwrap();
        picture.set_color_space(found).unwrap();
        assert_eq!(picture.color_space(), color_space);
    }
    // What a file is in without codes, and codes that have no name.
    let srgb = encode(Cicp::SRGB).unwrap();
    assert_eq!(GipDecoder::new(&srgb[..]).unwrap().color_space(), None);
    let unknown = &include_bytes!("../spec/vectors/cicp-unknown.gip")[..];
    assert_eq!(GipDecoder::new(unknown).unwrap().color_space(), None);
    let matrix = CicpMatrixCoefficients::Bt709;
    let error = encode(Cicp { matrix, ..Cicp::SRGB }).unwrap_err();
    assert!(matches!(error, ImageError::Unsupported(_)), "{error}");
}

#[test]
fn metadata_after_the_layers_is_found() {
    let file = encode(ColorType::L8);
    let header = SIGNATURE.len() + 2 + usize::from(file[SIGNATURE.len() + 1]) + 4;
    let (layers, end) = file.split_at(file.len() - chunk(b"E", &[]).len());
    let exif = b"II\x2a\0\x08\0\0\0\0\0\0\0\0\0";
    let profile = chunk(b"iCCP", b"a profile");
    let late = [chunk(b"eXIF", exif), chunk(b"xMPD", b"<x/>")].concat();
    let late = [&file[..header], &profile, &layers[header..], &late, end].concat();
    let mut decoder = GipDecoder::new(&late[..]).unwrap();
    assert_eq!(decoder.orientation().unwrap(), Orientation::NoTransforms);
    assert_eq!(decoder.icc_profile().unwrap().as_deref(), Some(&b"a profile"[..]));
    assert_eq!(decoder.exif_metadata().unwrap().as_deref(), Some(&exif[..]));
    assert_eq!(decoder.xmp_metadata().unwrap().as_deref(), Some(&b"<x/>"[..]));
    assert_eq!(read_all(decoder), reference(&file));

    // Orientation and colours are known when the first layer begins, the rest is not.
    let mut decoder = GipDecoder::new(&late[..=header + profile.len()]).unwrap();
    assert_eq!(decoder.orientation().unwrap(), Orientation::NoTransforms);
    assert_eq!(decoder.icc_profile().unwrap().as_deref(), Some(&b"a profile"[..]));
    assert!(matches!(decoder.exif_metadata(), Err(ImageError::Decoding(_))));
}

#[test]
fn texture_can_be_left_out() {
    let file = include_bytes!("../spec/vectors/texture-gray8.gip");
    let mut plain = GipDecoder::new(&file[..]).unwrap();
    plain.set_texture(false);
    let plain = read_all(plain);
    let textured = read_all(GipDecoder::new(&file[..]).unwrap());
    assert_eq!(textured, reference(file));
    assert_ne!(textured, plain);
    let mut decoder = Decoder::new(&file[..]).unwrap();
    decoder.set_options(RenderOptions::new().with_texture(false));
    let mut expected = vec![0; plain.len()];
    decoder.decode_into(&mut expected).unwrap();
    assert_eq!(plain, expected);
}

#[test]
fn a_rectangle_is_a_crop_of_the_whole() {
    for color in [ColorType::Rgb8, ColorType::La16] {
        let file = encode(color);
        let pixel = usize::from(color.bytes_per_pixel());
        let whole = read_all(GipDecoder::new(&file[..]).unwrap());
        let mut decoder = GipDecoder::new(&file[..]).unwrap();
        for (x, y, width, height) in [(0, 0, WIDTH, HEIGHT), (5, 7, 20, 11), (36, 28, 1, 1)] {
            let row = width as usize * pixel;
            for row_pitch in [row, row + 5] {
                let mut samples = vec![0xA5; row_pitch * height as usize];
                decoder.read_rect(x, y, width, height, &mut samples, row_pitch).unwrap();
                for (line, samples) in samples.chunks(row_pitch).enumerate() {
                    let at = ((y as usize + line) * WIDTH as usize + x as usize) * pixel;
                    assert_eq!(samples[..row], whole[at..at + row], "{color:?} line {line}");
                    assert!(samples[row..].iter().all(|&byte| byte == 0xA5), "padding is kept");
                }
            }
        }
    }
}

#[test]
fn impossible_rectangles_are_refused() {
    let file = encode(ColorType::Rgb8);
    let mut decoder = GipDecoder::new(&file[..]).unwrap();
    let mut samples = vec![0; 300];
    for (x, y, width, height, row_pitch) in [
        (WIDTH - 1, 0, 2, 1, 6),
        (0, HEIGHT, 1, 1, 3),
        (0, 0, 0, 1, 3),
        (0, 0, 10, 10, 29),
        (0, 0, 10, 11, 30),
        (u32::MAX, 0, 2, 1, 6),
    ] {
        let error = decoder
            .read_rect(x, y, width, height, &mut samples, row_pitch)
            .expect_err("outside, empty, or not fitting the buffer");
        assert!(matches!(error, ImageError::Parameter(_)), "{error:?}");
    }
    assert!(samples.iter().all(|&sample| sample == 0));
    decoder.read_rect(0, 0, 10, 10, &mut samples, 30).expect("the decoder goes on");
}

#[test]
fn renders_at_another_size() {
    let file = encode(ColorType::Rgba8);
    let mut decoder = GipDecoder::new(&file[..]).unwrap();
    assert!(matches!(decoder.set_size(0, 5), Err(ImageError::Parameter(_))));
    assert!(matches!(decoder.set_size(1 << 17, 5), Err(ImageError::Limits(_))));
    decoder.set_size(50, 10).unwrap();
    assert_eq!(decoder.dimensions(), (50, 10));

    let mut own = Decoder::new(&file[..]).unwrap();
    own.set_options(RenderOptions::new().with_size(50, 10));
    let mut expected = vec![0; 50 * 10 * ColorModel::Rgba.channels()];
    own.decode_into(&mut expected).unwrap();
    assert_eq!(read_all(decoder), expected);
}

#[test]
fn damaged_files_are_errors() {
    let file = encode(ColorType::Rgb8);
    for length in [0, 4, 40, file.len() - 1] {
        let outcome = GipDecoder::new(&file[..length]).and_then(|decoder| {
            let mut samples = vec![0; decoder.total_bytes() as usize];
            decoder.read_image(&mut samples)
        });
        assert!(matches!(outcome, Err(ImageError::Decoding(_))), "{length} bytes: {outcome:?}");
    }

    // The version is the seventh byte.
    let mut later = file.clone();
    later[6] = 200;
    assert!(matches!(GipDecoder::new(&later[..]), Err(ImageError::Unsupported(_))));
    // It is taken for what it is all the same.
    image_gip::register();
    let reader = ImageReader::new(Cursor::new(&later)).with_guessed_format().expect("in memory");
    assert!(matches!(reader.decode(), Err(ImageError::Unsupported(_))));

    let mut limits = Limits::default();
    limits.max_height = HEIGHT - 1;
    let refused = GipDecoder::new_with_limits(&file[..], limits);
    assert!(matches!(refused, Err(ImageError::Limits(_))));
}

#[test]
fn the_orientation_is_told_and_the_samples_are_as_stored() {
    let little_endian = b"II\x2a\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\0\0\0\0\0\0\0\0";
    for value in 0..=9 {
        let (mut big, mut little) = (EXIF_ROTATE_90.to_vec(), little_endian.to_vec());
        (big[19], little[18]) = (value, value);
        for exif in [big, little] {
            let mut file = Vec::new();
            let mut gip = GipEncoder::with_encoder(&mut file, encoder());
            gip.set_exif_metadata(exif).expect(".gip has Exif");
            picture(ColorType::L8).write_with_encoder(gip).expect("in memory");
            let mut decoder = GipDecoder::new(&file[..]).expect("a sound file");
            let expected = Orientation::from_exif(value).unwrap_or(Orientation::NoTransforms);
            assert_eq!(decoder.orientation().expect("a sound file"), expected, "{value}");
            assert_eq!(decoder.dimensions(), (WIDTH, HEIGHT), "{value}");
        }
    }
}
