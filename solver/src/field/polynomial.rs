//! Least squares with polynomials of two variables.
//!
//! With the monomials m(x, y) = (1, x, y, x², xy, y², x³, …) in rising degree, the coefficients c minimise
//! Σ_i (m(x_i)·c − y_i)². The normal matrix Σ m mᵀ = L Lᵀ is factored once (A.-L. Cholesky, published by
//! C. Benoît, "Note sur une méthode de résolution des équations normales", Bulletin géodésique 2, 1924);
//! because the order is nested, z = L⁻¹ Σ m y gives the residual sum of every lower degree at once,
//! Σ y² − Σ_k z_k². Monomials that depend on those before them on the given points are left out.
//!
//! Coordinates lie within [−1, 1]: the condition number of cubics is then below 10⁵.
//! Cost: 60 multiplications and divisions a point.

/// The highest degree. Fourth powers gain nothing where cells can be halved instead.
pub(super) const MAX_DEGREE: usize = 3;

/// Monomials up to [`MAX_DEGREE`].
pub(super) const TERMS: usize = terms(MAX_DEGREE);

/// A monomial whose part that is independent of those before it has a smaller mean square than this on the
/// points is left out: between the points nothing would hold it. On evenly spread points the smallest, that
/// of x³, has 0.023; on two rows of points that of y² has none.
const DEPENDENT: f64 = 0.005;

/// Monomials up to a degree.
pub(super) const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The exponents of x and y in each monomial.
const EXPONENTS: [[usize; 2]; TERMS] = [
    [0, 0],
    [1, 0],
    [0, 1],
    [2, 0],
    [1, 1],
    [0, 2],
    [3, 0],
    [2, 1],
    [1, 2],
    [0, 3],
];

/// All monomials at a point.
#[inline]
pub(super) fn monomials([x, y]: [f64; 2]) -> [f64; TERMS] {
    let (xx, xy, yy) = (x * x, x * y, y * y);
    [1.0, x, y, xx, xy, yy, xx * x, xx * y, x * yy, yy * y]
}

/// Where some points lie, for the monomials to stay within [−1, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chart {
    centre: [f64; 2],
    /// Half extents; one where there is none.
    half: [f64; 2],
}

impl Chart {
    /// The chart of a box. Monomials are constant beyond it.
    pub(super) fn of(low: [f64; 2], high: [f64; 2]) -> Self {
        let half = |axis: usize| {
            let half = 0.5 * (high[axis] - low[axis]);
            if half > 0.0 { half } else { 1.0 }
        };
        Self {
            centre: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
            half: [half(0), half(1)],
        }
    }

    /// Monomials at a point of the plane.
    #[inline]
    pub(super) fn monomials(&self, x: [f64; 2]) -> [f64; TERMS] {
        monomials(self.local(x))
    }

    /// Coordinates within [−1, 1].
    #[inline]
    fn local(&self, x: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let x = (x[axis] - self.centre[axis]) / self.half[axis];
            x.clamp(-1.0, 1.0)
        })
    }
}

/// The factored normal matrix of some points.
pub(super) struct Factor {
    terms: usize,
    /// L by rows; rows and columns of what was left out are zero.
    lower: [[f64; TERMS]; TERMS],
}

impl Factor {
    /// Factors the leading `terms` rows of a normal matrix, of which the lower triangle counts.
    pub(super) fn new(normal: &[[f64; TERMS]; TERMS], terms: usize) -> Self {
        let mut lower = [[0.0; TERMS]; TERMS];
        for j in 0..terms {
            let pivot = normal[j][j] - (0..j).map(|k| lower[j][k] * lower[j][k]).sum::<f64>();
            if pivot <= DEPENDENT * normal[0][0] {
                lower[j] = [0.0; TERMS];
                continue;
            }
            let root = pivot.sqrt();
            lower[j][j] = root;
            for i in j + 1..terms {
                let above: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                lower[i][j] = (normal[i][j] - above) / root;
            }
        }
        Self { terms, lower }
    }

    /// z = L⁻¹ b; zero for what was left out.
    pub(super) fn forward(&self, b: &[f64; TERMS]) -> [f64; TERMS] {
        let mut z = [0.0; TERMS];
        for i in 0..self.terms {
            if self.lower[i][i] > 0.0 {
                let known: f64 = (0..i).map(|k| self.lower[i][k] * z[k]).sum();
                z[i] = (b[i] - known) / self.lower[i][i];
            }
        }
        z
    }

    /// The coefficients, L⁻ᵀ z.
    pub(super) fn backward(&self, mut z: [f64; TERMS]) -> [f64; TERMS] {
        for i in (0..self.terms).rev() {
            if self.lower[i][i] > 0.0 {
                z[i] /= self.lower[i][i];
                for k in 0..i {
                    z[k] -= self.lower[i][k] * z[i];
                }
            }
        }
        z
    }

    /// How many of the first `terms` monomials are independent.
    pub(super) fn rank(&self, terms: usize) -> usize {
        (0..terms).filter(|&i| self.lower[i][i] > 0.0).count()
    }
}

