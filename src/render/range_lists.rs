//! Lists of the items that each of several places has, from the range of places of every item.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

/// For each place, the items whose ranges contain it, in order.
#[derive(Debug)]
pub(crate) struct RangeLists {
    /// `items[starts[p]..starts[p + 1]]` are those of place p.
    starts: Vec<usize>,
    items: Vec<u32>,
}

impl RangeLists {
    /// Lists of items with the numbers from `first` on. `changes` has for each place the difference of its
    /// number of items from that of the place before it, which wraps around, and a last one.
    pub(crate) fn new(
        changes: impl IntoIterator<Item = usize>,
        first: u32,
        ranges: impl Iterator<Item = Range<u32>>,
    ) -> Self {
        let (mut count, mut total) = (0_usize, 0);
        let starts = changes.into_iter().map(|change| {
            count = count.wrapping_add(change);
            let start = total;
            total += count;
            start
        });
        let mut starts: Vec<usize> = starts.collect();
        let mut items = vec![0; total];
        // `starts[p]` moves over the items of place p, and is at those of the next place at the end.
        for (item, range) in (first..).zip(ranges) {
            for start in &mut starts[range.start as usize..range.end as usize] {
                items[*start] = item;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Self { starts, items }
    }

    /// The items of a place.
    #[inline]
    pub(crate) fn of(&self, place: usize) -> &[u32] {
        &self.items[self.starts[place]..self.starts[place + 1]]
    }

    /// The number of items of all places.
    #[cfg(feature = "encode")]
    pub(crate) fn len(&self) -> usize {
        self.items.len()
    }

    /// Size in bytes.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.items.capacity() * size_of::<u32>()
    }
}
