//! Output files: checked before the work, written whole or not at all.
//!
//! [`Output::prepare`] finds out before the long work starts whether the file can be written;
//! [`Output::write`] writes a temporary file in the same folder and renames it, so that a reader
//! never sees half a file and an old file survives a failure. Special files (`/dev/stdout`, a
//! pipe) cannot be renamed onto and are written in place.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What temporary names begin with.
const TEMPORARY: &str = ".luxel-";

/// Held while a file is written under its temporary name.
static WRITING: Mutex<()> = Mutex::new(());

/// Waits until no file is being written, and lets none be written while the guard lives: so that the
/// process can end without leaving a temporary file behind.
pub fn hold_writes() -> MutexGuard<'static, ()> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why an output file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The folder is missing.
    #[error("cannot write {}: its folder does not exist; create it first: mkdir -p {}", .path.display(), .folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// The path names a folder.
    #[error("cannot write {}: it is a folder; name a file in it", .0.display())]
    IsFolder(PathBuf),
    /// The system refused.
    #[error("cannot write {}; check the folder's permissions and the free space, or choose another path", .0.display())]
    Refused(PathBuf, #[source] io::Error),
}

/// A place where a file can be written.
#[derive(Debug)]
pub struct Output {
    /// As the user named it.
    path: PathBuf,
    /// What is replaced: the target of a symbolic link, not the link.
    target: PathBuf,
    special: bool,
}

impl Output {
    /// Checks that `path` can be written, by creating (and removing) a file beside it.
    ///
    /// # Errors
    /// When the folder is missing or cannot be written, or when `path` is a folder.
    pub fn prepare(path: &Path) -> Result<Self, OutputError> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let existing = fs::metadata(&target).ok();
        if existing.as_ref().is_some_and(fs::Metadata::is_dir) {
            return Err(OutputError::IsFolder(path.to_path_buf()));
        }
        let output = Self {
            path: path.to_path_buf(),
            special: existing.is_some_and(|metadata| !metadata.is_file()),
            target,
        };
        if !output.special {
            let _held = hold_writes();
            output.temporary()?;
        }
        Ok(output)
    }

    /// The path as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes `bytes` the content of the file, at once.
    ///
    /// # Errors
    /// When the system refuses; an older file is then still there, unchanged.
    pub fn write(&self, bytes: &[u8]) -> Result<(), OutputError> {
        self.write_with(|file| file.write_all(bytes))
    }

    /// Makes what `content` writes the content of the file, at once.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_with(
        &self,
        content: impl FnOnce(&mut fs::File) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let refused = |error| OutputError::Refused(self.path.clone(), error);
        if self.special {
            return fs::OpenOptions::new()
                .write(true)
                .open(&self.target)
                .and_then(|mut file| content(&mut file))
                .map_err(refused);
        }
        let _held = hold_writes();
        let mut temporary = self.temporary()?;
        content(temporary.as_file_mut()).map_err(refused)?;
        // Some file systems find out only now that there is no room.
        temporary.as_file().sync_data().map_err(refused)?;
        temporary
            .persist(&self.target)
            .map_err(|error| refused(error.error))?;
        Ok(())
    }

    /// A new file in the target's folder, removed again unless it is renamed.
    fn temporary(&self) -> Result<tempfile::NamedTempFile, OutputError> {
        let folder = match self.target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(OutputError::NoFolder {
                path: self.path.clone(),
                folder: folder.to_path_buf(),
            });
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY);
        #[cfg(unix)]
        {
            // As any new file: readable by others, less what the user's mask forbids.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        builder
            .tempfile_in(folder)
            .map_err(|error| OutputError::Refused(self.path.clone(), error))
    }
}

/// A folder that files are written to, each as by [`Output`].
#[derive(Debug)]
pub struct OutputFolder(PathBuf);

impl OutputFolder {
    /// Makes the folder, if it does not exist, and checks that files can be written to it.
    ///
    /// # Errors
    /// When it cannot be made or written to, or is a file.
    pub fn prepare(path: &Path) -> Result<Self, OutputError> {
        fs::create_dir_all(path)
            .map_err(|error| OutputError::Refused(path.to_path_buf(), error))?;
        let folder = Self(path.to_path_buf());
        Output::prepare(&path.join("manifest.json"))?;
        Ok(folder)
    }

    /// Removes temporary files that a process which was killed has left.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn remove_temporaries(&self) -> Result<(), OutputError> {
        let _held = hold_writes();
        self.remove_all(|name| name.starts_with(TEMPORARY))
    }

    /// Names in it that suit.
    fn names(&self, suits: impl Fn(&str) -> bool) -> Result<Vec<String>, OutputError> {
        let refused = |error| OutputError::Refused(self.0.clone(), error);
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.0).map_err(refused)? {
            let name = entry.map_err(refused)?.file_name();
            names.extend(name.to_str().filter(|name| suits(name)).map(str::to_owned));
        }
        Ok(names)
    }

    /// Whether there is a file in it whose name suits.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn holds(&self, suits: impl Fn(&str) -> bool) -> Result<bool, OutputError> {
        Ok(!self.names(suits)?.is_empty())
    }

    /// Removes the files in it whose names suit.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn remove_all(&self, suits: impl Fn(&str) -> bool) -> Result<(), OutputError> {
        let names = self.names(suits)?;
        names.iter().try_for_each(|name| self.remove(name))
    }

    /// Makes `bytes` the content of a file in it, at once.
    ///
    /// # Errors
    /// As [`Output::prepare`] and [`Output::write`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        Output::prepare(&self.0.join(name))?.write(bytes)
    }

    /// Makes what `content` writes the content of a file in it, at once.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_with(
        &self,
        name: &str,
        content: impl FnOnce(&mut fs::File) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        Output::prepare(&self.0.join(name))?.write_with(content)
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Removes a file if it is there.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn remove(&self, name: &str) -> Result<(), OutputError> {
        let path = self.0.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(OutputError::Refused(path, error))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.txt");
        fs::write(&path, "old").expect("a file");
        let output = Output::prepare(&path).expect("writable");
        assert_eq!(fs::read_to_string(&path).expect("readable"), "old");
        output.write(b"new").expect("written");
        assert_eq!(fs::read_to_string(&path).expect("readable"), "new");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named_before_the_work() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("missing").join("out.exr");
        let error = Output::prepare(&path).expect_err("no folder").to_string();
        assert!(error.contains("out.exr") && error.contains("mkdir -p"));
    }

    #[test]
    fn a_folder_is_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = Output::prepare(folder.path()).expect_err("a folder");
        assert!(matches!(error, OutputError::IsFolder(_)));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_special_files_are_written_in_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        let link = folder.path().join("link");
        fs::write(&file, "old").expect("a file");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        Output::prepare(&link)
            .and_then(|output| output.write(b"new"))
            .expect("written");
        assert!(fs::symlink_metadata(&link).expect("a link").is_symlink());
        assert_eq!(fs::read_to_string(&file).expect("readable"), "new");
        Output::prepare(Path::new("/dev/null"))
            .and_then(|output| output.write(b"nothing"))
            .expect("written");
        assert!(!fs::metadata("/dev/null").expect("still there").is_file());
    }
}
