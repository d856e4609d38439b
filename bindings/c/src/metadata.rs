//! Metadata on its way from a file to the caller, and from the caller to a file.

use core::ffi::{CStr, c_char};
use core::ptr;

use image_gip::{Cicp, ContentLight, MasteringDisplay, Metadata, Text};

use crate::decoder::{Decoder, Input, State};
use crate::pointers;
use crate::status::{Failure, Status, guard};
use crate::strings::CallersText;
use crate::structures::{self, structure};

/// gip_metadata.cicp is there.
pub const GIP_METADATA_CICP: u32 = 1;
/// gip_metadata.mastering_display is there.
pub const GIP_METADATA_MASTERING_DISPLAY: u32 = 2;
/// gip_metadata.content_light is there.
pub const GIP_METADATA_CONTENT_LIGHT: u32 = 4;

/// Bytes of somebody else. A size of 0, whatever the pointer is, stands for what is not there.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Blob {
    /// The bytes.
    pub data: *const u8,
    /// How many they are.
    pub size: usize,
}

/// A keyword and its text, both in UTF-8 with a NUL at the end.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CText {
    /// The keyword, 1 to 79 bytes, such as "Title", "Author" or "Copyright".
    pub keyword: *const c_char,
    /// The text.
    pub text: *const c_char,
}

/// A colour space, as codes of Rec. ITU-T H.273. Samples are RGB in full range, or gray.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CCicp {
    /// ColourPrimaries: 1 for sRGB and BT.709, 9 for BT.2020, 12 for Display P3.
    pub primaries: u8,
    /// TransferCharacteristics: 13 for sRGB, 16 for PQ, 18 for HLG.
    pub transfer: u8,
}

/// The display on which a picture was made (SMPTE ST 2086).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CMasteringDisplay {
    /// CIE 1931 x and y of its red, in 0.00002.
    pub red: [u16; 2],
    /// x and y of its green, in 0.00002.
    pub green: [u16; 2],
    /// x and y of its blue, in 0.00002.
    pub blue: [u16; 2],
    /// x and y of its white, in 0.00002.
    pub white: [u16; 2],
    /// The most luminance that it shows, in 0.0001 cd/m^2.
    pub max_luminance: u32,
    /// The least luminance that it shows, in 0.0001 cd/m^2.
    pub min_luminance: u32,
}

/// How bright a picture is (CTA-861).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CContentLight {
    /// MaxCLL, that of the brightest pixel, in 0.0001 cd/m^2; 0 if it is not known.
    pub max_content: u32,
    /// MaxFALL, the mean of the picture, in 0.0001 cd/m^2; 0 if it is not known.
    pub max_frame_average: u32,
}

/// The metadata of a picture: of a file that is decoded, or of one to be encoded. It is passed on as it is
/// stored, and does not change the samples.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CMetadata {
    /// sizeof(gip_metadata).
    pub struct_size: usize,
    /// The ICC profile of the colours. Without one, and without cicp, they are sRGB.
    pub icc: Blob,
    /// Exif data: a TIFF stream, which begins with II or MM. Of a file to be encoded, the prefix that it has
    /// in JPEG may come before.
    pub exif: Blob,
    /// An XMP packet: XML in UTF-8.
    pub xmp: Blob,
    /// Keywords and their texts, in the order of the file.
    pub texts: *const CText,
    /// How many there are.
    pub text_count: usize,
    /// Which of the following fields are there: GIP_METADATA_CICP and so on, combined by |.
    pub present: u32,
    /// The colour space. It counts before the ICC profile.
    pub cicp: CCicp,
    /// The display on which the picture was made.
    pub mastering_display: CMasteringDisplay,
    /// How bright the picture is.
    pub content_light: CContentLight,
}

structure!(CMetadata, "gip_metadata", content_light: CContentLight);

/// The texts that a caller has pointers to, with their NULs.
#[derive(Debug, Default)]
pub(crate) struct Texts {
    strings: Vec<[CallersText; 2]>,
    pointers: Vec<CText>,
}

// SAFETY: the pointers are to the strings beside them, which do not change.
unsafe impl Send for Texts {}
// SAFETY: as above.
unsafe impl Sync for Texts {}

impl Texts {
    /// The pointers to all texts of a file. Those that were handed out remain valid unless there are more.
    fn of(&mut self, texts: &[Text]) -> &[CText] {
        for Text { keyword, text, .. } in &texts[self.strings.len()..] {
            let strings = [keyword, text].map(|text| CallersText::new(text));
            let [keyword, text] = strings.each_ref().map(CallersText::as_ptr);
            self.pointers.push(CText { keyword, text });
            self.strings.push(strings);
        }
        &self.pointers
    }
}

impl Blob {
    fn of(bytes: Option<&Vec<u8>>) -> Self {
        bytes.map_or(Self { data: ptr::null(), size: 0 }, |bytes| {
            let (data, size) = (bytes.as_ptr(), bytes.len());
            Self { data, size }
        })
    }

    /// The bytes of a caller.
    ///
    /// # Safety
    /// They are there, if there are any.
    unsafe fn bytes(self, name: &str) -> Result<Option<Vec<u8>>, Failure> {
        // SAFETY: the same contract.
        let bytes = unsafe { pointers::bytes(self.data.cast(), self.size, name) }?;
        Ok((!bytes.is_empty()).then(|| bytes.to_vec()))
    }
}

