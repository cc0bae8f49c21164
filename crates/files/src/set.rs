//! Files that appear together or not at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use crate::create_folder;
use crate::error::FileError;
use crate::inputs::Inputs;
use crate::lock::{Held, wait_for_folder};
use crate::place::{Place, There, folder_of, is_taken};
use crate::rename::{Existing, rename, sync_folder, sync_folder_of};
use crate::stage::Stage;

/// The files that a command writes, possibly from several threads. [`FileSet::publish`] gives them
/// their names together; without it nothing remains of them.
///
/// A killed process leaves a folder `.asperity-XXXXXXXX` beside the names, which the next set there
/// removes.
#[derive(Debug)]
pub struct FileSet(Mutex<State>);

#[derive(Debug)]
struct State {
    existing: Existing,
    inputs: Inputs,
    stages: Vec<Stage>,
    outputs: Vec<Output>,
    /// Dropped after the stages, which are inside these folders.
    made: MadeFolders,
}

/// Folders that were created for the files of a set, parents first. They are removed with it if
/// they are empty.
#[derive(Debug, Default)]
struct MadeFolders(Vec<PathBuf>);

impl Drop for MadeFolders {
    fn drop(&mut self) {
        // A folder with contents is not removed.
        self.0.iter().rev().for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

/// An output that is planned or written.
#[derive(Debug)]
struct Output {
    /// The path as given.
    path: PathBuf,
    place: Place,
    /// None until it is begun.
    staged: Option<Staged>,
    /// A device or pipe, written to in place.
    is_device: bool,
}

/// The temporary place of an output.
#[derive(Debug)]
struct Staged {
    at: PathBuf,
    /// Whether it is the record that lists the other files.
    is_record: bool,
}

impl FileSet {
    /// A set of files that never overwrites one of the `inputs`.
    pub fn new(existing: Existing, inputs: Inputs) -> FileSet {
        let (stages, outputs, made) = <_>::default();
        FileSet(Mutex::new(State { existing, inputs, stages, outputs, made }))
    }

    /// Writes a single file completely.
    ///
    /// # Errors
    /// As [`FileSet::create`] and [`FileSet::publish`].
    pub fn write_one(
        path: &Path,
        content: impl AsRef<[u8]>,
        existing: Existing,
        inputs: Inputs,
    ) -> Result<(), FileError> {
        let files = FileSet::new(existing, inputs);
        files.write(path, content)?;
        files.publish()
    }

    /// Adds inputs of the command.
    ///
    /// # Errors
    /// If an output would overwrite one of them.
    pub fn add_inputs<P: AsRef<Path>>(&self, paths: impl IntoIterator<Item = P>) -> Result<(), FileError> {
        let state = &mut *self.state();
        state.inputs.add(paths);
        let mut outputs = state.outputs.iter().filter(|output| !output.is_device);
        outputs.try_for_each(|output| state.inputs.check(&output.path))
    }

    /// Checks that files can be written, before the work for them begins. Creates their folders as
    /// [`FileSet::folder`] does.
    ///
    /// # Errors
    /// If a name is taken, or is that of an input or of another file of the set.
    pub fn reserve<P: AsRef<Path>>(&self, paths: impl IntoIterator<Item = P>) -> Result<(), FileError> {
        let mut state = self.state();
        paths.into_iter().try_for_each(|path| state.reserve(path.as_ref()).map(drop))
    }

    /// Creates a folder and its missing parents. New ones are removed again if they are empty when
    /// the set is dropped.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn folder(&self, folder: &Path) -> Result<(), FileError> {
        self.state().made.0.extend(create_folder(folder)?);
        Ok(())
    }

    /// Begins a file, whether or not it was reserved.
    ///
    /// # Errors
    /// As [`FileSet::reserve`]; or if the system refuses.
    pub fn create(&self, path: &Path) -> Result<File, FileError> {
        self.state().begin(path, false)
    }

    /// Writes a file completely.
    ///
    /// # Errors
    /// As [`FileSet::create`].
    pub fn write(&self, path: &Path, content: impl AsRef<[u8]>) -> Result<(), FileError> {
        self.create(path)?.write_all(content.as_ref()).map_err(FileError::io(path))
    }

    /// Writes the record that lists the other files. It is removed first and appears last, so that
    /// it only exists together with them.
    ///
    /// # Errors
    /// As [`FileSet::create`].
    pub fn write_record(&self, path: &Path, content: impl AsRef<[u8]>) -> Result<(), FileError> {
        let mut file = self.state().begin(path, true)?;
        file.write_all(content.as_ref()).map_err(FileError::io(path))
    }

    /// The temporary path of a begun file, for a reader; the writer must have flushed it.
    pub fn begun(&self, path: &Path) -> Option<PathBuf> {
        let state = self.state();
        let output = state.outputs.iter().find(|output| output.path == path)?;
        output.staged.as_ref().map(|staged| staged.at.clone())
    }

    /// Drops a file as if it had never been begun.
    pub fn discard(&self, path: &Path) {
        let state = &mut *self.state();
        let Some(index) = state.outputs.iter().position(|output| output.path == path) else { return };
        if let Some(Staged { at, .. }) = state.outputs.swap_remove(index).staged {
            // If this fails, it is removed with the folder.
            fs::remove_file(at).ok();
        }
    }

    /// Renames all files to their names: replaces existing files on request, otherwise renames none
    /// if one name is taken. Processes that publish in one folder take turns.
    ///
    /// # Errors
    /// If a name is taken, or the system refuses.
    pub fn publish(self) -> Result<(), FileError> {
        let mut state = self.0.into_inner().expect("no one panics with it");
        let mut outputs = std::mem::take(&mut state.outputs);
        outputs.retain(|output| output.staged.is_some());
        for output in &outputs {
            let synced = File::open(&output.staged().at).and_then(|file| file.sync_all());
            synced.map_err(FileError::io(&output.path))?;
        }
        // In a fixed order, so that processes cannot wait for each other in a circle.
        let folders: BTreeSet<&Path> = state.stages.iter().map(|stage| stage.folder.as_path()).collect();
        let lock = |folder| wait_for_folder(folder).map_err(FileError::io(folder));
        let _locks = folders.into_iter().map(lock).collect::<Result<Vec<Option<Held>>, FileError>>()?;
        for output in &outputs {
            state.inputs.check(&output.path)?;
            if There::at(&output.path)? != There::Nothing && state.existing == Existing::Refuse {
                return Err(FileError::Exists(output.path.clone()));
            }
        }
        give_all_names(outputs, state.existing)?;
        state.made.0.clear();
        Ok(())
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("no one panics with it")
    }
}

impl State {
    /// Returns the index of an output that is not begun; adds it if it is new.
    fn reserve(&mut self, path: &Path) -> Result<usize, FileError> {
        let there = There::at(path)?;
        if there == There::Nothing {
            self.made.0.extend(create_folder(folder_of(path))?);
        }
        let place = Place::of(path).map_err(FileError::io(path))?;
        let is_device = there == There::Device;
        if let Some(index) = self.outputs.iter().position(|output| output.place == place) {
            let first = &self.outputs[index];
            if is_device || (first.path == path && first.staged.is_none()) {
                return Ok(index);
            }
            return Err(FileError::Twice { first: first.path.clone(), second: path.to_owned() });
        }
        if !is_device {
            self.inputs.check(path)?;
            if there == There::File && self.existing == Existing::Refuse {
                return Err(FileError::Exists(path.to_owned()));
            }
        }
        self.outputs.push(Output { path: path.to_owned(), place, staged: None, is_device });
        Ok(self.outputs.len() - 1)
    }

