//! Checkpoints: long work that can go on after the process has ended, whatever ended it.
//!
//! A file holds the name of the format, a line of JSON with the [`Identity`] of the work, what was found so far, and a
//! checksum. It is written whole or not at all, every so often and when the user stops the work; each set of maps that is complete
//! while more are to come has a file of its own, so that it need not be held in memory, and so have maps of directions, masks and
//! volumes, of which nothing is kept before they are complete. Scene, atlas, meshes and
//! solutions are made anew from the same input: what goes on from a checkpoint ends with the same bytes as what was never
//! interrupted.

use super::Context;
use super::exit::{ExitCode, Failure};
use super::refine::Refined;
use super::stated::{StatedError, percent};
use crate::files::{OutputError, OutputFolder};
use crate::lightmap::manifest::Energy;
use luxel_scenes::Scene;
use luxel_solver::adaptive;
use luxel_solver::gather::Gathered;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::cell::{Cell, OnceCell, RefCell};
use std::fmt::{self, Write as _};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The name of the file of the work in progress.
const NAME: &str = "checkpoint.luxel";

/// What the names of files of work that is complete begin with.
const COMPLETE: &str = "checkpoint_";

/// The name of the file of work that is complete: a set of maps by its number, or something else.
fn name_of(what: impl fmt::Display) -> String {
    format!("{COMPLETE}{what}.luxel")
}

/// What it begins with; the number is that of the format.
const MAGIC: &str = "luxel checkpoint 1\n";

/// What must be the same for work to go on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Identity {
    software: String,
    scene: Fingerprint,
    options: Options,
}

/// A checksum of everything that a scene consists of, and the length of what it was taken of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Fingerprint {
    crc32: u32,
    length: u64,
}

impl Fingerprint {
    /// Of the scene as it is written for debugging, which leaves out nothing and tells all floating-point numbers apart.
    fn of(scene: &Scene) -> Self {
        struct Sum(crc32fast::Hasher, u64);
        impl fmt::Write for Sum {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                self.0.update(text.as_bytes());
                self.1 += text.len() as u64;
                Ok(())
            }
        }
        let mut sum = Sum(crc32fast::Hasher::new(), 0);
        // A sum refuses nothing.
        let _ = write!(sum, "{scene:?}");
        Self {
            crc32: sum.0.finalize(),
            length: sum.1,
        }
    }
}

/// Options with the values that they have, by their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Options(serde_json::Map<String, serde_json::Value>);

impl Options {
    /// A verb's own options, written as a structure with named fields, and the common ones that change results.
    ///
    /// # Errors
    /// When they cannot be written as JSON.
    pub(super) fn new(own: &impl Serialize, context: &Context<'_>) -> Result<Self, Failure> {
        let serde_json::Value::Object(mut options) = serde_json::to_value(own)? else {
            unreachable!("options are a structure with named fields");
        };
        let common = &context.common;
        options.insert("seed".into(), common.seed.into());
        let error = common.error.map(|error| format!("{}%", percent(error.0)));
        options.insert("error".into(), error.into());
        let limit = common.max_memory.map(|limit| limit.0.get());
        options.insert("max_memory".into(), limit.into());
        Ok(Self(options))
    }

    /// The first that has another value in `other`, with that value, for people.
    fn difference(&self, other: &Self) -> Option<String> {
        let mut names = self.0.keys().chain(other.0.keys());
        let name = names.find(|name| self.0.get(*name) != other.0.get(*name))?;
        let option = name.replace('_', "-");
        Some(match other.0.get(name) {
            None | Some(serde_json::Value::Null | serde_json::Value::Bool(false)) => {
                format!("no --{option}")
            }
            Some(serde_json::Value::Bool(true)) => format!("--{option}"),
            Some(serde_json::Value::String(value)) => format!("--{option} {value}"),
            Some(serde_json::Value::Array(values)) => {
                let values: Vec<&str> = values.iter().filter_map(|v| v.as_str()).collect();
                format!("--{option} {}", values.join(","))
            }
            Some(value) => format!("--{option} {value}"),
        })
    }
}

impl Identity {
    /// What tells another identity from this one, for people.
    fn difference(&self, other: &Self) -> Option<String> {
        if self.software != other.software {
            return Some(format!("luxel {}", other.software));
        }
        let of_options = self.options.difference(&other.options);
        of_options.or_else(|| {
            let differs = self.scene != other.scene;
            differs.then(|| "another scene, or with files that have changed since".into())
        })
    }
}

/// Values at receivers with their errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct AtLuxels {
    pub(super) values: Vec<Gathered>,
    pub(super) stated: StatedError,
    pub(super) energy: Option<Energy>,
    pub(super) patches: usize,
}

