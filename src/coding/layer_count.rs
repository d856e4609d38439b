//! How many Gaussians a layer has: each begins with its number but the last, which has the rest of those that the
//! header declares (spec, section 5.4).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

use crate::chunk::ChunkType;
use crate::container::varint;
use crate::error::DecodeError;

/// What is known of the number of Gaussians in a layer before it arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LayerCount {
    /// The layer is the last one: it has this many.
    Rest(u32),
    /// The layer begins with its number, which is at most this.
    AtMost(u32),
}

impl LayerCount {
    /// Of a layer after which there are `later` layers with a Gaussian each at least, where this many Gaussians are
    /// left for all of them.
    pub(crate) fn new(left: u32, later: usize) -> Self {
        match later {
            0 => Self::Rest(left),
            _ => Self::AtMost(left.saturating_sub(later as u32)),
        }
    }

    /// The bytes of the number with which a layer begins.
    #[cfg(feature = "encode")]
    pub(crate) fn written(count: u32, is_last: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        if !is_last {
            varint::write(count, &mut bytes);
        }
        bytes
    }

    /// Takes the bytes of the number from a payload that has arrived as a whole.
    pub(crate) fn take(self, payload: &mut &[u8]) -> Result<u32, DecodeError> {
        let count = self.read(&mut varint::Arriving::default(), payload)?;
        count.ok_or_else(|| {
            DecodeError::malformed(ChunkType::LAYER, "too short for a number of Gaussians")
        })
    }

    /// Takes the bytes of the number from `input`, if there are any. `None` until all of them have arrived.
    pub(crate) fn read(
        self,
        arriving: &mut varint::Arriving,
        input: &mut &[u8],
    ) -> Result<Option<u32>, DecodeError> {
        let malformed = |reason| DecodeError::malformed(ChunkType::LAYER, reason);
        let most = match self {
            Self::Rest(count) => return Ok(Some(count)),
            Self::AtMost(most) => most,
        };
        match arriving.read(input).map_err(|flaw| malformed(flaw.reason()))? {
            Some(0) => Err(malformed("no Gaussians")),
            Some(count) if count > most => {
                Err(malformed("more Gaussians than the header declares"))
            }
            count => Ok(count),
        }
    }
}