    /// Begins a file, in the stage of its folder.
    fn begin(&mut self, path: &Path, is_record: bool) -> Result<File, FileError> {
        let failed = FileError::io(path);
        let index = self.reserve(path)?;
        let Output { place: Place { folder, name }, staged, is_device, .. } = &mut self.outputs[index];
        if *is_device {
            return File::options().write(true).open(path).map_err(failed);
        }
        if !self.stages.iter().any(|stage| stage.folder == *folder) {
            self.stages.push(Stage::begin(folder).map_err(&failed)?);
        }
        let stage = self.stages.iter().find(|stage| stage.folder == *folder).expect("it was just begun");
        let at = stage.path(name);
        let file = File::options().read(true).write(true).create_new(true).open(&at).map_err(failed)?;
        *staged = Some(Staged { at, is_record });
        Ok(file)
    }
}

impl Output {
    fn staged(&self) -> &Staged {
        self.staged.as_ref().expect("only what has been begun is published")
    }
}

/// Renames files to their names, the records last and after those of a former set went; on a failure undoes the renames to
/// free names.
fn give_all_names(outputs: Vec<Output>, existing: Existing) -> Result<(), FileError> {
    let (records, others): (Vec<Output>, Vec<Output>) =
        outputs.into_iter().partition(|output| output.staged().is_record);
    for record in records.iter().filter(|record| is_taken(&record.path)) {
        fs::remove_file(&record.path).map_err(FileError::io(&record.path))?;
        sync_folder_of(&record.path)?;
    }
    let mut given = Vec::new();
    let outcome = [&others, &records].into_iter().try_for_each(|outputs| {
        for output in outputs {
            rename(&output.staged().at, &output.path, existing)?;
            given.push(&output.path);
        }
        let folders: BTreeSet<&Path> = outputs.iter().map(|output| output.place.folder.as_path()).collect();
        folders.into_iter().try_for_each(sync_folder)
    });
    if outcome.is_err() && existing == Existing::Refuse {
        // The set was never complete.
        given.into_iter().for_each(|path| drop(fs::remove_file(path)));
    }
    outcome
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::FileSet;
    use crate::{Existing, FileError, Inputs, partial_path};

    /// The contents of a folder, by name.
    fn content(folder: &Path) -> BTreeMap<String, String> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries
            .map(|path| {
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                (name, fs::read_to_string(path).unwrap_or_else(|_folder| "-".to_owned()))
            })
            .collect()
    }

