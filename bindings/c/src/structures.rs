//! Structures that begin with their size, so that later versions of the header can add fields at their end.

use core::mem::MaybeUninit;
use core::{ptr, slice};

use crate::status::Failure;

/// Most bytes of a structure, of any version: a larger size was never set.
const MOST: usize = 4096;

/// A structure of the header.
///
/// # Safety
/// It is `repr(C)`, its first field is a `usize`, and it may have any bytes.
pub(crate) unsafe trait Structure: Copy {
    /// Its bytes in the first version of the header that had it.
    const LEAST: usize;
    /// Its name in the header.
    const NAME: &'static str;
}

/// Declares that a type is a [`Structure`], with its name and the last field of its first version.
macro_rules! structure {
    ($type:ty, $name:literal, $last:ident: $last_type:ty) => {
        // SAFETY: every use of this macro stands below a `repr(C)` structure of numbers, pointers and
        // arrays of them that begins with `struct_size`.
        unsafe impl $crate::structures::Structure for $type {
            const LEAST: usize = core::mem::offset_of!($type, $last) + size_of::<$last_type>();
            const NAME: &'static str = $name;
        }
    };
}
pub(crate) use structure;

/// The size that a caller has set, in bytes.
///
/// # Safety
/// `structure` is null, or points to a structure whose size is set.
unsafe fn size_of_callers<T: Structure>(structure: *const T) -> Result<usize, Failure> {
    let name = T::NAME;
    if structure.is_null() || !structure.is_aligned() {
        return Err(Failure::argument(format!("the pointer to a {name} is null or not aligned")));
    }
    // SAFETY: it is the first field, and aligned as the structure is.
    let size = unsafe { structure.cast::<usize>().read() };
    if !(T::LEAST..=MOST).contains(&size) {
        return Err(Failure::argument(format!("struct_size {size} of a {name} was not set")));
    }
    Ok(size)
}

/// Reads a structure. Fields that the caller's version lacks are 0.
///
/// # Safety
/// `from` is null, or points to a structure of as many bytes as its first field says, all of them set.
pub(crate) unsafe fn read<T: Structure>(from: *const T) -> Result<T, Failure> {
    // SAFETY: the same contract.
    let size = unsafe { size_of_callers(from) }?;
    let mut structure = MaybeUninit::<T>::zeroed();
    let (known, bytes) = (size.min(size_of::<T>()), from.cast::<u8>());
    // SAFETY: so many bytes are in both.
    unsafe { ptr::copy_nonoverlapping(bytes, structure.as_mut_ptr().cast::<u8>(), known) };
    // SAFETY: it is inside of the caller's structure, or its end.
    let rest = unsafe { bytes.add(known) };
    // SAFETY: so many bytes are left there.
    let rest = unsafe { slice::from_raw_parts(rest, size - known) };
    if rest.iter().any(|&byte| byte != 0) {
        let message = format!("a {} has a field that this library does not know", T::NAME);
        return Err(Failure::argument(message));
    }
    // SAFETY: all bytes are set, and the trait says that any will do.
    Ok(unsafe { structure.assume_init() })
}

/// As [`read`], where null stands for a structure whose fields are 0.
///
/// # Safety
/// As of [`read`].
pub(crate) unsafe fn read_or_default<T: Structure>(from: *const T) -> Result<T, Failure> {
    if from.is_null() {
        // SAFETY: the trait says that any bytes will do.
        return Ok(unsafe { MaybeUninit::zeroed().assume_init() });
    }
    // SAFETY: the same contract.
    unsafe { read(from) }
}

/// Refuses a structure that [`write`] would refuse, before there is anything to write.
///
/// # Safety
/// As of [`write`].
pub(crate) unsafe fn check<T: Structure>(to: *const T) -> Result<(), Failure> {
    // SAFETY: the same contract.
    unsafe { size_of_callers(to) }.map(drop)
}

/// Fills the caller's structure. Its size remains; fields that this library does not know become 0.
///
/// # Safety
/// `to` is null, or points to a structure of as many bytes as its first field says, which nobody else uses.
pub(crate) unsafe fn write<T: Structure>(to: *mut T, structure: T) -> Result<(), Failure> {
    // SAFETY: the same contract.
    let size = unsafe { size_of_callers(to) }?;
    let (known, bytes) = (size.min(size_of::<T>()), to.cast::<u8>());
    let from = ptr::from_ref(&structure).cast::<u8>();
    // SAFETY: so many bytes are in both.
    unsafe { ptr::copy_nonoverlapping(from, bytes, known) };
    // SAFETY: it is inside of the caller's structure, or its end.
    let rest = unsafe { bytes.add(known) };
    // SAFETY: so many bytes are left there.
    unsafe { ptr::write_bytes(rest, 0, size - known) };
    // SAFETY: it is the first field.
    unsafe { to.cast::<usize>().write(size) };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::Status;

    #[derive(Clone, Copy)]
    #[repr(C)]
    struct Sample {
        struct_size: usize,
        first: u32,
        added: u32,
    }

    structure!(Sample, "sample", first: u32);

    /// What a caller has whose header is newer, or older.
    #[repr(C)]
    struct Larger(Sample, [u32; 2]);

    fn sample(struct_size: usize) -> Sample {
        Sample { struct_size, first: 1, added: 2 }
    }

    fn read_larger(larger: &Larger) -> Result<Sample, Failure> {
        // SAFETY: it has at least as many bytes as the sizes below.
        unsafe { read(ptr::from_ref(larger).cast::<Sample>()) }
    }

    #[test]
    fn structures_may_be_of_other_versions() {
        let word = size_of::<usize>();
        let of = |size, rest| read_larger(&Larger(sample(size), rest));
        let fields = |sample: Sample| (sample.first, sample.added);
        assert_eq!(of(word + 8, [5, 5]).map(fields).ok(), Some((1, 2)));
        assert_eq!(of(word + 4, [5, 5]).map(fields).ok(), Some((1, 0)));
        assert_eq!(of(word + 16, [0, 0]).map(fields).ok(), Some((1, 2)));
        for (size, rest) in [(word + 16, [0, 5]), (word, [0, 0]), (0, [0, 0]), (usize::MAX, [0, 0])]
        {
            let status = of(size, rest).map(fields).map_err(|failure| failure.status);
            assert_eq!(status, Err(Status::Argument), "{size}");
        }
    }

    #[test]
    fn results_fill_as_much_as_the_caller_knows() {
        let word = size_of::<usize>();
        for (size, expected) in
            [(word + 4, (1, 7, [7, 7])), (word + 8, (1, 2, [7, 7])), (word + 12, (1, 2, [0, 7]))]
        {
            let mut larger = Larger(Sample { struct_size: size, first: 7, added: 7 }, [7, 7]);
            // SAFETY: it has at least so many bytes.
            let written = unsafe { write(ptr::from_mut(&mut larger).cast(), sample(0)) };
            assert!(written.is_ok());
            let Larger(sample, rest) = larger;
            assert_eq!((sample.first, sample.added, rest), expected);
            assert_eq!(sample.struct_size, size);
        }
    }

    #[test]
    fn null_is_refused_where_nothing_is_no_default() {
        // SAFETY: null is refused.
        assert!(unsafe { read(ptr::null::<Sample>()) }.is_err());
        // SAFETY: null is refused.
        assert!(unsafe { write(ptr::null_mut(), sample(0)) }.is_err());
        // SAFETY: null is allowed.
        let default = unsafe { read_or_default(ptr::null::<Sample>()) };
        assert_eq!(default.map(|sample| sample.first).ok(), Some(0));
    }
}
