//! Asking git about this repository, without touching the user's checkout,
//! index or branches.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::say::say;
use crate::workspace::{Failure, not_started};

/// Variables inherited from a hook or an alias of git that would redirect its commands.
const HANDED_DOWN: [&str; 5] =
    ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_COMMON_DIR", "GIT_OBJECT_DIRECTORY"];

/// A git repository with a checkout.
#[derive(Debug, Clone)]
pub(crate) struct Repository {
    root: PathBuf,
}

/// A commit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Commit {
    /// All forty digits.
    pub(crate) id: String,
    /// As many digits as git shows, and the first line of the message.
    pub(crate) title: String,
}

impl Commit {
    /// Name of its folders: equal in every checkout, however git abbreviates.
    pub(crate) fn short(&self) -> &str {
        &self.id[..12]
    }
}

impl Repository {
    pub(crate) fn new(root: &Path) -> Repository {
        Repository { root: root.to_owned() }
    }

    fn git(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new("git");
        // Disables hooks for read-only work, and keeps `status` from writing the index.
        command.args(["-c", "core.hooksPath=/dev/null", "--no-optional-locks"]);
        command.args(arguments).current_dir(&self.root);
        for name in HANDED_DOWN {
            command.env_remove(name);
        }
        command
    }

    /// Returns the output of git.
    ///
    /// # Errors
    /// If it fails; with its message.
    pub(crate) fn output(&self, arguments: &[&str]) -> Result<String, Failure> {
        let mut command = self.git(arguments);
        let output = command.output().map_err(|error| not_started(&command, error))?;
        if output.status.success() {
            return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
        }
        Err(Failure::Check(format!(
            "git {}: {}",
            arguments.join(" "),
            String::from_utf8_lossy(&output.stderr).trim()
        )))
    }

    /// Whether git succeeds; discards its output.
    pub(crate) fn says_yes(&self, arguments: &[&str]) -> Result<bool, Failure> {
        let mut command = self.git(arguments);
        let output = command.output().map_err(|error| not_started(&command, error))?;
        Ok(output.status.success())
    }

    /// The commit that a revision names.
    pub(crate) fn commit(&self, revision: &str) -> Result<Commit, Failure> {
        let named = format!("{revision}^{{commit}}");
        let id = self.output(&["rev-parse", "--verify", "--quiet", "--end-of-options", &named]).map_err(
            |_refused| {
                Failure::Check(format!(
                    "{revision} is no revision of this repository (accepted: what git rev-parse takes, such \
                     as a commit, a tag, a branch or HEAD~3)"
                ))
            },
        )?;
        let id = id.trim().to_owned();
        let title = self.output(&["log", "-1", "--format=%h %s", &id])?.trim().to_owned();
        Ok(Commit { id, title })
    }

    /// Files that differ from the last commit or are not in it, as `git status` has them.
    pub(crate) fn changed_files(&self) -> Result<usize, Failure> {
        Ok(self.output(&["status", "--porcelain", "--untracked-files=all"])?.lines().count())
    }

    /// Whether a commit has a file.
    pub(crate) fn has(&self, commit: &Commit, path: &str) -> Result<bool, Failure> {
        self.says_yes(&["cat-file", "-e", &format!("{}:{path}", commit.id)])
    }

    /// A file of a commit.
    pub(crate) fn show(&self, commit: &Commit, path: &str) -> Result<String, Failure> {
        self.output(&["show", &format!("{}:{path}", commit.id)])
    }

    /// Makes a checkout of a commit elsewhere, which belongs to no branch.
    ///
    /// One of an earlier call that was killed is replaced.
    pub(crate) fn worktree(&self, commit: &Commit, folder: &Path) -> Result<Worktree, Failure> {
        self.forget_worktree(folder)?;
        // Before git starts, so that its leftovers after an interruption are removed as well.
        let worktree = Worktree { repository: self.clone(), folder: folder.to_owned() };
        self.output(&["worktree", "add", "--quiet", "--detach", utf8(folder)?, &commit.id])?;
        Ok(worktree)
    }

    /// Removes a worktree, as far as it exists: its folder, and the entry of git.
    ///
    /// Not by `git worktree prune`, which would forget worktrees of the user's
    /// as well, if their disk is not at hand.
    pub(crate) fn forget_worktree(&self, folder: &Path) -> Result<(), Failure> {
        if self.has_worktree(folder)? {
            // Twice: also if it is locked, as an interrupted creation leaves it.
            self.output(&["worktree", "remove", "--force", "--force", utf8(folder)?])?;
        }
        match std::fs::remove_dir_all(folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(Failure::Io { what: format!("remove {}", folder.display()), error })
            }
            _ => Ok(()),
        }
    }

    fn has_worktree(&self, folder: &Path) -> Result<bool, Failure> {
        let listed = self.output(&["worktree", "list", "--porcelain"])?;
        let folder = resolved(folder);
        let mut paths = listed.lines().filter_map(|line| line.strip_prefix("worktree "));
        Ok(paths.any(|path| Path::new(path) == folder))
    }
}

