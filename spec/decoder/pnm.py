"""Writes samples as PGM, PPM or PAM."""

TUPLE_TYPES = {1: "GRAYSCALE", 2: "GRAYSCALE_ALPHA", 3: "RGB", 4: "RGB_ALPHA"}


def sample_bytes(samples, depth):
    """Interleaved samples, rows from the top; 16 bits with the more significant byte first."""
    return samples.astype(">u2" if depth == 16 else "u1").tobytes()


def file_bytes(samples, depth, name):
    """A PAM if the name ends in .pam or there is alpha, else a PGM or PPM. samples: (height, width, channels)."""
    height, width, channels = samples.shape
    most = 2**depth - 1
    if name.endswith(".pam") or channels in (2, 4):
        head = (f"P7\nWIDTH {width}\nHEIGHT {height}\nDEPTH {channels}\nMAXVAL {most}\n"
                f"TUPLTYPE {TUPLE_TYPES[channels]}\nENDHDR\n")
    else:
        head = f"P{5 if channels == 1 else 6}\n{width} {height}\n{most}\n"
    return head.encode() + sample_bytes(samples, depth)
