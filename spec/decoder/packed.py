"""The packed coding: a layer's codes and their values (sections 6, 7.1 and 7.2)."""

import numpy as np

from .arith import F, exp
from .errors import Malformed
from .header import FLOAT, LINEAR

AT_ONCE = 4096  # Gaussians; a multiple of 8, so that each portion begins on a byte boundary


def layer_bytes(quantizers, count):
    """Section 7.2: the length in bytes of a layer of `count` Gaussians."""
    return (count * bits_of_gaussian(quantizers) + 7) // 8


def bits_of_gaussian(quantizers):
    return sum(q.depth for q in quantizers)


def values_of(quantizer, codes):
    """Section 6: the values of codes; codes: integers, any shape; binary32 of the same shape."""
    if quantizer.kind == FLOAT:
        values = codes.astype(np.uint32).view(F)
        if not np.isfinite(values).all():
            raise Malformed("a float that is infinite or NaN")
        return values
    logarithm_or_value = codes.astype(F) * quantizer.scale + quantizer.offset
    return logarithm_or_value if quantizer.kind == LINEAR else exp(logarithm_or_value)


def decode_portion(quantizers, stream, count):
    """The components of `count` Gaussians at the beginning of the bytes `stream`: binary32, (count, components)."""
    width = bits_of_gaussian(quantizers)
    # Section 7.1: bit k of the stream is bit (k mod 8) of byte (k div 8).
    bits = np.unpackbits(np.frombuffer(stream, dtype=np.uint8), bitorder="little")
    bits = bits[: count * width].reshape(count, width).astype(np.uint64)
    components, at = [], 0
    for quantizer in quantizers:
        weights = np.uint64(1) << np.arange(quantizer.depth, dtype=np.uint64)
        codes = (bits[:, at : at + quantizer.depth] * weights).sum(axis=1, dtype=np.uint64)
        components.append(values_of(quantizer, codes))
        at += quantizer.depth
    return np.stack(components, axis=1)


def decode_gaussians(quantizers, stream, count):
    """The components of the first `count` Gaussians: binary32, shape (count, components)."""
    width = bits_of_gaussian(quantizers)
    portions = [np.zeros((0, len(quantizers)), dtype=F)]
    for first in range(0, count, AT_ONCE):
        last = min(first + AT_ONCE, count)
        portion = stream[first * width // 8 : (last * width + 7) // 8]
        portions.append(decode_portion(quantizers, portion, last - first))
    return np.concatenate(portions)


def check_started(quantizers, stream, done):
    """Section 11: a value that is infinite or NaN counts as soon as its bytes are there.

    Checks those values of Gaussian `done` (from 0) that the cut off `stream` has as a whole.
    """
    at = done * bits_of_gaussian(quantizers)
    for quantizer in quantizers:
        if at + quantizer.depth > 8 * len(stream):
            return
        bits = int.from_bytes(stream[at // 8 : (at + quantizer.depth + 7) // 8], "little") >> at % 8
        values_of(quantizer, np.array([bits % 2**quantizer.depth], dtype=np.uint64))
        at += quantizer.depth


def check_padding(quantizers, stream, count):
    """Section 7.2: the bits behind the last Gaussian are zero. The stream has the right length."""
    used = count * bits_of_gaussian(quantizers) % 8
    if used and stream[-1] >> used:
        raise Malformed("a padding bit that is not zero")
