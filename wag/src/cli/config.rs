//! Arguments of `wag config`.

use crate::config::Kind;
use clap::Subcommand;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print the effective configuration: the built-in values, overridden by those of the
    /// site, of the rig, and of FILE.
    #[command(after_help = "LAYERS, the later over the earlier:\n  \
        built in   the files in configs/ that this program was built with\n  \
        site       planner.toml, limits.toml, cell.toml, rt-controller.toml, rig.toml in\n  \
                   /etc/wag\n  \
        rig        the same in the folder that WAG_CONFIG names, else in ~/.config/wag\n  \
        run        the file named on the command line, as --config FILE of `wag plan`\n\n\
        A file says only what differs from the layers below it.")]
    Show {
        /// What is configured.
        #[arg(value_enum)]
        kind: Kind,
        /// A file that overrides all others, as a run would name it.
        #[arg(value_name = "FILE")]
        run: Option<PathBuf>,
        /// Show which file each value comes from.
        #[arg(long)]
        origin: bool,
    },
    /// Check every file of the site and of the rig, or FILE over them.
    Check {
        /// What is configured; default: everything.
        #[arg(value_enum)]
        kind: Option<Kind>,
        /// A file that overrides all others, as a run would name it.
        #[arg(value_name = "FILE")]
        run: Option<PathBuf>,
    },
}
