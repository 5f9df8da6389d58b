//! How the command ends.

use crate::lightmap::folder::FolderError;
use crate::points::PointsError;
use std::error::Error;

/// The exit codes that scripts rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitCode {
    /// Done.
    Ok = 0,
    /// An internal error, or a file that cannot be read or written.
    Failure = 1,
    /// Wrong arguments.
    Usage = 2,
    /// The scene or another input is invalid; the message names the place.
    InvalidInput = 3,
    /// There is nothing to do: no light, no receiver, no points.
    NothingToDo = 4,
    /// A limit that the user set is exceeded: `check --strict`, `diff --max-rel-rmse`.
    LimitExceeded = 5,
    /// The error that was asked for was not reached; the result is written and says what was.
    TargetMissed = 6,
    /// More memory would be needed than `--max-memory`; nothing was done.
    MemoryLimit = 7,
    /// The user stopped it; the last complete result is written, if there was one.
    Interrupted = 130,
}

impl From<ExitCode> for std::process::ExitCode {
    fn from(exit: ExitCode) -> Self {
        Self::from(exit as u8)
    }
}

/// An error with the exit code that it leads to.
#[derive(Debug)]
pub(super) struct Failure {
    /// The exit code.
    pub(super) exit: ExitCode,
    /// What went wrong, with its causes.
    pub(super) error: Box<dyn Error + Send + Sync>,
}

impl Failure {
    /// `error`, leading to `exit`. Text is an error, too.
    pub(super) fn new(exit: ExitCode, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self {
            exit,
            error: error.into(),
        }
    }

    /// The user stopped the work before there was anything to keep.
    pub(super) fn interrupted() -> Self {
        Self::new(ExitCode::Interrupted, "interrupted; nothing was written")
    }
}

/// The exit code that an error of the library leads to.
macro_rules! exits_with {
    ($($error:ty => $exit:ident),+ $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::new(ExitCode::$exit, error)
            }
        })+
    };
}

impl From<PointsError> for Failure {
    fn from(error: PointsError) -> Self {
        let exit = match error {
            PointsError::Unreadable(..) => ExitCode::Failure,
            PointsError::Empty(_) => ExitCode::NothingToDo,
            _ => ExitCode::InvalidInput,
        };
        Self::new(exit, error)
    }
}

impl From<FolderError> for Failure {
    fn from(error: FolderError) -> Self {
        let exit = match error {
            FolderError::Unreadable(..) => ExitCode::Failure,
            _ => ExitCode::InvalidInput,
        };
        Self::new(exit, error)
    }
}

impl From<luxel_scenes::LoadError> for Failure {
    fn from(error: luxel_scenes::LoadError) -> Self {
        let exit = match error.kind() {
            luxel_scenes::FailureKind::Io => ExitCode::Failure,
            luxel_scenes::FailureKind::InvalidScene => ExitCode::InvalidInput,
        };
        Self::new(exit, error)
    }
}

exits_with! {
    crate::camera::CameraError => InvalidInput,
    crate::diff::DiffError => InvalidInput,
    crate::files::OutputError => Failure,
    crate::image::exr::ReadExrError => Failure,
    crate::image::exr::EncodeExrError => Failure,
    crate::image::png::EncodePngError => Failure,
    luxel_solver::patches::MeshError => InvalidInput,
    luxel_solver::solvers::SystemError => InvalidInput,
    luxel_solver::pilot::PilotError => InvalidInput,
    luxel_solver::solvers::DirectError => Failure,
    luxel_solver::solvers::NotReciprocal => InvalidInput,
    crate::lightmap::encoding::EncodeMapError => Failure,
    crate::lightmap::export::glb::GlbError => Failure,
    crate::lightmap::given::GivenError => InvalidInput,
    crate::lightmap::handover::HandoverError => Usage,
    crate::lightmap::unwrap::UnwrapError => InvalidInput,
    crate::ply::TooManyCorners => Failure,
    crate::serve::ServeError => Failure,
    csv::Error => Failure,
    std::io::Error => Failure,
    luxel_solver::transport::DenseError => Failure,
    serde_json::Error => Failure,
    rayon::ThreadPoolBuildError => Failure,
}
