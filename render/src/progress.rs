//! How long work tells how far it is.

/// Receives the progress of work, stage by stage. Calls may come from any thread; nothing that is
/// computed may depend on them.
pub trait Progress: Sync {
    /// A stage of `total` units of work begins.
    fn start(&self, stage: &str, total: u64);

    /// `amount` more units of the stage are done.
    fn advance(&self, amount: u64);

    /// The stage is complete.
    fn finish(&self);
}

/// Tells nobody.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _stage: &str, _total: u64) {}

    fn advance(&self, _amount: u64) {}

    fn finish(&self) {}
}
