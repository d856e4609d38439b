//! Layers of coding 1 that wait to be decoded: none needs another one (spec, section 7.3), so that
//! threads can take them side by side.

use alloc::vec::Vec;
use core::cmp::Reverse;

use super::account::AttributeBits;
use super::set::{LAYER_PREFIX, SetCoding};
use crate::bounds::Bounds;
use crate::color::ColorModel;
use crate::container::Header;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::lattice::Lattice;
use crate::threads;

/// Bytes that a layer takes beside its payload: its entries in lists, and what came of it.
const BY_LAYER: u64 = size_of::<(Layer, [usize; 5], Result<(), DecodeError>)>() as u64;

/// Layers that have arrived, in file order.
#[derive(Debug, Default)]
pub(crate) struct Layers {
    layers: Vec<Layer>,
    count: usize,
    memory: u64,
}

#[derive(Debug)]
struct Layer {
    /// How many Gaussians it has.
    count: usize,
    payload: Vec<u8>,
    /// Where they show, if the file says so.
    bounds: Option<Bounds>,
}

impl Layer {
    /// Decodes the Gaussians into as many places.
    fn read(
        &self,
        coding: &SetCoding<'_>,
        model: ColorModel,
        account: Option<&mut AttributeBits>,
        places: &mut [Gaussian],
    ) -> Result<(), DecodeError> {
        let mut places = places.iter_mut();
        coding.read(self.count, &self.payload[LAYER_PREFIX..], account, |code, shape| {
            if let Some(place) = places.next() {
                *place = coding.lattice.gaussian(&code, shape, &coding.grid, model);
            }
        })
    }
}

impl Layers {
    /// Adds a layer that has at most `allowed` Gaussians.
    pub(crate) fn push(
        &mut self,
        payload: Vec<u8>,
        bounds: Option<Bounds>,
        allowed: u32,
    ) -> Result<(), DecodeError> {
        let (count, _) = SetCoding::counted(&payload, allowed)?;
        self.count += count;
        self.memory += payload.len() as u64 + BY_LAYER;
        self.layers.push(Layer { count, payload, bounds });
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
    pub(crate) fn select(&self, wanted: impl Fn(Option<Bounds>) -> bool) -> Selected<'_> {
        let mut layers = Vec::with_capacity(self.layers.len());
        layers.extend(self.layers.iter().filter(|layer| wanted(layer.bounds)));
        let count = layers.iter().map(|layer: &&Layer| layer.count).sum();
        Selected { layers, count }
    }
}

/// Layers that are to be decoded, in file order.
#[derive(Debug)]
pub(crate) struct Selected<'a> {
    layers: Vec<&'a Layer>,
    count: usize,
}

impl Selected<'_> {
    /// How many Gaussians there are in all of them.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Adds the Gaussians of the layers to others, those before the first layer that is not sound,
    /// or also adds to an account on the
    /// way, one after the other.
    ///
    /// # Errors
    /// What is wrong with that layer.
    pub(crate) fn decode(
        self,
        header: &Header,
        lattice: &Lattice,
        account: Option<&mut AttributeBits>,
        parallel: bool,
        gaussians: &mut Vec<Gaussian>,
    ) -> Result<(), DecodeError> {
        let mut sound = gaussians.len();
        threads::extend(parallel, gaussians, Gaussian::NOTHING, self.count);
        let mut places = &mut gaussians[sound..];
        let coding = SetCoding::new(lattice, header);
        let mut outcomes: Vec<_> = self.layers.iter().map(|_| Ok(())).collect();
        let mut work = Vec::with_capacity(self.layers.len());
        for (&layer, outcome) in self.layers.iter().zip(&mut outcomes) {
            let (own, rest) = core::mem::take(&mut places).split_at_mut(layer.count);
            places = rest;
            work.push((layer, own, outcome));
        }
        if let Some(account) = account {
            for (layer, places, outcome) in work {
                *outcome = layer.read(&coding, header.color, Some(account), places);
            }
        } else {
            // The largest first, so that none of them is what all wait for in the end.
            work.sort_by_key(|(layer, ..)| Reverse(layer.count));
            threads::for_each(parallel, work, |(): &mut (), (layer, places, outcome)| {
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
