//! How often light may be reflected.

/// Reflections between surfaces that light may undergo before it arrives where it is measured.
///
/// With R the operator that reflects light once, E = Σ_k E_k, where E_0 comes straight from sources and E_k was reflected k times
/// (Neumann's series). Each further term is smaller by the reflectance, or more in open scenes: after N bounces in a closed scene of
/// reflectance ρ the share ρ^(N+1) is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// As often as it is: the whole series.
    All,
    /// No more often than this: a partial sum. Zero leaves direct light alone.
    AtMost(u32),
}

impl Bounces {
    /// Whether light counts that was reflected so many times.
    pub fn include(self, reflections: u32) -> bool {
        match self {
            Self::All => true,
            Self::AtMost(most) => reflections <= most,
        }
    }

    /// Whether any reflected light counts.
    pub fn reflect(self) -> bool {
        self.include(1)
    }

    /// What light may undergo before it is reflected once more; `None` where it may not be reflected.
    #[must_use]
    pub fn before_reflection(self) -> Option<Self> {
        match self {
            Self::All => Some(Self::All),
            Self::AtMost(most) => most.checked_sub(1).map(Self::AtMost),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounces_are_used_up_one_by_one() {
        assert!(!Bounces::AtMost(0).reflect() && Bounces::AtMost(0).include(0));
        let mut left = Some(Bounces::AtMost(2));
        let mut used = 0;
        while let Some(bounces) = left {
            assert_eq!(bounces, Bounces::AtMost(2 - used));
            left = bounces.before_reflection();
            used += 1;
        }
        assert_eq!(used, 3, "two reflections and none");
        assert_eq!(Bounces::All.before_reflection(), Some(Bounces::All));
        assert!(Bounces::All.include(u32::MAX));
    }
}
