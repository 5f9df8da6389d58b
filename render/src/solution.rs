//! Radiosity solutions summed up by object, for reports and meshes.

use luxel_scenes::{Exitance, FaceId, Flux, Irradiance, ObjectId, Radiosity};
use luxel_solver::patches::{PatchId, Patches};
use luxel_solver::world::World;

/// Irradiance and radiosity of every patch of a scene.
pub struct PatchLight {
    /// Irradiance E in W/m², direct light included, by patch.
    pub irradiance: Vec<Irradiance>,
    /// Radiosity B = M + ρE in W/m², by patch.
    pub radiosity: Vec<Radiosity>,
}

/// What an object receives and sends.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectLight {
    /// The object's name.
    pub name: String,
    /// Area of its faces in m², one side.
    pub area: f64,
    /// Mean radiosity over its lit sides in W/m².
    pub radiosity: Radiosity,
    /// Mean irradiance over its lit sides in W/m².
    pub irradiance: Irradiance,
}

impl PatchLight {
    /// The light of patches with the given irradiance.
    ///
    /// # Panics
    /// When there is not one irradiance per patch.
    pub fn new(patches: &Patches, irradiance: Vec<Irradiance>) -> Self {
        assert_eq!(irradiance.len(), patches.len(), "one irradiance per patch");
        let radiosity = irradiance
            .iter()
            .zip(patches.reflectances())
            .zip(patches.emissions())
            .map(|((&irradiance, &reflectance), &emission)| emission + reflectance * irradiance)
            .collect();
        Self {
            irradiance,
            radiosity,
        }
    }

    /// The largest radiosity of all patches and channels in W/m².
    pub fn brightest(&self) -> f64 {
        let largest = self.radiosity.iter().map(|b| b.0.max_element());
        largest.fold(0.0, f64::max)
    }

    /// Area-weighted means by object, in the order of the scene's objects; objects without faces
    /// are left out. A patch that spans faces of several objects counts for each by their area.
    pub fn by_object(&self, world: &World<'_>, patches: &Patches) -> Vec<ObjectLight> {
        let scene = world.scene();
        let frame = world.surfaces().geometry().frame();
        let face_area = |face: FaceId| frame.area_to_world(world.surfaces().area(face));
        let mut areas = vec![0.0; scene.objects.len()];
        for face in scene.face_ids() {
            areas[scene.faces[face.index()].object.index()] += face_area(face);
        }
        let mut lit = vec![0.0; areas.len()];
        let mut radiosity = vec![Radiosity::ZERO; areas.len()];
        let mut irradiance = vec![Irradiance::ZERO; areas.len()];
        for patch in patches.ids() {
            let (faces, _) = patches.faces(patch);
            let area = frame.area_to_world(patches.areas()[patch.index()]);
            let whole: f64 = faces.iter().map(|&face| face_area(face)).sum();
            for &face in faces {
                let object = scene.faces[face.index()].object.index();
                let share = area * face_area(face) / whole;
                lit[object] += share;
                radiosity[object] += self.radiosity[patch.index()] * share;
                irradiance[object] += self.irradiance[patch.index()] * share;
            }
        }
        (0..areas.len())
            .filter(|&object| areas[object] > 0.0)
            .map(|object| ObjectLight {
                name: scene.objects[ObjectId::new(object).index()].name.clone(),
                area: areas[object],
                radiosity: radiosity[object] * (1.0 / lit[object]),
                irradiance: irradiance[object] * (1.0 / lit[object]),
            })
            .collect()
    }

    /// The patches as a mesh, each with its radiosity, not interpolated.
    pub fn mesh(&self, world: &World<'_>, patches: &Patches) -> crate::ply::Mesh {
        let geometry = world.surfaces().geometry();
        let mut mesh = crate::ply::Mesh::default();
        for patch in patches.ids() {
            for polygon in patches.polygons(geometry, patch) {
                let first = mesh.vertices.len() as u32;
                mesh.faces
                    .push((first..first + polygon.len() as u32).collect());
                mesh.vertices
                    .extend(polygon.iter().map(|&corner| crate::ply::Vertex {
                        position: geometry.frame().to_world(corner),
                        radiosity: self.radiosity[patch.index()],
                    }));
            }
        }
        mesh
    }
}

/// Flux in W that the patches emit, Σ A M.
pub fn emitted_flux(world: &World<'_>, patches: &Patches) -> Flux {
    let frame = world.surfaces().geometry().frame();
    let flux = |patch: PatchId| {
        let Exitance(exitance) = patches.emissions()[patch.index()];
        Flux(exitance * frame.area_to_world(patches.areas()[patch.index()]))
    };
    patches.ids().map(flux).sum()
}
