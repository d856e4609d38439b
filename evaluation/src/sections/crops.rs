//! Where in a picture two codecs differ most.

/// A square of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crop {
    /// Of its upper left corner.
    pub(super) x: u32,
    pub(super) y: u32,
    /// The mean of the map in it.
    pub(super) mean: f64,
}

/// The squares of a map, `side` pixels wide, with the least and the largest mean.
pub(super) fn extremes(map: &[f64], width: u32, side: u32) -> [Crop; 2] {
    let (stride, height) = (width as usize + 1, map.len() as u32 / width);
    // Sums of all that is above and to the left.
    let mut sums = vec![0.0; stride * (height as usize + 1)];
    for (y, row) in map.chunks_exact(width as usize).enumerate() {
        let mut left = 0.0;
        for (x, value) in row.iter().enumerate() {
            left += value;
            sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + left;
        }
    }
    let sum = |x: u32, y: u32| sums[y as usize * stride + x as usize];
    let crop = |x: u32, y: u32| {
        let inside = sum(x + side, y + side) - sum(x, y + side) - sum(x + side, y) + sum(x, y);
        Crop { x, y, mean: inside / f64::from(side * side) }
    };
    let mut found = [crop(0, 0); 2];
    for y in 0..=height - side {
        for x in 0..=width - side {
            let crop = crop(x, y);
            if crop.mean < found[0].mean {
                found[0] = crop;
            }
            if crop.mean > found[1].mean {
                found[1] = crop;
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extremes_are_found() {
        // 5 x 4, with a hole in one corner and a hill in another.
        let mut map = [1.0; 20];
        (map[15], map[4], map[3]) = (-7.0, 5.0, 9.0);
        let [least, largest] = extremes(&map, 5, 2);
        assert_eq!(least, Crop { x: 0, y: 2, mean: -1.0 });
        assert_eq!(largest, Crop { x: 3, y: 0, mean: 4.0 });
        let [least, largest] = extremes(&map[..16], 4, 4);
        assert_eq!(least, largest);
    }
}
