//! Patches: the pieces of surface that carry one radiosity each.
