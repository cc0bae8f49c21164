//! Builds the `asperity` command of another revision from an archive of its sources: git's checkout, index and branches
//! are not touched. The command of a commit is kept under `target/diff-events`, since a commit does not change, and so are
//! the libraries of others, which nearly all revisions share.

use std::env;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::say::say;
use crate::workspace::{Failure, asperity, cargo, emptied, io, not_started, program, run, target_folder};

/// Variables inherited from a hook or an alias of git that would redirect its commands.
const HANDED_DOWN: [&str; 5] =
    ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR", "GIT_OBJECT_DIRECTORY"];

/// The package that the command is built from.
const PACKAGE: &str = "asperity-cli";

/// A revision of this project.
#[derive(Debug, Clone)]
pub(crate) struct Revision {
    /// All forty digits of the commit; for this checkout, of the one that it is based on.
    id: String,
    /// For messages: the commit's first digits and first line, and what else a checkout has.
    pub(crate) title: String,
    /// Name of its folders: equal in every checkout, however git abbreviates.
    pub(crate) name: String,
    is_checkout: bool,
}

impl Revision {
    /// What git takes for a commit, such as a tag, a branch or HEAD~3.
    ///
    /// # Errors
    /// If it names none.
    pub(crate) fn of(revision: &str) -> Result<Revision, Failure> {
        let named = format!("{revision}^{{commit}}");
        let id = git(&["rev-parse", "--verify", "--quiet", "--end-of-options", &named]).map_err(|_refused| {
            Failure::Check(format!(
                "{revision} is no revision of this repository (accepted: what git rev-parse takes, such as a commit, a \
                 tag, a branch or HEAD~3)"
            ))
        })?;
        let id = id.trim().to_owned();
        let title = git(&["log", "-1", "--format=%h %s", &id])?.trim().to_owned();
        Ok(Revision { name: id[..12].to_owned(), id, title, is_checkout: false })
    }

    /// This checkout as it stands.
    ///
    /// # Errors
    /// If git does not answer.
    pub(crate) fn checkout() -> Result<Revision, Failure> {
        let mut revision = Revision::of("HEAD")?;
        revision.is_checkout = true;
        revision.title = format!("this checkout, {}", revision.title);
        let files = git(&["status", "--porcelain", "--untracked-files=all"])?.lines().count();
        if files > 0 {
            revision.title += &format!(" and changes in {files} files not committed");
            revision.name += "-changed";
        }
        Ok(revision)
    }

    /// A file of a commit, if it has that.
    pub(crate) fn file(&self, path: &str) -> Option<String> {
        git(&["show", &format!("{}:{path}", self.id)]).ok().filter(|_| !self.is_checkout)
    }

    /// Its `asperity` command, built unless an earlier call has done it.
    ///
    /// # Errors
    /// If it has no such command, or does not build.
    pub(crate) fn asperity(&self) -> Result<PathBuf, Failure> {
        if self.is_checkout {
            return Ok(asperity()?.get_program().into());
        }
        let all = target_folder().join("diff-events");
        let folder = all.join(&self.name);
        let failed = io("write into", &folder);
        fs::create_dir_all(&folder).map_err(&failed)?;
        // Two calls at once would take each other's command. The lock goes with the file.
        let lock = File::create(all.join("lock")).map_err(&failed)?;
        lock.lock().map_err(&failed)?;
        let name = format!("asperity{}", env::consts::EXE_SUFFIX);
        let binary = folder.join(&name);
        if binary.exists() {
            say!("==> {}: built before", self.title);
            return Ok(binary);
        }
        say!("==> {}: building", self.title);
        let started = Instant::now();
        let [sources, target, archive] = ["sources", "target", "sources.tar"].map(|name| all.join(name));
        emptied(&sources)?;
        let mut packing = git_command(&["archive", "--format=tar", &self.id, "--output"]);
        run(packing.arg(&archive))?;
        // As files of now: cargo takes older ones for those that it compiled last.
        run(program("tar").arg("-xmf").arg(&archive).arg("-C").arg(&sources))?;
        let cargo = |arguments: &[&str]| {
            let mut cargo = cargo(arguments);
            cargo.args(["--locked", "--package", PACKAGE]);
            cargo.current_dir(&sources).env("CARGO_TARGET_DIR", &target);
            cargo
        };
        // Checked first: a build exits alike whether the network is missing or its sources fail.
        let mut resolved = cargo(&["tree", "--offline", "--edges", "normal,build"]);
        let is_at_hand = run(resolved.stdout(Stdio::null()).stderr(Stdio::null())).is_ok();
        let offline: &[&str] = if is_at_hand { &["--offline"] } else { &[] };
        run(cargo(&["build"]).args(offline).stdout(Stdio::null())).map_err(|_| {
            Failure::Check(format!(
                "{} does not build here; what cargo says stands above (accepted: a revision that builds with this \
                 toolchain, and the network, for dependencies that are not at hand)",
                self.title
            ))
        })?;
        // Under its name only when it is whole.
        let partial = folder.join("partial");
        fs::copy(target.join("debug").join(&name), &partial)
            .and_then(|_bytes| fs::rename(&partial, &binary))
            .and_then(|()| fs::remove_file(&archive))
            .and_then(|()| fs::remove_dir_all(&sources))
            .map_err(failed)?;
        say!("==> {}: built in {:.0} s", self.title, started.elapsed().as_secs_f64());
        Ok(binary)
    }
}

/// Git in this repository, without hooks and without writing the index.
fn git_command(arguments: &[&str]) -> Command {
    let mut command = program("git");
    command.args(["-c", "core.hooksPath=/dev/null", "--no-optional-locks"]).args(arguments);
    HANDED_DOWN.iter().for_each(|name| {
        command.env_remove(name);
    });
    command
}

/// The output of git, which keeps its complaints to itself.
fn git(arguments: &[&str]) -> Result<String, Failure> {
    let mut command = git_command(arguments);
    let output = command.output().map_err(not_started(&command))?;
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(Failure::Check(format!("git {}: {}", arguments.join(" "), said(&output.stderr)))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revision_that_is_none_is_refused_by_name() {
        for none in ["no-such", "--help"] {
            let refused = Revision::of(none).expect_err("there is none").to_string();
            assert!(refused.starts_with(&format!("{none} is no revision")), "{refused}");
        }
        let head = Revision::of("HEAD").expect("there is a commit");
        assert!(head.file("Cargo.toml").is_some_and(|text| text.contains("[workspace]")));
        assert!(head.file("no-such").is_none());
    }
}
