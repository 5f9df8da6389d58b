// Shows a scene with the lightmaps that luxel baked: three.js r155 or later.
//
//   import { loadBaked } from './three.js';
//   const { scene, manifest } = await loadBaked('baked/', renderer);
//   world.add(scene);
//
// The maps hold all light (manifest.lightmap.include says which): leave the scene's own lights out, or they count twice. Show it with
// renderer.toneMapping = THREE.LinearToneMapping and renderer.toneMappingExposure = manifest.exposure.

import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

// Phones that filter no 32-bit textures (OES_texture_float_linear) want THREE.HalfFloatType, which ends at 65504, or maps in KTX2.
const TYPE = THREE.FloatType;

// By the kind of file: its loader, whether that puts the last row first (glTF counts v from the first), and what HDRLoader's division by
// 255 instead of 256 is to be made good with. HDRLoader is called RGBELoader before r180.
const LOADERS = {
  exr: async () => new (await import('three/addons/loaders/EXRLoader.js')).EXRLoader().setDataType(TYPE),
  hdr: async () => new (await import('three/addons/loaders/HDRLoader.js')).HDRLoader().setDataType(TYPE),
  ktx2: async (renderer) => new (await import('three/addons/loaders/KTX2Loader.js')).KTX2Loader().detectSupport(renderer),
};
const LAST_ROW_FIRST = { exr: true, hdr: false, ktx2: false };
const BRIGHTNESS = { exr: 1, hdr: 255 / 256, ktx2: 1 };

export async function loadBaked(folder, renderer) {
  const manifest = await (await fetch(folder + 'manifest.json')).json();
  // Materials whose gloss can be turned off, see below.
  const gltf = new GLTFLoader().register(() => ({ name: 'luxel', getMaterialType: () => THREE.MeshPhysicalMaterial }));
  const { scene } = await gltf.loadAsync(folder + 'scene.glb');
  const { format } = manifest.lightmap.pages[0].encoding;
  const loader = await LOADERS[format](renderer);
  const pages = await Promise.all(manifest.lightmap.pages.map((page) => loader.loadAsync(folder + page.file)));
  for (const texture of pages) {
    texture.channel = 1; // TEXCOORD_1
    texture.flipY = LAST_ROW_FIRST[format];
    texture.minFilter = THREE.LinearFilter;
    texture.magFilter = THREE.LinearFilter;
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
    material.lightMapIntensity = BRIGHTNESS[format]; // texels hold irradiance
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
