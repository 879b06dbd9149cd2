//! At most 255 colours that are near to those of a picture, and its pixels in them.
//!
//! The colours are divided in two, again and again, where that lowers the sum of squared errors most (after Wu 1992). Pixels are
//! dithered by an ordered pattern: a pixel depends on its own colour and place only. Objects at rest therefore do not flicker from frame
//! to frame, as they do with error diffusion.

/// Largest number of colours: one number of a GIF's 256 is for pixels that do not change.
const MAX_COLORS: usize = 255;
/// Bits of each channel of the table of nearest colours.
const BITS: u32 = 6;
/// Value of a table entry that has not been computed.
const UNKNOWN: u16 = u16::MAX;

/// Thresholds of an ordered dither, 8 x 8 (Bayer 1973).
const BAYER: [[u8; 8]; 8] = [
    [0, 32, 8, 40, 2, 34, 10, 42],
    [48, 16, 56, 24, 50, 18, 58, 26],
    [12, 44, 4, 36, 14, 46, 6, 38],
    [60, 28, 52, 20, 62, 30, 54, 22],
    [3, 35, 11, 43, 1, 33, 9, 41],
    [51, 19, 59, 27, 49, 17, 57, 25],
    [15, 47, 7, 39, 13, 45, 5, 37],
    [63, 31, 55, 23, 61, 29, 53, 21],
];

/// The colours of a picture.
pub(super) struct Palette {
    colors: Vec<[u8; 3]>,
    /// Range of the dither, in steps of a channel; `None` where all colours of the picture are in the palette.
    dither: Option<f32>,
    /// Nearest colours, by the first bits of each channel, as far as they have been found.
    nearest: Vec<u16>,
}

/// A colour with the number of its pixels.
type Counted = ([u8; 3], u32);

impl Palette {
    /// The palette of the colours of a picture's pixels.
    pub(super) fn of(pixels: impl Iterator<Item = [u8; 3]>) -> Self {
        let colors = counted(pixels);
        if colors.len() <= MAX_COLORS {
            let colors = colors.into_iter().map(|(color, _)| color).collect();
            return Self { colors, dither: None, nearest: Vec::new() };
        }
        let mut colors: Vec<[u8; 3]> = divided(colors).iter().map(|part| mean(part)).collect();
        colors.sort_unstable();
        colors.dedup();
        let dither = Some(spacing(&colors));
        Self { colors, dither, nearest: vec![UNKNOWN; 1 << (3 * BITS)] }
    }

    /// Number of no colour.
    pub(super) fn unused(&self) -> u8 {
        // At most MAX_COLORS.
        self.colors.len() as u8
    }

    /// All colours as bytes, with one for [`Self::unused`].
    pub(super) fn bytes(&self) -> Vec<u8> {
        self.colors.iter().copied().chain([[0; 3]]).flatten().collect()
    }

    /// Number of the colour that a pixel at a place has.
    pub(super) fn index(&mut self, color: [u8; 3], (x, y): (usize, usize)) -> u8 {
        let Some(range) = self.dither else {
            return self.colors.binary_search(&color).map_or(0, |index| index as u8);
        };
        let threshold = (f32::from(BAYER[y % 8][x % 8]) + 0.5) / 64.0 - 0.5;
        // Conversion saturates at 0 and 255.
        let dithered = color.map(|channel| (f32::from(channel) + threshold * range).round() as u8);
        let shift = 8 - BITS;
        let key = dithered.iter().fold(0, |key, channel| key << BITS | usize::from(channel >> shift));
        let Some(found) = self.nearest.get_mut(key) else { return 0 };
        if *found == UNKNOWN {
            let center = dithered.map(|channel| channel >> shift << shift | 1 << (shift - 1));
            let nearest = (0_u16..).zip(&self.colors).min_by_key(|(_, color)| distance(**color, center));
            *found = nearest.map_or(0, |(index, _)| index);
        }
        *found as u8
    }
}

/// The different colours of pixels, ascending.
fn counted(pixels: impl Iterator<Item = [u8; 3]>) -> Vec<Counted> {
    let mut all: Vec<[u8; 3]> = pixels.collect();
    all.sort_unstable();
    let runs = all.chunk_by(|a, b| a == b);
    runs.filter_map(|run| Some((*run.first()?, run.len() as u32))).collect()
}

/// Divides colours into [`MAX_COLORS`] parts at most.
fn divided(colors: Vec<Counted>) -> Vec<Vec<Counted>> {
    let mut parts = vec![(best_cut(&colors), colors)];
    while parts.len() < MAX_COLORS {
        let gain = |part: &(Option<Cut>, Vec<Counted>)| part.0.map_or(0.0, |cut| cut.gain);
        let best = parts.iter_mut().max_by(|a, b| gain(a).total_cmp(&gain(b)));
        let Some((Some(Cut { axis, above, .. }), colors)) = best else { break };
        let (axis, above) = (*axis, *above);
        let (low, high): (Vec<_>, Vec<_>) =
            std::mem::take(colors).into_iter().partition(|(color, _)| color[axis] <= above);
        if let Some(part) = parts.iter_mut().find(|(_, colors)| colors.is_empty()) {
            *part = (best_cut(&low), low);
        }
        parts.push((best_cut(&high), high));
    }
    parts.into_iter().map(|(_, colors)| colors).collect()
}

