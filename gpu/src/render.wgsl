// Renders the Gaussians of a .gip picture (spec, section 9) on a GPU. Native programs run it through
// the crate image-gip-gpu, browsers load this file as it is. It is for viewing: the GPU may fuse and
// reassociate operations, so samples can differ from the decoder's in the last step.
//
// For each picture that is drawn:
//   1. clear the buffer `bins` to zero,
//   2. dispatch `prepare` with ceil(gaussians / 256) workgroups,
//   3. dispatch `render` with ceil(pixels.x / 16) x ceil(pixels.y / 16) workgroups.
// All three go into one command encoder, and the two dispatches may share a compute pass. Nothing is
// sorted: `prepare` marks each Gaussian in the bins that it may touch, one bit for each, and `render`
// goes through these bits in the order of the file.
//
// Bindings, all in group 0, with the buffers' sizes in bytes for N Gaussians:
//
//   0  view       uniform, 112       what to draw; see `View`
//   1  gaussians  storage, 36 N      see below
//   2  splats     storage, 48 N      filled by `prepare`
//   3  bins       storage, 4 ceil(N / 32) x number of bins; at most 1024 ceil(N / 32)
//   4  output     storage texture, rgba8unorm, of at least `pixels`
//   5  map        storage, 12 M      the map of the picture's texture, which has M nodes; see below
//
// `prepare` uses 0 to 3, `render` 0 and 2 to 5. Both accept a bind group with all six.

struct View {
    // Pixels of the grid for one stored pixel, along x and y. The grid is what is evaluated: the
    // output, or where that is smaller than the picture, what it is the average of (spec, section
    // 9.2). (offset 0)
    scale: vec2<f32>,
    // Column and row of the first pixel of the grid that is evaluated. They may be fractions, so that
    // a picture can be moved smoothly. (offset 8)
    origin: vec2<f32>,
    // Width and height in pixels of what is evaluated of the grid. (offset 16)
    size: vec2<u32>,
    // How many Gaussians to draw: the first ones of the file. (offset 24)
    gaussians: u32,
    // Width and height of a bin in tiles: b = ceil(max(ceil(size.x / 16), ceil(size.y / 16)) / 16).
    // There are ceil(ceil(size.x / 16) / b) x ceil(ceil(size.y / 16) / b) bins, at most 256.
    // (offset 28)
    bin_tiles: u32,
    // The base colour of each channel of the file, where 1 is a full sample. (offset 32)
    base: vec4<f32>,
    // The number of channels: 1 gray, 2 gray and alpha, 3 RGB, 4 RGB and alpha. (offset 48)
    channels: u32,
    // 0 exponential, 1 quartic. (offset 52)
    kernel: u32,
    // The cut-off of the kernel, which is 4 for the quartic one. (offset 56)
    cutoff: f32,
    // What the strength of the picture's texture is multiplied by: clamp(8 s - 1, 0, 1), where s are the
    // output's pixels for one stored pixel, along the axis along which there are fewer. 0 without
    // texture; `map` can be any buffer then. (offset 60)
    fade: f32,
    // Pixels of the grid for one of the output, along x and y: 1 unless the output is smaller than the
    // picture. (offset 64)
    ratio: vec2<f32>,
    // Where the output's first pixel begins, in pixels of the grid from `origin`. (offset 72)
    offset: vec2<f32>,
    // Width and height in pixels of what is drawn; `output` has at least this size. (offset 80)
    pixels: vec2<u32>,
    // Width and height of the stored picture. (offset 88)
    stored: vec2<u32>,
    // How the stored picture was turned to the one that `gaussians` are of, since texture is that of stored
    // pixels: MIRROR_COLUMNS, then MIRROR_ROWS, then EXCHANGE_AXES; 0 if not at all. (offset 96; size 112)
    turn: u32,
}

const MIRROR_COLUMNS: u32 = 1u;
const MIRROR_ROWS: u32 = 2u;
const EXCHANGE_AXES: u32 = 4u;

