//! Which material of the document each group of faces has: the file's own, one that a scene file made, or a copy whose textures
//! look for set 1 where it has gone.

use super::{Groups, Source, primitives};
use crate::lightmap::export::glb::GlbError;
use crate::lightmap::export::glb::document::{Document, index};
use crate::lightmap::export::glb::surfaces::{self, Surfaces};
use crate::lightmap::export::glb::texture_sets::{self, Uses};
use luxel_scenes::{MaterialId, Scene};
use serde_json::Value;
use std::collections::BTreeMap;

/// The materials of the document, after all changes.
pub(super) struct Materials {
    /// The document's material of each run and material of the scene; `None` is the format's default.
    chosen: BTreeMap<(usize, MaterialId), Option<usize>>,
    /// Which material stands for one whose set 1 has gone to a place.
    moved: BTreeMap<(usize, usize), usize>,
}

impl Materials {
    /// Adds and changes materials as the scene and its lightmap ask for it.
    pub(super) fn choose(
        document: &mut Document,
        scene: &Scene,
        source: &Source,
        groups: &Groups,
    ) -> Result<Self, GlbError> {
        let count = document.items("materials").len();
        let changed = &source.origin.changed;
        let mut surfaces = Surfaces::new(scene);
        let mut chosen = BTreeMap::new();
        for &(run, _, id) in groups.keys() {
            let own = index(source.primitive(run), "material");
            // The reader adds the format's default behind the materials of the document.
            let is_default = own.is_none() && id.index() == count;
            let material = if id.index() < count {
                Some(id.index())
            } else if is_default && !changed.contains(&id) {
                None
            } else {
                Some(surfaces.material(document, id)?)
            };
            chosen.insert((run, id), material);
        }
        for &id in changed.iter().filter(|id| id.index() < count) {
            surfaces::change(document, id.index(), &scene.materials[id.index()]);
        }
        let uses = uses(document, source, groups, &chosen);
        let moved = texture_sets::repoint(document, &uses);
        Ok(Self { chosen, moved })
    }

    /// The material of faces of a run, and whether it looks for set 1 behind the `sets` of the primitive. Faces without a
    /// lightmap keep set 1 where it is.
    pub(super) fn of(
        &self,
        run: usize,
        material: MaterialId,
        is_lit: bool,
        sets: usize,
    ) -> (Option<usize>, bool) {
        let chosen = self.chosen.get(&(run, material)).copied().flatten();
        let moved = chosen.and_then(|chosen| self.moved.get(&(chosen, sets)));
        match moved {
            Some(&moved) if is_lit => (Some(moved), true),
            _ => (chosen, false),
        }
    }
}

/// Where set 1 goes in the primitives of each material that has textures there.
fn uses(
    document: &Document,
    source: &Source,
    groups: &Groups,
    chosen: &BTreeMap<(usize, MaterialId), Option<usize>>,
) -> Uses {
    let materials = document.items("materials");
    let second: Vec<bool> = materials.iter().map(texture_sets::uses_second).collect();
    let mut uses = Uses::new();
    let mut add = |material: Option<usize>, set| {
        let used = material.filter(|&m| second.get(m) == Some(&true));
        if let Some(material) = used {
            uses.entry(material).or_default().insert(set);
        }
    };
    for &(run, page, id) in groups.keys() {
        let sets = texture_sets::count(source.primitive(run));
        add(
            chosen[&(run, id)],
            (sets > 1 && page.is_some()).then_some(sets),
        );
    }
    // What stays as it is uses its materials as they are.
    let mut stays = |primitive: &Value| add(index(primitive, "material"), None);
    let mut is_replaced = vec![false; source.meshes.len()];
    for node in &source.nodes {
        is_replaced[node.mesh] |= node.takes_place;
        source.untouched(node).for_each(&mut stays);
    }
    let meshes = source.meshes.iter().zip(is_replaced);
    for (mesh, _) in meshes.filter(|(_, is_replaced)| !is_replaced) {
        primitives(mesh).iter().for_each(&mut stays);
    }
    uses
}
