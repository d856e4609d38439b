//! What is used of JavaScript's own types. A crate that has all of them would add 2 kB to what a page loads.

use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    #[derive(Debug)]
    pub(crate) type Object;
    #[wasm_bindgen(constructor)]
    pub(crate) fn new() -> Object;
    #[wasm_bindgen(method, structural, indexing_setter)]
    pub(crate) fn set(this: &Object, name: &str, value: JsValue);

    #[derive(Debug)]
    pub(crate) type Array;
    #[wasm_bindgen(constructor)]
    pub(crate) fn new() -> Array;
    #[wasm_bindgen(method)]
    pub(crate) fn push(this: &Array, value: JsValue);

    #[derive(Debug)]
    pub(crate) type Uint8Array;
    /// With a copy of these bytes.
    #[wasm_bindgen(constructor)]
    pub(crate) fn new(bytes: &[u8]) -> Uint8Array;

    #[derive(Debug)]
    pub(crate) type Float64Array;
    /// With a copy of these numbers.
    #[wasm_bindgen(constructor)]
    pub(crate) fn new(numbers: &[f64]) -> Float64Array;

    #[derive(Debug)]
    pub(crate) type Uint8ClampedArray;
    #[wasm_bindgen(constructor)]
    pub(crate) fn new(length: u32) -> Uint8ClampedArray;
    /// Copies samples to a place in it.
    #[wasm_bindgen(method)]
    pub(crate) fn set(this: &Uint8ClampedArray, samples: &[u8], at: u32);

    #[derive(Debug)]
    pub(crate) type Uint16Array;
    #[wasm_bindgen(constructor)]
    pub(crate) fn new(length: u32) -> Uint16Array;
    /// Copies samples to a place in it.
    #[wasm_bindgen(method)]
    pub(crate) fn set(this: &Uint16Array, samples: &[u16], at: u32);
}

impl FromIterator<JsValue> for Array {
    fn from_iter<I: IntoIterator<Item = JsValue>>(values: I) -> Self {
        let array = Self::new();
        values.into_iter().for_each(|value| array.push(value));
        array
    }
}
