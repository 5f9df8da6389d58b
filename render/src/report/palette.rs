//! Colours and marks.
//!
//! Lines are told apart three times: by a colour of the palette of M. Okabe, K. Ito, "Color universal
//! design", 2008 (its yellow darkened, which is too light for lines on white), by the shape of the mark,
//! and by a label. Signed errors run from blue over white to orange, which stays distinct for every
//! kind of colour blindness and in grey (both ends dark, told apart by the sign in captions).

use super::family::Family;
use super::solver::Solver;
use plotters::style::RGBColor;

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Diamond,
    TriangleUp,
    TriangleDown,
    Cross,
    Plus,
}

const BLACK: RGBColor = RGBColor(0, 0, 0);
const ORANGE: RGBColor = RGBColor(200, 130, 0);
const SKY: RGBColor = RGBColor(60, 150, 210);
const GREEN: RGBColor = RGBColor(0, 140, 100);
const BLUE: RGBColor = RGBColor(0, 90, 160);
const VERMILION: RGBColor = RGBColor(213, 94, 0);
const PURPLE: RGBColor = RGBColor(180, 90, 150);

/// Colour and mark of a family.
pub(super) fn of_family(family: Family) -> (RGBColor, Mark) {
    match family {
        Family::Analytic => (BLUE, Mark::Square),
        Family::Hemicube => (ORANGE, Mark::Diamond),
        Family::RayCast => (SKY, Mark::TriangleUp),
        Family::RayCastRows => (GREEN, Mark::TriangleDown),
        Family::Radiosity => (PURPLE, Mark::Plus),
        Family::Gather => (VERMILION, Mark::Circle),
        Family::Path => (BLACK, Mark::Cross),
    }
}

/// Colour and mark of a solver.
pub(super) fn of_solver(solver: Solver) -> (RGBColor, Mark) {
    match solver {
        Solver::Jacobi => (BLUE, Mark::Square),
        Solver::GaussSeidel => (VERMILION, Mark::Circle),
        Solver::Southwell => (GREEN, Mark::TriangleDown),
        Solver::ConjugateGradient => (PURPLE, Mark::Diamond),
        Solver::Direct => (BLACK, Mark::Cross),
    }
}

/// Colours of the three parts of an error: solver, sampling, discretisation.
pub(super) const PARTS: [RGBColor; 3] = [BLACK, SKY, ORANGE];

/// The colour of a signed value in [−1, 1]: blue below zero, white at it, orange above.
pub(super) fn diverging(value: f64) -> [u8; 3] {
    const BELOW: [f64; 3] = [8.0, 64.0, 129.0];
    const MIDDLE: [f64; 3] = [255.0, 255.0, 255.0];
    const ABOVE: [f64; 3] = [179.0, 76.0, 0.0];
    let end = if value < 0.0 { BELOW } else { ABOVE };
    let t = value.abs().min(1.0);
    std::array::from_fn(|c| (MIDDLE[c] + t * (end[c] - MIDDLE[c])).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_told_apart_and_clipped() {
        assert_eq!(diverging(0.0), [255; 3]);
        assert_eq!(diverging(-3.0), [8, 64, 129]);
        assert_eq!(diverging(1.0), [179, 76, 0]);
    }

    #[test]
    fn no_two_families_look_alike() {
        let all: Vec<_> = Family::ALL
            .iter()
            .map(|&family| of_family(family))
            .collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                assert!(a.0 != b.0 && a.1 != b.1, "{a:?} {b:?}");
            }
        }
    }
}
