//! Configuration: the controller's, the limits, and the cell.

use arm_model::{ArmResponse, Cell, Limits};
use rt_controller::ControllerConfig;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// What was read, which can be written and read again.
fn again<T: Serialize + DeserializeOwned + PartialEq + Debug>(text: &str) -> Option<T> {
    let value: T = toml::from_str(text).ok()?;
    let written = toml::to_string(&value).unwrap();
    assert_eq!(toml::from_str::<T>(&written).unwrap(), value);
    Some(value)
}

/// Reads `data` as each kind; what passes its checks resolves, and what was read
/// can be written and read again.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    if let Some(config) = again::<ControllerConfig>(text) {
        if config.check().is_ok() {
            let _ = config.control_settings();
        }
        if config.limits_file.is_none() {
            let _ = config.resolve_limits();
        }
    }
    let _ = (again::<Limits>(text), again::<Cell>(text));
    if let Ok(response) = toml::from_str::<ArmResponse>(text) {
        let _ = toml::to_string(&response).unwrap();
    }
}

/// The files as we write them.
pub fn seeds() -> Vec<Vec<u8>> {
    let config: ControllerConfig = toml::from_str("").unwrap();
    vec![
        toml::to_string(&config).unwrap().into_bytes(),
        toml::to_string(&Limits::default()).unwrap().into_bytes(),
        toml::to_string(&Cell::default()).unwrap().into_bytes(),
        b"[real_time]\npriority = 80\ncpu = 1\nlock_memory = true\nrequire = true\n".to_vec(),
    ]
}
