//! Which DDS domain programs of ROS 2 meet in, as its own programs are told.

use anyhow::{Context, Result, ensure};
use std::env::var_os;

/// Where to publish.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// The DDS domain.
    pub id: u16,
    /// Whether on this machine alone.
    pub is_local: bool,
}

impl Domain {
    /// The largest one whose ports there are.
    const LAST: u16 = 232;

    /// The domain of this number, or else the one that ROS's own programs join: `ROS_DOMAIN_ID`, or
    /// 0; on this machine alone where `ROS_AUTOMATIC_DISCOVERY_RANGE` or `ROS_LOCALHOST_ONLY` has it.
    ///
    /// # Errors
    /// There is no such domain.
    pub fn of(named: Option<u32>) -> Result<Self> {
        let text = |name| var_os(name).map(|text| text.to_string_lossy().into_owned());
        let (id, from) = match (named, text("ROS_DOMAIN_ID").filter(|t| !t.is_empty())) {
            (Some(id), _) => (id.to_string(), "--ros2"),
            (None, Some(id)) => (id, "ROS_DOMAIN_ID"),
            (None, None) => ("0".to_owned(), "--ros2"),
        };
        let last = Self::LAST;
        let fail = || format!("{from}: there is no DDS domain `{id}`, give one of 0 to {last}");
        let number: u16 = id.parse().with_context(fail)?;
        ensure!(number <= last, fail());
        let range = text("ROS_AUTOMATIC_DISCOVERY_RANGE").unwrap_or_default();
        let is_local = ["LOCALHOST", "OFF"].contains(&range.as_str())
            || text("ROS_LOCALHOST_ONLY").is_some_and(|only| only == "1");
        Ok(Self {
            id: number,
            is_local,
        })
    }
}
