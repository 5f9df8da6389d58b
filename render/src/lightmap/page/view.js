// The page: the scene with its maps, and all that the reader can do with it.

/* global THREE, MODES, RAMP, SHOWN_DECADES, bytesOf, dress, makePage, sharedUniforms */

const MEANINGS = {
  lit: 'What is seen: albedo × E / π and emission, with the exposure below.',
  lightmap: 'E / π: the light alone, as white surfaces would show it.',
  albedo: 'The share of the light that surfaces send back.',
  normals: 'The way surfaces look: red for x, green for y, blue for z, grey for none.',
  charts: 'A hue for each object, a lightness for each chart, and its texels in turn.',
  validity: 'Which texels have light of their own.',
  error: 'Standard error of each texel relative to its value, with what filtering leaves.',
};
// Why there is nothing to see, should it come to that.
const NO_WEBGL = 'This browser shows no WebGL 2. Turn hardware acceleration on, or open the page in another browser.';

const element = (id) => document.getElementById(id);
const content = JSON.parse(element('content').textContent);
const { manifest } = content;

/** Keys for what the colours of a mode mean. */
function legendOf(mode) {
  const box = element('legend');
  box.hidden = mode !== 'validity' && mode !== 'error';
  box.replaceChildren();
  const add = (parent, className, text = '') => {
    const made = document.createElement('div');
    made.className = className;
    made.textContent = text;
    parent.append(made);
    return made;
  };
  if (mode === 'validity') {
    const kinds = [['#45998f', 'Light was gathered'], ['#ed7329', 'Buried in other geometry'], ['#544d6b', 'No surface']];
    for (const [colour, text] of kinds) {
      const key = add(box, 'key');
      add(key, 'swatch').style.background = colour;
      key.append(text);
    }
  } else if (mode === 'error') {
    add(box, 'scale').style.background = `linear-gradient(to right, ${RAMP.join(', ')})`;
    const ticks = add(box, 'ticks');
    const [low, high] = SHOWN_DECADES;
    for (let decade = low; decade <= high; decade++) add(ticks, 'tick', `${+(100 * 10 ** decade).toPrecision(3)} %`);
  }
}

/** Starting views: the cameras of the file, and one of everything. */
function viewsOf(root, bounds) {
  const views = [];
  root.traverse((object) => {
    if (!object.isPerspectiveCamera) return;
    const position = object.getWorldPosition(new THREE.Vector3());
    const direction = object.getWorldDirection(new THREE.Vector3());
    const hit = new THREE.Raycaster(position, direction).intersectObject(root, true)[0];
    const away = hit?.distance ?? bounds.getCenter(new THREE.Vector3()).distanceTo(position);
    const target = position.clone().addScaledVector(direction, Math.max(away, 1e-6));
    views.push({ name: object.name || `camera ${views.length + 1}`, position, target, fov: object.fov, aspect: object.aspect });
  });
  const middle = bounds.getCenter(new THREE.Vector3());
  const radius = 0.5 * bounds.getSize(new THREE.Vector3()).length() || 1;
  const position = middle.clone().add(new THREE.Vector3(0.9, 0.75, 1.1).normalize().multiplyScalar(2.4 * radius));
  views.push({ name: 'whole scene', position, target: middle, fov: 45, aspect: 1 });
  return views;
}

/** Numbers to three digits, without exponents where they can be read. */
function written(value) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size < 1e-3 || size >= 1e6 ? value.toExponential(2) : String(+value.toPrecision(3));
}