    fn folder() -> (tempfile::TempDir, impl Fn(&str) -> PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_owned();
        (folder, move |name| path.join(name))
    }

    fn set(existing: Existing) -> FileSet {
        FileSet::new(existing, Inputs::default())
    }

    fn of<const N: usize>(pairs: [(&str, &str); N]) -> BTreeMap<String, String> {
        pairs.map(|(name, text)| (name.to_owned(), text.to_owned())).into()
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let (folder, path) = folder();
        let files = set(Existing::Refuse);
        files.write(&path("a"), "1").unwrap();
        files.write(&path("b"), "2").unwrap();
        files.write(&path("c"), "3").unwrap();
        files.discard(&path("c"));
        assert!(content(folder.path()).into_keys().all(|name| name.starts_with(".asperity-")));
        drop(files);
        assert!(content(folder.path()).is_empty());

        let files = set(Existing::Refuse);
        files.write(&path("a"), "1").unwrap();
        files.write(&path("b"), "2").unwrap();
        files.publish().unwrap();
        assert_eq!(content(folder.path()), of([("a", "1"), ("b", "2")]));
    }

    #[test]
    fn folders_stay_with_what_is_in_them() {
        let (folder, path) = folder();
        fs::create_dir(path("mine")).unwrap();
        let begin = || {
            let files = set(Existing::Refuse);
            files.folder(&path("mine")).unwrap();
            files.folder(&path("new/beside")).unwrap();
            files.write(&path("new/within/a"), "1").unwrap();
            files
        };
        drop(begin());
        assert_eq!(content(folder.path()), of([("mine", "-")]));
        let files = begin();
        fs::write(path("new/beside/b"), "mine").unwrap();
        drop(files);
        assert_eq!(content(&path("new")), of([("beside", "-")]));
        fs::remove_dir_all(path("new")).unwrap();
        begin().publish().unwrap();
        assert_eq!(content(&path("new")), of([("beside", "-"), ("within", "-")]));
        // Names taken in the meantime.
        fs::remove_dir_all(path("new")).unwrap();
        let files = begin();
        fs::write(path("new/within/a"), "mine").unwrap();
        files.publish().unwrap_err();
        assert_eq!(content(&path("new")), of([("within", "-")]));
    }

    #[test]
    fn of_two_sets_at_once_one_is_whole_and_the_other_leaves_nothing() {
        let (folder, path) = folder();
        let [first, second] = [set(Existing::Refuse), set(Existing::Refuse)];
        for (files, text) in [(&first, "1"), (&second, "2")] {
            files.reserve([path("a"), path("b")]).unwrap();
            files.write(&path("b"), text).unwrap();
        }
        second.write(&path("a"), "2").unwrap();
        second.publish().unwrap();
        assert!(matches!(first.publish(), Err(FileError::Exists(there)) if there == path("b")));
        assert_eq!(content(folder.path()), of([("a", "2"), ("b", "2")]));

        let [first, second] = [set(Existing::Replace), set(Existing::Replace)];
        for (files, text) in [(&first, "3"), (&second, "4")] {
            files.write(&path("a"), text).unwrap();
            files.write_record(&path("b"), text).unwrap();
        }
        second.publish().unwrap();
        first.publish().unwrap();
        assert_eq!(content(folder.path()), of([("a", "3"), ("b", "3")]));
    }

