// Shows a scene with the lightmaps that luxel baked: three.js r152 or later.
//
//   import { loadBaked } from './three.js';
//   const { scene, manifest } = await loadBaked('baked/');
//   world.add(scene);
//
// The maps hold all light (manifest.include says which): leave the scene's own lights out, or they count twice. Show it with
// renderer.toneMappingExposure = manifest.exposure.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

export async function loadBaked(folder) {
  const manifest = await (await fetch(folder + 'manifest.json')).json();
  const { scene } = await new GLTFLoader().loadAsync(folder + 'scene.glb');
  const loader = new EXRLoader().setDataType(THREE.FloatType);
  const pages = await Promise.all(manifest.pages.map((page) => loader.loadAsync(folder + page.file)));
  for (const texture of pages) {
    texture.channel = 1; // TEXCOORD_1
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
  }
  const lights = [];
  scene.traverse((object) => {
    if (object.isLight) lights.push(object);
    if (!object.isMesh) return;
    // Nodes of several primitives are groups: what they say holds for their meshes.
    const said = object.userData.luxel_lightmap ?? object.parent?.userData.luxel_lightmap;
    if (!said) return;
    object.material = object.material.clone();
    object.material.lightMap = pages[said.page];
    object.material.lightMapIntensity = 1; // texels hold irradiance
  });
  for (const light of lights) light.removeFromParent();
  return { scene, manifest };
}
