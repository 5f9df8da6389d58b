//! Transport operators: E = F B.
