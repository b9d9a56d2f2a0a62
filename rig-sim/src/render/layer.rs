//! One row of one layer of a picture: what covers each pixel, and how far away.

use super::colour::{Ycc, mix};

/// One pixel of a layer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Part of the pixel covered, 0 to 1.
    pub(super) cover: f32,
    /// Distance of the surface (m).
    pub(super) depth_m: f32,
    /// Colour of the covered part.
    pub(super) colour: Ycc,
}

impl Cell {
    const EMPTY: Self = Self {
        cover: 0.0,
        depth_m: f32::INFINITY,
        colour: [0.0; 3],
    };
}

/// A row of cells and the span of those in use.
#[derive(Debug)]
pub(super) struct RowLayer {
    cells: Vec<Cell>,
    used: (usize, usize),
}

impl RowLayer {
    pub(super) fn new(width: usize) -> Self {
        Self {
            cells: vec![Cell::EMPTY; width],
            used: (width, 0),
        }
    }

    pub(super) fn width(&self) -> usize {
        self.cells.len()
    }

    pub(super) fn clear(&mut self) {
        let (from, to) = self.used;
        if from < to {
            self.cells[from..to].fill(Cell::EMPTY);
        }
        self.used = (self.cells.len(), 0);
    }

    /// First and one past the last column in use.
    pub(super) fn used(&self) -> (usize, usize) {
        self.used
    }

    pub(super) fn cell(&self, u: usize) -> &Cell {
        &self.cells[u]
    }

    /// Lays a piece over a pixel. Pieces of one layer belong to one body: where
    /// they meet they share an edge instead of covering twice.
    pub(super) fn put(&mut self, u: usize, piece: Cell) {
        let cell = &mut self.cells[u];
        if piece.depth_m < cell.depth_m {
            cell.colour = if cell.cover > 0.0 {
                mix(cell.colour, piece.colour, piece.cover)
            } else {
                piece.colour
            };
            cell.depth_m = piece.depth_m;
        } else if cell.cover < piece.cover {
            cell.colour = mix(piece.colour, cell.colour, cell.cover);
        }
        cell.cover = cell.cover.max(piece.cover);
        self.used = (self.used.0.min(u), self.used.1.max(u + 1));
    }
}

/// Colour of one pixel: the layers over `behind`, nearest last.
pub(super) fn composite<const N: usize>(layers: [&RowLayer; N], u: usize, behind: Ycc) -> Ycc {
    let mut order: [&Cell; N] = layers.map(|layer| layer.cell(u));
    order.sort_unstable_by(|a, b| b.depth_m.total_cmp(&a.depth_m));
    order
        .iter()
        .fold(behind, |under, cell| mix(under, cell.colour, cell.cover))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(cover: f32, depth_m: f32, y: f32) -> Cell {
        Cell {
            cover,
            depth_m,
            colour: [y, 0.0, 0.0],
        }
    }

    #[test]
    fn the_nearer_layer_wins_and_edges_let_the_background_through() {
        let mut layers = [RowLayer::new(4), RowLayer::new(4)];
        layers[0].put(1, cell(1.0, 1.0, 50.0));
        layers[1].put(1, cell(1.0, 2.0, 90.0));
        layers[1].put(2, cell(0.25, 2.0, 90.0));
        let composite = |l: &[RowLayer; 2], u, behind| super::composite([&l[0], &l[1]], u, behind);
        assert_eq!(composite(&layers, 1, [10.0, 0.0, 0.0])[0], 50.0);
        assert_eq!(composite(&layers, 2, [10.0, 0.0, 0.0])[0], 30.0);
        assert_eq!(composite(&layers, 3, [10.0, 0.0, 0.0])[0], 10.0);
        layers[1].clear();
        assert_eq!(composite(&layers, 2, [10.0, 0.0, 0.0])[0], 10.0);
    }

    #[test]
    fn neighbouring_pieces_do_not_thicken_a_shared_edge() {
        let mut layers = [RowLayer::new(1)];
        layers[0].put(0, cell(0.5, 1.0, 100.0));
        layers[0].put(0, cell(0.5, 1.1, 100.0));
        assert_eq!(composite([&layers[0]], 0, [0.0; 3])[0], 50.0);
    }
}
