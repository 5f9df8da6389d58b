//! Every solver on every operator agrees with LU within the bounds that both state.

use super::{Config, Outcome, System, Tolerance, direct, gauss_seidel, jacobi, no_progress};
use crate::sampling::Stage;
use crate::sampling::hash::bits;
use crate::transport::{Dense, Row, SparseRows, Transport};
use luxel_scenes::{Radiosity, Reflectance};

const UNKNOWNS: usize = 40;
const RAYS: u32 = 64;

/// Rows of rays that meet unknowns at random, one in eight none; some meet their own unknown.
fn sparse() -> SparseRows {
    let mut entries = Vec::new();
    let mut rows = Vec::new();
    for row in 0..UNKNOWNS as u64 {
        let first = entries.len();
        for ray in 0..u64::from(RAYS) {
            let random = bits(3, Stage::ROWS, row, ray);
            if !random.is_multiple_of(8) {
                entries.push((random >> 8) as u32 % UNKNOWNS as u32);
            }
        }
        let end = entries.len();
        rows.push(Row {
            first,
            end,
            rays: RAYS,
        });
    }
    SparseRows::new(entries, rows)
}

#[test]
fn every_solver_on_every_operator_agrees_with_lu() {
    let sparse = sparse();
    let full = sparse.to_dense();
    let entries = (0..UNKNOWNS * UNKNOWNS)
        .map(|k| full[(k / UNKNOWNS, k % UNKNOWNS)])
        .collect();
    let dense = Dense::new(UNKNOWNS, entries).expect("rays make valid factors");
    let reflectance: Vec<_> = (0..UNKNOWNS)
        .map(|k| Reflectance::new(0.02 * k as f64, 0.999, 0.0))
        .collect();
    let source: Vec<_> = (0..UNKNOWNS)
        .map(|k| Radiosity::new(1.0, (k % 7) as f64, (k % 3) as f64))
        .collect();
    let config = Config {
        tolerance: Tolerance::Error(1e-11),
        max_iterations: 100_000,
    };
    let oracle = {
        let system = System::new(&dense, &reflectance, &source).expect("a valid system");
        direct(&system).expect("a regular matrix")
    };
    for (operator, transport) in [
        ("dense", &dense as &dyn Transport),
        ("sparse rows", &sparse),
    ] {
        let system = System::new(transport, &reflectance, &source).expect("a valid system");
        let solutions = [
            ("jacobi", jacobi(&system, &config, no_progress)),
            ("gauss-seidel", gauss_seidel(&system, &config, no_progress)),
            ("direct", direct(&system).expect("a regular matrix")),
        ];
        for (solver, solution) in solutions {
            assert_eq!(
                solution.outcome,
                Outcome::Converged,
                "{solver} on {operator}"
            );
            let brightest = oracle
                .radiosity
                .iter()
                .fold(0.0, |m: f64, b| m.max(b.0.max_element()));
            // Both bounds, and the rounding of a residual, 40 eps, amplified by 1/(1 - gain) <= 9.
            let bound = solution.error_bound + oracle.error_bound + 1e-13 * brightest;
            for (k, (b, exact)) in solution.radiosity.iter().zip(&oracle.radiosity).enumerate() {
                assert!(
                    (b.0 - exact.0).abs().cmple(bound).all(),
                    "{solver} on {operator}, unknown {k}: {b:?} against {exact:?}"
                );
                assert_eq!(
                    b.0.z.to_bits(),
                    source[k].0.z.to_bits(),
                    "{solver} on {operator}: a black channel keeps its source"
                );
            }
        }
    }
}
