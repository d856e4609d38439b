"""Limits (section 10): the least numbers that a conforming decoder has to accept, and one of this decoder's own."""

SIDE = 16_384            # pixels: stored width and height, and those of a rendered region
PIXELS = 2**26           # pixels: of the stored picture, of a region, and of what it covers of the grid
GAUSSIANS = 2**20        # in all layers; and by itself in a texture's map
LAYERS = 65_535
METADATA_CHUNK = 2**24   # bytes: payload of one metadata chunk
METADATA = 2**25         # bytes: all metadata, each text counted with 256 bytes more
TEXT_EXTRA = 256         # bytes

# Work in the sense of section 10 counts whole tiles in which some pixel is within the cut-off. This decoder counts only
# the pixels that are within it, which are fewer, so it refuses nothing that it has to accept.
WORK_PER_PIXEL = 64
WORK_MORE = 2**30

# This decoder's own: kernel evaluations, those included that turn out to be beyond the cut-off, for each unit of work
# allowed. Thin Gaussians in ordinary files stay below it. It guards against those that pass between pixel centres, for
# which section 10 has no bound: they cost time, but no work as it is counted there. At some 30 million evaluations in a
# second, a small picture takes five minutes at most and one of 2^26 pixels less than an hour.
EVALUATIONS = 8