/// A division of colours.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Channel whose value divides the colours.
    axis: usize,
    /// Largest value of the lower part.
    above: u8,
    /// Amount by which the sum of squared errors falls.
    gain: f64,
}

/// Number of pixels and sums of their channels.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: u64,
    channels: [u64; 3],
}

impl Sums {
    fn add(&mut self, (color, count): &Counted) {
        let count = u64::from(*count);
        self.count += count;
        for (sum, channel) in self.channels.iter_mut().zip(color) {
            *sum += count * u64::from(*channel);
        }
    }

    /// The squared length of the sum over the count: the sum of squares less the squared errors.
    fn weight(&self) -> f64 {
        let squares: f64 = self.channels.iter().map(|&sum| sum as f64 * sum as f64).sum();
        if self.count == 0 { 0.0 } else { squares / self.count as f64 }
    }

    fn without(&self, other: &Self) -> Self {
        let [r, g, b] = [0, 1, 2].map(|i| self.channels[i] - other.channels[i]);
        Self { count: self.count - other.count, channels: [r, g, b] }
    }
}

/// The cut that lowers the error most; `None` for a single colour.
fn best_cut(colors: &[Counted]) -> Option<Cut> {
    let mut all = Sums::default();
    colors.iter().for_each(|color| all.add(color));
    let mut best: Option<Cut> = None;
    for axis in 0..3 {
        let mut planes = [Sums::default(); 256];
        colors.iter().for_each(|color| planes[usize::from(color.0[axis])].add(color));
        let mut low = Sums::default();
        for (above, plane) in (0_u8..=u8::MAX).zip(&planes) {
            low.count += plane.count;
            low.channels.iter_mut().zip(plane.channels).for_each(|(sum, more)| *sum += more);
            let high = all.without(&low);
            if plane.count == 0 || high.count == 0 {
                continue;
            }
            let gain = low.weight() + high.weight() - all.weight();
            if best.is_none_or(|best| gain > best.gain) {
                best = Some(Cut { axis, above, gain });
            }
        }
    }
    best
}

fn mean(colors: &[Counted]) -> [u8; 3] {
    let mut sums = Sums::default();
    colors.iter().for_each(|color| sums.add(color));
    sums.channels.map(|sum| ((sum + sums.count / 2) / sums.count.max(1)) as u8)
}

fn distance(a: [u8; 3], b: [u8; 3]) -> u32 {
    a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// The mean distance from a colour to the nearest other one, along one channel.
fn spacing(colors: &[[u8; 3]]) -> f32 {
    let nearest = |(at, color): (usize, &[u8; 3])| {
        let others = colors.iter().enumerate().filter(|(other, _)| *other != at);
        others.map(|(_, other)| distance(*color, *other)).min().unwrap_or(0)
    };
    let sum: f32 = colors.iter().enumerate().map(|color| (nearest(color) as f32 / 3.0).sqrt()).sum();
    sum / colors.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of smooth colours, 64 x 64.
    fn smooth() -> Vec<[u8; 3]> {
        let place = |at: usize| (at % 64, at / 64);
        (0..64 * 64).map(place).map(|(x, y)| [2 * x as u8 + 60, 2 * y as u8, (x + y) as u8]).collect()
    }

    #[test]
    fn few_colours_are_kept_exactly() {
        let colors: Vec<[u8; 3]> = (0..255).map(|i| [i, 255 - i, i / 2]).collect();
        let mut palette = Palette::of(colors.iter().copied().cycle().take(2000));
        for (at, color) in colors.into_iter().enumerate() {
            let index = palette.index(color, (at, 3));
            assert_eq!(palette.colors[usize::from(index)], color);
        }
        assert_eq!((palette.unused(), palette.bytes().len()), (255, 768));
    }

    #[test]
    fn many_colours_are_near_and_their_means_are_right() {
        let picture = smooth();
        let mut palette = Palette::of(picture.iter().copied());
        assert!((200..=MAX_COLORS).contains(&palette.colors.len()));
        let indices: Vec<u8> =
            (0..picture.len()).map(|at| palette.index(picture[at], (at % 64, at / 64))).collect();
        let shown: Vec<[u8; 3]> = indices.iter().map(|index| palette.colors[usize::from(*index)]).collect();
        let far = picture.iter().zip(&shown).map(|(a, b)| distance(*a, *b)).max().unwrap();
        assert!(far < 40 * 40, "{far}");
        for block in 0..64 {
            let (left, top) = (block % 8 * 8, block / 8 * 8);
            let sum = |of: &[[u8; 3]], channel: usize| -> i32 {
                let rows = (top..top + 8).flat_map(|y| (left..left + 8).map(move |x| 64 * y + x));
                rows.map(|at| i32::from(of[at][channel])).sum()
            };
            for channel in 0..3 {
                let error = (sum(&picture, channel) - sum(&shown, channel)) as f32 / 64.0;
                assert!(error.abs() < 4.0, "block {block}, channel {channel}: {error}");
            }
        }
    }

    #[test]
    fn two_far_groups_of_colours_are_divided_first() {
        let dark = (0..200).map(|i| ([i % 20, 0, 0], 10));
        let mut colors: Vec<Counted> = dark.chain([([250, 250, 250], 500)]).collect();
        colors.sort_unstable();
        let cut = best_cut(&colors).unwrap();
        assert!(colors.iter().filter(|(color, _)| color[cut.axis] > cut.above).count() == 1);
        assert!(best_cut(&colors[..1]).is_none());
    }
}
