//! PendingLayers of the entropy coding that wait to be decoded: none needs another one (spec, section 7.3), so that
//! threads can take them side by side.

use alloc::vec::Vec;
use core::cmp::Reverse;

use crate::coding::entropy::{AttributeBits, LAYER_PREFIX, Lattice, LayerCoder};
use crate::color::ColorModel;
use crate::container::Header;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::layers::bounds::LayerBounds;
use crate::threads::{self, Threads};

/// Bytes that a layer takes beside its payload: its entries in lists, and what came of it.
const BY_LAYER: u64 = size_of::<(PendingLayer, [usize; 5], Result<(), DecodeError>)>() as u64;

/// PendingLayers that have arrived, in file order.
#[derive(Debug, Default)]
pub(crate) struct PendingLayers {
    layers: Vec<PendingLayer>,
    count: usize,
    memory: u64,
}

#[derive(Debug)]
struct PendingLayer {
    /// How many Gaussians it has.
    count: usize,
    payload: Vec<u8>,
    /// Where they show, if the file says so.
    bounds: Option<LayerBounds>,
}

impl PendingLayer {
    /// Decodes the Gaussians into as many places.
    fn read(
        &self,
        coding: &LayerCoder<'_>,
        model: ColorModel,
        statistics: Option<&mut AttributeBits>,
        places: &mut [Gaussian],
    ) -> Result<(), DecodeError> {
        let mut places = places.iter_mut();
        coding.read(self.count, &self.payload[LAYER_PREFIX..], statistics, |code, shape| {
            if let Some(place) = places.next() {
                *place = coding.lattice.gaussian(&code, shape, &coding.grid, model);
            }
        })
    }
}

impl PendingLayers {
    /// Adds a layer that has at most `allowed` Gaussians.
    pub(crate) fn push(
        &mut self,
        payload: Vec<u8>,
        bounds: Option<LayerBounds>,
        allowed: u32,
    ) -> Result<(), DecodeError> {
        let (count, _) = LayerCoder::counted(&payload, allowed)?;
        self.count += count;
        self.memory += payload.len() as u64 + BY_LAYER;
        self.layers.push(PendingLayer { count, payload, bounds });
        Ok(())
    }

    /// How many Gaussians there are in all layers.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Bytes that all layers take.
    pub(crate) fn memory(&self) -> u64 {
        self.memory
    }

    /// Those of the layers whose bounds are wanted.
    pub(crate) fn select(
        &self,
        wanted: impl Fn(Option<LayerBounds>) -> bool,
    ) -> SelectedLayers<'_> {
        let mut layers = Vec::with_capacity(self.layers.len());
        layers.extend(self.layers.iter().filter(|layer| wanted(layer.bounds)));
        let count = layers.iter().map(|layer: &&PendingLayer| layer.count).sum();
        SelectedLayers { layers, count }
    }
}

/// PendingLayers that are to be decoded, in file order.
#[derive(Debug)]
pub(crate) struct SelectedLayers<'a> {
    layers: Vec<&'a PendingLayer>,
    count: usize,
}

impl SelectedLayers<'_> {
    /// How many Gaussians there are in all of them.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Adds the Gaussians of the layers to others, those before the first layer that is not sound,
    /// or also adds to an statistics on the
    /// way, one after the other.
    ///
    /// # Errors
    /// What is wrong with that layer.
    pub(crate) fn decode(
        self,
        header: &Header,
        lattice: &Lattice,
        statistics: Option<&mut AttributeBits>,
        threads: Threads,
        gaussians: &mut Vec<Gaussian>,
    ) -> Result<(), DecodeError> {
        let mut sound = gaussians.len();
        gaussians.resize(sound + self.count, Gaussian::NOTHING);
        let mut places = &mut gaussians[sound..];
        let coding = LayerCoder::new(lattice, header);
        let mut outcomes: Vec<_> = self.layers.iter().map(|_| Ok(())).collect();
        let mut work = Vec::with_capacity(self.layers.len());
        for (&layer, outcome) in self.layers.iter().zip(&mut outcomes) {
            let (own, rest) = core::mem::take(&mut places).split_at_mut(layer.count);
            places = rest;
            work.push((layer, own, outcome));
        }
        if let Some(statistics) = statistics {
            for (layer, places, outcome) in work {
                *outcome = layer.read(&coding, header.color, Some(statistics), places);
            }
        } else {
            // The largest first, so that none of them is what all wait for in the end.
            work.sort_by_key(|(layer, ..)| Reverse(layer.count));
            threads::for_each(threads, work, |(): &mut (), (layer, places, outcome)| {
                *outcome = layer.read(&coding, header.color, None, places);
            });
        }
        for (layer, outcome) in self.layers.iter().zip(outcomes) {
            if outcome.is_err() {
                gaussians.truncate(sound);
                return outcome;
            }
            sound += layer.count;
        }
        Ok(())
    }
}
