//! Direct light at a point with what is to be expected of its noise.
//!
//! n rays of which a share p reaches a light of unoccluded irradiance E leave Var = E² p (1 − p) / n, were they
//! independent of each other; even samples have less, by about the same factor everywhere. Lights of few rays, which
//! each alone seem wholly visible or wholly hidden, are judged together: Var = Σ E_i² / n_i · p (1 − p) with
//! p = Σ E_i V_i / Σ E_i. It is zero where every light is wholly visible or wholly hidden: there rays make no noise.

use luxel_scenes::{Irradiance, Rgb};

/// Rays from which a light's visible share is judged by its own rays alone.
const ENOUGH_RAYS: usize = 4;

/// Direct light at a sample.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Lit {
    /// Irradiance in W/m².
    pub irradiance: Irradiance,
    /// What the variance of the irradiance would be if rays were independent of each other, in W²/m⁴.
    pub variance: Rgb,
}

/// Adds up the light of a sample.
#[derive(Default)]
pub(super) struct LitSum {
    lit: Lit,
    pooled: Rgb,
    pooled_visible: Rgb,
    pooled_squares: Rgb,
}

impl LitSum {
    /// Adds a light, or a share of many, of which `rays` rays find that share visible.
    pub(super) fn add(&mut self, irradiance: Rgb, visible: f64, rays: usize) {
        self.lit.irradiance.0 += irradiance * visible;
        let square = irradiance * irradiance / rays as f64;
        if rays < ENOUGH_RAYS {
            self.pooled += irradiance;
            self.pooled_visible += irradiance * visible;
            self.pooled_squares += square;
        } else {
            self.lit.variance += square * of_share(visible);
        }
    }

    /// The sum.
    pub(super) fn finish(self) -> Lit {
        let pooled = self.pooled.element_sum();
        if pooled <= 0.0 {
            return self.lit;
        }
        let visible = self.pooled_visible.element_sum() / pooled;
        let variance = self.lit.variance + self.pooled_squares * of_share(visible);
        Lit {
            variance,
            ..self.lit
        }
    }
}

/// p (1 − p), not below zero by rounding.
fn of_share(visible: f64) -> f64 {
    (visible * (1.0 - visible)).max(0.0)
}