// A Gaussian in pixels of the grid (spec, section 9.2).
struct Splat {
    // x, y: the centre. i11, w: see `point`.
    place: vec4<f32>,
    // i22, and half of the width and of the height of the part with a weight.
    shape: vec4<f32>,
    // The amplitudes in red, green, blue and alpha.
    color: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
// Nine binary32 for each Gaussian, in the order of the file: x, y, l11, l21, l22 in stored pixels
// (spec, section 8.1), and the amplitudes in up to four channels; those that the picture lacks are 0.
// They are read as integers, because WGSL does not say what comparisons with NaN give.
@group(0) @binding(1) var<storage, read> gaussians: array<u32>;
@group(0) @binding(2) var<storage, read_write> splats: array<Splat>;
// For each bin, row by row, a bit for each Gaussian: the lowest bit of the first word is the first.
@group(0) @binding(3) var<storage, read_write> bins: array<atomic<u32>>;
@group(0) @binding(4) var output: texture_storage_2d<rgba8unorm, write>;
// The sums m0 to m2 of the map (spec, section 9.7): three planes of ceil(stored.y / 8) + 1 rows of
// ceil(stored.x / 8) + 1 nodes.
@group(0) @binding(5) var<storage, read> map: array<f32>;

// Width and height of a tile in pixels.
const TILE: u32 = 16u;
// Pixels of a tile, and invocations of a workgroup.
const BATCH: u32 = 256u;
// Words of 32 bits for a batch.
const BATCH_WORDS: u32 = 8u;
const COMPONENTS: u32 = 9u;
const QUARTIC: u32 = 1u;
// What the weight of a colour exceeds its alpha by (spec, section 9.5).
const LEAST_WEIGHT: f32 = 0.0000152587890625;

fn tiles() -> vec2<u32> {
    return (view.size + TILE - 1u) / TILE;
}

fn bin_columns() -> u32 {
    return (tiles().x + view.bin_tiles - 1u) / view.bin_tiles;
}

// Words of each bin.
fn bin_words() -> u32 {
    return (view.gaussians + 31u) / 32u;
}

// The squared distance at which the weight ends, in the distances of `point`. Those of the quartic
// kernel are halved, so that it ends at 1.
fn end() -> f32 {
    return select(view.cutoff, 1.0, view.kernel == QUARTIC);
}

// How far rounding may move the outline of a splat along each axis, in pixels.
fn margin(splat: Splat) -> vec2<f32> {
    return 0.01 + (abs(splat.place.xy) + splat.shape.yz) * 4e-6;
}

// ---- prepare: Gaussians to splats and bins ----

// Whether the magnitude of a component is at most `most`. Integers order NaN above all numbers.
fn is_within(bits: u32, most: f32) -> bool {
    return (bits & 0x7fffffffu) <= bitcast<u32>(most);
}

// Whether a diagonal entry is from 2^-12 to 2^24. Negative numbers are larger integers.
fn is_diagonal(bits: u32) -> bool {
    return bits >= bitcast<u32>(0.000244140625) && bits <= bitcast<u32>(16777216.0);
}

// Whether a Gaussian is drawn (spec, section 8.5).
fn is_drawn(first: u32) -> bool {
    var drawn = is_diagonal(gaussians[first + 2u]) && is_diagonal(gaussians[first + 4u]);
    drawn = drawn && is_within(gaussians[first], 16777216.0);
    drawn = drawn && is_within(gaussians[first + 1u], 16777216.0);
    drawn = drawn && is_within(gaussians[first + 3u], 16777216.0);
    for (var channel = 5u; channel < COMPONENTS; channel++) {
        drawn = drawn && is_within(gaussians[first + channel], 65536.0);
    }
    return drawn;
}

fn component(index: u32) -> f32 {
    return bitcast<f32>(gaussians[index]);
}

// Values of the file's channels as red, green, blue and alpha (spec, section 9.6).
fn to_rgba(values: vec4<f32>, opaque: f32) -> vec4<f32> {
    switch view.channels {
        case 1u: { return vec4(values.xxx, opaque); }
        case 2u: { return values.xxxy; }
        case 3u: { return vec4(values.xyz, opaque); }
        default: { return values; }
    }
}

// The splat of a Gaussian that is drawn (spec, section 9.2).
fn to_splat(first: u32) -> Splat {
    let center = vec2(component(first), component(first + 1u)) * view.scale;
    var l11 = component(first + 2u) * view.scale.x;
    var l21 = component(first + 3u) * view.scale.y;
    var l22 = component(first + 4u) * view.scale.y;
    var color = vec4(
        component(first + 5u),
        component(first + 6u),
        component(first + 7u),
        component(first + 8u),
    );

    // Along an axis that is made smaller, the splat is widened by what pixels have grown.
    let divisor = select(12.0, 6.0, view.kernel == QUARTIC);
    let wider = max(1.0 - view.scale * view.scale, vec2(0.0)) / divisor;
    if (any(wider > vec2(0.0))) {
        let m11 = sqrt(l11 * l11 + wider.x);
        let r = l21 / m11;
        let m22 = sqrt((l22 * l22 + wider.y) + (r * r) * wider.x);
        color *= (l11 / m11) * (l22 / m22);
        l21 = (l11 * l21) / m11;
        l11 = m11;
        l22 = m22;
    }

    let halving = select(1.0, 0.5, view.kernel == QUARTIC);
    let i11 = 1.0 / l11;
    let i22 = 1.0 / l22;
    let w = -((l21 * i11) * i22);
    let radius = sqrt(view.cutoff);
    let reach = radius * vec2(l11, sqrt(l21 * l21 + l22 * l22));
    return Splat(
        vec4(center, i11 * halving, w * halving),
        vec4(i22 * halving, reach, 0.0),
        to_rgba(color, 0.0),
    );
}

@compute @workgroup_size(256)
fn prepare(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let index = invocation.x;
    if (index >= view.gaussians || !is_drawn(index * COMPONENTS)) {
        return;
    }
    let splat = to_splat(index * COMPONENTS);
    let reach = splat.shape.yz + margin(splat);
    let low = splat.place.xy - reach - view.origin;
    let high = splat.place.xy + reach - view.origin;
    let size = vec2<f32>(view.size);
    if (any(high < vec2(0.0)) || any(low >= size)) {
        return;
    }
    splats[index] = splat;
    let bin_size = view.bin_tiles * TILE;
    let first = vec2<u32>(max(low, vec2(0.0))) / bin_size;
    let last = vec2<u32>(min(high, size - 1.0)) / bin_size;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let bin = y * bin_columns() + x;
            atomicOr(&bins[bin * bin_words() + index / 32u], 1u << (index % 32u));
        }
    }
}

