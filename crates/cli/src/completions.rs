//! `asperity completions`: the completion script of a shell.

use clap::{Args, CommandFactory};

use crate::args::Arguments;
use crate::exit::Failure;
use crate::terminal;

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

pub(crate) fn command(arguments: &CompletionsArguments) -> Result<(), Failure> {
    // Into memory first, since the generator panics if its output cannot be written.
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "asperity", &mut script);
    Ok(terminal::print(&script)?)
}
