"""Encodes and decodes pictures with established codecs, on request.

Prints the versions of the libraries, one per line and an empty line at the end. Then reads one
request per line, fields separated by tabs:

    codec, quality, threads (0: all), repeats of encoding, repeats of decoding, picture to encode,
    file for the decoded samples

The answer to a request is one line: the number of bytes of the file, the seconds to encode and the
seconds to decode it, separated by tabs. Times are from samples in memory to bytes in memory and
back, medians over the repeats. The answer to

    again, repeats of decoding

is the seconds to decode the last file, the median over the repeats.

The decoded samples are interleaved 8-bit RGB, as decoded by the binding that encoded the file. The
time to decode is that of the binding with the least overhead around the same decoder.
"""

import io
import os
import statistics
import sys
import time
from importlib.metadata import version

import av
import imagecodecs
import mozjpeg_lossless_optimization
import numpy
import pillow_heif
import pyjpegli
from PIL import AvifImagePlugin, Image, features


def through_pillow(name, options, quality_option="quality"):
    def encode(image, quality, threads):
        out = io.BytesIO()
        more = {"max_threads": threads} if name == "AVIF" else {}
        image.save(out, name, **{quality_option: quality}, **options, **more)
        return out.getvalue()

    def decode(data, threads):
        AvifImagePlugin.DEFAULT_MAX_THREADS = threads
        image = Image.open(io.BytesIO(data))
        image.load()
        return image

    return encode, decode


def jpeg_2000():
    encode_as, decode = through_pillow(
        "JPEG2000",
        {"irreversible": True, "mct": 1, "quality_mode": "rates"},
        "quality_layers",
    )

    def encode(image, bits_per_pixel, threads):
        # OpenJPEG takes the ratio to the samples' 24 bits.
        return encode_as(image, [24 / bits_per_pixel], threads)

    return encode, decode


def jpegli():
    def encode(image, quality, threads):
        data = pyjpegli.encode(image.tobytes(), image.width, image.height, quality)
        # The binding writes sequential files; progressive ones of the same samples are smaller.
        return mozjpeg_lossless_optimization.optimize(data)

    _, decode = through_pillow("JPEG", {})
    return encode, decode


def jpeg_xl(effort):
    def encode(image, distance, threads):
        samples = numpy.asarray(image)
        return imagecodecs.jpegxl_encode(
            samples, distance=distance, effort=effort, numthreads=threads
        )

    def decode(data, threads):
        return imagecodecs.jpegxl_decode(data, numthreads=threads)

    return encode, decode


def heic():
    def encode(image, quality, threads):
        out = io.BytesIO()
        # The slowest preset that libheif has; it tunes x265 for SSIM.
        more = {"preset": "veryslow", "x265:pools": str(threads)}
        pillow_heif.from_pillow(image).save(out, quality=quality, chroma=420, enc_params=more)
        return out.getvalue()

    def decode(data, threads):
        return pillow_heif.open_heif(data, convert_hdr_to_8bit=True).to_pillow()

    return encode, decode


def svt_av1():
    def encode(image, quality, threads):
        out = io.BytesIO()
        # From the constant quality factor 63 to 1.
        more = {"crf": str(63 - round(quality * 0.62)), "preset": "4"}
        more["svtav1-params"] = f"avif=1:tune=3:lp={threads}"
        with av.open(out, "w", format="avif") as file:
            stream = file.add_stream("libsvtav1", rate=1, options=more)
            stream.width, stream.height, stream.pix_fmt = *image.size, "yuv420p10le"
            # Full range, and the matrix of BT.601 as AVIF has it by default.
            stream.codec_context.color_range = av.video.reformatter.ColorRange.JPEG
            stream.codec_context.colorspace = 6
            frame = av.VideoFrame.from_ndarray(numpy.asarray(image), format="rgb24").reformat(
                format="yuv420p10le",
                dst_colorspace=av.video.reformatter.Colorspace.ITU601,
                dst_color_range=av.video.reformatter.ColorRange.JPEG,
            )
            for packet in stream.encode(frame) + stream.encode():
                file.mux(packet)
        return out.getvalue()

    _, decode = through_pillow("AVIF", {})
    return encode, lambda data, threads: decode(data, threads).convert("RGB")


