"""Limits (section 10): the least numbers that a conforming decoder has to accept."""

SIDE = 16_384            # pixels: stored width and height, and those of a rendered region
PIXELS = 2**26           # pixels: of the stored picture, of a region, and of what it covers of the grid
GAUSSIANS = 2**20        # in all layers; and by itself in a texture's map
LAYERS = 65_535
METADATA_CHUNK = 2**24   # bytes: payload of one metadata chunk
METADATA = 2**25         # bytes: all metadata, each text counted with 256 bytes more; not what is skipped
TEXT_EXTRA = 256         # bytes

# Work, as section 10 counts it (module `work`), for each pixel of the grid that the region covers, and more for all.
# This decoder takes up to some eight times as many evaluations, as it works with rectangles around parts of ellipses.
WORK_PER_PIXEL = 32
WORK_MORE = 2**30
