//! Solvers of the radiosity system B = S + rho F B.
