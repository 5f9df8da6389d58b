// The page's side of the check: shows a baked folder with the snippet that luxel wrote, unchanged, and measures what is shown
// against the picture that luxel rendered from the same camera. Everything is linear; pictures are rows from the bottom.

import * as THREE from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

const SUPERSAMPLING = 4; // a pixel of luxel's is the mean over its area

function pixels(renderer, scene, camera, width, height) {
  const options = { type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter };
  const target = new THREE.WebGLRenderTarget(width, height, options);
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const data = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, data);
  renderer.setRenderTarget(null);
  target.dispose();
  return data;
}

function reduced(data, width, height, factor) {
  const result = new Float32Array(4 * width * height);
  for (let y = 0; y < height * factor; y++) {
    for (let x = 0; x < width * factor; x++) {
      const from = 4 * (y * width * factor + x);
      const to = 4 * (Math.floor(y / factor) * width + Math.floor(x / factor));
      for (let c = 0; c < 4; c++) result[to + c] += data[from + c] / factor ** 2;
    }
  }
  return result;
}

// Primitives of one node count as one object.
function named(object) {
  return object.parent?.userData.luxel_lightmap ? object.parent.name : object.name;
}

// Which object each pixel shows, zero where its neighbours show another.
function objects(renderer, scene, camera, width, height) {
  const names = ['nothing'];
  const kept = [];
  scene.traverse((object) => {
    if (!object.isMesh) return;
    const name = named(object);
    if (!names.includes(name)) names.push(name);
    kept.push([object, object.material]);
    const material = new THREE.MeshBasicMaterial({ side: object.material.side, toneMapped: false });
    material.color.setRGB(names.indexOf(name), 0, 0);
    object.material = material;
  });
  const data = pixels(renderer, scene, camera, width, height);
  for (const [object, material] of kept) object.material = material;
  const at = (x, y) => Math.round(data[4 * (y * width + x)]);
  const ids = new Array(width * height).fill(0);
  for (let y = 1; y < height - 1; y++) {
    for (let x = 1; x < width - 1; x++) {
      const around = [-1, 0, 1].flatMap((dy) => [-1, 0, 1].map((dx) => at(x + dx, y + dy)));
      if (around.every((id) => id === around[4])) ids[y * width + x] = around[4];
    }
  }
  return { names, ids };
}

function compared(shown, reference, ids, id, level) {
  const sums = [0, 0, 0].map(() => ({ shown: 0, reference: 0, squares: 0 }));
  const differences = [];
  let count = 0;
  ids.forEach((own, pixel) => {
    if (own !== id) return;
    count += 1;
    let [a, b] = [0, 0];
    sums.forEach((sum, c) => {
      const [value, expected] = [shown[4 * pixel + c], reference[4 * pixel + c]];
      sum.shown += value;
      sum.reference += expected;
      sum.squares += (value - expected) ** 2;
      a += value;
      b += expected;
    });
    differences.push(Math.abs(a - b) / (3 * level));
  });
  differences.sort((a, b) => a - b);
  const total = (key) => sums.reduce((all, sum) => all + sum[key], 0);
  return {
    count,
    level: total('reference') / (3 * count),
    bias: total('shown') / total('reference') - 1,
    channels: sums.map((sum) => sum.shown / sum.reference - 1),
    rms: Math.sqrt(total('squares') / (3 * count)) / level,
    median: differences[differences.length >> 1],
  };
}

export async function measure(name, points) {
  const { loadBaked } = await import(`/bake/${name}/three.js`);
  const { scene, manifest } = await loadBaked(`/bake/${name}/`);
  const loader = new EXRLoader().setDataType(THREE.FloatType);
  const reference = (await loader.loadAsync(`/bake/${name}/reference.exr`)).image;
  const { width, height } = reference;
  const world = new THREE.Scene();
  world.add(scene);
  world.updateMatrixWorld(true);
  let camera;
  scene.traverse((object) => (camera ??= object.isCamera ? object : undefined));
  camera.aspect = width / height;
  camera.updateProjectionMatrix();

  const renderer = new THREE.WebGLRenderer();
  renderer.toneMapping = THREE.NoToneMapping;
  const { names, ids } = objects(renderer, world, camera, width, height);
  const large = pixels(renderer, world, camera, width * SUPERSAMPLING, height * SUPERSAMPLING);
  const shown = reduced(large, width, height, SUPERSAMPLING);
  // What pixels differ by is told relative to the mean of all that are no lamps, as luxel tells errors.
  const emits = names.map(() => false);
  world.traverse((object) => (emits[names.indexOf(named(object))] ||= object.isMesh && object.material.emissive.r > 0));
  let [sum, count] = [0, 0];
  ids.forEach((id, pixel) => {
    if (id === 0 || emits[id]) return;
    for (let c = 0; c < 3; c++) sum += reference.data[4 * pixel + c];
    count += 3;
  });
  const found = names
    .map((object, id) => ({ object, ...compared(shown, reference.data, ids, id, sum / count) }))
    .slice(1)
    .filter(({ count }) => count > 0);

  // Radiance where given points are seen, of one of the fine pixels.
  const probed = points.map((point) => {
    const place = new THREE.Vector3(...point).project(camera);
    const x = Math.floor((0.5 + 0.5 * place.x) * width * SUPERSAMPLING);
    const y = Math.floor((0.5 + 0.5 * place.y) * height * SUPERSAMPLING);
    const from = 4 * (y * width * SUPERSAMPLING + x);
    return Array.from(large.slice(from, from + 3));
  });
  return { revision: THREE.REVISION, target: manifest.units.target, objects: found, probed };
}
