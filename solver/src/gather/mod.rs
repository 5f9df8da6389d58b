//! The final gather of irradiance.