async function start() {
  const canvas = element('view');
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
  } catch {
    element('status').textContent = NO_WEBGL;
    return;
  }
  renderer.setClearColor(0x17181a);
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  const pages = content.pages.map(makePage);
  const { scene: root } = await new THREE.GLTFLoader().parseAsync(bytesOf(content.glb).buffer, '');
  const world = new THREE.Scene();
  world.add(root);
  world.updateMatrixWorld(true);

  const shared = sharedUniforms();
  const meshes = [];
  const lights = [];
  root.traverse((object) => {
    if (object.isLight) lights.push(object);
    if (object.isMesh) meshes.push(object);
  });
  for (const light of lights) light.removeFromParent();
  for (const mesh of meshes) {
    // Nodes of several primitives are groups: what they say holds for their meshes.
    const said = [mesh, mesh.geometry, mesh.parent].map((object) => object?.userData.luxel_lightmap).find(Boolean);
    mesh.userData.page = pages[said?.page];
    dress(mesh, mesh.userData.page, shared);
  }

  const bounds = new THREE.Box3().setFromObject(root);
  const views = viewsOf(root, bounds);
  const radius = 0.5 * bounds.getSize(new THREE.Vector3()).length() || 1;
  const camera = new THREE.PerspectiveCamera(45, 1, radius / 2000, radius * 40);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.minDistance = radius / 500;
  controls.maxDistance = radius * 12;
  let view = views[0];
  let isStale = false;

  function draw() {
    isStale = false;
    renderer.render(world, camera);
  }
  function invalidate() {
    if (!isStale) requestAnimationFrame(draw);
    isStale = true;
  }
  /** Shows at least what the camera of the file shows, however narrow the window is. */
  function resize() {
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    renderer.setSize(width, height, false);
    camera.aspect = width / Math.max(height, 1);
    const half = Math.tan((view.fov * Math.PI) / 360) * Math.max(1, view.aspect / camera.aspect);
    camera.fov = Math.min((Math.atan(half) * 360) / Math.PI, 110);
    camera.updateProjectionMatrix();
    invalidate();
  }
  function goTo(next) {
    view = next;
    camera.position.copy(view.position);
    controls.target.copy(view.target);
    controls.update();
    resize();
  }

  element('camera').replaceChildren(...views.map(({ name }, index) => new Option(name, index)));
  element('camera').addEventListener('change', (event) => goTo(views[event.target.value]));
  element('reset').addEventListener('click', () => goTo(view));
  controls.addEventListener('change', invalidate);
  new ResizeObserver(resize).observe(canvas.parentElement);

  const modes = element('modes').elements;
  function show(mode) {
    for (const input of modes) input.checked = input.value === mode;
    shared.mode.value = MODES.indexOf(mode);
    element('meaning').textContent = MEANINGS[mode];
    element('exposure-row').setAttribute('aria-disabled', mode !== 'lit' && mode !== 'lightmap');
    element('exposure').disabled = mode !== 'lit' && mode !== 'lightmap';
    legendOf(mode);
    invalidate();
  }
  element('modes').addEventListener('change', (event) => show(event.target.value));

  function expose() {
    const stops = Number(element('exposure').value);
    shared.exposure.value = manifest.exposure * 2 ** stops;
    element('stops').textContent = `${stops > 0 ? '+' : ''}${stops.toFixed(1).replace('-', '−')} EV`;
    invalidate();
  }
  element('exposure').addEventListener('input', expose);
  element('exposure').addEventListener('dblclick', () => {
    element('exposure').value = 0;
    expose();
  });
  element('smooth').addEventListener('change', (event) => {
    const filter = event.target.checked ? THREE.LinearFilter : THREE.NearestFilter;
    for (const { light } of pages) {
      light.magFilter = filter;
      light.minFilter = filter;
      light.needsUpdate = true;
    }
    invalidate();
  });
  element('grid').addEventListener('change', (event) => {
    shared.showsGrid.value = event.target.checked;
    invalidate();
  });
  element('backs').addEventListener('change', (event) => {
    for (const mesh of meshes) mesh.material.side = event.target.checked ? THREE.DoubleSide : mesh.userData.side;
    invalidate();
  });

  // Turns, moves and brings nearer what the pointer cannot.
  canvas.addEventListener('keydown', (event) => {
    const away = camera.position.clone().sub(controls.target);
    const side = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const nearer = { '+': 0.9, '=': 0.9, '-': 1 / 0.9 };
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key in arrows) {
      const [x, y] = arrows[event.key];
      if (event.shiftKey) {
        const step = side.multiplyScalar(x).addScaledVector(up, y).multiplyScalar(0.05 * away.length());
        camera.position.add(step);
        controls.target.add(step);
      } else {
        const turned = away.clone().applyAxisAngle(new THREE.Vector3(0, 1, 0), 0.09 * x);
        const tilted = turned.clone().applyAxisAngle(side.applyAxisAngle(new THREE.Vector3(0, 1, 0), 0.09 * x), -0.09 * y);
        // Not over the pole.
        camera.position.copy(controls.target).add(Math.abs(tilted.y) < 0.995 * away.length() ? tilted : turned);
      }
    } else if (event.key in nearer) {
      camera.position.copy(controls.target).addScaledVector(away, nearer[event.key]);
    } else if (event.key === 'Home') {
      goTo(view);
    } else {
      return;
    }
    event.preventDefault();
    controls.update();
    invalidate();
  });
  document.addEventListener('keydown', (event) => {
    const isTyping = event.target.tagName === 'SELECT' || event.ctrlKey || event.altKey || event.metaKey;
    const mode = MODES[Number(event.key) - 1];
    if (mode && !isTyping) show(mode);
  });

  // What the texel under the pointer holds.
  const caster = new THREE.Raycaster();
  let pointer = null;
  function read() {
    const box = element('readout');
    box.hidden = true;
    if (!pointer) return;
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const place = new THREE.Vector2((2 * (pointer.x - left)) / width - 1, 1 - (2 * (pointer.y - top)) / height);
    caster.setFromCamera(place, camera);
    const hit = caster.intersectObjects(meshes, false)[0];
    if (!hit) return;
    const name = document.createElement('b');
    const node = hit.object.parent?.userData.luxel_lightmap ? hit.object.parent : hit.object;
    name.textContent = node.userData.name ?? node.name;
    const page = hit.object.userData.page;
    box.hidden = false;
    if (!page || !hit.uv1) {
      box.replaceChildren(name, '\nno lightmap');
      return;
    }
    const column = Math.min(Math.max(Math.floor(hit.uv1.x * page.width), 0), page.width - 1);
    const row = Math.min(Math.max(Math.floor(hit.uv1.y * page.height), 0), page.height - 1);
    const { value, error, validity } = page.at(column, row);
    const irradiance = value.map(written).join('  ');
    const accuracy = error === null ? '' : ` ± ${written(100 * error)} %`;
    const unit = manifest.units.unit.replace('m2', 'm²');
    const kind = validity > 200 ? '' : validity > 64 ? ', buried' : ', no surface';
    const which = pages.length > 1 ? `page ${pages.indexOf(page)}, ` : '';
    box.replaceChildren(name, `\nE = ${irradiance} ${unit}${accuracy}\n${which}texel (${column}, ${row})${kind}`);
  }
  const track = (event) => {
    // A drag turns the scene: what lies under it does not matter.
    if (event.buttons !== 0 && event.type === 'pointermove') return;
    if (!pointer) requestAnimationFrame(() => { read(); pointer = null; });
    pointer = { x: event.clientX, y: event.clientY };
  };
  canvas.addEventListener('pointermove', track);
  canvas.addEventListener('pointerdown', track);
  canvas.addEventListener('pointerleave', () => { element('readout').hidden = true; });

  await Promise.all(pages.map(({ loaded }) => loaded));
  const wanted = location.hash.slice(1);
  show(MODES.includes(wanted) ? wanted : 'lit');
  expose();
  goTo(view);
  element('status').textContent = '';
  draw();
  document.documentElement.dataset.ready = 'yes';
}

start().catch((error) => {
  element('status').textContent = `The scene cannot be shown: ${error.message}`;
});
