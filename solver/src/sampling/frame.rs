//! An orthonormal frame around a normal.
//!
//! Equation: with s = sign(n_z), a = −1/(s + n_z), b = n_x n_y a:
//! t = (1 + s n_x² a, s b, −s n_x), β = (b, s + n_y² a, −n_y).
//!
//! Source: T. Duff, J. Burgess, P. Christensen, C. Hery, A. Kensler, M. Liani, R. Villemin,
//! "Building an orthonormal basis, revisited", JCGT 6(1), 2017, listing 3.
//!
//! Validity: unit normals; orthonormal to 1e-6 in f32 for all of them. The frame jumps where n_z
//! changes sign. Cost: one division.

use glam::Vec3;

/// Tangent, bitangent and normal, right-handed: tangent × bitangent = normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// x axis, unit.
    pub tangent: Vec3,
    /// y axis, unit.
    pub bitangent: Vec3,
    /// z axis, unit.
    pub normal: Vec3,
}

impl Frame {
    /// A frame whose z axis is `normal` (unit).
    #[inline]
    pub fn around(normal: Vec3) -> Self {
        let n = normal;
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            bitangent: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            normal,
        }
    }

    /// A vector given in this frame, in world space.
    #[inline]
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }

    /// A vector given in world space, in this frame.
    #[inline]
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(
            self.tangent.dot(world),
            self.bitangent.dot(world),
            self.normal.dot(world),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sphere;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let mut normals = vec![
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            Vec3::Y,
            Vec3::new(0.0, 0.0, -0.0) - Vec3::Z,
        ];
        for i in 0..32 {
            for j in 0..32 {
                normals.push(sphere::sample_sphere([i as f32 / 32.0, j as f32 / 32.0]).normalize());
            }
        }
        for n in normals {
            let f = Frame::around(n);
            // A few roundings of f32 each.
            let defects = [
                f.tangent.dot(f.bitangent),
                f.tangent.dot(n),
                f.bitangent.dot(n),
                f.tangent.length() - 1.0,
                f.bitangent.length() - 1.0,
                (f.tangent.cross(f.bitangent) - n).length(),
            ];
            assert!(defects.iter().all(|d| d.abs() < 1e-6), "{n}: {defects:?}");
            let v = Vec3::new(0.3, -0.5, 0.7);
            assert!((f.to_local(f.to_world(v)) - v).length() < 1e-6, "{n}");
        }
    }
}
