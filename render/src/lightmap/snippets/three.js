// Shows a scene with the lightmaps that luxel baked: three.js r155 or later.
//
//   import { loadBaked } from './three.js';
//   const { scene, manifest } = await loadBaked('baked/');
//   world.add(scene);
//
// The maps hold all light (manifest.lightmap.include says which): leave the scene's own lights out, or they count twice. Show it with
// renderer.toneMapping = THREE.LinearToneMapping and renderer.toneMappingExposure = manifest.exposure.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

export async function loadBaked(folder) {
  const manifest = await (await fetch(folder + 'manifest.json')).json();
  // Materials whose gloss can be turned off, see below.
  const gltf = new GLTFLoader().register(() => ({ name: 'luxel', getMaterialType: () => THREE.MeshPhysicalMaterial }));
  const { scene } = await gltf.loadAsync(folder + 'scene.glb');
  // Phones that filter no 32-bit textures (OES_texture_float_linear) want THREE.HalfFloatType, which ends at 65504.
  const loader = new EXRLoader().setDataType(THREE.FloatType);
  const pages = await Promise.all(manifest.lightmap.pages.map((page) => loader.loadAsync(folder + page.file)));
  for (const texture of pages) {
    texture.channel = 1; // TEXCOORD_1
    texture.flipY = true; // EXRLoader puts the last row first, glTF counts v from the first
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    texture.needsUpdate = true;
  }
  const lights = [];
  scene.traverse((object) => {
    if (object.isLight) lights.push(object);
    if (!object.isMesh) return;
    // Nodes of several primitives are groups: what they say holds for their meshes.
    const said =
      object.userData.luxel_lightmap ?? object.geometry.userData.luxel_lightmap ?? object.parent?.userData.luxel_lightmap;
    if (!said) return;
    const material = object.material.clone();
    material.lightMap = pages[said.page];
    material.lightMapIntensity = 1; // texels hold irradiance
    material.aoMap = null; // would darken what is occluded already
    // luxel's surfaces are matt. three.js takes what gloss and metal would mirror (4 % at least) from their light, and has
    // nothing to mirror: leave these two lines out where scene.environment gives it something.
    material.specularIntensity = 0;
    if (material.roughness > 0.05) material.metalness = 0;
    object.material = material;
  });
  for (const light of lights) light.removeFromParent();
  return { scene, manifest };
}