// ---- render: splats to pixels, a tile of the output for each workgroup ----

// Of each invocation, the number of bits in its word; and sums of sixteen of them.
var<workgroup> counts: array<u32, 256>;
var<workgroup> sums: array<u32, 16>;
var<workgroup> candidates_left: u32;
// Splats of the tile's bin, in order.
var<workgroup> candidates: array<u32, 256>;
// Which of the candidates touch the tile, a bit for each; and these splats, in order.
var<workgroup> touching: array<atomic<u32>, 8>;
var<workgroup> places: array<vec4<f32>, 256>;
var<workgroup> i22s: array<f32, 256>;
// Their amplitudes; later the pixels of a tile of the grid, where the output is their average.
var<workgroup> colors: array<vec4<f32>, 256>;

// The point (u, v) of the kernel for a distance from the centre (spec, section 9.3).
fn point(place: vec4<f32>, i22: f32, d: vec2<f32>) -> vec2<f32> {
    return vec2(place.z * d.x, place.w * d.x + i22 * d.y);
}

// The least squared distance that rounding may give at a distance from the centre.
fn least(splat: Splat, d: vec2<f32>) -> f32 {
    let u = splat.place.z * d.x;
    let left = splat.place.w * d.x;
    let right = splat.shape.x * d.y;
    let v = max(abs(left + right) - (abs(left) + abs(right)) * 1e-6, 0.0);
    return u * u * 0.999999 + v * v;
}

