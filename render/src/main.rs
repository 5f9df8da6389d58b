//! The luxel command.
fn main() {}
