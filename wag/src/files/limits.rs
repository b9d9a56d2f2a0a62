//! Limits of the arm: the built-in ones, or what holds here.

use crate::config;
use arm_model::Limits;
use std::path::Path;

/// The limits shipped in `configs/robot/xarm7.toml`, whatever this machine's folders say.
pub fn default_limits() -> anyhow::Result<Limits> {
    config::built_in()
}

/// The limits that hold here, with the file `path` over those of site and rig.
pub fn read_limits(path: Option<&Path>) -> anyhow::Result<Limits> {
    config::here(path)
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
