//! `asperity man`: the help as manual pages, one for the command and one per subcommand.

use std::io;
use std::path::PathBuf;

use asperity_files::{Existing, FileSet, Inputs};
use clap::{Args, CommandFactory};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use crate::args::Arguments;
use crate::exit::Failure;
use crate::outputs::{A_FOLDER, create_folder, fits, refused};
use crate::terminal;

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

pub(crate) fn command(arguments: &ManArguments) -> Result<(), Failure> {
    let folder = &arguments.out;
    fits("--out", folder, "", A_FOLDER)?;
    let mut all = Arguments::command().disable_help_subcommand(true);
    all.build();
    let mut pages = Vec::new();
    let help = all.get_after_help().map(ToString::to_string).unwrap_or_default();
    let exit_codes = help.find(EXIT_CODES).map_or("", |start| &help[start..]);
    collect(&all, exit_codes, &mut pages)?;
    let pages: Vec<_> = pages.into_iter().map(|(name, page)| (folder.join(name), page)).collect();
    create_folder(folder)?;
    let existing = if arguments.force { Existing::Replace } else { Existing::Refuse };
    let files = FileSet::new(existing, Inputs::default());
    let refused = |error| refused("--out", &error, true);
    for (path, page) in &pages {
        files.write(path, page).map_err(refused)?;
    }
    files.publish().map_err(refused)?;
    for (path, _) in &pages {
        terminal::say(path.display())?;
    }
    Ok(())
}

/// Their heading, in the help of the whole command.
const EXIT_CODES: &str = "Exit codes:";

/// Collects the pages of a command and its subcommands, each with its file name and with all exit codes.
fn collect(command: &clap::Command, exit_codes: &str, pages: &mut Vec<(String, Vec<u8>)>) -> io::Result<()> {
    let version = format!("asperity {}", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).source(version).manual("Asperity");
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut page)?;
    }
    let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let also = if help.contains(EXIT_CODES) { "" } else { exit_codes };
    after_help(&format!("{help}\n{also}")).to_writer(&mut page)?;
    pages.push((man.get_filename(), page));
    command.get_subcommands().try_for_each(|below| collect(below, exit_codes, pages))
}

/// Converts the text below the options: short lines that end with a colon become headings, indented
/// lines stay as they are, and the rest is flowing text.
fn after_help(text: &str) -> Roff {
    let mut page = Roff::new();
    let mut is_verbatim = false;
    let mut in_examples = false;
    for line in text.lines() {
        if line.starts_with("  ") != is_verbatim {
            is_verbatim = !is_verbatim;
            page.control(if is_verbatim { "nf" } else { "fi" }, []);
        }
        let heading = line.strip_suffix(':').filter(|heading| heading.split(' ').count() <= 2);
        match heading {
            _ if is_verbatim => {
                page.text([roman(line)]);
            }
            Some(heading) => {
                in_examples = heading == "Examples";
                page.control("SH", [heading.to_uppercase().as_str()]);
            }
            None if line.is_empty() => {
                page.control("PP", []);
            }
            None => {
                if in_examples {
                    page.control("SH", ["NOTES"]);
                    in_examples = false;
                }
                page.text([roman(line)]);
            }
        }
    }
    if is_verbatim {
        page.control("fi", []);
    }
    page
}
