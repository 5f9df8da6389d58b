//! Ray casting, in batches.
