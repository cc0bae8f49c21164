//! What a disk may have after a power cut: a model of files and folders that replays the operations of a
//! command and keeps what is on disk for certain apart from what may be.
//!
//! - The bytes of a file are there up to its last sync. Of later writes any number is there, the last of them
//!   in part; where the length came before the bytes, there are zeros.
//! - The names in a folder are there up to the folder's last sync. Of later operations in it, a file system
//!   with a journal has the first few, in their order; folders are independent of each other.
//! - A rename from one folder to another is one operation, of the folder that has the new name.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::ground::Error;
use crate::operations::{Kind, Operation};
use crate::random::Random;

/// Of a file or folder, whatever its name.
type Node = usize;

#[derive(Debug, Clone)]
enum Change {
    /// A name is given to a node, and taken from another name.
    Name {
        folder: Node,
        name: PathBuf,
        node: Node,
        from: Option<(Node, PathBuf)>,
    },
    Remove {
        folder: Node,
        name: PathBuf,
    },
    Write {
        node: Node,
        at: u64,
        bytes: Vec<u8>,
    },
    Length {
        node: Node,
        length: u64,
    },
}

/// The recorded operations.
#[derive(Debug)]
pub(crate) struct Disk {
    /// Each with the number of its operation.
    changes: Vec<(usize, Change)>,
    /// The number of a sync, and the file or folder.
    syncs: Vec<(usize, Node)>,
    /// What is there before: on disk for certain.
    before: Tree,
    is_folder: Vec<bool>,
    /// The present names, in all folders.
    now: BTreeMap<PathBuf, Node>,
}

/// Contents of folders and files.
#[derive(Debug, Clone, Default)]
struct Tree {
    names: BTreeMap<(Node, PathBuf), Node>,
    bytes: BTreeMap<Node, Vec<u8>>,
}

/// How much is on disk that was not synced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kept {
    /// Nothing.
    Least,
    /// All names, and no bytes: a rename that came before the bytes.
    NamesAlone,
    /// All bytes, and no names.
    BytesAlone,
    /// As chance has it.
    Some,
    /// Everything, as after a kill.
    All,
}

impl Disk {
    /// The disk with a folder, which is on it for certain.
    pub(crate) fn of(folder: &Path) -> Result<Disk, Error> {
        let mut disk = Disk {
            changes: Vec::new(),
            syncs: Vec::new(),
            before: Tree::default(),
            is_folder: vec![true],
            now: BTreeMap::from([(PathBuf::new(), 0)]),
        };
        disk.read(folder, Path::new(""))?;
        Ok(disk)
    }

    fn read(&mut self, folder: &Path, at: &Path) -> Result<(), Error> {
        let parent = self.now[at];
        for entry in fs::read_dir(folder.join(at))? {
            let entry = entry?;
            let path = at.join(entry.file_name());
            let is_folder = entry.file_type()?.is_dir();
            let node = self.add(&path, is_folder);
            self.before.names.insert((parent, entry.file_name().into()), node);
            if is_folder {
                self.read(folder, &path)?;
            } else {
                self.before.bytes.insert(node, fs::read(entry.path())?);
            }
        }
        Ok(())
    }

    fn add(&mut self, path: &Path, is_folder: bool) -> Node {
        let node = self.is_folder.len();
        self.is_folder.push(is_folder);
        self.now.insert(path.to_owned(), node);
        node
    }

    /// The folder of a path, and the name in it.
    fn place(&self, path: &Path) -> Option<(Node, PathBuf)> {
        let folder = self.now.get(path.parent()?)?;
        Some((*folder, path.file_name()?.into()))
    }

    /// Replays an operation, which succeeded. One on what is not there failed, and changes nothing.
    pub(crate) fn record(&mut self, number: usize, operation: &Operation) {
        let Operation { kind, path, to, at, bytes, empties } = operation;
        let there = self.now.get(path).copied();
        if let (Kind::Sync, Some(node)) = (kind, there) {
            self.syncs.push((number, node));
        }
        let Some((folder, name)) = self.place(path) else { return };
        let change = match (kind, there) {
            (Kind::Folder, None) => {
                let node = self.add(path, true);
                Change::Name { folder, name, node, from: None }
            }
            (Kind::Create, None) => {
                let node = self.add(path, false);
                Change::Name { folder, name, node, from: None }
            }
            (Kind::Create, Some(node)) if *empties => Change::Length { node, length: 0 },
            (Kind::Length, Some(node)) => Change::Length { node, length: *at },
            (Kind::Write, Some(node)) => Change::Write { node, at: *at, bytes: bytes.clone() },
            (Kind::Remove, Some(node)) => {
                let has_contents = self.now.keys().any(|other| other != path && other.starts_with(path));
                if self.is_folder[node] && has_contents {
                    return;
                }
                self.now.remove(path);
                Change::Remove { folder, name }
            }
            (Kind::Rename | Kind::Link, Some(node)) => {
                let Some(to) = to else { return };
                let Some((new_folder, new_name)) = self.place(to) else { return };
                let from = (*kind == Kind::Rename).then_some((folder, name));
                if from.is_some() {
                    self.now.remove(path);
                }
                self.now.insert(to.clone(), node);
                Change::Name { folder: new_folder, name: new_name, node, from }
            }
            _ => return,
        };
        self.changes.push((number, change));
    }

