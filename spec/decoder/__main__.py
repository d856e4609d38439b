"""python -m decoder FILE OUT: renders a .gip file; OUT is a PGM, PPM or PAM."""

import argparse
import sys
from pathlib import Path

from .decode import decode
from .errors import LimitExceeded, RequestError
from .header import MODELS
from .pnm import file_bytes
from .render import Request
from .samples import render


def main():
    parser = argparse.ArgumentParser(prog="python -m decoder")
    parser.add_argument("file")
    parser.add_argument("out")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"))
    parser.add_argument("--region", type=int, nargs=4, metavar=("X", "Y", "W", "H"))
    parser.add_argument("--first", type=int, metavar="N", help="only the first N Gaussians")
    parser.add_argument("--model", choices=MODELS)
    parser.add_argument("--without-texture", action="store_true")
    options = parser.parse_args()
    picture, error = decode(Path(options.file).read_bytes())
    if error:
        print(f"{options.file}: {error}", file=sys.stderr)
    for type in picture.skipped if picture else []:
        print(f"{options.file}: a chunk {type} breaks a rule and is skipped", file=sys.stderr)
    if picture is None:
        return 1
    model = MODELS.index(options.model) if options.model else None
    request = Request(options.size and tuple(options.size), options.region and tuple(options.region),
                      options.first, model, not options.without_texture)
    try:
        samples = render(picture, request)
    except (LimitExceeded, RequestError) as e:
        print(f"{options.file}: {e}", file=sys.stderr)
        return 1
    Path(options.out).write_bytes(file_bytes(samples, picture.header.depth, options.out))
    return 1 if error else 0


sys.exit(main())
