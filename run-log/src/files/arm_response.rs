//! `arm-response.toml`: how an arm follows its setpoints.

use super::atomic::write_atomic;
use super::text::read_text;
use crate::Result;
use crate::error::At;
use arm_model::ArmResponse;
use arm_model::response::Excitation;
use std::path::Path;

/// Writes a measured response.
///
/// # Errors
/// The file cannot be written.
pub fn write_arm_response(path: &Path, response: &ArmResponse) -> Result<()> {
    let text = format!(
        "# How an arm follows its setpoints, measured by wag {}: dead time, then a\n\
         # second-order lag of gain one. SI units; intervals hold the truth in 95 of\n\
         # 100 measurements. A joint with excited = false is not known.\n{}",
        response.version,
        toml::to_string(response)?
    );
    write_atomic(path, text.as_bytes())
}

/// Reads a measured response.
///
/// # Errors
/// The file cannot be read or is not as it should be.
pub fn read_arm_response(path: &Path) -> Result<ArmResponse> {
    toml::from_str(&read_text(path)?).at(|| format!("arm response `{}`", path.display()))
}

/// Reads the sweep an arm is to be measured with; keys left out keep their
/// defaults.
///
/// # Errors
/// The file cannot be read or is not as it should be.
pub fn read_excitation(path: &Path) -> Result<Excitation> {
    toml::from_str(&read_text(path)?).at(|| format!("excitation `{}`", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JOINTS;
    use arm_model::response::{JointResponse, NotExcited};

    #[test]
    fn a_response_can_be_read_as_it_was_written() {
        let response = ArmResponse {
            version: "0.0.1".to_owned(),
            source: "a test".to_owned(),
            command_to_target_s: None,
            excitation: Some(Excitation::default()),
            joints: [JointResponse::NotExcited(NotExcited::Still); JOINTS],
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("arm-response.toml");
        write_arm_response(&path, &response).unwrap();
        assert_eq!(read_arm_response(&path).unwrap(), response);
    }

    #[test]
    fn an_excitation_may_name_only_what_differs() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sweep.toml");
        std::fs::write(&path, "highest_hz = 10.0\n").unwrap();
        let e = read_excitation(&path).unwrap();
        assert_eq!(e.highest_hz, 10.0);
        assert_eq!(e.duration_s, Excitation::default().duration_s);
        std::fs::write(&path, "loudness = 11\n").unwrap();
        let said = format!(
            "{:#}",
            anyhow::Error::from(read_excitation(&path).unwrap_err())
        );
        assert!(
            said.contains("sweep.toml") && said.contains("loudness"),
            "{said}"
        );
    }
}
