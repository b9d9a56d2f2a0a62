//! Limits of the arm: the built-in xArm 7 file or one of the user's.

use super::read_text;
use anyhow::Context;
use shared_types::Limits;
use std::path::Path;

const XARM7: &str = include_str!("../../../configs/robot/xarm7.toml");

/// The limits shipped in `configs/robot/xarm7.toml`.
pub fn default_limits() -> anyhow::Result<Limits> {
    toml::from_str(XARM7).context("the built-in `configs/robot/xarm7.toml` is damaged")
}

/// Limits from `path`, or the built-in ones.
pub fn read_limits(path: Option<&Path>) -> anyhow::Result<Limits> {
    match path {
        None => default_limits(),
        Some(path) => toml::from_str(&read_text(path)?)
            .with_context(|| format!("limits file `{}`", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_file_is_valid_and_keeps_the_vendor_ranges() {
        let shipped = default_limits().unwrap();
        let vendor = Limits::default();
        for j in 0..7 {
            assert!(shipped.position_min_rad[j] >= vendor.position_min_rad[j] - 1e-6);
            assert!(shipped.position_max_rad[j] <= vendor.position_max_rad[j] + 1e-6);
            assert!(shipped.velocity_max_rad_s[j] <= vendor.velocity_max_rad_s[j] + 1e-6);
        }
    }
}
