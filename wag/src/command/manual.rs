//! `wag man` and `wag completions`: the command line, told to `man` and to shells.

use crate::cli::Cli;
use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;
use cli_output::{OrInput, Outcome};
use run_log::files;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// One page for `wag` and one for each of its commands, as `wag-sim-rope.1`.
pub fn man(folder: &Path) -> Outcome<Option<Value>> {
    let mut wag = Cli::command().disable_help_subcommand(true);
    wag.build();
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make folder `{}`", folder.display()))
        .or_input()?;
    let mut pages = Vec::new();
    write_pages(&wag, folder, &mut pages).or_input()?;
    println!(
        "{} pages in `{}`; read one with `man -l {}`",
        pages.len(),
        folder.display(),
        folder.join("wag.1").display()
    );
    Ok(Some(
        json!({ "ok": true, "command": "man", "pages": pages }),
    ))
}

fn write_pages(
    command: &clap::Command,
    folder: &Path,
    pages: &mut Vec<PathBuf>,
) -> anyhow::Result<()> {
    let man = Man::new(command.clone());
    let path = folder.join(man.get_filename());
    let mut page = Vec::new();
    man.render(&mut page)?;
    files::write_atomic(&path, &page)?;
    pages.push(path);
    for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
        write_pages(sub, folder, pages)?;
    }
    Ok(())
}

/// The script a shell completes `wag` by, on standard output.
pub fn completions(shell: Shell) -> Option<Value> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "wag", &mut script);
    let script = String::from_utf8_lossy(&script);
    print!("{script}");
    Some(
        json!({ "ok": true, "command": "completions", "shell": shell.to_string(), "script": script }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_and_what_is_hidden_has_none() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("new/man1");
        let said = man(&folder).unwrap().unwrap();
        let pages = said["pages"].as_array().unwrap().len();
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), pages);
        let page = std::fs::read_to_string(folder.join("wag-sim-rope.1")).unwrap();
        assert!(
            page.contains("wag sim rope") || page.contains("wag\\-sim\\-rope"),
            "{page}"
        );
        assert!(page.contains("fps"), "{page}");
        assert!(folder.join("wag-report.1").is_file());
        assert!(!folder.join("wag-process.1").exists());
    }
}
