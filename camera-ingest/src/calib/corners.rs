//! Finds a `ChArUco` board's corners in a picture, where the feature `calibration` is on:
//! the detector is as much to build as the rest of this crate, and is needed when a camera
//! is set up only.

use crate::frame::ImageFrame;

#[cfg(feature = "calibration")]
pub(super) struct CornerDetector(calib_targets_charuco::CharucoDetector);

#[cfg(feature = "calibration")]
impl CornerDetector {
    /// A detector of a board of so many squares, by the sides of a square and of a marker
    /// and the markers' dictionary.
    ///
    /// # Errors
    /// The dictionary is not known, or the board is none: as text.
    pub(super) fn new(
        [rows, columns]: [u32; 2],
        [square_m, marker_m]: [f64; 2],
        dictionary: &str,
    ) -> Result<Self, String> {
        use calib_targets_charuco::{
            CharucoBoardSpec, CharucoDetector, CharucoParams, resolve_dictionary,
        };
        let dictionary = resolve_dictionary(dictionary)
            .ok_or_else(|| format!("dictionary {dictionary:?} is not known"))?;
        let (square, ratio) = (square_m as f32, (marker_m / square_m) as f32);
        let spec = CharucoBoardSpec::new(rows, columns, square, ratio, dictionary);
        let detector = CharucoDetector::new(CharucoParams::for_board(spec));
        detector.map(Self).map_err(|e| e.to_string())
    }

    /// Corners in one image's picture: id and raw pixel, integers at pixel centres.
    pub(super) fn corners(&self, image: &ImageFrame) -> Vec<(u32, [f64; 2])> {
        let view = calib_targets_charuco::GrayImageView {
            width: image.width_px,
            height: image.height_px,
            data: &image.luma,
        };
        // A miss is no error: the other frames may show the board.
        let Ok(found) = self.0.detect(&view) else {
            return Vec::new();
        };
        let corners = found.corners.iter();
        corners
            .map(|c| (c.id, [f64::from(c.position.x), f64::from(c.position.y)]))
            .collect()
    }
}

/// Without the feature there is no detector.
#[cfg(not(feature = "calibration"))]
pub(super) enum CornerDetector {}

#[cfg(not(feature = "calibration"))]
impl CornerDetector {
    /// Always refuses.
    ///
    /// # Errors
    /// How a build with the detector is made.
    pub(super) fn new(
        _squares: [u32; 2],
        _sides_m: [f64; 2],
        _dictionary: &str,
    ) -> Result<Self, String> {
        Err(
            "this build cannot find printed boards; build it with `cargo build --release -p wag \
             --features calibration` (the Debian package has it), or show the lead instead \
             (--lead, --lead-rgb)"
                .to_owned(),
        )
    }

    /// Corners in one image's picture.
    pub(super) fn corners(&self, _eye: &ImageFrame) -> Vec<(u32, [f64; 2])> {
        match *self {}
    }
}
