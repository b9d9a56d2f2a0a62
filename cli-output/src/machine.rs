//! What the figures were measured on.

use serde::Serialize;
use std::fmt;

/// Processor and program.
#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    /// Model name as the operating system has it.
    pub cpu: String,
    /// Vector instructions found at run time.
    pub features: Vec<&'static str>,
    /// Cores this process may use.
    pub cores: usize,
    /// Version of this program.
    pub version: &'static str,
}

impl Machine {
    /// The machine this process runs on.
    pub fn here() -> Self {
        Self {
            cpu: cpu_model(),
            features: vector_features(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            version: shared_types::VERSION,
        }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let features = if self.features.is_empty() {
            "no known vector instructions".to_owned()
        } else {
            self.features.join(" ")
        };
        write!(
            f,
            "{}, {features}, {} cores, wag {}",
            self.cpu, self.cores, self.version
        )
    }
}

/// First model name of `/proc/cpuinfo`; the architecture where there is none.
fn cpu_model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text
        .lines()
        .filter_map(|line| line.split_once(':'))
        .find(|(key, _)| key.trim() == "model name")
        .map(|(_, value)| value.trim().to_owned());
    model.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

#[cfg(target_arch = "x86_64")]
fn vector_features() -> Vec<&'static str> {
    [
        ("fma", is_x86_feature_detected!("fma")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
        ("avx512dq", is_x86_feature_detected!("avx512dq")),
        ("avx512vl", is_x86_feature_detected!("avx512vl")),
    ]
    .into_iter()
    .filter_map(|(name, found)| found.then_some(name))
    .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn vector_features() -> Vec<&'static str> {
    Vec::new()
}
