//! Where a target may lie at one height, seen from above.

use arm_model::Cell;
use planner::plan::{check_reach, clear_of_arm};
use serde::Serialize;
use shared_types::rope::RANGES;

/// Cells along each axis.
const CELLS: usize = 60;
/// Half the side of the map (m); more than any rope gets to.
const HALF_M: f64 = 1.8;

/// A square around the base axis, at one height.
#[derive(Debug, Serialize)]
pub(crate) struct ReachBounds {
    /// Half its side (m).
    half_m: f64,
    /// Cells along each axis.
    cells: usize,
    /// `1` where a rope of the longest length may reach; rows from x = -half_m up, in each row y from
    /// -half_m up.
    rows: Vec<String>,
}

/// Why a rope of this length cannot be thrown there; `None` where it may.
pub(crate) fn objection(target_m: [f64; 3], length_m: f64, cell: &Cell) -> Option<String> {
    check_reach(target_m, length_m, cell)
        .and_then(|()| clear_of_arm(target_m, cell))
        .err()
        .map(|error| error.to_string())
}

/// The longest rope there is (m).
pub(crate) const LENGTH_MAX_M: f64 = RANGES[1].max;

impl ReachBounds {
    /// For a rope of `length_m`, targets at `z_m`.
    pub(crate) fn at(z_m: f64, length_m: f64, cell: &Cell) -> Self {
        let at = |i: usize| HALF_M * ((2 * i + 1) as f64 / CELLS as f64 - 1.0);
        let may = |x: usize, y: usize| objection([at(x), at(y), z_m], length_m, cell).is_none();
        let row = |x: usize| -> String {
            (0..CELLS)
                .map(|y| if may(x, y) { '1' } else { '0' })
                .collect()
        };
        Self {
            half_m: HALF_M,
            cells: CELLS,
            rows: (0..CELLS).map(row).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_says_what_the_planner_says() {
        let cell = Cell::default();
        let map = ReachBounds::at(0.3, LENGTH_MAX_M, &cell);
        let centre = |v: f64| ((v / HALF_M + 1.0) * CELLS as f64 / 2.0) as usize;
        let at = |x, y| map.rows[centre(x)].as_bytes()[centre(y)];
        assert_eq!(at(0.95, 0.1), b'1');
        assert_eq!(at(0.0, 0.0), b'0', "the base is there");
        assert_eq!(at(1.75, 0.0), b'0', "too far");
        let near = |x: f64| objection([x, 0.0, 0.3], LENGTH_MAX_M, &cell);
        assert!(near(0.95).is_none() && near(3.0).unwrap().contains("reach"));
    }
}
