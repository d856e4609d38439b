//! The functions as C calls them, for Miri: it sees what valgrind does not, and takes so long that pictures
//! are tiny and none is encoded. What is tested of results stands in the folder `tests`.

use core::ffi::{CStr, c_int, c_void};
use core::mem::MaybeUninit;
use core::{ptr, slice};

use image_gip::{ColorModel, Encoder, RenderOptions, Source, StreamDecoder, Target, Threads};

use crate::buffer::{Buffer, gip_buffer_free};
use crate::decoder::{
    Decoder, gip_decoder_feed, gip_decoder_finish, gip_decoder_free, gip_decoder_new,
    gip_decoder_open, gip_decoder_skipped,
};
use crate::encode::{CReport, CTarget, EncodeOptions, gip_encode};
use crate::gaussians::{CGaussian, gip_decoder_gaussians};
use crate::info::{Info, gip_decoder_info};
use crate::limits::CLimits;
use crate::metadata::{
    Blob, CCicp, CContentLight, CMasteringDisplay, CMetadata, CText, gip_decoder_metadata,
};
use crate::output::{Output, gip_output_size};
use crate::prefix::gip_prefix;
use crate::progress::CProgress;
use crate::render::gip_render;
use crate::source::CSource;
use crate::status::{Status, gip_last_error, guard};
use crate::structures::Structure;
use crate::view::{Color, Samples, View};

const PICTURE: &[u8] = include_bytes!("../../../spec/vectors/gray-alpha8.gip");
const ENTROPY: &[u8] = include_bytes!("../../../spec/vectors/entropy-rgba8.gip");
const METADATA: &[u8] = include_bytes!("../../../spec/vectors/metadata.gip");
const SKIPPED: &[u8] = include_bytes!("../../../spec/vectors/skip-twice-icc.gip");

/// A structure whose fields are 0 but for its size.
fn sized<T>() -> T {
    let mut structure = MaybeUninit::<T>::zeroed();
    // SAFETY: all structures of the header begin with their size.
    unsafe { structure.as_mut_ptr().cast::<usize>().write(size_of::<T>()) };
    // SAFETY: they consist of numbers and pointers, which may be 0.
    unsafe { structure.assume_init() }
}

fn last_error() -> String {
    // SAFETY: the text is valid until the next failure.
    unsafe { CStr::from_ptr(gip_last_error()) }.to_string_lossy().into_owned()
}

fn open(file: &[u8]) -> *mut Decoder {
    let mut decoder = ptr::null_mut();
    // SAFETY: all pointers are valid.
    let status = unsafe {
        gip_decoder_open(file.as_ptr().cast(), file.len(), ptr::null(), &raw mut decoder)
    };
    assert_eq!(status, Status::Ok, "{}", last_error());
    decoder
}

fn fed(file: &[u8], piece: usize) -> *mut Decoder {
    let mut decoder = ptr::null_mut();
    // SAFETY: all pointers are valid.
    let status = unsafe { gip_decoder_new(ptr::null(), &raw mut decoder) };
    assert_eq!(status, Status::Ok);
    for piece in file.chunks(piece) {
        let mut used = 0;
        // SAFETY: all pointers are valid.
        let status =
            unsafe { gip_decoder_feed(decoder, piece.as_ptr().cast(), piece.len(), &raw mut used) };
        assert_eq!((status, used), (Status::Ok, piece.len()), "{}", last_error());
    }
    decoder
}

fn free(decoder: *mut Decoder) {
    // SAFETY: the tests free each decoder once.
    unsafe { gip_decoder_free(decoder) };
}

/// The bytes of a rendering, into memory that was not set before. `padding` stands behind each row.
fn rendered(decoder: *mut Decoder, view: &View, padding: usize) -> Vec<u8> {
    let mut output: Output = sized();
    // SAFETY: all pointers are valid.
    let status = unsafe { gip_output_size(decoder, view, &raw mut output) };
    assert_eq!(status, Status::Ok, "{}", last_error());
    let (rows, stride) = (output.size / output.row_size, output.row_size + padding);
    // Aligned for all types of samples.
    let mut memory = vec![MaybeUninit::<u32>::uninit(); (stride * rows).div_ceil(4)];
    let out = memory.as_mut_ptr().cast::<c_void>();
    // SAFETY: there are so many bytes.
    let status = unsafe { gip_render(decoder, view, out, stride, stride * rows) };
    assert_eq!(status, Status::Ok, "{}", last_error());
    let mut bytes = Vec::new();
    for row in 0..rows {
        // SAFETY: the row is inside.
        let first = unsafe { memory.as_ptr().cast::<u8>().add(row * stride) };
        // SAFETY: it was rendered.
        bytes.extend_from_slice(unsafe { slice::from_raw_parts(first, output.row_size) });
    }
    bytes
}

