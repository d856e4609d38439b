//! Codes to a file (spec, sections 4 to 7).

use crate::coding::fixed;
use crate::container::{ChunkType, Header, Metadata, SIGNATURE, write_chunk};
use crate::quantizer::Quantizer;

/// The whole file. `layers` holds the codes of each layer, one per component and Gaussian, in
/// file order; it agrees with the counts of `header`.
pub(crate) fn write(
    header: &Header,
    metadata: &Metadata,
    quantizers: &[Quantizer],
    layers: &[&[u32]],
) -> Vec<u8> {
    debug_assert_eq!(usize::from(header.layers), layers.len(), "the header counts the layers");
    let mut file = SIGNATURE.to_vec();
    write_chunk(&mut file, ChunkType::GHDR, &header.to_payload());
    let entries: Vec<u8> = quantizers.iter().flat_map(|q| q.to_entry()).collect();
    write_chunk(&mut file, ChunkType::QNTZ, &entries);
    for (kind, payload) in metadata.chunks() {
        write_chunk(&mut file, kind, &payload);
    }
    for codes in layers {
        write_chunk(&mut file, ChunkType::GAUS, &fixed::write_layer(codes, quantizers));
    }
    write_chunk(&mut file, ChunkType::GEND, &[]);
    file
}
