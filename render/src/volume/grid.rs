//! Where the probes of a volume stand: one in the middle of each cell of a box.
//!
//! The box is cut into n_x × n_y × n_z equal cells; probe (i, j, k) stands at lower + ((i, j, k) + ½) size / n, number i + n_x (j + n_y k).
//! So a texture of three dimensions that holds a probe a texel and is addressed by (p − lower) / size, clamped at its edges,
//! interpolates between probes as it should, and none stands on a wall that bounds the scene.

use glam::DVec3;

/// Most probes: their coefficients of degree two are a file of 1.8 GB.
pub const MOST_PROBES: usize = 1 << 24;

/// A box of probes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The corner of the smallest coordinates, in metres.
    pub lower: DVec3,
    /// The corner of the largest.
    pub upper: DVec3,
    /// Probes along each axis.
    pub probes: [usize; 3],
}

/// How many probes are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// At most so many metres apart.
    Spacing(f64),
    /// So many along each axis.
    Probes([usize; 3]),
}

/// Why a box cannot be filled.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// It has no extent along an axis.
    #[error("the scene has no extent along {0}: --volume-box says where probes are wanted")]
    Flat(char),
    /// There would be too many probes.
    #[error(
        "{0:.0} probes are more than the {MOST_PROBES} that there may be: --volume {1:.3} would do, or a smaller --volume-box"
    )]
    TooMany(f64, f64),
}

impl Grid {
    /// Fills the box with the given corners, in metres.
    ///
    /// # Errors
    /// When it is flat, or holds more than [`MOST_PROBES`].
    pub fn new(lower: DVec3, upper: DVec3, resolution: Resolution) -> Result<Self, GridError> {
        let size = upper - lower;
        for (axis, name) in ['x', 'y', 'z'].into_iter().enumerate() {
            let is_solid = size[axis] > 0.0;
            if !is_solid {
                return Err(GridError::Flat(name));
            }
        }
        let wanted = match resolution {
            // A box of so many spacings to rounding is not cut once more.
            Resolution::Spacing(spacing) => (size / spacing - 1e-9).ceil().max(DVec3::ONE),
            Resolution::Probes(probes) => DVec3::from_array(probes.map(|n| n as f64)),
        };
        let count = wanted.element_product();
        if count > MOST_PROBES as f64 {
            let cubic = (size.element_product() / MOST_PROBES as f64).cbrt();
            // One more along each axis for what is rounded up.
            let would_do = cubic * 1.01 + size.max_element() / MOST_PROBES as f64;
            return Err(GridError::TooMany(count, would_do));
        }
        Ok(Self {
            lower,
            upper,
            probes: wanted.to_array().map(|n| n as usize),
        })
    }

    /// Number of probes.
    pub fn count(&self) -> usize {
        self.probes.iter().product()
    }

    /// Metres between neighbours along each axis.
    pub fn spacing(&self) -> DVec3 {
        (self.upper - self.lower) / DVec3::from_array(self.probes.map(|n| n as f64))
    }

    /// Place of a probe along each axis.
    pub fn cell(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.probes;
        [index % x, index / x % y, index / (x * y)]
    }

    /// Number of the probe at a place.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [x, y, _] = self.probes;
        i + x * (j + y * k)
    }

    /// Position of a probe in metres.
    pub fn position(&self, index: usize) -> DVec3 {
        let cell = DVec3::from_array(self.cell(index).map(|c| c as f64 + 0.5));
        self.lower + self.spacing() * cell
    }

    /// The probes at the sides of one, at most six.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let cell = self.cell(index);
        (0..3).flat_map(move |axis| {
            [-1_isize, 1].into_iter().filter_map(move |step| {
                let mut other = cell;
                other[axis] = cell[axis].checked_add_signed(step)?;
                (other[axis] < self.probes[axis]).then(|| self.index(other))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_stand_in_the_middle_of_cells() {
        let upper = DVec3::new(2.0, 1.0, 0.3);
        let grid = Grid::new(DVec3::ZERO, upper, Resolution::Spacing(0.5)).expect("a grid");
        assert_eq!(grid.probes, [4, 2, 1]);
        assert_eq!(grid.position(0), DVec3::new(0.25, 0.25, 0.15));
        assert_eq!(grid.position(7), DVec3::new(1.75, 0.75, 0.15));
        assert_eq!(grid.cell(6), [2, 1, 0]);
        assert_eq!(grid.neighbours(5).collect::<Vec<_>>(), [4, 6, 1]);
        assert_eq!((0..8).map(|i| grid.index(grid.cell(i))).sum::<usize>(), 28);
    }

    #[test]
    fn what_is_flat_or_too_fine_is_refused_with_the_remedy() {
        let flat = Grid::new(
            DVec3::ZERO,
            DVec3::new(1.0, 0.0, 1.0),
            Resolution::Spacing(0.1),
        );
        assert_eq!(flat, Err(GridError::Flat('y')));
        let size = DVec3::new(30.0, 3.0, 20.0);
        let Err(GridError::TooMany(_, would_do)) =
            Grid::new(DVec3::ZERO, size, Resolution::Spacing(1e-3))
        else {
            panic!("too many");
        };
        assert!(Grid::new(DVec3::ZERO, size, Resolution::Spacing(would_do)).is_ok());
        let huge = Resolution::Probes([1 << 20, 1 << 20, 1 << 20]);
        assert!(Grid::new(DVec3::ZERO, size, huge).is_err());
    }
}