/// Sums over points from which polynomials follow.
pub(super) struct Sums {
    /// Σ m mᵀ, lower triangle.
    pub(super) normal: [[f64; TERMS]; TERMS],
    /// Σ m y.
    pub(super) right: [f64; TERMS],
    /// Σ y².
    pub(super) square: f64,
}

impl Sums {
    /// Sums up to a number of terms, that of a degree, over points and their values.
    pub(super) fn new(
        chart: &Chart,
        terms: usize,
        points: impl Iterator<Item = ([f64; 2], f64)>,
    ) -> Self {
        match terms {
            1 => Self::of_degree::<1, 1>(chart, points),
            3 => Self::of_degree::<2, 3>(chart, points),
            6 => Self::of_degree::<3, 5>(chart, points),
            _ => Self::of_degree::<4, 7>(chart, points),
        }
    }

    /// The same for polynomials of degree `P` − 1, `M` being 2P − 1. The products of two monomials are 28 different ones at most,
    /// x^a y^b with a + b < M: summed up are these, by b and a, not the 55 entries of the matrix.
    fn of_degree<const P: usize, const M: usize>(
        chart: &Chart,
        points: impl Iterator<Item = ([f64; 2], f64)>,
    ) -> Self {
        let mut moments = [[0.0; M]; M];
        let mut weighted = [[0.0; P]; P];
        let mut square = 0.0;
        for (point, value) in points {
            let [x, y] = chart.local(point);
            let mut powers = [1.0; M];
            for a in 1..M {
                powers[a] = powers[a - 1] * x;
            }
            let mut of_y = 1.0;
            for b in 0..M {
                for a in 0..M - b {
                    moments[b][a] += of_y * powers[a];
                }
                if b < P {
                    let of_value = of_y * value;
                    for a in 0..P - b {
                        weighted[b][a] += of_value * powers[a];
                    }
                }
                of_y *= y;
            }
            square += value * value;
        }
        let mut sums = Self {
            normal: [[0.0; TERMS]; TERMS],
            right: [0.0; TERMS],
            square,
        };
        let exponents = EXPONENTS.iter().take(terms(P - 1)).enumerate();
        for (i, [a, b]) in exponents.clone() {
            sums.right[i] = weighted[*b][*a];
            for (k, [c, d]) in exponents.clone().take(i + 1) {
                sums.normal[i][k] = moments[b + d][a + c];
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(side: usize) -> impl Iterator<Item = [f64; 2]> {
        let at = move |i: usize| 3.0 + 2.0 * i as f64 / (side - 1) as f64;
        (0..side * side).map(move |i| [at(i % side), at(i / side) - 7.0])
    }

    fn fit(points: impl Iterator<Item = ([f64; 2], f64)>, terms: usize) -> (Chart, [f64; TERMS]) {
        let chart = Chart::of([3.0, -4.0], [5.0, -2.0]);
        let sums = Sums::new(&chart, terms, points);
        let factor = Factor::new(&sums.normal, terms);
        (chart, factor.backward(factor.forward(&sums.right)))
    }

    #[test]
    fn a_cubic_is_found_exactly() {
        let value =
            |[x, y]: [f64; 2]| 1.0 + x - 2.0 * y + x * y - 0.3 * y * y * y + 0.1 * x * x * y;
        let (chart, found) = fit(grid(6).map(|x| (x, value(x))), TERMS);
        for x in grid(11) {
            let shown: f64 = chart
                .monomials(x)
                .iter()
                .zip(found)
                .map(|(m, c)| m * c)
                .sum();
            // Values of about 30, a condition number below 10⁵.
            assert!((shown - value(x)).abs() < 1e-9, "{shown} {}", value(x));
        }
    }

    #[test]
    fn points_on_a_line_determine_a_line() {
        let on_line = grid(5).map(|[x, _]| ([x, -3.0], 2.0 * x));
        let (chart, found) = fit(on_line, TERMS);
        let shown: f64 = chart
            .monomials([3.7, -3.0])
            .iter()
            .zip(found)
            .map(|(m, c)| m * c)
            .sum();
        assert!((shown - 7.4).abs() < 1e-9);
    }

    #[test]
    fn residuals_of_all_degrees_follow_from_one_factor() {
        let chart = Chart::of([3.0, -4.0], [5.0, -2.0]);
        let value = |[x, y]: [f64; 2]| (3.0 * x).sin() * y;
        let sums = Sums::new(&chart, TERMS, grid(7).map(|x| (x, value(x))));
        let z = Factor::new(&sums.normal, TERMS).forward(&sums.right);
        for degree in 0..=MAX_DEGREE {
            let (chart, found) = fit(grid(7).map(|x| (x, value(x))), terms(degree));
            let residual = |x| {
                let m = chart.monomials(x);
                m.iter().zip(found).map(|(m, c)| m * c).sum::<f64>() - value(x)
            };
            let direct: f64 = grid(7).map(|x| residual(x).powi(2)).sum();
            let nested = sums.square - z[..terms(degree)].iter().map(|z| z * z).sum::<f64>();
            assert!(
                (direct - nested).abs() < 1e-9 * sums.square,
                "{direct} {nested}"
            );
        }
    }
}
