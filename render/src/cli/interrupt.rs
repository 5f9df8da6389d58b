//! The user's wish to stop (Ctrl-C).
//!
//! Work that refines a result listens to the wish and ends with its last complete state. Other work
//! has nothing to keep: the process ends at once, between two writes of files.

use crate::files;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Set from a signal handler, read between pieces of work. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    wished: AtomicBool,
    listeners: AtomicUsize,
}

impl Interrupt {
    /// What the signal handler calls: wishes to stop, and ends the process with `code` when nobody
    /// listens or the wish is repeated. A file that is being written is completed before.
    pub fn raise(&self, code: i32) {
        let repeated = self.0.wished.swap(true, Ordering::SeqCst);
        if repeated || self.0.listeners.load(Ordering::SeqCst) == 0 {
            let _complete = files::hold_writes();
            std::process::exit(code);
        }
    }

    /// Whether to stop.
    pub(super) fn is_set(&self) -> bool {
        self.0.wished.load(Ordering::Relaxed)
    }

    /// Promises to look at [`Self::is_set`] again and again.
    pub(super) fn listen(&self) -> Listening {
        self.0.listeners.fetch_add(1, Ordering::SeqCst);
        Listening(self.clone())
    }
}

/// Somebody listens while this lives.
#[derive(Debug)]
pub(super) struct Listening(Interrupt);

impl Drop for Listening {
    fn drop(&mut self) {
        self.0.0.listeners.fetch_sub(1, Ordering::SeqCst);
    }
}
