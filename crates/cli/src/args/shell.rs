//! Arguments of `asperity completions` and `asperity man`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  source <(asperity completions bash)       # a line for ~/.bashrc
  asperity completions fish > ~/.config/fish/completions/asperity.fish
  asperity completions zsh > ~/.zfunc/_asperity

For zsh, the folder must be in $fpath before compinit runs.")]
pub(crate) struct CompletionsArguments {
    /// The shell.
    #[arg(value_name = "SHELL")]
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity man -o ~/.local/share/man/man1
  man asperity-run

One page for the command and one for each subcommand.")]
pub(crate) struct ManArguments {
    /// Folder for the pages.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Replace existing pages.
    #[arg(long)]
    pub(crate) force: bool,
}
