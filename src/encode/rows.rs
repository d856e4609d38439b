//! Rows of a picture and of a rendering of it, on one scale.

use std::collections::VecDeque;

/// Sixteen neighbours in a row.
pub(crate) type Lanes = [f32; 16];

/// Columns before a row that are no part of it; there are at least as many after it.
pub(crate) const MARGIN: usize = 16;

/// What is taken to be around a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Border {
    /// Nothing: zeros, as SSIMULACRA2 has it.
    Zeros,
    /// The picture's mirror images.
    Mirrored,
}

/// Some rows of the source and of a rendering.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    /// Vectors of a row with its margins.
    stride: usize,
    /// The row of the source, then the row of the rendering, row by row.
    values: Vec<Lanes>,
}

impl Group {
    fn new(width: usize, rows: usize) -> Self {
        let stride = stride(width);
        Self { stride, values: vec![[0.0; 16]; 2 * rows * stride] }
    }

    /// The part of a row from column x on; `which` is 0 for the source and 1 for the rendering.
    pub(crate) fn part(&mut self, which: usize, row: usize, x: usize) -> &mut [f32] {
        let row = &mut self.values[(2 * row + which) * self.stride..][..self.stride];
        &mut row.as_flattened_mut()[MARGIN + x..]
    }

    /// Fills the margins with mirror images of rows of a width.
    fn mirror(&mut self, width: usize) {
        for row in self.values.chunks_exact_mut(self.stride) {
            let row = row.as_flattened_mut();
            for distance in 1..=MARGIN as isize {
                row[MARGIN - distance as usize] = row[MARGIN + mirrored(-distance, width)];
                let after = width as isize - 1 + distance;
                row[MARGIN + after as usize] = row[MARGIN + mirrored(after, width)];
            }
        }
    }

    /// A row of both, with margins.
    fn row(&self, row: usize) -> [&[Lanes]; 2] {
        [0, 1].map(|which| &self.values[(2 * row + which) * self.stride..][..self.stride])
    }
}

/// The latest rows of both pictures.
#[derive(Debug)]
pub(crate) struct Rows {
    pub(crate) width: usize,
    pub(crate) height: usize,
    border: Border,
    /// Rows of a group.
    by_group: usize,
    /// The first of the groups, as its number from the top.
    first: usize,
    groups: VecDeque<Group>,
    /// Groups that are no longer needed, to be filled anew.
    spare: Vec<Group>,
    /// A row outside the picture.
    zeros: Vec<Lanes>,
}

impl Rows {
    /// No rows yet of pictures of a size.
    pub(crate) fn new([width, height]: [usize; 2], border: Border, by_group: usize) -> Self {
        let zeros = vec![[0.0; 16]; stride(width)];
        let (groups, spare) = (VecDeque::new(), Vec::new());
        Self { width, height, border, by_group, first: 0, groups, spare, zeros }
    }

    /// A group to be filled.
    pub(crate) fn blank(&mut self) -> Group {
        self.spare.pop().unwrap_or_else(|| Group::new(self.width, self.by_group))
    }

    /// Appends the next rows.
    pub(crate) fn push(&mut self, mut group: Group) {
        if self.border == Border::Mirrored {
            group.mirror(self.width);
        }
        self.groups.push_back(group);
    }

    /// The number of rows that are known, from the top.
    pub(crate) fn known(&self) -> usize {
        self.height.min((self.first + self.groups.len()) * self.by_group)
    }

    /// Forgets rows before this one.
    pub(crate) fn forget(&mut self, before: usize) {
        while (self.first + 1) * self.by_group <= before {
            let Some(group) = self.groups.pop_front() else { return };
            self.spare.push(group);
            self.first += 1;
        }
    }

    /// Size in bytes of some groups, and of those with the rows before them.
    pub(crate) fn memory(&self, groups: usize, before: usize) -> usize {
        let group = 2 * self.by_group * stride(self.width) * size_of::<Lanes>();
        (groups + before.div_ceil(self.by_group)) * group
    }

    /// The row at y of both, with margins. Up to so many rows outside the picture can be asked for as
    /// rows inside it are known.
    pub(crate) fn row(&self, y: isize) -> [&[Lanes]; 2] {
        let is_inside = (0..self.height as isize).contains(&y);
        if !is_inside && self.border == Border::Zeros {
            return [&self.zeros; 2];
        }
        let y = mirrored(y, self.height);
        self.groups[y / self.by_group - self.first].row(y % self.by_group)
    }
}

/// An index inside of a length, mirrored at its ends.
pub(crate) fn mirrored(at: isize, length: usize) -> usize {
    let period = (2 * (length as isize - 1)).max(1);
    let at = at.rem_euclid(period);
    at.min(period - at).min(length as isize - 1) as usize
}

/// Vectors of a row with its margins.
fn stride(width: usize) -> usize {
    width.div_ceil(16) + 2
}
