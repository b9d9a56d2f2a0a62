//! Which domains of this machine have a controller.

use super::domain::{is_hash, prefix_of, root_folder};
use super::{Bus, DomainSweep, StateReader};

/// Domain of a service's file, `wag_DOMAIN_HASH.service`.
fn domain_in(file: &str) -> Option<&str> {
    let (head, hash) = file.strip_suffix(".service")?.rsplit_once('_')?;
    let domain = head.strip_prefix("wag_").filter(|_| is_hash(hash))?;
    // The one place that builds the prefix must agree.
    (prefix_of(domain) == format!("{head}_")).then_some(domain)
}

/// Domains of this user in which a controller runs, in alphabetical order. Not
/// RT-safe.
#[must_use]
pub fn running_controllers() -> Vec<String> {
    let Ok(root) = root_folder() else {
        return Vec::new();
    };
    let files = root.join("services").read_dir().into_iter().flatten();
    let mut domains: Vec<String> = files
        .flatten()
        .filter_map(|file| domain_in(file.file_name().to_str()?).map(str::to_owned))
        .collect();
    domains.sort_unstable();
    domains.dedup();
    domains.retain(|domain| has_controller(domain));
    domains
}

fn has_controller(domain: &str) -> bool {
    let _sweep = DomainSweep::new(domain);
    // Joining removes what killed processes left; what opens then is alive.
    Bus::join(domain)
        .and_then(|bus| StateReader::open(&bus).map(|_| ()))
        .is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::ControllerBoards;

    #[test]
    fn domains_are_read_from_file_names() {
        let hash = "0".repeat(40);
        let of = |name: String| domain_in(&name).map(str::to_owned);
        assert_eq!(
            of(format!("wag_my_cam_{hash}.service")).as_deref(),
            Some("my_cam")
        );
        assert_eq!(of(format!("wag_my_cam_{hash}.dynamic")), None);
        assert_eq!(of("wag_my_cam_123.service".to_owned()), None);
        assert_eq!(of(format!("iox2_{hash}.service")), None);
    }

    #[test]
    fn a_controller_is_listed_while_it_runs() {
        let domain = format!("test_domains_{}", std::process::id());
        let other = format!("{domain}_empty");
        let _sweeps = (DomainSweep::new(&domain), DomainSweep::new(&other));
        let (bus, empty) = (Bus::join(&domain).unwrap(), Bus::join(&other).unwrap());
        let _no_controller = empty.cycle_publisher().unwrap();
        let boards = ControllerBoards::create(&bus).unwrap();
        let listed = running_controllers();
        assert!(listed.contains(&domain), "{listed:?}");
        assert!(!listed.contains(&other), "{listed:?}");
        drop(boards);
        assert!(!running_controllers().contains(&domain));
    }
}
