//! A printed ChArUco board: what is on it, where it hangs, and its corners in a
//! picture.

use shared_types::file_error::why;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::corners::CornerDetector;
use super::extrinsics::Correspondence;
use crate::source::{SourceError, StereoSource};

/// Corners both images must see for a picture to count.
const MIN_CORNERS: usize = 6;

/// Why a board cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The description cannot be read or does not parse.
    #[error("board {path}: {reason}")]
    File {
        /// File concerned.
        path: PathBuf,
        /// What is wrong, with the field.
        reason: String,
    },
    /// A frame cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The board was not found.
    #[error(
        "the board was found in both images in none of {frames} frames (at best {most} corners, \
         {least} are needed); show it whole, flat and lit, and check rows, columns and dictionary",
        least = MIN_CORNERS
    )]
    NotFound {
        /// Frames looked at.
        frames: usize,
        /// Most corners seen by both images.
        most: usize,
    },
}

/// Description of a board, file `board.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Squares from top to bottom.
    pub rows: u32,
    /// Squares from left to right.
    pub columns: u32,
    /// Side of a square (m).
    pub square_m: f64,
    /// Side of a marker (m).
    pub marker_m: f64,
    /// Marker dictionary by OpenCV's name, such as `DICT_4X4_50` or
    /// `DICT_APRILTAG_36h11`.
    pub dictionary: String,
    /// Where the board hangs.
    pub pose: BoardPose,
}

/// Pose of a board in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardPose {
    /// Outer corner of the first, black square (m).
    pub position_m: [f64; 3],
    /// Rows of the rotation board to world; the board's x points along its rows,
    /// y down its columns, z into it.
    pub rotation: [[f64; 3]; 3],
}

impl Board {
    /// Reads `board.toml`.
    ///
    /// # Errors
    /// The file is missing or a field is impossible.
    pub fn read(path: &Path) -> Result<Self, BoardError> {
        let fail = |reason: String| BoardError::File {
            path: path.to_owned(),
            reason,
        };
        let text = std::fs::read_to_string(path).map_err(|e| fail(why(&e)))?;
        let board: Self = toml::from_str(&text).map_err(|e| fail(e.to_string()))?;
        board.detector().map_err(fail)?;
        let r = board.rotation();
        if (r * r.transpose() - Matrix3::identity()).norm() > 1e-3 || r.determinant() < 0.0 {
            return Err(fail("pose.rotation is not a rotation matrix".to_owned()));
        }
        Ok(board)
    }

    fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.pose.rotation[row][column])
    }

    fn detector(&self) -> Result<CornerDetector, String> {
        if !(self.square_m > 0.0 && self.marker_m > 0.0 && self.marker_m < self.square_m) {
            return Err(
                "square_m and marker_m must be positive, the marker the smaller".to_owned(),
            );
        }
        CornerDetector::new(
            [self.rows, self.columns],
            [self.square_m, self.marker_m],
            &self.dictionary,
        )
    }

    /// Place of an inner corner in the world (m).
    fn corner_w_m(&self, id: u32) -> Vector3<f64> {
        let across = self.columns - 1;
        let x = f64::from(id % across + 1) * self.square_m;
        let y = f64::from(id / across + 1) * self.square_m;
        Vector3::from(self.pose.position_m) + self.rotation() * Vector3::new(x, y, 0.0)
    }

    /// Corners seen by both images in some frames spread over a recording, in which
    /// the board hangs still.
    ///
    /// # Errors
    /// A frame is damaged, or the board is in none of them.
    pub fn look(
        &self,
        source: &mut dyn StereoSource,
        frames: usize,
    ) -> Result<Vec<Correspondence>, BoardError> {
        let detector = self.detector().map_err(|reason| BoardError::File {
            path: PathBuf::from("(board)"),
            reason,
        })?;
        let chosen = crate::track::spread(source.len(), frames.max(2));
        let (mut seen, mut most) = (Vec::new(), 0);
        for &index in &chosen {
            let frame = source.read(index)?;
            let left = detector.corners(&frame.left());
            let right = detector.corners(&frame.right());
            let both: Vec<Correspondence> = left
                .iter()
                .filter_map(|(id, pixel)| {
                    let other = right.iter().find(|(other, _)| other == id)?.1;
                    Some(Correspondence {
                        p_w_m: self.corner_w_m(*id),
                        pixels: [*pixel, other],
                    })
                })
                .collect();
            most = most.max(both.len());
            if both.len() >= MIN_CORNERS {
                seen.extend(both);
            }
        }
        if seen.is_empty() {
            return Err(BoardError::NotFound {
                frames: chosen.len(),
                most,
            });
        }
        Ok(seen)
    }
}