/// Fills `metadata`, whose struct_size is set, with what has arrived. Of a file in memory all of it is read
/// before, without decoding layers. Of a file that is fed, what says how the picture is shown has arrived
/// with the first layer, and the rest with the end. On failure for what the file is, it is filled with what
/// stands before the error.
///
/// All that it points to is valid until gip_decoder_feed, gip_decoder_metadata or gip_decoder_free are called
/// with the decoder. It may be used as it is for gip_source.metadata.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gip_decoder_metadata(
    decoder: *mut Decoder,
    metadata: *mut CMetadata,
) -> Status {
    guard(|| {
        // SAFETY: the caller passes a decoder.
        let mut state = unsafe { Decoder::of(decoder) }?.write()?;
        let read = match &mut state.input {
            Input::Fed(_) => Ok(()),
            Input::Memory(decoder) => decoder.read_metadata().map(|_| ()),
        };
        let read = state.told(read);
        let State { input, texts, .. } = &mut *state;
        let found = CMetadata::of(input.metadata(), texts);
        // SAFETY: the caller passes a structure with its size.
        unsafe { structures::write(metadata, found) }?;
        read
    })
}

impl CMetadata {
    fn of(metadata: &Metadata, texts: &mut Texts) -> Self {
        let Metadata { cicp, mastering_display, content_light, .. } = *metadata;
        let flags = [
            (cicp.is_some(), GIP_METADATA_CICP),
            (mastering_display.is_some(), GIP_METADATA_MASTERING_DISPLAY),
            (content_light.is_some(), GIP_METADATA_CONTENT_LIGHT),
        ];
        let texts = texts.of(&metadata.texts);
        Self {
            struct_size: size_of::<Self>(),
            icc: Blob::of(metadata.icc_profile.as_ref()),
            exif: Blob::of(metadata.exif.as_ref()),
            xmp: Blob::of(metadata.xmp.as_ref()),
            texts: if texts.is_empty() { ptr::null() } else { texts.as_ptr() },
            text_count: texts.len(),
            present: flags.iter().filter(|(holds, _)| *holds).map(|(_, flag)| flag).sum(),
            cicp: cicp.map(CCicp::of).unwrap_or_default(),
            mastering_display: mastering_display.map(CMasteringDisplay::of).unwrap_or_default(),
            content_light: content_light.map(CContentLight::of).unwrap_or_default(),
        }
    }

    /// A copy of what a caller gives. The encoder checks what can be stored.
    ///
    /// # Safety
    /// All that it points to is there.
    pub(crate) unsafe fn copied(&self) -> Result<Metadata, Failure> {
        let known = GIP_METADATA_CICP | GIP_METADATA_MASTERING_DISPLAY | GIP_METADATA_CONTENT_LIGHT;
        if self.present & !known != 0 {
            return Err(Failure::argument(format!("present {}; it has others", self.present)));
        }
        let has = |flag| self.present & flag != 0;
        let mut metadata = Metadata::default();
        metadata.cicp =
            has(GIP_METADATA_CICP).then(|| Cicp::new(self.cicp.primaries, self.cicp.transfer));
        metadata.mastering_display =
            has(GIP_METADATA_MASTERING_DISPLAY).then(|| self.mastering_display.display());
        metadata.content_light =
            has(GIP_METADATA_CONTENT_LIGHT).then(|| self.content_light.light());
        // SAFETY: the same contract.
        metadata.icc_profile = unsafe { self.icc.bytes("icc") }?;
        // SAFETY: the same contract.
        metadata.exif = unsafe { self.exif.bytes("exif") }?.map(tiff_stream).transpose()?;
        // SAFETY: the same contract.
        metadata.xmp = unsafe { self.xmp.bytes("xmp") }?;
        // SAFETY: the same contract.
        let texts = unsafe { pointers::elements(self.texts, self.text_count, "texts") }?;
        for text in texts {
            // SAFETY: the same contract.
            let keyword = unsafe { string(text.keyword, "a keyword") }?;
            // SAFETY: the same contract.
            let text = unsafe { string(text.text, "a text") }?;
            metadata.texts.push(Text::new(keyword, text));
        }
        Ok(metadata)
    }
}

impl CCicp {
    fn of(cicp: Cicp) -> Self {
        Self { primaries: cicp.primaries, transfer: cicp.transfer }
    }
}

impl CMasteringDisplay {
    fn of(display: MasteringDisplay) -> Self {
        let MasteringDisplay { red, green, blue, white, max_luminance, min_luminance } = display;
        Self { red, green, blue, white, max_luminance, min_luminance }
    }

    fn display(self) -> MasteringDisplay {
        let Self { red, green, blue, white, max_luminance, min_luminance } = self;
        MasteringDisplay { red, green, blue, white, max_luminance, min_luminance }
    }
}

impl CContentLight {
    fn of(light: ContentLight) -> Self {
        let ContentLight { max_content, max_frame_average } = light;
        Self { max_content, max_frame_average }
    }

    fn light(self) -> ContentLight {
        let Self { max_content, max_frame_average } = self;
        ContentLight { max_content, max_frame_average }
    }
}

/// A text of a caller.
///
/// # Safety
/// If it is not null, there is a NUL at its end.
unsafe fn string(text: *const c_char, name: &str) -> Result<String, Failure> {
    if text.is_null() {
        return Err(Failure::argument(format!("{name} is null")));
    }
    // SAFETY: it is not null, and the caller warrants the rest.
    let text = unsafe { CStr::from_ptr(text) }.to_str();
    text.map(String::from).map_err(|_| Failure::argument(format!("{name} is not UTF-8")))
}

/// The TIFF stream of Exif data, without the prefix that it has in JPEG.
fn tiff_stream(mut exif: Vec<u8>) -> Result<Vec<u8>, Failure> {
    if exif.starts_with(b"Exif\0\0") {
        exif.drain(..6);
    }
    if exif.starts_with(b"II") || exif.starts_with(b"MM") {
        return Ok(exif);
    }
    Err(Failure::argument("exif must be a TIFF stream, which begins with II or MM"))
}