// Whether a splat has a weight at a pixel of the tile whose first pixel has the centre `first`.
fn touches(splat: Splat, first: vec2<f32>) -> bool {
    let low = first - splat.place.xy - margin(splat);
    let high = first + f32(TILE - 1u) - splat.place.xy + margin(splat);
    // The nearest point of a rectangle is on one of the two sides that face the centre. A side that
    // passes the centre gives other points of the rectangle, which do no harm.
    let near = clamp(vec2(0.0), low, high);
    let i11 = splat.place.z;
    let w = splat.place.w;
    let i22 = splat.shape.x;
    let y = clamp(-w * near.x / i22, low.y, high.y);
    let x = clamp(-w * i22 * near.y / (i11 * i11 + w * w), low.x, high.x);
    return min(least(splat, vec2(near.x, y)), least(splat, vec2(x, near.y))) <= end();
}

fn weight(uv: vec2<f32>) -> f32 {
    if (view.kernel == QUARTIC) {
        let t = max((1.0 - uv.x * uv.x) - uv.y * uv.y, 0.0);
        return t * t;
    }
    let q = uv.x * uv.x + uv.y * uv.y;
    return select(0.0, exp(q * -0.5), q <= view.cutoff);
}

// The sum of `count` over the invocations before this one; `candidates_left` gets that over all.
fn sum_before(invocation: u32, count: u32) -> u32 {
    counts[invocation] = count;
    workgroupBarrier();
    let row = invocation / 16u;
    var before = 0u;
    for (var i = row * 16u; i < invocation; i++) {
        before += counts[i];
    }
    if (invocation % 16u == 15u) {
        sums[row] = before + count;
    }
    workgroupBarrier();
    for (var i = 0u; i < row; i++) {
        before += sums[i];
    }
    if (invocation == BATCH - 1u) {
        candidates_left = before + count;
    }
    return before;
}

// ---- texture: two lattices for each tile (spec, section 9.7) ----

// The texture of a tile of the grid is interpolated from that of stored pixels, the lattice of octave 0, which is
// made from that of octave 1. Of these there are so many points along each axis, in one array.
const OCTAVES: i32 = 2;
const SIDES = array<i32, 2>(20, 12);
const STARTS = array<i32, 2>(0, 400);
var<workgroup> lattices: array<f32, 544>;

// The gains of both octaves at the nodes that the lattices need, so many along each axis: of isotropic noise, and of
// horizontal and vertical streaks.
const NODES: i32 = 6;
var<workgroup> nodes: array<vec3<f32>, 72>;
// What makes the standard deviation of each octave's patterns 1. Octave 1 becomes larger by 16 where it is enlarged.
const DEVIATIONS = array<vec3<f32>, 2>(
    vec3(1.0, 1.23, 1.23) / 1024.0,
    vec3(1.82, 1.72, 1.72) / 16384.0,
);

// A pattern of noise.
struct Pattern {
    octave: i32,
    // Its place among those of its octave.
    kind: i32,
    // The direction of streaks: a step along them, and 0 where there are none.
    along: vec2<i32>,
    // Blocks from one node to the next are 1 << bits.
    bits: u32,
}

// The first point of a lattice, if `first` is that of octave 0.
fn first_point(first: vec2<i32>, octave: i32) -> vec2<i32> {
    return (first >> vec2(u32(octave))) - octave;
}

// The first node that these lattices need.
fn first_node(first: vec2<i32>) -> vec2<i32> {
    return first_point(first, 1) >> vec2(2u);
}

// The gains of an octave at a node.
fn gains_of_node(node: vec2<i32>, octave: i32) -> vec3<f32> {
    let count = vec2<i32>((view.stored + 7u) / 8u) + 1;
    let at = clamp(node, vec2(0), count - 1);
    let first = at.y * count.x + at.x;
    let plane = count.x * count.y;
    let strength = clamp((map[octave * plane + first] - 0.0078125) * 0.5, 0.0, 1.0) * view.fade;
    let direction = map[OCTAVES * plane + first] * 4.0 - 2.0;
    let horizontal = clamp(direction - 0.375, 0.0, 1.0);
    let vertical = clamp(-0.375 - direction, 0.0, 1.0);
    let streaks = horizontal + vertical;
    let isotropic = sqrt(max(1.0 - streaks * streaks, 0.0));
    return strength * vec3(isotropic, horizontal, vertical) * DEVIATIONS[octave];
}

