//! Files that nothing reads because of a slip in their name.

use cli_output::nearest;
use std::path::{Path, PathBuf};

/// TOML files in `folder` that are none of those that are `read`, each with the one that its name
/// is probably a slip of.
pub fn misnamed<'a>(folder: &Path, read: &[&'a str]) -> Vec<(PathBuf, &'a str)> {
    let stem = |name: &'a str| name.strip_suffix(".toml");
    let meant = |path: &Path| -> Option<&'a str> {
        let name = path.file_name()?.to_str()?;
        let unread = name
            .strip_suffix(".toml")
            .filter(|_| !read.contains(&name))?;
        let stems = read.iter().copied().filter_map(stem);
        let meant = nearest(unread, stems)?;
        read.iter().copied().find(|name| stem(name) == Some(meant))
    };
    let paths = folder.read_dir().into_iter().flatten().flatten();
    let mut found: Vec<_> = paths
        .map(|entry| entry.path())
        .filter_map(|path| meant(&path).map(|meant| (path, meant)))
        .collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_slips_are_told() {
        let dir = tempfile::tempdir().unwrap();
        for name in [
            "planer.toml",
            "planner.toml",
            "demo.toml",
            "camera.conf",
            "notes.toml",
            "lmits.toml",
        ] {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        let read = [
            "planner.toml",
            "limits.toml",
            "camera.toml",
            "cell.toml",
            "rig.toml",
        ];
        let found = misnamed(dir.path(), &read);
        let expected = [
            ("lmits.toml", "limits.toml"),
            ("planer.toml", "planner.toml"),
        ];
        assert_eq!(
            found,
            expected.map(|(name, meant)| (dir.path().join(name), meant))
        );
        assert!(misnamed(&dir.path().join("none"), &read).is_empty());
    }
}
