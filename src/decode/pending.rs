//! Layers of the entropy coding that have arrived and are not decoded yet. They do not depend on
//! each other, so that they can be decoded in parallel, and those that a region does not need can
//! be skipped (spec, sections 5.6 and 7.3).

use alloc::vec::Vec;

use crate::chunk::ChunkType;
use crate::coding::entropy::{AttributeBits, LayerCoder, Quantization};
use crate::coding::layer_count::LayerCount;
use crate::color::ColorModel;
use crate::container::{Header, varint};
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::threads::{self, Threads};

/// Bytes that a layer takes besides its payload: its entries in lists, and its result.
const BYTES_PER_LAYER: u64 =
    size_of::<(PendingLayer, [usize; 5], Result<(), DecodeError>)>() as u64;

/// The layers that are not decoded yet, in file order.
#[derive(Debug, Default)]
pub(crate) struct PendingLayers {
    layers: Vec<PendingLayer>,
    count: usize,
    memory: u64,
}

#[derive(Debug)]
struct PendingLayer {
    /// The number of its Gaussians.
    count: usize,
    payload: Vec<u8>,
    /// Where the coded Gaussians begin in the payload.
    start: usize,
    /// The number of layers before it.
    number: usize,
}

impl PendingLayer {
    /// Decodes the Gaussians into `out`, which has as many elements.
    fn decode(
        &self,
        coder: &LayerCoder<'_>,
        model: ColorModel,
        statistics: Option<&mut AttributeBits>,
        out: &mut [Gaussian],
    ) -> Result<(), DecodeError> {
        coder.read_gaussians(&self.payload[self.start..], statistics, model, out)
    }
}

impl PendingLayers {
    /// Adds a layer, before which there are `number` layers in the file. Returns how many Gaussians it has.
    pub(crate) fn push(
        &mut self,
        payload: Vec<u8>,
        declared: LayerCount,
        number: usize,
    ) -> Result<u32, DecodeError> {
        let mut bytes = &payload[..];
        let Some(count) = declared.read(&mut varint::Arriving::default(), &mut bytes)? else {
            let reason = "too short for a number of Gaussians";
            return Err(DecodeError::malformed(ChunkType::LAYER, reason));
        };
        LayerCoder::check_count(count, bytes)?;
        let start = payload.len() - bytes.len();
        self.count += count as usize;
        self.memory += payload.len() as u64 + BYTES_PER_LAYER;
        self.layers.push(PendingLayer { count: count as usize, payload, start, number });
        Ok(count)
    }

    /// The number of Gaussians in all layers.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The memory of all layers, in bytes.
    pub(crate) fn memory(&self) -> u64 {
        self.memory
    }

    /// The layers whose numbers fulfil a condition.
    pub(crate) fn select(&self, condition: impl Fn(usize) -> bool) -> SelectedLayers<'_> {
        let mut layers = Vec::with_capacity(self.layers.len());
        layers.extend(self.layers.iter().filter(|layer| condition(layer.number)));
        let count = layers.iter().map(|layer: &&PendingLayer| layer.count).sum();
        SelectedLayers { layers, count }
    }
}

/// Layers to decode, in file order.
#[derive(Debug)]
pub(crate) struct SelectedLayers<'a> {
    layers: Vec<&'a PendingLayer>,
    count: usize,
}

impl SelectedLayers<'_> {
    /// The number of Gaussians in all of them.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Decodes the layers and appends their Gaussians to `gaussians`, in file order. If a layer is
    /// malformed, only the Gaussians of the layers before it are appended.
    ///
    /// The layers are shared among threads, unless `statistics` are given: then one is decoded
    /// after the other, and its bits are added to the statistics.
    ///
    /// # Errors
    /// When a layer is malformed: the error of the first one.
    pub(crate) fn decode(
        self,
        header: &Header,
        quantization: &Quantization,
        statistics: Option<&mut AttributeBits>,
        threads: Threads,
        gaussians: &mut Vec<Gaussian>,
    ) -> Result<(), DecodeError> {
        let mut valid = gaussians.len();
        gaussians.resize(valid + self.count, Gaussian::NOTHING);
        let mut free = &mut gaussians[valid..];
        let coder = header.layer_coder(quantization);
        let mut results: Vec<_> = self.layers.iter().map(|_| Ok(())).collect();
        let mut work = Vec::with_capacity(self.layers.len());
        for (&layer, result) in self.layers.iter().zip(&mut results) {
            let (out, rest) = core::mem::take(&mut free).split_at_mut(layer.count);
            free = rest;
            work.push((layer, out, result));
        }
        if let Some(statistics) = statistics {
            for (layer, out, result) in work {
                *result = layer.decode(&coder, header.color, Some(statistics), out);
            }
        } else {
            let cost = |(layer, ..): &(&PendingLayer, _, _)| layer.count;
            threads::for_each_by_cost(threads, work, cost, |(): &mut (), (layer, out, result)| {
                *result = layer.decode(&coder, header.color, None, out);
            });
        }
        for (layer, result) in self.layers.iter().zip(results) {
            if result.is_err() {
                gaussians.truncate(valid);
                return result;
            }
            valid += layer.count;
        }
        Ok(())
    }
}