#[test]
fn every_way_to_render_gives_the_samples_of_the_crate() {
    let mut stream = StreamDecoder::new();
    stream.feed(PICTURE).expect("a valid file");
    let picture = stream.picture().expect("it has a header");
    let options = RenderOptions::new().with_threads(Threads::One);
    let mut samples = vec![0; picture.output_len(&options).expect("no limit is exceeded")];
    picture.render_u8(&options, &mut samples).expect("no limit is exceeded");
    // Miri takes minutes for pools of threads, and sees leaks in crossbeam.
    let several = if cfg!(miri) { 1 } else { 2 };
    for (decoder, threads, padding) in
        [(open(PICTURE), 0, 0), (open(PICTURE), several, 4), (fed(PICTURE, 1), 1, 4)]
    {
        let view = View { threads, ..sized() };
        assert_eq!(rendered(decoder, &view, padding), samples);
        let view = View { samples: Samples::F32Planes as u32, ..sized() };
        assert_eq!(rendered(decoder, &view, padding).len(), 4 * samples.len());
        // Composed over black, and widened.
        let view = View { samples: Samples::U16 as u32, color: Color::Rgb as u32, ..sized() };
        assert_eq!(rendered(decoder, &view, padding).len(), samples.len() / 2 * 6);
        free(decoder);
    }
}

#[test]
fn what_is_borrowed_of_a_decoder_remains_while_it_is_used() {
    // The file may be gone when the decoder is freed.
    let file = METADATA.to_vec();
    let decoder = open(&file);
    let mut metadata: CMetadata = sized();
    // SAFETY: all pointers are valid.
    let status = unsafe { gip_decoder_metadata(decoder, &raw mut metadata) };
    assert_eq!(status, Status::Ok);
    let mut info: Info = sized();
    // SAFETY: all pointers are valid.
    assert_eq!(unsafe { gip_decoder_info(decoder, &raw mut info) }, Status::Ok);
    assert!(!rendered(decoder, &sized(), 0).is_empty());
    // SAFETY: the decoder is as it was.
    let exif = unsafe { slice::from_raw_parts(metadata.exif.data, metadata.exif.size) };
    assert!(exif.starts_with(b"II") || exif.starts_with(b"MM"));
    // SAFETY: as above.
    let texts = unsafe { slice::from_raw_parts(metadata.texts, metadata.text_count) };
    for CText { keyword, text } in texts {
        // SAFETY: as above.
        assert!(!unsafe { CStr::from_ptr(*keyword) }.is_empty());
        // SAFETY: as above.
        assert!(unsafe { CStr::from_ptr(*text) }.to_str().is_ok());
    }
    drop(file);
    free(decoder);

    let decoder = fed(SKIPPED, 3);
    // SAFETY: the decoder is valid.
    let first = unsafe { gip_decoder_skipped(decoder, 0) };
    // SAFETY: the decoder is valid.
    assert!(unsafe { gip_decoder_skipped(decoder, 1) }.is_null());
    // SAFETY: the text remains.
    assert!(unsafe { CStr::from_ptr(first) }.to_string_lossy().contains("iCCP"));
    free(decoder);
}

#[test]
fn gaussians_and_prefixes_are_copied() {
    let decoder = open(ENTROPY);
    // SAFETY: the decoder is valid.
    assert_eq!(unsafe { gip_decoder_finish(decoder, 1) }, Status::Ok);
    let (mut gaussians, mut copied) = ([MaybeUninit::<CGaussian>::uninit(); 2], 0);
    let to = gaussians.as_mut_ptr().cast();
    // SAFETY: there is memory for two.
    let status = unsafe { gip_decoder_gaussians(decoder, 0, 2, to, &raw mut copied) };
    assert_eq!((status, copied), (Status::Ok, 2));
    // SAFETY: they were copied.
    assert!(unsafe { gaussians[1].assume_init() }.cholesky[0] > 0.0);
    free(decoder);

    let mut buffer = Buffer { data: ptr::null_mut(), size: 0 };
    // SAFETY: all pointers are valid.
    let status =
        unsafe { gip_prefix(ENTROPY.as_ptr().cast(), ENTROPY.len(), 1 << 20, &raw mut buffer) };
    assert_eq!(status, Status::Ok, "{}", last_error());
    // SAFETY: it was filled.
    free(open(unsafe { slice::from_raw_parts(buffer.data, buffer.size) }));
    // SAFETY: the buffer is valid.
    unsafe { gip_buffer_free(&raw mut buffer) };
    assert!(buffer.data.is_null());
}