/// The work in progress.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Current<'a> {
    /// Light is gathered.
    Gather(adaptive::Checkpoint<'a>),
    /// A film is exposed.
    Film(Refined<'a>),
}

/// The set of maps in progress.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct InProgress<'a> {
    index: usize,
    current: Current<'a>,
}

/// Why a checkpoint cannot be gone on from.
#[derive(Debug, thiserror::Error)]
enum CheckpointError {
    #[error("cannot read {}; check its permissions, or remove it to begin anew", .0.display())]
    Unreadable(PathBuf, #[source] io::Error),
    #[error("{}: not a complete checkpoint of this version of luxel; remove it to begin anew", .0.display())]
    Broken(PathBuf),
    #[error("{} was made with {difference}; give the same scene and options, or remove it to begin anew", .path.display())]
    Other { path: PathBuf, difference: String },
}

/// Keeps work in a folder.
pub(super) struct Keeper<'a, 'r> {
    folder: &'a OutputFolder,
    scene: &'a Scene,
    options: Options,
    /// Known from the first checkpoint on: short work needs none.
    identity: OnceCell<Identity>,
    every: Duration,
    last: Cell<Instant>,
    context: &'a Context<'r>,
    resume: Cell<Resume>,
    /// The set of maps that is worked on.
    index: Cell<usize>,
    /// What the checkpoint that is gone on from was in the middle of.
    found: RefCell<Option<InProgress<'static>>>,
    is_refused: Cell<bool>,
}

impl<'a, 'r> Keeper<'a, 'r> {
    /// Keeps work on `scene` with `options` in `folder`, anew `every` so often.
    pub(super) fn new(
        folder: &'a OutputFolder,
        scene: &'a Scene,
        options: Options,
        every: Duration,
        context: &'a Context<'r>,
    ) -> Self {
        Self {
            folder,
            scene,
            options,
            identity: OnceCell::new(),
            every,
            last: Cell::new(Instant::now()),
            context,
            resume: Cell::new(Resume::Anew),
            index: Cell::new(0),
            found: RefCell::default(),
            is_refused: Cell::new(false),
        }
    }

    /// What the work may use.
    pub(super) fn context(&self) -> &'a Context<'r> {
        self.context
    }

    /// Takes up the checkpoint of the folder, if there is one and `resume` says so.
    ///
    /// # Errors
    /// When it is broken or of other work.
    pub(super) fn take_up(&self, resume: Resume) -> Result<(), Failure> {
        let path = self.folder.path().join(NAME);
        let reporter = &self.context.reporter;
        self.resume.set(resume);
        match (resume, path.exists()) {
            (Resume::Anew, false) => {}
            (Resume::Anew, true) => reporter.note(format_args!(
                "{} is of work that was not finished: it will be replaced; with --resume that work would go on",
                path.display()
            )),
            (Resume::GoOn, false) if self.folder.holds(|name| name.starts_with(COMPLETE))? => {
                reporter.note(format_args!("going on after what is complete"));
            }
            (Resume::GoOn, false) => reporter.note(format_args!(
                "there is no {}: the work begins from the start",
                path.display()
            )),
            (Resume::GoOn, true) => {
                self.found.replace(Some(self.read(&path)?));
                reporter.note(format_args!("going on from {}", path.display()));
            }
        }
        if resume == Resume::Anew {
            self.remove_complete()?;
        }
        Ok(())
    }

    fn identity(&self) -> &Identity {
        self.identity.get_or_init(|| Identity {
            software: env!("CARGO_PKG_VERSION").into(),
            scene: Fingerprint::of(self.scene),
            options: self.options.clone(),
        })
    }

    /// Work on the set of maps with this number begins. Returns it where it is complete.
    ///
    /// # Errors
    /// When its file is broken or of other work.
    pub(super) fn begin(&self, index: usize) -> Result<Option<AtLuxels>, Failure> {
        self.index.set(index);
        self.complete(&name_of(index))
    }

    /// What a file of complete work holds, where the folder has it and it is to be taken up.
    fn complete<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>, Failure> {
        let path = self.folder.path().join(name);
        let is_there = self.resume.get() == Resume::GoOn && path.exists();
        is_there.then(|| self.read(&path)).transpose()
    }

    /// What the checkpoint was in the middle of, once, if that is what is worked on.
    pub(super) fn current(&self) -> Option<Current<'static>> {
        let found = self.found.take()?;
        if found.index == self.index.get() {
            return Some(found.current);
        }
        self.found.replace(Some(found));
        None
    }

    /// The set of maps that is worked on is complete, and more will follow.
    pub(super) fn keep_complete(&self, maps: &AtLuxels) {
        self.keep_whole(&name_of(self.index.get()), maps);
    }

