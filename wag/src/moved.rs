//! Commands that another program has taken over.

/// Benchmarks of the program `experiments`.
const BENCHES: [&str; 4] = ["rope", "identify", "plan", "track"];

/// What to call instead of a command line that `wag` no longer knows.
pub fn replacement(arguments: impl Iterator<Item = String>) -> Option<String> {
    let words: Vec<String> = arguments.collect();
    let is_option = |w: &String| w.starts_with('-') || w.parse::<u64>().is_ok();
    let command = words.iter().position(|w| !is_option(w))?;
    let options = words[..command].iter();
    let rest = match words[command].as_str() {
        "reproduce" => &words[command + 1..],
        "bench" => {
            let mut names = words[command + 1..].iter();
            names.find(|w| BENCHES.contains(&w.as_str()))?;
            &words[command..]
        }
        _ => return None,
    };
    let line: Vec<&str> = options.chain(rest).map(String::as_str).collect();
    Some(format!(
        "`wag {}` has moved: call `cargo run --release -p experiments -- {}`",
        words.join(" "),
        line.join(" ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(line: &str) -> Option<String> {
        replacement(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn what_has_moved_is_named_with_its_arguments() {
        for (old, new) in [
            (
                "reproduce sysid --ropes 2",
                "experiments -- sysid --ropes 2`",
            ),
            ("--json reproduce robust", "experiments -- --json robust`"),
            ("bench rope --quick", "experiments -- bench rope --quick`"),
            ("bench --live track", "experiments -- bench --live track`"),
        ] {
            let said = of(old).unwrap_or_default();
            assert!(said.contains(old) && said.ends_with(new), "{old}: {said}");
        }
        for kept in [
            "bench rt --cpu x",
            "bench",
            "plan strike --out bench",
            "",
            "--json",
        ] {
            assert_eq!(of(kept), None, "{kept}");
        }
    }
}