/// A picture of 4 x 3 pixels, in rows with a byte of padding.
fn source(pixels: &[u8; 14]) -> CSource {
    CSource {
        width: 4,
        height: 3,
        color: Color::Gray as u32,
        samples: Samples::U8 as u32,
        pixels: pixels.as_ptr().cast(),
        stride: 5,
        size: pixels.len(),
        ..sized()
    }
}

#[test]
fn sources_and_options_are_read() {
    let mut buffer = Buffer { data: ptr::null_mut(), size: 0 };
    let texts = [CText { keyword: c"Title".as_ptr(), text: c"A picture".as_ptr() }];
    let metadata = CMetadata { texts: texts.as_ptr(), text_count: 1, ..sized() };
    let source = CSource { metadata: &raw const metadata, ..source(&[7; 14]) };
    // So many are refused when all else was read, and before there is a pool.
    let options = EncodeOptions { threads: 1025, ..sized() };
    // SAFETY: all pointers are valid.
    let status = unsafe {
        gip_encode(&raw const source, &raw const options, &raw mut buffer, ptr::null_mut())
    };
    assert_eq!(status, Status::Argument);
    assert!(last_error().contains("threads 1025"), "{}", last_error());
}

#[test]
#[cfg_attr(miri, ignore = "takes minutes")]
fn progress_is_told_to_the_thread_that_calls() {
    unsafe extern "C" fn tell(progress: *const CProgress, user: *mut c_void) -> c_int {
        // SAFETY: the library passes its progress.
        let fraction = unsafe { (*progress).fraction };
        // SAFETY: the library passes what the test has given to it.
        let calls = unsafe { &mut *user.cast::<Vec<f64>>() };
        calls.push(fraction);
        0
    }
    let mut calls: Vec<f64> = Vec::new();
    let mut buffer = Buffer { data: ptr::null_mut(), size: 0 };
    let source = source(&[0, 9, 20, 30, 99, 50, 70, 80, 90, 99, 7, 8, 9, 10]);
    let options = EncodeOptions {
        target: CTarget::Gaussians as u32,
        value: 2.0,
        effort: 1,
        progress: Some(tell),
        user: (&raw mut calls).cast(),
        ..sized()
    };
    // SAFETY: all pointers are valid.
    let status = unsafe {
        gip_encode(&raw const source, &raw const options, &raw mut buffer, ptr::null_mut())
    };
    assert_eq!(status, Status::Ok, "{}", last_error());
    assert!(!calls.is_empty() && calls.is_sorted());
    // The file is that of the crate, of the picture without padding.
    let pixels = [0, 9, 20, 30, 50, 70, 80, 90, 7, 8, 9, 10];
    let source = Source::new_u8(4, 3, ColorModel::Gray, &pixels).expect("a picture");
    let encoder = Encoder::new().with_target(Target::Gaussians(2)).with_effort(1);
    let encoded = encoder.encode(&source).expect("nothing is out of range");
    // SAFETY: the buffer is valid.
    assert_eq!(unsafe { slice::from_raw_parts(buffer.data, buffer.size) }, encoded.bytes);
    // SAFETY: the buffer is valid.
    unsafe { gip_buffer_free(&raw mut buffer) };
}

#[test]
fn panics_end_at_the_boundary() {
    let status = guard(|| panic!("on purpose"));
    assert_eq!(status, Status::Internal);
    assert_eq!(last_error(), "a bug: on purpose");

    // A decoder in whose middle there was one is used no more, but freed.
    let decoder = open(ENTROPY);
    let status = guard(|| {
        // SAFETY: the decoder is valid.
        let _state = unsafe { Decoder::of(decoder) }?.write()?;
        panic!("on purpose");
    });
    assert_eq!(status, Status::Internal);
    let mut info: Info = sized();
    // SAFETY: all pointers are valid.
    assert_eq!(unsafe { gip_decoder_info(decoder, &raw mut info) }, Status::Internal);
    free(decoder);
}

/// Programs of the first version of the header have structures of these sizes: a field may only be added
/// behind the last one.
#[test]
#[cfg(target_pointer_width = "64")]
fn structures_do_not_change() {
    let least = [
        EncodeOptions::LEAST,
        Info::LEAST,
        CLimits::LEAST,
        CMetadata::LEAST,
        Output::LEAST,
        CReport::LEAST,
        CSource::LEAST,
        View::LEAST,
    ];
    assert_eq!(least, [88, 68, 44, 112, 40, 76, 56, 58]);
    let whole =
        [size_of::<Buffer>(), size_of::<Blob>(), size_of::<CText>(), size_of::<CGaussian>()];
    assert_eq!(whole, [16, 16, 16, 36]);
    let whole = [size_of::<CMasteringDisplay>(), size_of::<CContentLight>(), size_of::<CCicp>()];
    assert_eq!(whole, [24, 8, 2]);
}
