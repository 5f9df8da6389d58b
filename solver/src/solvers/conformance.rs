//! Every solver on every operator: agreement with LU within the bounds that both state, degenerate
//! systems first.

use super::{
    Ambient, Config, Ledger, Outcome, Solution, System, Tolerance, conjugate_gradient, direct,
    gauss_seidel, jacobi, no_progress, southwell,
};
use crate::sampling::Stage;
use crate::sampling::hash::bits;
use crate::transport::{Dense, Row, SparseRows, Symmetrised, Transport};
use luxel_scenes::{Exitance, Irradiance, Radiosity, Reflectance, Rgb};

const UNKNOWNS: usize = 40;
const RAYS: u32 = 64;

const CONFIG: Config = Config {
    tolerance: Tolerance::Error(1e-11),
    max_iterations: 100_000,
};

/// A solver that takes any operator.
type Solver = fn(&System, &Config) -> Solution;

const SOLVERS: [(&str, Solver); 5] = [
    ("jacobi", |s, c| jacobi(s, c, no_progress)),
    ("gauss-seidel", |s, c| gauss_seidel(s, c, no_progress)),
    ("southwell", |s, c| {
        southwell(s, Ambient::None, c, no_progress)
    }),
    ("southwell with ambient", |s, c| {
        southwell(s, Ambient::Estimated, c, no_progress)
    }),
    ("direct", |s, _| direct(s).expect("a regular matrix")),
];

/// Those, and conjugate gradient, which asks for reciprocity.
fn solvers_of_reciprocal() -> impl Iterator<Item = (&'static str, Solver)> {
    let reciprocal: Solver = |s, c| conjugate_gradient(s, c, no_progress).expect("reciprocal");
    SOLVERS
        .into_iter()
        .chain([("conjugate gradient", reciprocal)])
}

/// Rows of rays that meet unknowns at random by area, one in four none; some meet their own unknown.
fn random_rows() -> SparseRows {
    let targets: Vec<u32> = (0_u32..)
        .zip(areas())
        .flat_map(|(unknown, area)| vec![unknown; area as usize])
        .collect();
    let target = |word: u64| targets[(word >> 8) as usize % targets.len()];
    let hits = (0..UNKNOWNS as u64).map(|row| {
        let words = (0..u64::from(RAYS)).map(move |ray| bits(3, Stage::ROWS, row, ray));
        words
            .filter(|word| !word.is_multiple_of(4))
            .map(target)
            .collect()
    });
    rows(hits.collect(), &[RAYS; UNKNOWNS])
}

/// Areas in small whole numbers.
fn areas() -> Vec<f64> {
    (0..UNKNOWNS).map(|k| (1 + k % 3) as f64).collect()
}

/// Rays in proportion to area, and as many hits of j from i as of i from j: A_i F_ij = A_j F_ji.
fn reciprocal_rows() -> SparseRows {
    let mut hits = vec![Vec::new(); UNKNOWNS];
    for pair in 0..UNKNOWNS as u64 * 12 {
        let word = bits(5, Stage::ROWS, pair, 0);
        let (i, j) = (word % UNKNOWNS as u64, (word >> 32) % UNKNOWNS as u64);
        hits[i as usize].push(j as u32);
        if i != j {
            hits[j as usize].push(i as u32);
        }
    }
    // The most hits for an area fill their row: nothing escapes there.
    let densest = hits.iter().zip(areas()).map(|(h, a)| h.len() as f64 / a);
    let rays = densest.fold(0.0, f64::max).ceil();
    let rays: Vec<u32> = areas().iter().map(|a| (a * rays) as u32).collect();
    rows(hits, &rays)
}

fn rows(hits: Vec<Vec<u32>>, rays: &[u32]) -> SparseRows {
    let mut first = 0;
    let rows = hits.iter().zip(rays).map(|(hits, &rays)| {
        let row = Row {
            first,
            end: first + hits.len(),
            rays,
        };
        first = row.end;
        row
    });
    let rows = rows.collect();
    SparseRows::new(hits.into_iter().flatten().collect(), rows)
}

