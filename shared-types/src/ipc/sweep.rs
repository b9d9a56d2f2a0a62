//! The last one out turns off the light: a domain's last file.
//!
//! The library keeps one small counter per domain and never removes it, so a
//! machine that throws a thousand times would keep a thousand of them.

use super::bus::Transport;
use super::domain::{config_of, is_hash, prefix_of};
use iceoryx2::prelude::{CallbackProgression, Node, NodeState};
use std::path::Path;

/// Where shared memory lies on Linux.
const SHARED_MEMORY: &str = "/dev/shm";
/// What the counter's name ends with.
const COUNTER_SUFFIX: &str = ".global_mgmt";

/// Removes what is left of a domain when dropped, unless somebody still uses
/// it. Drop it after the process's last [`super::Bus`] of that domain. Not
/// RT-safe.
#[derive(Debug)]
pub struct DomainSweep {
    domain: String,
}

impl DomainSweep {
    /// Of `domain`.
    #[must_use]
    pub fn new(domain: &str) -> Self {
        Self {
            domain: domain.to_owned(),
        }
    }

    /// Whether a living process, or one that cannot be looked at, uses the domain.
    fn is_in_use(&self) -> bool {
        let Ok(config) = config_of(&self.domain) else {
            return true;
        };
        let mut in_use = false;
        let listed = Node::<Transport>::list(&config, |node| {
            in_use |= !matches!(node, NodeState::Dead(_));
            CallbackProgression::Continue
        });
        in_use || listed.is_err()
    }

    /// Whether a file is this domain's counter: its prefix, a hash without
    /// further underscores, the suffix. `run-1` must not take `run-1_b` for
    /// its own.
    fn owns(&self, name: &str) -> bool {
        name.strip_prefix(&prefix_of(&self.domain))
            .and_then(|rest| rest.strip_suffix(COUNTER_SUFFIX))
            .and_then(|rest| rest.split_once('_'))
            .is_some_and(|(hash, _)| is_hash(hash))
    }
}

impl Drop for DomainSweep {
    fn drop(&mut self) {
        if self.is_in_use() {
            return;
        }
        let Ok(files) = Path::new(SHARED_MEMORY).read_dir() else {
            return;
        };
        for file in files.flatten() {
            if file.file_name().to_str().is_some_and(|n| self.owns(n)) {
                let _ = std::fs::remove_file(file.path());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::Bus;

    fn files(domain: &str) -> usize {
        let prefix = prefix_of(domain);
        let all = Path::new(SHARED_MEMORY).read_dir().unwrap().flatten();
        all.filter(|f| f.file_name().to_string_lossy().starts_with(&prefix))
            .count()
    }

    #[test]
    fn the_last_user_of_a_domain_leaves_nothing() {
        let domain = format!("test_sweep_{}", std::process::id());
        let sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let other = Bus::join(&domain).unwrap();
        drop(other);
        drop(DomainSweep::new(&domain));
        assert!(files(&domain) > 0, "somebody is still there");
        drop(bus);
        drop(sweep);
        assert_eq!(files(&domain), 0);
    }

    #[test]
    fn a_longer_domain_name_is_another_domain() {
        let hash = "0".repeat(40);
        let sweep = DomainSweep::new("run-1");
        assert!(sweep.owns(&format!("wag_run-1_{hash}_node.0_10_0.global_mgmt")));
        assert!(!sweep.owns(&format!("wag_run-1_b_{hash}_node.0_10_0.global_mgmt")));
        assert!(!sweep.owns(&format!("wag_run-1_{hash}_node.0_10_0.dynamic")));
    }
}
