//! A hit with all that shading asks of it.

use glam::{DVec3, Vec3};
use luxel_scenes::{Material, Radiance, Reflectance, Specular};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::geometry::ray_origin;
use luxel_solver::patches::Side;
use luxel_solver::world::{Interaction, Receiver, World};

/// A point where a ray met a surface. Vectors are in the unit frame.
#[derive(Clone, Copy)]
pub(crate) struct Vertex<'w> {
    world: &'w World<'w>,
    /// Where it is.
    pub(crate) interaction: Interaction,
    /// Unit direction back along the ray.
    pub(super) view: DVec3,
    /// Unit shading normal, to the side of the ray.
    pub(super) shading_normal: DVec3,
}

impl<'w> Vertex<'w> {
    /// The vertex of a hit; `None` for a miss.
    pub(crate) fn new(world: &'w World<'w>, ray: &Ray, hit: &Hit) -> Option<Self> {
        let interaction = world.interaction(ray, hit)?;
        let front = world.surfaces().shading_normal(interaction.point);
        Some(Self {
            world,
            interaction,
            view: -ray.direction.as_dvec3().normalize(),
            shading_normal: match interaction.side {
                Side::Front => front,
                Side::Back => -front,
            },
        })
    }

    /// Unit normal of the face, to the side of the ray.
    pub(super) fn normal(&self) -> DVec3 {
        self.interaction.receiver.normal
    }

    /// The vertex as a receiver of diffuse light, about its shading normal.
    pub(crate) fn receiver(&self) -> Receiver {
        Receiver {
            normal: self.shading_normal,
            ..self.interaction.receiver
        }
    }

    /// The material.
    pub(super) fn material(&self) -> &'w Material {
        self.world.surfaces().material(self.interaction.face)
    }

    /// Whether the face emits and reflects on this side.
    fn is_lit_side(&self) -> bool {
        let surfaces = self.world.surfaces();
        surfaces.has_side(self.interaction.face, self.interaction.side)
    }

    /// Radiance that the surface itself sends along the ray.
    pub(crate) fn emission(&self) -> Radiance {
        if self.is_lit_side() {
            self.world.surfaces().emission(self.interaction.point)
        } else {
            Radiance::ZERO
        }
    }

    /// Diffuse reflectance on this side; zero on the back of a one-sided face.
    pub(crate) fn reflectance(&self) -> Reflectance {
        if self.is_lit_side() {
            self.world.surfaces().reflectance(self.interaction.point)
        } else {
            Reflectance::ZERO
        }
    }

    /// What the surface does besides diffuse reflection on this side. Glass has two sides always.
    pub(super) fn specular(&self) -> Specular {
        match self.material().specular {
            glass @ Specular::Glass { .. } => glass,
            other if self.is_lit_side() => other,
            _ => Specular::None,
        }
    }

    /// Index of refraction beyond the surface over that on the viewer's side, of glass whose inside
    /// has `index` times that of its outside.
    pub(super) fn relative_index(&self, index: f64) -> f64 {
        match self.interaction.side {
            Side::Front => index,
            Side::Back => 1.0 / index,
        }
    }

    /// A ray that leaves in the unit direction `direction`, on whichever side that is, and cannot
    /// meet the surface itself again.
    pub(super) fn ray(&self, direction: DVec3) -> Ray {
        let Receiver {
            position,
            normal,
            origin,
        } = self.interaction.receiver;
        let beyond = || -> Vec3 {
            let geometry = self.world.surfaces().geometry();
            ray_origin(position, -normal, geometry.extent(self.interaction.face))
        };
        let origin = if direction.dot(normal) < 0.0 {
            beyond()
        } else {
            origin
        };
        Ray::new(origin, direction.as_vec3().normalize())
    }
}
