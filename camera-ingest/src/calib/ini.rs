//! The INI dialect of the factory files: sections and keys without case, `.` as
//! the decimal point whatever the locale, comments after `#` or `;`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::error::CalibError;
use super::mode::VideoMode;

/// Parsed file: text by lower-case section and key.
pub(super) struct Ini {
    path: PathBuf,
    values: HashMap<(String, String), String>,
}

impl Ini {
    pub(super) fn parse(path: &Path, text: &str) -> Result<Self, CalibError> {
        let mut values = HashMap::new();
        let mut section = String::new();
        for (index, raw) in text.lines().enumerate() {
            let line = raw.split(['#', ';']).next().unwrap_or("").trim();
            if line.is_empty() {
                continue;
            }
            if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
                section = name.trim().to_ascii_lowercase();
            } else if let Some((key, value)) = line.split_once('=') {
                let key = key.trim().to_ascii_lowercase();
                values.insert((section.clone(), key), value.trim().to_owned());
            } else {
                let reason = format!(
                    "line {}: expected `key=value` or `[section]`, found {raw:?}; is this a factory \
                     SNxxxx.conf?",
                    index + 1
                );
                return Err(CalibError::calibration(path, reason));
            }
        }
        Ok(Self {
            path: path.to_owned(),
            values,
        })
    }

    fn text(&self, section: &str, key: &str) -> Option<&str> {
        let at = (section.to_ascii_lowercase(), key.to_ascii_lowercase());
        self.values.get(&at).map(String::as_str)
    }

    /// A finite number, `None` if the key is absent.
    pub(super) fn number(&self, section: &str, key: &str) -> Result<Option<f64>, CalibError> {
        let Some(text) = self.text(section, key) else {
            return Ok(None);
        };
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => {
                let problem = "is not a finite number (use '.' as decimal point)";
                Err(self.bad(section, key, problem))
            }
        }
    }

    /// A number that a mode cannot do without.
    pub(super) fn need(
        &self,
        section: &str,
        key: &str,
        mode: VideoMode,
    ) -> Result<f64, CalibError> {
        self.number(section, key)?.ok_or_else(|| {
            let mode = mode.name();
            let reason = format!("[{section}] has no `{key}`; the mode `{mode}` needs it");
            CalibError::calibration(&self.path, reason)
        })
    }

    /// Error about a value that is present.
    pub(super) fn bad(&self, section: &str, key: &str, problem: &str) -> CalibError {
        let text = self.text(section, key).unwrap_or_default();
        let reason = format!("[{section}] {key} = {text:?} {problem}");
        CalibError::calibration(&self.path, reason)
    }
}
