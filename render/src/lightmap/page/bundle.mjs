// Makes three.bundle.js: what the page uses of three.js, as one script that names it THREE. See README.md.

import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const folder = process.cwd();
const require = createRequire(join(folder, 'package.json'));
const { buildSync } = require('esbuild');
const three = join(folder, 'node_modules/three');
const { version } = JSON.parse(readFileSync(join(three, 'package.json'), 'utf8'));
const licence = readFileSync(join(three, 'LICENSE'), 'utf8').trim();

const core = [
  'BackSide', 'Box3', 'Color', 'DataTexture', 'DoubleSide', 'FrontSide', 'HalfFloatType', 'LinearFilter', 'Matrix3', 'NearestFilter',
  'PerspectiveCamera', 'RGBAFormat', 'RGFormat', 'Raycaster', 'Scene', 'ShaderMaterial', 'Texture', 'UnsignedByteType', 'Vector2',
  'Vector3', 'WebGLRenderer',
];
const contents = `
export { ${core.join(', ')} } from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
`;

buildSync({
  stdin: { contents, resolveDir: folder },
  bundle: true,
  minify: true,
  format: 'iife',
  globalName: 'THREE',
  target: 'es2020',
  // The whole licence stands at the top.
  legalComments: 'none',
  banner: { js: `/*! three.js ${version}: core, OrbitControls, GLTFLoader\n\n${licence}\n*/` },
  outfile: join(dirname(fileURLToPath(import.meta.url)), 'three.bundle.js'),
});