// The gain of a pattern at a node, counted from the first one.
fn gain_of_node(node: vec2<i32>, pattern: Pattern) -> f32 {
    return nodes[(pattern.octave * NODES + node.y) * NODES + node.x][pattern.kind];
}

// The gain of a block, in the middle or, along streaks, where it begins.
fn gain(block: vec2<i32>, first: vec2<i32>, pattern: Pattern) -> f32 {
    let bits = vec2(pattern.bits);
    let node = block >> bits;
    let within = vec2<f32>(block - (node << bits)) + 0.5 * vec2<f32>(1 - pattern.along);
    let part = within / f32(1u << pattern.bits);
    let at = node - first_node(first);
    let above = mix(gain_of_node(at, pattern), gain_of_node(at + vec2(1, 0), pattern), part.x);
    let below = mix(gain_of_node(at + vec2(0, 1), pattern), gain_of_node(at + vec2(1, 1), pattern), part.x);
    return mix(above, below, part.y);
}

// One of the four values of a block: a sum of three numbers from -1024 to 1023 with the signs + + +, + - -, - + - or
// - - +.
fn value(block: vec2<i32>, index: i32, pattern: Pattern) -> f32 {
    var seed = 8u * bitcast<u32>(block.y) + u32(3 * pattern.octave + pattern.kind + 1);
    seed = (seed ^ (seed >> 16u)) * 0x21f0aaadu;
    seed = (seed ^ (seed >> 15u)) * 0x735a2d97u;
    seed ^= seed >> 15u;
    var random = bitcast<u32>(block.x) * 0x9e3779b1u + seed;
    random = (random ^ (random >> 15u)) * 0x2c1b3c6du;
    let numbers = bitcast<vec3<i32>>(vec3(random, random << 11u, random << 21u)) >> vec3(21u);
    let signs = select(vec3(-1), vec3(1), vec3(index < 2, index % 2 == 0, index % 3 == 0));
    let products = signs * numbers;
    return f32(products.x + products.y + products.z);
}

// Noise at a point of a lattice, multiplied by its gain.
fn isotropic(point: vec2<i32>, first: vec2<i32>, octave: i32) -> f32 {
    let pattern = Pattern(octave, 0, vec2(0), u32(2 - octave));
    let block = point >> vec2(1u);
    let factor = gain(block, first, pattern);
    if (factor == 0.0) {
        return 0.0;
    }
    return factor * value(block, (point.y & 1) * 2 + (point.x & 1), pattern);
}

// The same of streaks, whose values change from one block to the next.
fn streaks(point: vec2<i32>, first: vec2<i32>, octave: i32, kind: i32) -> f32 {
    let along = select(vec2(0, 1), vec2(1, 0), kind == 1);
    let pattern = Pattern(octave, kind, along, u32(1 - octave));
    let block = point >> vec2(2u);
    let factors = vec2(gain(block, first, pattern), gain(block + along, first, pattern));
    if (all(factors == vec2(0.0))) {
        return 0.0;
    }
    let within = point & vec2(3);
    let index = dot(within, 1 - along);
    let near = factors.x * value(block, index, pattern);
    let far = factors.y * value(block + along, index, pattern);
    return mix(near, far, (f32(dot(within, along)) + 0.5) / 4.0);
}

// A point of the lattice of octave 1, counted from the first one.
fn coarser(at: vec2<i32>) -> f32 {
    return lattices[STARTS[1] + at.y * SIDES[1] + at.x];
}

// The lattice of octave 1, enlarged by two, at a point.
fn enlarged(point: vec2<i32>, first: vec2<i32>) -> f32 {
    let near = (point >> vec2(1u)) - first_point(first, 1);
    let far = near + (point & vec2(1)) * 2 - 1;
    let in_row = 3.0 * coarser(near) + coarser(vec2(far.x, near.y));
    let beside = 3.0 * coarser(vec2(near.x, far.y)) + coarser(far);
    return 3.0 * in_row + beside;
}

