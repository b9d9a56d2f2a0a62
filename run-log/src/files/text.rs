//! Values in files of one text each: JSON and TOML, read with errors that name file and
//! field.

use super::atomic::write_atomic;
use anyhow::{Context, Result, anyhow, ensure};
use arm_model::response::Excitation;
use arm_model::{ArmResponse, Cell};
use serde::de::DeserializeOwned;
use shared_types::Plan;
use shared_types::file_error::why;
use shared_types::plan::trajectory_hash_hex;
use std::path::Path;

/// What a failure to read `path` is called.
pub(crate) fn cannot_read(path: &Path) -> impl FnOnce(std::io::Error) -> anyhow::Error + '_ {
    move |error| anyhow!("cannot read `{}`: {}", path.display(), why(&error))
}

/// Reads a text file.
pub fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(cannot_read(path))
}

/// Reads JSON.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    serde_json::from_str(&read_text(path)?).with_context(|| format!("`{}`", path.display()))
}

/// Reads TOML; `what` is what errors call the file.
///
/// # Errors
/// The file cannot be read, or is no TOML of this type.
pub fn read_toml<T: DeserializeOwned>(path: &Path, what: &str) -> Result<T> {
    toml::from_str(&read_text(path)?).with_context(|| format!("{what} `{}`", path.display()))
}

/// A refusal of values; where their text alone is refused for the same reason, that refusal,
/// which knows the line.
pub fn located<T>(refusal: toml::de::Error, alone: Result<T, toml::de::Error>) -> toml::de::Error {
    let alone = alone.err();
    let located = alone.filter(|alone| alone.message() == refusal.message());
    located.unwrap_or(refusal)
}

/// Reads a cell, as a run keeps it.
pub fn read_cell(path: &Path) -> Result<Cell> {
    read_toml(path, "cell file")
}

/// Reads a plan and verifies that it was not changed after it was planned.
pub fn read_plan(path: &Path) -> Result<Plan> {
    let plan: Plan = serde_json::from_str(&read_text(path)?).with_context(|| {
        let name = path.display();
        format!("`{name}` is not a plan (JSON, as `wag plan` writes it)")
    })?;
    ensure!(
        trajectory_hash_hex(&plan.trajectory) == plan.trajectory_sha256,
        "`{}`: `trajectory_sha256` does not match the waypoints; the file was changed by hand or \
         damaged, plan again",
        path.display()
    );
    Ok(plan)
}

/// Reads the sweep an arm is to be measured with; keys left out keep their defaults.
pub fn read_excitation(path: &Path) -> Result<Excitation> {
    read_toml(path, "excitation")
}

/// Reads how an arm follows its setpoints.
pub fn read_arm_response(path: &Path) -> Result<ArmResponse> {
    read_toml(path, "arm response")
}

/// Writes how an arm follows its setpoints, as measured.
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
        let said = format!("{:#}", read_excitation(&path).unwrap_err());
        assert!(
            said.contains("sweep.toml") && said.contains("loudness"),
            "{said}"
        );
    }
}
