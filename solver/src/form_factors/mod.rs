//! Form factors, by three estimators.