AVIF = {"speed": 6, "subsampling": "4:2:0"}
# Speed 0 takes more than three times as long for files that are hardly smaller.
BEST_AVIF = {"speed": 2, "subsampling": "4:4:4"}
SSIMULACRA2 = {"advanced": {"tune": "ssimulacra2"}}
CODECS = {
    "jpeg420prog": through_pillow(
        "JPEG", {"subsampling": "4:2:0", "optimize": True, "progressive": True}
    ),
    "jpeg420": through_pillow("JPEG", {"subsampling": "4:2:0", "optimize": True}),
    "jpegli": jpegli(),
    "jp2": jpeg_2000(),
    "webp_m6": through_pillow("WEBP", {"method": 6}),
    "avif420_s6": through_pillow("AVIF", AVIF),
    "avif420_s6_psnr": through_pillow("AVIF", AVIF | {"advanced": {"tune": "psnr"}}),
    "avif420_s6_ssim2": through_pillow("AVIF", AVIF | SSIMULACRA2),
    "avif444_s2": through_pillow("AVIF", BEST_AVIF),
    "avif444_s2_ssim2": through_pillow("AVIF", BEST_AVIF | SSIMULACRA2),
    "avif444_s0": through_pillow("AVIF", {"speed": 0, "subsampling": "4:4:4"}),
    "jxl_e7": jpeg_xl(7),
    "jxl_e9": jpeg_xl(9),
    "heic": heic(),
    "avif_svt": svt_av1(),
}

# These decode into an array of RGB that is allocated beforehand. Pillow has more overhead: its WebP
# plugin, for example, takes twice as long.
DECODERS = {
    "jpeg420prog": lambda data, out, threads: imagecodecs.jpeg8_decode(data, out=out),
    "jpeg420": lambda data, out, threads: imagecodecs.jpeg8_decode(data, out=out),
    "jpegli": lambda data, out, threads: imagecodecs.jpeg8_decode(data, out=out),
    "jp2": lambda data, out, threads: imagecodecs.jpeg2k_decode(
        data, out=out, numthreads=threads
    ),
    "webp_m6": lambda data, out, threads: imagecodecs.webp_decode(data, out=out),
    "avif420_s6": lambda data, out, threads: imagecodecs.avif_decode(
        data, out=out, numthreads=threads
    ),
    "jxl_e7": lambda data, out, threads: imagecodecs.jpegxl_decode(
        data, out=out, numthreads=threads
    ),
}
DECODERS |= {codec: DECODERS["avif420_s6"] for codec in CODECS if codec.startswith("avif")}
DECODERS["jxl_e9"] = DECODERS["jxl_e7"]



def by_its_binding(codec):
    return lambda data, out, threads: numpy.asarray(CODECS[codec][1](data, threads))


DECODERS |= {codec: by_its_binding(codec) for codec in ("avif_svt", "heic")}


def timed(repeats, work, *arguments):
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = work(*arguments)
        seconds.append(time.perf_counter() - start)
    return result, statistics.median(seconds)


def answer(codec, quality, threads, encodings, decodings, source, decoded):
    encode, decode = CODECS[codec]
    image = Image.open(source).convert("RGB")
    quality = float(quality)
    if codec not in ("jp2", "jxl_e7", "jxl_e9"):
        quality = int(quality)
    threads = int(threads) or len(os.sched_getaffinity(0))
    data, encode_seconds = timed(int(encodings), encode, image, quality, threads)
    samples = numpy.asarray(decode(data, threads))
    out = numpy.empty_like(samples)
    again = DECODERS[codec], data, out, threads
    result, decode_seconds = timed(int(decodings), *again)
    # Another version of the library may round differently, but must decode the same picture.
    if result.shape != samples.shape or abs(result.astype(int) - samples).mean() > 1:
        raise ValueError(f"two decoders of {codec} disagree")
    with open(decoded, "wb") as file:
        file.write(samples.tobytes())
    return (len(data), encode_seconds, decode_seconds), again


def versions():
    yield f"Pillow {Image.__version__}"
    yield f"libjpeg-turbo {features.version('libjpeg_turbo')}"
    yield f"jpegli of pyjpegli {pyjpegli.__version__}"
    yield f"mozjpeg-lossless-optimization {version('mozjpeg-lossless-optimization')}"
    yield f"OpenJPEG {features.version('jpg_2000')}"
    yield f"libwebp {features.version('webp')}"
    yield f"libavif {features.version('avif')} ({AvifImagePlugin.get_codec_version('aom')})"
    yield f"SVT-AV1 of PyAV {av.__version__}"
    yield f"imagecodecs {imagecodecs.__version__}"
    yield f"libheif {pillow_heif.libheif_version()} ({pillow_heif.libheif_info()['HEIF']})"
    yield f"libjxl {imagecodecs.jpegxl_version().split()[-1]}"


def main():
    for version in versions():
        print(version)
    print(flush=True)
    again = None
    for request in sys.stdin:
        fields = request.rstrip("\n").split("\t")
        if fields[0] == "again":
            numbers = (timed(int(fields[1]), *again)[1],)
        else:
            numbers, again = answer(*fields)
        print(*numbers, sep="\t", flush=True)


if __name__ == "__main__":
    main()