    /// Work of which nothing is kept before it is complete: it is taken up where the folder has it, and else done. `name`
    /// tells it from other such work.
    ///
    /// # Errors
    /// Those of the work, and when its file is broken or of other work.
    pub(super) fn whole<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        work: impl FnOnce() -> Result<Option<T>, Failure>,
    ) -> Result<Option<T>, Failure> {
        let name = name_of(name);
        let kept = self.complete(&name)?;
        if kept.is_some() {
            return Ok(kept);
        }
        let done = work()?;
        if let Some(done) = &done {
            self.keep_whole(&name, done);
        }
        Ok(done)
    }

    /// Keeps what is complete, unless it took no time or is what there was when the user stopped the work.
    fn keep_whole(&self, name: &str, done: &impl Serialize) {
        let context = self.context;
        if context.started.elapsed() >= self.every && !context.interrupt.is_set() {
            self.try_to_write(name, done);
        }
    }

    /// Keeps what there is when it is time, or when the user stops the work. That it cannot be written ends nothing.
    pub(super) fn keep(&self, current: Current<'_>) {
        let is_due = self.last.get().elapsed() >= self.every;
        if is_due || self.context.interrupt.is_set() {
            let index = self.index.get();
            self.try_to_write(NAME, &InProgress { index, current });
            self.last.set(Instant::now());
        }
    }

    /// Writes a file, or warns once that none is kept.
    fn try_to_write(&self, name: &str, found: &impl Serialize) {
        if let Err(failure) = self.write(name, found)
            && !self.is_refused.replace(true)
        {
            let error = &failure.error;
            self.context
                .reporter
                .warning(format_args!("no checkpoint is kept: {error}"));
        }
    }

    fn write(&self, name: &str, found: &impl Serialize) -> Result<(), Failure> {
        let identity = serde_json::to_string(self.identity())?;
        self.folder.write_with(name, |file| {
            let mut file = Summed {
                file: BufWriter::new(file),
                sum: crc32fast::Hasher::new(),
            };
            writeln!(file, "{MAGIC}{identity}")?;
            let Summed { mut file, sum } =
                postcard::to_io(found, file).map_err(io::Error::other)?;
            file.write_all(&sum.finalize().to_le_bytes())?;
            file.flush()
        })?;
        Ok(())
    }

    fn read<T: DeserializeOwned>(&self, path: &Path) -> Result<T, Failure> {
        read(path, self.identity()).map_err(|error| {
            let exit = match error {
                CheckpointError::Unreadable(..) => ExitCode::Failure,
                _ => ExitCode::InvalidInput,
            };
            Failure::new(exit, error)
        })
    }

    fn remove_complete(&self) -> Result<(), OutputError> {
        self.folder.remove_all(|name| name.starts_with(COMPLETE))
    }

    /// Work is done: there is nothing to go on from.
    ///
    /// # Errors
    /// When the file cannot be removed.
    pub(super) fn finish(&self) -> Result<(), OutputError> {
        self.remove_complete()?;
        self.folder.remove(NAME)
    }

    /// How the user can go on, when there is a checkpoint.
    pub(super) fn tell(&self) {
        let path = self.folder.path().join(NAME);
        if path.exists() {
            self.context.reporter.note(format_args!(
                "kept {}: the same command with --resume goes on from it",
                path.display()
            ));
        }
    }
}

/// Whether to go on from a checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Resume {
    /// From the start.
    Anew,
    /// From the checkpoint.
    GoOn,
}

/// A file and the checksum of what is written to it.
struct Summed<W> {
    file: W,
    sum: crc32fast::Hasher,
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.sum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Reads a checkpoint of certain work.
fn read<T: DeserializeOwned>(path: &Path, identity: &Identity) -> Result<T, CheckpointError> {
    let broken = || CheckpointError::Broken(path.to_path_buf());
    let bytes = std::fs::read(path)
        .map_err(|error| CheckpointError::Unreadable(path.to_path_buf(), error))?;
    let (content, sum) = bytes.split_last_chunk().ok_or_else(broken)?;
    if crc32fast::hash(content) != u32::from_le_bytes(*sum) {
        return Err(broken());
    }
    let rest = content.strip_prefix(MAGIC.as_bytes()).ok_or_else(broken)?;
    let end = rest.iter().position(|&byte| byte == b'\n');
    let (line, found) = rest.split_at(end.ok_or_else(broken)?);
    let theirs: Identity = serde_json::from_slice(line).map_err(|_| broken())?;
    if let Some(difference) = identity.difference(&theirs) {
        return Err(CheckpointError::Other {
            path: path.to_path_buf(),
            difference,
        });
    }
    postcard::from_bytes(&found[1..]).map_err(|_| broken())
}