/// A checkout of a commit that goes when this is dropped.
#[derive(Debug)]
pub(crate) struct Worktree {
    repository: Repository,
    folder: PathBuf,
}

impl Worktree {
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Drop for Worktree {
    fn drop(&mut self) {
        if let Err(failure) = self.repository.forget_worktree(&self.folder) {
            say!("warning: {} is left until the next call: {failure}", self.folder.display());
        }
    }
}

/// A path as git lists it: without links, whether the folder itself is there or not.
fn resolved(folder: &Path) -> PathBuf {
    let parent = folder.parent().and_then(|parent| parent.canonicalize().ok());
    match (parent, folder.file_name()) {
        (Some(parent), Some(name)) => parent.join(name),
        _ => folder.to_owned(),
    }
}

fn utf8(path: &Path) -> Result<&str, Failure> {
    path.to_str().ok_or_else(|| {
        Failure::Check(format!("{} is no path in UTF-8, which git needs here", path.display()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A repository of two commits.
    fn repository() -> (tempfile::TempDir, Repository) {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let repository = Repository::new(folder.path());
        let git = |arguments: &[&str]| repository.output(arguments).expect("git does as it is told");
        git(&["init", "--quiet", "--initial-branch=main"]);
        git(&["config", "user.name", "A"]);
        git(&["config", "user.email", "a@example.org"]);
        fs::create_dir(folder.path().join("src")).expect("the folder can be written");
        for text in ["shape\n", "shape\ncolour\n"] {
            fs::write(folder.path().join("src/keys"), text).expect("the folder can be written");
            git(&["add", "."]);
            git(&["commit", "--quiet", "-m", text.lines().last().unwrap_or_default()]);
        }
        fs::write(folder.path().join(".gitignore"), "/target\n").expect("the folder can be written");
        (folder, repository)
    }

    /// The changes visible to a user.
    fn state(repository: &Repository) -> [String; 4] {
        let git = |arguments: &[&str]| repository.output(arguments).expect("git answers");
        [
            git(&["status", "--porcelain"]),
            git(&["worktree", "list"]),
            git(&["for-each-ref"]),
            git(&["ls-files", "--stage"]),
        ]
    }

    #[test]
    fn a_worktree_comes_and_goes_and_leaves_the_checkout_alone() {
        let (folder, repository) = repository();
        let before = state(&repository);
        let path = folder.path().join("target/old");
        let old = repository.commit("HEAD~1").expect("the revision is there");
        {
            let worktree = repository.worktree(&old, &path).expect("git makes it");
            let text = fs::read_to_string(worktree.folder().join("src/keys")).expect("it is checked out");
            assert_eq!(text, "shape\n");
            assert_ne!(state(&repository)[1], before[1], "git lists it while it is there");
        }
        assert!(!path.exists());
        assert_eq!(state(&repository), before);
        fs::write(folder.path().join("src/new"), "not even added\n").expect("the folder can be written");
        assert_eq!(repository.changed_files().expect("git answers"), 2);
    }

    #[test]
    fn what_a_killed_call_left_is_replaced() {
        let (folder, repository) = repository();
        let before = state(&repository);
        let path = folder.path().join("target/old");
        let old = repository.commit("HEAD~1").expect("the revision is there");
        // Killed while it was there; its folder cleared away by hand; killed while git made it.
        let leave: [fn(&Repository, &Path); 3] = [
            |_, _| {},
            |_, path| fs::remove_dir_all(path).expect("the folder is there"),
            |repository, path| {
                let path = path.to_str().expect("a plain name");
                repository.output(&["worktree", "lock", path]).expect("git locks it");
            },
        ];
        for leave in leave {
            std::mem::forget(repository.worktree(&old, &path).expect("git makes it"));
            leave(&repository, &path);
            drop(repository.worktree(&old, &path).expect("what was left does not stand in the way"));
            assert_eq!(state(&repository), before);
        }
        // A folder that git does not know of.
        fs::create_dir_all(path.join("src")).expect("the folder can be written");
        drop(repository.worktree(&old, &path).expect("nor does a foreign folder"));
        assert_eq!(state(&repository), before);
    }

    #[test]
    fn a_revision_that_is_none_is_refused_by_name() {
        let (_folder, repository) = repository();
        let refused = repository.commit("no-such").expect_err("there is none");
        assert!(refused.to_string().starts_with("no-such is no revision"), "{refused}");
        let refused = repository.commit("--help").expect_err("an option is no revision");
        assert!(refused.to_string().starts_with("--help is no revision"), "{refused}");
    }
}
