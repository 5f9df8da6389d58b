// Proves that three.js shows a bake as luxel renders it: see README.md. Expected values are luxel's own, computed now.

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { dirname, join, normalize, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const here = dirname(fileURLToPath(import.meta.url));
const root = resolve(here, '../../..');
const LUXEL = process.env.LUXEL ?? join(root, 'target/release/luxel');
const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
const LIMIT = 0.02;
// Smaller objects are seen in too few pixels to tell the light from the outline.
const LEAST_PIXELS = 100;

// Errors are relative to the mean of all luxels, or of all pixels. The lamp's sides have a tenth of that: at 1 % and 0.5 % their own
// light would be known to a tenth and a twentieth.
const scenes = {
  lamp: { file: join(here, 'lamp/lamp.toml'), errors: ['0.2%', '0.1%'], points: join(here, 'lamp/floor.csv'), reflectance: 0.5 },
  cornell: { file: join(root, 'scenes/data/cornell/cornell.toml'), errors: ['1%', '0.5%'] },
  pavilion: { file: join(root, 'scenes/data/pavilion/pavilion.toml'), errors: ['1%', '0.5%'] },
};
const asked = process.argv.slice(2);
const unknown = asked.filter((name) => !(name in scenes));
if (unknown.length > 0) {
  console.error(`no scene ${unknown.join(', ')}; there are ${Object.keys(scenes).join(', ')}`);
  process.exit(2);
}

const folder = mkdtempSync(join(tmpdir(), 'luxel-three-'));
const luxel = (...args) => execFileSync(LUXEL, ['--quiet', ...args], { encoding: 'utf8' });

const HTML = `<!doctype html><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>`;
const TYPES = { js: 'text/javascript', json: 'application/json', glb: 'model/gltf-binary' };

// Serves three.js, the baked folders and the page's script on loopback.
const server = createServer((request, response) => {
  const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  const places = { '/three/': join(here, 'node_modules/three/'), '/bake/': `${folder}/`, '/check/': `${here}/` };
  const prefix = Object.keys(places).find((prefix) => path.startsWith(prefix));
  try {
    const body = prefix ? readFileSync(join(places[prefix], path.slice(prefix.length))) : HTML;
    const extension = path.split('.').pop();
    response.writeHead(200, { 'content-type': prefix ? (TYPES[extension] ?? 'application/octet-stream') : 'text/html' });
    response.end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));

const percent = (share) => `${(100 * share).toFixed(2)} %`.padStart(9);
const table = (text) => text.trim().split('\n').slice(1).map((line) => line.split(',').map(Number));
let failures = 0;
let browser;
try {
  const args = ['--headless=new', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'];
  browser = await chromium.launch({ executablePath: CHROMIUM, args });
  for (const name of asked.length > 0 ? asked : Object.keys(scenes)) {
    const { file, errors: [ofBake, ofPicture], points, reflectance } = scenes[name];
    const output = join(folder, name);
    luxel('bake', file, '-o', output, '--for', 'three', '--size', '512', '--error', ofBake);
    luxel('render', file, '-o', join(output, 'reference.exr'), '--integrator', 'gather', '--error', ofPicture);
    const expected = points ? table(luxel('probe', file, '--points', points, '--error', '0.5%')) : [];

    const page = await browser.newPage();
    page.on('pageerror', (error) => console.error(error));
    page.on('console', (message) => message.type() === 'error' && console.error(message.text()));
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    const places = expected.map((row) => row.slice(0, 3));
    const result = await page.evaluate(
      async ([name, places]) => (await import('/check/page.js')).measure(name, places),
      [name, places],
    );
    await page.close();

    console.log(`${name} (three.js r${result.revision})`);
    console.log('  object               pixels   mean L      bias    median       rms');
    for (const { object, count, level, bias, channels, median, rms } of result.objects) {
      const agrees = Math.max(Math.abs(bias), median, ...channels.map(Math.abs)) <= LIMIT;
      const counts = count >= LEAST_PIXELS;
      if (counts && !agrees) failures += 1;
      const verdict = counts ? (agrees ? '' : 'DIFFERS') : 'too few pixels to count';
      const cells = [object.padEnd(20), String(count).padStart(6), level.toPrecision(4).padStart(9)];
      console.log(`  ${cells.join(' ')} ${percent(bias)} ${percent(median)} ${percent(rms)}   ${verdict}`);
    }
    expected.forEach((row, index) => {
      const [e, l] = [row.slice(6, 9), result.probed[index]];
      const worst = Math.max(...e.map((value, c) => Math.abs((l[c] * Math.PI) / (reflectance * value) - 1)));
      if (!(worst <= LIMIT)) failures += 1;
      console.log(`  L π / ρ at (${row.slice(0, 3)}) against E of luxel probe: ${percent(worst)}${worst <= LIMIT ? '' : '   DIFFERS'}`);
    });
  }
} finally {
  await browser?.close();
  server.close();
  rmSync(folder, { recursive: true });
}
console.log(failures === 0 ? `all agree within ${100 * LIMIT} %` : `${failures} differ by more than ${100 * LIMIT} %`);
process.exit(failures === 0 ? 0 : 1);