fn dense(transport: &dyn Transport) -> Dense {
    let (n, matrix) = (transport.len(), transport.to_dense());
    let entries = (0..n * n).map(|k| matrix[(k / n, k % n)]).collect();
    Dense::new(n, entries).expect("valid factors")
}

/// Dark to bright, almost white, and black; no emitter in every seventh and third.
fn lit() -> (Vec<Reflectance>, Vec<Radiosity>) {
    let reflectance = (0..UNKNOWNS).map(|k| Reflectance::new(0.02 * k as f64, 0.999, 0.0));
    let source = (0..UNKNOWNS).map(|k| Radiosity::new(1.0, (k % 7) as f64, (k % 3) as f64));
    (reflectance.collect(), source.collect())
}

/// Holds a solver to the solution of LU, and its ledger to the residual.
fn check(name: &str, system: &System, solver: Solver) {
    let oracle = direct(system).expect("a regular matrix");
    let solution = solver(system, &CONFIG);
    assert_eq!(solution.outcome, Outcome::Converged, "{name}");
    let brightest = oracle
        .radiosity
        .iter()
        .fold(0.0, |m: f64, b| m.max(b.0.max_element()));
    // Both bounds, and the rounding of a residual, 40 eps, amplified by 1/(1 - gain) <= 1000, of which
    // these systems reach a hundredth.
    let bound = solution.error_bound + oracle.error_bound + 1e-13 * brightest;
    let pairs = solution.radiosity.iter().zip(&oracle.radiosity);
    for (k, (b, exact)) in pairs.enumerate() {
        assert!(
            (b.0 - exact.0).abs().cmple(bound).all(),
            "{name}, unknown {k}: {b:?} against {exact:?}"
        );
        assert_eq!(
            b.0.z.to_bits(),
            system.source()[k].0.z.to_bits(),
            "{name}: a black channel keeps its source"
        );
    }
    let emission: Vec<_> = system.source().iter().map(|s| Exitance(s.0)).collect();
    let none = vec![Irradiance::ZERO; system.len()];
    let ledger = Ledger::new(system, &solution, &emission, &none);
    // Sums of 40 terms of one sign.
    assert!(
        ledger.imbalance().abs().max_element() < 1e-13,
        "{name}: {ledger:?}"
    );
}

#[test]
fn every_solver_on_every_operator_agrees_with_lu() {
    let (areas, (reflectance, source)) = (areas(), lit());
    let (random, reciprocal) = (random_rows(), reciprocal_rows());
    let (random_dense, reciprocal_dense) = (dense(&random), dense(&reciprocal));
    let symmetrised = Symmetrised::new(&random, &areas);
    let symmetrised_dense = dense(&symmetrised);
    let system =
        |transport| System::new(transport, &areas, &reflectance, &source).expect("a valid system");
    for (name, transport) in [
        ("random rows", &random as &dyn Transport),
        ("their matrix", &random_dense),
    ] {
        let system = system(transport);
        for (solver, solve) in SOLVERS {
            check(&format!("{solver} on {name}"), &system, solve);
        }
        let refused = conjugate_gradient(&system, &CONFIG, no_progress);
        let defect = refused.expect_err("random rows are not reciprocal").defect;
        assert!(defect > 0.1, "{defect}");
        let solution = jacobi(&system, &CONFIG, no_progress);
        assert!(system.mean_error_bound(&solution).is_err(), "no bound");
    }
    for (name, transport) in [
        ("reciprocal rows", &reciprocal as &dyn Transport),
        ("their matrix", &reciprocal_dense),
        ("random rows made reciprocal", &symmetrised),
        ("the matrix of those", &symmetrised_dense),
    ] {
        let system = system(transport);
        for (solver, solve) in solvers_of_reciprocal() {
            check(&format!("{solver} on {name}"), &system, solve);
        }
    }
}

