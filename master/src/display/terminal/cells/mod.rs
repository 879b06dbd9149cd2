//! Pictures as characters: each cell of the terminal shows a block of 2 to 8 pixels with one glyph and two colours.
//!
//! The glyph says which pixels of the block have the foreground colour, the others have the background colour.

mod fit;
mod glyphs;

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

/// A colour in sRGB.
pub(super) type Rgb = [u8; 3];

/// Largest number of pixels in a cell.
const MAX_PIXELS: usize = 8;

/// Shape of the pixels of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellKind {
    /// 1 x 2 pixels, in every font.
    Half,
    /// 2 x 2 pixels, in nearly every font.
    Quadrant,
    /// 2 x 3 pixels, Unicode 13.
    Sextant,
    /// 2 x 4 pixels, Unicode 16.
    Octant,
}

impl CellKind {
    /// Pixels of a cell: columns and rows.
    pub(super) fn pixels(self) -> (usize, usize) {
        match self {
            Self::Half => (1, 2),
            Self::Quadrant => (2, 2),
            Self::Sextant => (2, 3),
            Self::Octant => (2, 4),
        }
    }

    /// Size of a picture for an area of `columns` x `rows` cells, with square pixels where a cell is twice as high as wide. Cells whose
    /// own pixels are not square show the average of parts of it.
    pub(super) fn picture_size(self, columns: usize, rows: usize) -> (usize, usize) {
        match self {
            Self::Half => (columns, rows * 2),
            Self::Quadrant | Self::Sextant | Self::Octant => (columns * 2, rows * 4),
        }
    }
}

/// What one cell of the terminal shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// Character, one column wide.
    pub(super) glyph: char,
    /// Colour of the glyph.
    pub(super) foreground: Rgb,
    /// Colour around the glyph.
    pub(super) background: Rgb,
}

impl Cell {
    /// A cell of one colour.
    pub(super) fn filled(background: Rgb) -> Self {
        Self { glyph: ' ', foreground: background, background }
    }
}

/// The cells of a picture whose size is a whole number of cells: `pixels` has rows of `columns` times the columns of a cell.
/// Rows of cells are independent, and are computed on all cores.
pub(super) fn cells_of(kind: CellKind, pixels: &[Rgb], columns: usize) -> Vec<Cell> {
    let (cell_columns, cell_rows) = kind.pixels();
    let width = columns * cell_columns;
    if width == 0 {
        return Vec::new();
    }
    let rows = pixels.len() / (width * cell_rows);
    let mut cells = vec![Cell::filled([0; 3]); rows * columns];
    cells.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
        let band = pixels.get(row * cell_rows * width..).unwrap_or_default();
        for (column, cell) in cells.iter_mut().enumerate() {
            let mut block = [[0; 3]; MAX_PIXELS];
            for (index, pixel) in block.iter_mut().take(cell_columns * cell_rows).enumerate() {
                let at = index / cell_columns * width + column * cell_columns + index % cell_columns;
                *pixel = band.get(at).copied().unwrap_or_default();
            }
            *cell = fit::best_cell(kind, block.get(..cell_columns * cell_rows).unwrap_or_default());
        }
    });
    cells
}
