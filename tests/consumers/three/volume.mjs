// Is the irradiance of a volume in three.js that which luxel computes at the same points? Needs no browser:
//
//   npm install && LUXEL=../../../target/release/luxel node volume.mjs
//
// Bakes the Cornell box with --volume, loads it with the three.js that luxel wrote, and compares SphericalHarmonics3.getIrradianceAt at probes with
// `luxel probe`: what a normal receives more than its opposite follows from degree one and agrees to the stated errors, the whole to what degree two leaves out besides.

import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import * as THREE from 'three';

const here = dirname(fileURLToPath(import.meta.url));
const luxel = process.env.LUXEL ?? join(here, '../../../target/release/luxel');
const scene = join(here, '../../../scenes/data/cornell/cornell.toml');
const folder = mkdtempSync(join(here, 'volume-'));
const run = (...args) => execFileSync(luxel, args, { stdio: ['ignore', 'pipe', 'inherit'] });
try {
  run('bake', scene, '-o', folder, '--for', 'three', '--size', '64', '--volume-probes', '3x3x3', '--error', '2%', '-q');
  // As an ES module.
  const module = join(folder, 'three.mjs');
  copyFileSync(join(folder, 'three.js'), module);
  const { Volume } = await import(module);
  const header = JSON.parse(readFileSync(join(folder, 'volume.json')));
  const data = readFileSync(join(folder, header.files.data));
  const volume = new Volume(header, data.buffer.slice(data.byteOffset, data.byteOffset + data.length));
  const validity = readFileSync(join(folder, header.files.validity));
  const { lower, spacing, probes } = header.grid;
  const normals = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
  const rows = [];
  for (let k = 0; k < probes[2]; k++)
    for (let j = 0; j < probes[1]; j++)
      for (let i = 0; i < probes[0]; i++) {
        if (validity[i + probes[0] * (j + probes[1] * k)] !== 255) continue;
        const at = [i, j, k].map((n, axis) => lower[axis] + (n + 0.5) * spacing[axis]);
        for (const normal of normals) rows.push([...at, ...normal]);
      }
  writeFileSync(join(folder, 'points.csv'), ['x,y,z,nx,ny,nz', ...rows.map((row) => row.join(','))].join('\n') + '\n');
  run('probe', scene, '--points', join(folder, 'points.csv'), '-o', join(folder, 'result.csv'), '--error', '0.5%', '-q');
  const lines = readFileSync(join(folder, 'result.csv'), 'utf8').trim().split('\n').slice(1);
  const expected = lines.map((line) => line.split(',').map(Number).slice(6, 9));
  const found = rows.map(([x, y, z, nx, ny, nz]) => {
    const sh = volume.sample(new THREE.Vector3(x, y, z));
    return sh.getIrradianceAt(new THREE.Vector3(nx, ny, nz), new THREE.Vector3()).toArray();
  });
  const mean = header.error.mean;
  const rms = (values) => Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length);
  const channels = [0, 1, 2];
  const whole = found.flatMap((f, n) => channels.map((c) => (f[c] - expected[n][c]) / mean[c]));
  const odd = [];
  for (let n = 0; n < found.length; n += 2)
    for (const c of channels) odd.push((found[n][c] - found[n + 1][c] - expected[n][c] + expected[n + 1][c]) / mean[c]);
  const stated = header.error.irradiance;
  console.log(`${rows.length} values: ${(100 * rms(odd)).toFixed(2)} % between opposite normals, ${(100 * rms(whole)).toFixed(2)} % in all; ` +
    `stated ${(100 * stated).toFixed(2)} %, truncation at most ${(100 * header.error.truncation).toFixed(1)} %`);
  // A difference of two normals holds twice the error of degree one, √3 of it along an axis; and the probe's own.
  if (rms(odd) > 2 * Math.sqrt(3) * stated + 0.02) throw new Error('opposite normals disagree');
  if (rms(whole) > header.error.truncation + stated + 0.01) throw new Error('irradiance disagrees');
  // What light() puts into shaders finds its places there.
  const object = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial());
  volume.light(object)(new THREE.Vector3());
  const shader = { uniforms: {}, fragmentShader: THREE.ShaderLib.physical.fragmentShader };
  object.material.onBeforeCompile(shader);
  const places = shader.fragmentShader.split('luxelProbe').length - 1;
  if (places !== 2 || shader.uniforms.luxelProbe.value.length !== 9) throw new Error('the shader of three.js has changed');
} finally {
  rmSync(folder, { recursive: true, force: true });
}