#[test]
fn the_mean_bound_holds_and_is_tighter_at_every_stage() {
    let (areas, (reflectance, source)) = (areas(), lit());
    let transport = reciprocal_rows();
    let system = System::new(&transport, &areas, &reflectance, &source).expect("a valid system");
    let oracle = direct(&system).expect("a regular matrix");
    let area: f64 = areas.iter().sum();
    for sweeps in [0, 1, 2, 4, 8, 16] {
        let config = Config {
            max_iterations: sweeps,
            ..CONFIG
        };
        for (name, solve) in solvers_of_reciprocal() {
            let solution = solve(&system, &config);
            let squares: Rgb = (solution.radiosity.iter().zip(&oracle.radiosity))
                .zip(&areas)
                .map(|((b, exact), &a)| (b.0 - exact.0).powf(2.0) * a)
                .sum();
            let error = (squares / area).map(f64::sqrt);
            let bound = system.mean_error_bound(&solution).expect("reciprocal");
            // What LU itself rounds.
            assert!(
                error.cmple(bound + 1e-12).all(),
                "{name}, {sweeps} sweeps: {error} against {bound}"
            );
            assert!(
                bound.cmple(solution.error_bound).all(),
                "{name}, {sweeps} sweeps: {bound} above {}",
                solution.error_bound
            );
        }
    }
    // Reflectances from 0 to 0.78 in red: the spectral radius is far below the largest row.
    let config = Config {
        max_iterations: 8,
        ..CONFIG
    };
    let solution = jacobi(&system, &config, no_progress);
    let bound = system.mean_error_bound(&solution).expect("reciprocal");
    assert!(
        bound.x < 0.5 * solution.error_bound.x,
        "{bound} against {}",
        solution.error_bound
    );
}

/// Checks all solvers on a small system given by its matrix and reflectances.
fn check_small(name: &str, entries: &[f64], rho: &[Reflectance], source: &[Radiosity]) {
    let n = rho.len();
    let areas = vec![2.0; n];
    let dense = Dense::new(n, entries.to_vec()).expect("a valid matrix");
    let symmetrised = Symmetrised::new(&dense, &areas);
    for transport in [&dense as &dyn Transport, &symmetrised] {
        let system = System::new(transport, &areas, rho, source).expect("a valid system");
        for (solver, solve) in solvers_of_reciprocal() {
            check(&format!("{solver}, {name}"), &system, solve);
            let solution = solve(&system, &CONFIG);
            let bound = system.mean_error_bound(&solution).expect("reciprocal");
            assert!(bound.cmple(solution.error_bound).all(), "{solver}, {name}");
        }
    }
}

#[test]
fn degenerate_systems_are_solved() {
    let red = Reflectance::new(0.5, 0.9, 0.0);
    let light = Radiosity::new(1.0, 2.0, 3.0);
    check_small("no unknown", &[], &[], &[]);
    check_small("one that sees nothing", &[0.0], &[red], &[light]);
    check_small("one that sees itself", &[0.75], &[red], &[light]);
    check_small("one in the dark", &[0.75], &[red], &[Radiosity::ZERO]);
    let facing = [0.0, 0.5, 0.5, 0.0];
    check_small("black", &facing, &[Reflectance::ZERO; 2], &[light; 2]);
    check_small("no emitter", &facing, &[red; 2], &[Radiosity::ZERO; 2]);
    let apart = [0.0; 4];
    check_small("nobody sees anybody", &apart, &[red; 2], &[light; 2]);
    check_small(
        "tiny reflectance",
        &facing,
        &[Reflectance::new(1e-200, 1e-310, 0.0); 2],
        &[light; 2],
    );
}

#[test]
fn one_that_sees_itself_has_the_geometric_series() {
    let dense = Dense::new(1, vec![0.75]).expect("a valid matrix");
    let rho = [Reflectance::new(0.5, 0.9, 0.0)];
    let light = [Radiosity::splat(1.0)];
    let system = System::new(&dense, &[2.0], &rho, &light).expect("a valid system");
    for (solver, solve) in solvers_of_reciprocal() {
        let b = solve(&system, &CONFIG).radiosity[0].0;
        let exact = Rgb::new(1.0 / 0.625, 1.0 / 0.325, 1.0);
        // An error of 1e-11 is asked for.
        assert!((b - exact).abs().max_element() < 1e-10, "{solver}: {b}");
    }
}