    /// Numbers of the operations that change the disk or sync it. Of writes to one file in succession, the first
    /// and the last: between them the disk has a part of the last state.
    pub(crate) fn points(&self) -> Vec<usize> {
        let is_between = |at: usize| {
            let node = |at: usize| match self.changes.get(at) {
                Some((_, Change::Write { node, .. })) => Some(*node),
                _ => None,
            };
            at > 0 && node(at).is_some() && node(at - 1) == node(at) && node(at) == node(at + 1)
        };
        let changes = (0..self.changes.len()).filter(|at| !is_between(*at)).map(|at| self.changes[at].0);
        let mut points: Vec<usize> = changes.chain(self.syncs.iter().map(|(number, _)| *number)).collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// Writes into an empty folder what is on disk after the power was cut behind operation `last`.
    pub(crate) fn cut(
        &self,
        last: usize,
        kept: Kept,
        random: &mut Random,
        folder: &Path,
    ) -> Result<(), Error> {
        let changes: Vec<&(usize, Change)> =
            self.changes.iter().take_while(|(number, _)| *number <= last).collect();
        let synced_at = |node: Node| {
            let of_node = self.syncs.iter().filter(|(number, synced)| *synced == node && *number <= last);
            of_node.map(|(number, _)| *number).max()
        };
        // How many of the changes after the last sync, of each file and folder.
        let mut more = BTreeMap::new();
        for node in 0..self.is_folder.len() {
            let since = synced_at(node);
            let after =
                changes.iter().filter(|(number, change)| change.of() == node && Some(*number) > since);
            let count = after.count();
            let count = match kept {
                Kept::Least => 0,
                Kept::All => count,
                Kept::NamesAlone => count * usize::from(self.is_folder[node]),
                Kept::BytesAlone => count * usize::from(!self.is_folder[node]),
                Kept::Some => random.below(count as u64 + 1) as usize,
            };
            more.insert(node, (since, count));
        }
        let mut tree = self.before.clone();
        for (number, change) in changes {
            let (since, count) = more.get_mut(&change.of()).expect("every node has its count");
            if Some(*number) <= *since {
                tree.make(change);
            } else if *count > 0 {
                *count -= 1;
                tree.make(change);
            } else if let (Kept::Some, Change::Write { node, at, bytes }) = (kept, change) {
                // The first that is not wholly there, and its followers: a part of it, or zeros.
                let part = random.below(bytes.len() as u64 + 1) as usize;
                let bytes = if random.below(2) == 0 { bytes[..part].to_vec() } else { vec![0; part] };
                tree.make(&Change::Write { node: *node, at: *at, bytes });
            }
        }
        tree.write(0, &self.is_folder, folder)
    }
}

impl Change {
    /// The file or folder that it is a change of.
    fn of(&self) -> Node {
        match self {
            Change::Name { folder, .. } | Change::Remove { folder, .. } => *folder,
            Change::Write { node, .. } | Change::Length { node, .. } => *node,
        }
    }
}

impl Tree {
    fn make(&mut self, change: &Change) {
        match change {
            Change::Name { folder, name, node, from } => {
                if let Some((folder, name)) = from {
                    // It may have been removed on disk, as by a sync of that folder.
                    let from = (*folder, name.clone());
                    if self.names.get(&from) == Some(node) {
                        self.names.remove(&from);
                    }
                }
                self.names.insert((*folder, name.clone()), *node);
            }
            Change::Remove { folder, name } => drop(self.names.remove(&(*folder, name.clone()))),
            Change::Length { node, length } => {
                self.bytes.entry(*node).or_default().resize(*length as usize, 0)
            }
            Change::Write { node, at, bytes } => {
                let file = self.bytes.entry(*node).or_default();
                let (start, end) = (*at as usize, *at as usize + bytes.len());
                if file.len() < end {
                    file.resize(end, 0);
                }
                file[start..end].copy_from_slice(bytes);
            }
        }
    }

    fn write(&self, node: Node, is_folder: &[bool], at: &Path) -> Result<(), Error> {
        fs::create_dir_all(at)?;
        for ((_, name), child) in self.names.range((node, PathBuf::new())..(node + 1, PathBuf::new())) {
            let path = at.join(name);
            if is_folder[*child] {
                self.write(*child, is_folder, &path)?;
            } else {
                fs::write(path, self.bytes.get(child).map_or(&[][..], Vec::as_slice))?;
            }
        }
        Ok(())
    }
}
