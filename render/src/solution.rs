//! Radiosity solutions summed up by object, for reports and meshes.

use crate::accuracy::{Accuracy, Replicates};
use crate::display::Display;
use crate::ply::{Mesh, Vertex};
use glam::DVec3;
use luxel_scenes::{Exitance, FaceId, Flux, Irradiance, ObjectId, Radiosity, Rgb};
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
    /// One standard deviation of the error of the mean radiosity in W/m², where it is known.
    pub standard_error: Option<Radiosity>,
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
                standard_error: None,
            })
            .collect()
    }

    /// As [`Self::by_object`], with the errors of the means: sampling from the `irradiance` of each
    /// replicate that this light is the mean of, larger patches from `coarsening`, by replicate and
    /// patch, and the solver's bound in W/m².
    ///
    /// # Panics
    /// With fewer than two replicates.
    pub fn by_object_with_errors(
        &self,
        world: &World<'_>,
        patches: &Patches,
        irradiance: &[Vec<Irradiance>],
        coarsening: &[Vec<Irradiance>],
        bound: Rgb,
    ) -> Vec<ObjectLight> {
        // Reflected light alone: what is emitted is known.
        let reflected = |irradiance: Vec<Irradiance>| {
            let radiosity = irradiance
                .iter()
                .zip(patches.reflectances())
                .map(|(&e, &rho)| rho * e)
                .collect();
            let light = Self {
                irradiance,
                radiosity,
            };
            light.by_object(world, patches)
        };
        let values: Vec<_> = irradiance.iter().cloned().map(reflected).collect();
        let coarsening: Vec<_> = coarsening.iter().cloned().map(reflected).collect();
        let mut objects = self.by_object(world, patches);
        let of_object = |from: &[Vec<ObjectLight>], index: usize| {
            from.iter()
                .map(|objects| objects[index].radiosity.0)
                .collect()
        };
        let replicates: Vec<Replicates> = (0..objects.len())
            .map(|index| Replicates {
                values: of_object(&values, index),
                coarsening: of_object(&coarsening, index),
            })
            .collect();
        let accuracy = Accuracy::of(&replicates);
        for (object, error) in objects.iter_mut().zip(accuracy.standard_error()) {
            let square = error.0 * error.0 + bound * bound;
            object.standard_error = Some(Radiosity(square.map(f64::sqrt)));
        }
        objects
    }

    /// Memory of the mesh of so many patches and of its file, in bytes, while it is made.
    pub fn bytes_of_mesh(patches: usize) -> usize {
        // About as many vertices and faces as patches.
        Display::bytes_for(patches) + patches * 2 * size_of::<(Vertex, [u32; 10])>()
    }

    /// The patches as a mesh without T-junctions, continuous over smooth surfaces of one material
    /// ([`Display`]); `errors` are those of the patches' irradiance, and `exposed` tells which patches
    /// lie in the open. Where smaller patches meet a larger one, that is a fan around its middle.
    ///
    /// # Panics
    /// When there is not one error and one answer per patch.
    pub fn mesh(
        &self,
        world: &World<'_>,
        patches: &Patches,
        errors: &[Irradiance],
        exposed: &[bool],
    ) -> Mesh {
        assert_eq!(errors.len(), patches.len(), "one error per patch");
        let geometry = world.surfaces().geometry();
        let material = |patch: PatchId| world.surfaces().material_id(patches.faces(patch).0[0]);
        let display = Display::new(world, patches, exposed, |a, b| material(a) == material(b));
        let radiosity: Vec<Rgb> = self.radiosity.iter().map(|b| b.0).collect();
        let errors: Vec<Rgb> = errors
            .iter()
            .zip(patches.reflectances())
            .map(|(&error, &rho)| (rho * error).0)
            .collect();
        let at_vertices = display.at_vertices(&radiosity);
        let vertex = |position, radiosity, error| Vertex {
            position: geometry.frame().to_world(position),
            radiosity: Radiosity(radiosity),
            standard_error: Radiosity(error),
        };
        let mut mesh = Mesh {
            vertices: display
                .vertices()
                .iter()
                .zip(at_vertices.iter().zip(display.at_vertices(&errors)))
                .map(|(v, (&radiosity, error))| vertex(v.position, radiosity, error))
                .collect(),
            faces: Vec::new(),
        };
        for patch in patches.ids() {
            for piece in display.pieces(patch) {
                let corners = &piece.vertices;
                if !piece.has_hanging {
                    mesh.faces.push(corners.clone());
                    continue;
                }
                let places = corners
                    .iter()
                    .map(|&v| display.vertices()[v as usize].position);
                let middle = places.sum::<DVec3>() / corners.len() as f64;
                let centre = mesh.vertices.len() as u32;
                let index = patch.index();
                mesh.vertices
                    .push(vertex(middle, radiosity[index], errors[index]));
                let next = corners.iter().cycle().skip(1);
                mesh.faces
                    .extend(corners.iter().zip(next).map(|(&a, &b)| vec![a, b, centre]));
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
