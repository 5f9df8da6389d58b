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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wholly_visible_or_hidden_makes_no_noise() {
        let mut sum = LitSum::default();
        sum.add(Rgb::splat(3.0), 1.0, 48);
        sum.add(Rgb::splat(2.0), 0.0, 1);
        sum.add(Rgb::splat(5.0), 0.0, 48);
        assert_eq!(
            sum.finish(),
            Lit {
                irradiance: Irradiance(Rgb::splat(3.0)),
                variance: Rgb::ZERO
            }
        );
        assert_eq!(LitSum::default().finish(), Lit::default());
    }

    #[test]
    fn a_light_of_many_rays_has_the_variance_of_its_share() {
        let mut sum = LitSum::default();
        sum.add(Rgb::splat(2.0), 0.25, 16);
        // 2² · 0.25 · 0.75 / 16, exact in binary.
        assert_eq!(sum.finish().variance, Rgb::splat(4.0 * 0.1875 / 16.0));
    }

    #[test]
    fn lights_of_few_rays_are_judged_together() {
        // Four lights of one ray each, half of their light seen: Σ E² p (1 − p) = 4 · 1/4.
        let mut sum = LitSum::default();
        for visible in [1.0, 0.0, 0.0, 1.0] {
            sum.add(Rgb::ONE, visible, 1);
        }
        let lit = sum.finish();
        assert_eq!(lit.irradiance, Irradiance(Rgb::splat(2.0)));
        assert_eq!(lit.variance, Rgb::ONE);
    }
}
