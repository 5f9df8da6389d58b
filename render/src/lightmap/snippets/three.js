// Shows a scene with the lightmaps that luxel baked: three.js r155 or later.
//
//   import { loadBaked } from './three.js';
//   const { scene, manifest } = await loadBaked('baked/', renderer);
//   world.add(scene);
//
// The maps hold all light (manifest.lightmap.include says which): leave the scene's own lights out, or they count twice. Show it with
// renderer.toneMapping = THREE.LinearToneMapping and renderer.toneMappingExposure = manifest.exposure.

// A bake with --volume lights what moves:
//
//   const volume = await loadVolume('baked/');
//   const follow = volume.light(object); // its materials alone: the lightmaps of the others hold this light already
//   follow(object.position); // whenever it has moved
//
// volume.sample(point, probe.sh) gives a THREE.LightProbe the same light, which then falls on everything in the scene.

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

// The irradiance volume of a bake, or null where there is none.
export async function loadVolume(folder) {
  const manifest = await (await fetch(folder + 'manifest.json')).json();
  if (!manifest.volume) return null;
  const header = await (await fetch(folder + manifest.volume)).json();
  const data = await (await fetch(folder + header.files.data)).arrayBuffer();
  return new Volume(header, data);
}

// Spherical harmonics of the radiance that arrives at probes, in the basis and order of THREE.SphericalHarmonics3, of which three.js makes irradiance.
export class Volume {
  constructor(header, data) {
    this.header = header;
    this.coefficients = (header.order + 1) ** 2;
    const view = new DataView(data); // little-endian wherever it is read
    this.values = Float32Array.from({ length: data.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, true));
  }

  // Writes what arrives at a point (THREE.Vector3, in the scene's metres) to `sh` (THREE.SphericalHarmonics3).
  sample(point, sh = new THREE.SphericalHarmonics3()) {
    const { lower, upper, probes } = this.header.grid;
    const axes = ['x', 'y', 'z'].map((axis, i) => {
      const at = ((point[axis] - lower[i]) / (upper[i] - lower[i])) * probes[i] - 0.5;
      const clamped = Math.min(Math.max(at, 0), probes[i] - 1);
      const first = Math.min(Math.floor(clamped), Math.max(probes[i] - 2, 0));
      return { first, share: clamped - first };
    });
    sh.zero();
    for (let corner = 0; corner < 8; corner++) {
      const steps = axes.map((_, i) => (corner >> i) & 1);
      const weight = axes.reduce((w, axis, i) => w * (steps[i] ? axis.share : 1 - axis.share), 1);
      if (weight === 0) continue;
      const [i, j, k] = axes.map((axis, n) => axis.first + steps[n]);
      const start = 3 * this.coefficients * (i + probes[0] * (j + probes[1] * k));
      for (let c = 0; c < this.coefficients; c++) {
        const at = start + 3 * c;
        sh.coefficients[c].x += weight * this.values[at];
        sh.coefficients[c].y += weight * this.values[at + 1];
        sh.coefficients[c].z += weight * this.values[at + 2];
      }
    }
    return sh;
  }

  // Lights an object, and nothing else, with what arrives where it is. Returns what to call with its position.
  light(object) {
    const sh = new THREE.SphericalHarmonics3();
    const irradiance = `#include <lights_fragment_begin>
      #if defined( RE_IndirectDiffuse )
        vec3 luxelNormal = normalize( ( vec4( geometryNormal, 0.0 ) * viewMatrix ).xyz );
        irradiance += max( shGetIrradianceAt( luxelNormal, luxelProbe ), vec3( 0.0 ) );
      #endif`;
    object.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.material = [mesh.material].flat().map((material) => {
        const own = material.clone();
        own.onBeforeCompile = (shader) => {
          shader.uniforms.luxelProbe = { value: sh.coefficients };
          shader.fragmentShader = shader.fragmentShader
            .replace('#include <lights_pars_begin>', '#include <lights_pars_begin>\nuniform vec3 luxelProbe[ 9 ];')
            .replace('#include <lights_fragment_begin>', irradiance);
        };
        own.customProgramCacheKey = () => 'luxel-volume';
        return own;
      });
      if (mesh.material.length === 1) mesh.material = mesh.material[0];
    });
    return (point) => this.sample(point, sh);
  }
}
