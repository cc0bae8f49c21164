//! `asperity man`: the help as manual pages, one for the command and one per subcommand.

use std::io;

use asperity_files::{Existing, FileSet, Inputs};
use clap::CommandFactory;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use crate::args::{Arguments, ManArguments};
use crate::exit::Failure;
use crate::outputs::{A_FOLDER, create_folder, fits, refused};
use crate::terminal;

pub(crate) fn command(arguments: &ManArguments) -> Result<(), Failure> {
    let folder = &arguments.out;
    fits("--out", folder, "", A_FOLDER)?;
    let mut all = Arguments::command().disable_help_subcommand(true);
    all.build();
    let mut pages = Vec::new();
    collect(&all, &mut pages)?;
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

/// Collects the pages of a command and its subcommands, each with its file name.
fn collect(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> io::Result<()> {
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
    if let Some(help) = command.get_after_help() {
        after_help(&help.to_string()).to_writer(&mut page)?;
    }
    pages.push((man.get_filename(), page));
    command.get_subcommands().try_for_each(|below| collect(below, pages))
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