// Fills the lattices, of which the finer begins at the stored pixel `first`. All invocations of the workgroup call
// it together.
fn make_lattices(first: vec2<i32>, invocation: u32) {
    let index = i32(invocation);
    if (index < OCTAVES * NODES * NODES) {
        let node = vec2(index % NODES, index / NODES % NODES);
        nodes[index] = gains_of_node(first_node(first) + node, index / (NODES * NODES));
    }
    workgroupBarrier();
    for (var octave = OCTAVES - 1; octave >= 0; octave--) {
        let side = SIDES[octave];
        for (var i = index; i < side * side; i += i32(BATCH)) {
            let point = first_point(first, octave) + vec2(i % side, i / side);
            var sum = 0.0;
            if (octave == 0) {
                sum = enlarged(point, first);
            }
            sum += isotropic(point, first, octave);
            sum += streaks(point, first, octave, 1);
            sum += streaks(point, first, octave, 2);
            lattices[STARTS[octave] + i] = sum;
        }
        workgroupBarrier();
    }
}

// The weights of four pixels in a cubic interpolation, for a part of the way from the second to the third.
fn cubic(t: f32) -> vec4<f32> {
    return vec4(
        ((1.0 - 0.5 * t) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((2.0 - 1.5 * t) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    );
}

// The texture of a pixel of a tile of the grid. All invocations of the workgroup call it together.
fn texture_at(tile: vec2<u32>, within: vec2<u32>, invocation: u32) -> f32 {
    let corner = (view.origin + vec2<f32>(tile * TILE) + 0.5) / view.scale - 0.5;
    // The first of the pixels that those of the tile are interpolated from, in the turned picture.
    let first = vec2<i32>(floor(corner)) - 1;
    let side = SIDES[0];
    var stored = first;
    let is_exchanged = (view.turn & EXCHANGE_AXES) != 0u;
    if (is_exchanged) {
        stored = stored.yx;
    }
    let last = vec2<i32>(view.stored) - side - stored;
    let is_mirrored = vec2((view.turn & MIRROR_COLUMNS) != 0u, (view.turn & MIRROR_ROWS) != 0u);
    make_lattices(select(stored, last, is_mirrored), invocation);

    let place = corner + vec2<f32>(within) / view.scale;
    let before = floor(place);
    let columns = cubic(place.x - before.x);
    let rows = cubic(place.y - before.y);
    let at = clamp(vec2<i32>(before) - 1 - first, vec2(0), vec2(side - 4));
    var sum = 0.0;
    for (var x = 0; x < 4; x++) {
        var column = 0.0;
        for (var y = 0; y < 4; y++) {
            var pixel = at + vec2(x, y);
            if (is_exchanged) {
                pixel = pixel.yx;
            }
            pixel = select(pixel, side - 1 - pixel, is_mirrored);
            column += rows[y] * lattices[pixel.y * side + pixel.x];
        }
        sum += columns[x] * column;
    }
    // What follows writes to the same memory.
    workgroupBarrier();
    return sum;
}

// The sum at a pixel of a tile of the grid. All invocations of the workgroup call it together.
fn sum_at(tile: vec2<u32>, within: vec2<u32>, invocation: u32) -> vec4<f32> {
    let corner = view.origin + vec2<f32>(tile * TILE) + 0.5;
    let center = corner + vec2<f32>(within);
    let bin = (tile.y / view.bin_tiles) * bin_columns() + tile.x / view.bin_tiles;
    let words = bin_words();
    var sum = to_rgba(view.base, 1.0);
    if (view.fade > 0.0) {
        sum += vec4(vec3(texture_at(tile, within, invocation)), 0.0);
    }
    for (var first = 0u; first < words; first += BATCH) {
        // Each invocation has a word of the bin, and puts its splats among the candidates.
        let word = first + invocation;
        var bits = 0u;
        if (word < words) {
            bits = atomicLoad(&bins[bin * words + word]);
        }
        var position = sum_before(invocation, countOneBits(bits));
        let total = workgroupUniformLoad(&candidates_left);
        for (var start = 0u; start < total; start += BATCH) {
            while (bits != 0u && position < start + BATCH) {
                candidates[position - start] = word * 32u + firstTrailingBit(bits);
                bits &= bits - 1u;
                position++;
            }
            if (invocation < BATCH_WORDS) {
                atomicStore(&touching[invocation], 0u);
            }
            workgroupBarrier();

            // Each invocation tests a candidate.
            var splat: Splat;
            var is_touching = false;
            if (invocation < total - start) {
                splat = splats[candidates[invocation]];
                is_touching = touches(splat, corner);
            }
            let bit = 1u << (invocation % 32u);
            if (is_touching) {
                atomicOr(&touching[invocation / 32u], bit);
            }
            workgroupBarrier();
            var place = 0u;
            var count = 0u;
            for (var i = 0u; i < BATCH_WORDS; i++) {
                let ones = atomicLoad(&touching[i]);
                if (i == invocation / 32u) {
                    place = count + countOneBits(ones & (bit - 1u));
                }
                count += countOneBits(ones);
            }
            if (is_touching) {
                places[place] = splat.place;
                i22s[place] = splat.shape.x;
                colors[place] = splat.color;
            }
            workgroupBarrier();

            // Each invocation adds those that touch the tile to its pixel.
            for (var i = 0u; i < count; i++) {
                let uv = point(places[i], i22s[i], center - places[i].xy);
                sum += colors[i] * weight(uv);
            }
            // What follows writes to the same memory.
            workgroupBarrier();
        }
    }
    return sum;
}

// What a pixel of the output gets of the pixels of a tile of the grid, each as much as they overlap.
fn part_of(tile: vec2<u32>, pixel: vec2<u32>) -> vec4<f32> {
    let low = view.offset + vec2<f32>(pixel) * view.ratio;
    let high = low + view.ratio;
    let corner = tile * TILE;
    let first = max(vec2<u32>(low), corner);
    let end = min(vec2<u32>(ceil(high)), min(corner + TILE, view.size));
    var sum = vec4(0.0);
    for (var y = first.y; y < end.y; y++) {
        var row = vec4(0.0);
        for (var x = first.x; x < end.x; x++) {
            let overlap = min(high.x, f32(x + 1u)) - max(low.x, f32(x));
            row += max(overlap, 0.0) * colors[(y - corner.y) * TILE + (x - corner.x)];
        }
        let overlap = min(high.y, f32(y + 1u)) - max(low.y, f32(y));
        sum += max(overlap, 0.0) * row;
    }
    return sum;
}

// The average of the grid over a pixel of the output, in which colours count times their alpha (spec,
// section 9.5). All invocations of the workgroup, which has this tile of the output, call it together.
fn average(tile: vec2<u32>, within: vec2<u32>, invocation: u32) -> vec4<f32> {
    let pixels = min((tile + 1u) * TILE, view.pixels);
    let low = view.offset + vec2<f32>(tile * TILE) * view.ratio;
    let high = view.offset + vec2<f32>(pixels) * view.ratio;
    let first = vec2<u32>(low) / TILE;
    let end = min((vec2<u32>(ceil(high)) + TILE - 1u) / TILE, tiles());
    var sum = vec4(0.0);
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            let value = clamp(sum_at(vec2(x, y), within, invocation), vec4(0.0), vec4(1.0));
            colors[invocation] = vec4(value.rgb * (value.a + LEAST_WEIGHT), value.a);
            workgroupBarrier();
            sum += part_of(vec2(x, y), tile * TILE + within);
            // What follows writes to the same memory.
            workgroupBarrier();
        }
    }
    let mean = sum / (view.ratio.x * view.ratio.y);
    return vec4(mean.rgb / (mean.a + LEAST_WEIGHT), mean.a);
}

@compute @workgroup_size(16, 16)
fn render(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(local_invocation_id) within: vec3<u32>,
    @builtin(local_invocation_index) invocation: u32,
) {
    var color: vec4<f32>;
    if (all(view.ratio == vec2(1.0))) {
        color = sum_at(tile.xy, within.xy, invocation);
    } else {
        color = average(tile.xy, within.xy, invocation);
    }
    let pixel = tile.xy * TILE + within.xy;
    if (all(pixel < view.pixels)) {
        // Rounded here, since textures may round halves otherwise.
        let samples = floor(clamp(color, vec4(0.0), vec4(1.0)) * 255.0 + 0.5);
        textureStore(output, pixel, samples / 255.0);
    }
}