    /// A process that ignores our locks may take a name at any time.
    #[test]
    fn a_name_taken_in_the_middle_takes_all_back() {
        let (folder, path) = folder();
        let files = set(Existing::Refuse);
        files.write(&path("a"), "1").unwrap();
        files.write(&path("b"), "2").unwrap();
        let state = files.0.into_inner().unwrap();
        fs::write(path("b"), "mine").unwrap();
        let outcome = super::give_all_names(state.outputs, Existing::Refuse);
        assert!(matches!(outcome, Err(FileError::Exists(there)) if there == path("b")));
        drop(state.stages);
        assert_eq!(content(folder.path()), of([("b", "mine")]));
    }

    #[test]
    fn names_that_collide_are_refused_before_anything_is_written() {
        let (folder, path) = folder();
        fs::create_dir(path("real")).unwrap();
        let files = set(Existing::Replace);
        let around = path("real").join("..").join("a");
        let refused = files.reserve([path("a"), around.clone()]);
        assert!(matches!(refused, Err(FileError::Twice { second, .. }) if second == around));
        assert!(matches!(files.reserve([path("real")]), Err(FileError::NoFile { what: "a folder", .. })));
        assert_eq!(content(folder.path()), of([("real", "-")]));
    }

    #[test]
    #[cfg(unix)]
    fn an_input_is_not_written_over_by_any_name() {
        use std::os::unix::fs::symlink;
        let (folder, path) = folder();
        fs::write(path("in.mcap"), "log").unwrap();
        fs::hard_link(path("in.mcap"), path("hard")).unwrap();
        symlink("in.mcap", path("link")).unwrap();
        symlink(folder.path(), path("here")).unwrap();
        for input in ["in.mcap", "hard", "link"] {
            let through = path("here").join("in.mcap");
            let outputs = [path("in.mcap"), path("hard"), path("link"), through, partial_path(&path(input))];
            for output in outputs {
                let files = FileSet::new(Existing::Replace, Inputs::of([path(input)]));
                let refused = files.write(&output, "table");
                assert!(matches!(refused, Err(FileError::Input { .. })), "{input} {output:?}: {refused:?}");
            }
        }
        // A name that is found to be taken later.
        let files = set(Existing::Replace);
        files.write(&path("link"), "table").unwrap();
        assert!(matches!(files.add_inputs([path("hard")]), Err(FileError::Input { .. })));
        assert!(matches!(files.publish(), Err(FileError::Input { .. })));
        assert_eq!(fs::read_to_string(path("in.mcap")).unwrap(), "log");
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_replaced_and_what_it_leads_to_stays() {
        let (_folder, path) = folder();
        fs::write(path("file"), "mine").unwrap();
        for (link, to) in [("link", "file"), ("dangling", "nowhere")] {
            std::os::unix::fs::symlink(to, path(link)).unwrap();
            assert!(matches!(set(Existing::Refuse).create(&path(link)), Err(FileError::Exists(_))));
            FileSet::write_one(&path(link), "new", Existing::Replace, Inputs::default()).unwrap();
            assert!(fs::symlink_metadata(path(link)).unwrap().is_file());
        }
        assert_eq!(fs::read_to_string(path("file")).unwrap(), "mine");
        assert!(!path("nowhere").exists());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn devices_are_written_to_and_names_of_the_system_kept() {
        let (folder, path) = folder();
        // A link to a device, so that no device is at risk.
        std::os::unix::fs::symlink("/dev/null", path("null")).unwrap();
        FileSet::write_one(&path("null"), "gone", Existing::Refuse, Inputs::default()).unwrap();
        assert_eq!(content(folder.path()).len(), 1);
        let file = fs::File::create(path("file")).unwrap();
        let name = format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&file));
        let refused = FileSet::write_one(name.as_ref(), "new", Existing::Replace, Inputs::default());
        assert!(matches!(refused, Err(FileError::NoFile { .. })), "{refused:?}");
    }
}
