// What surfaces of a baked scene look like in each mode, and the maps that they are coloured by.
//
// Pages come as rows from the first, which is how glTF counts v: no texture is flipped. `light` is half floats, three to a texel,
// in units of `scale`; `info` is two bytes a texel: the error as `errorOf` reads it, and the sample of validity.

/* global THREE */

const MODES = ['lit', 'lightmap', 'albedo', 'normals', 'charts', 'validity', 'error'];

// Ends of the scale of relative errors, as powers of ten; agrees with `page/encode.rs`.
const ERROR_DECADES = [-4, 0];
// What the picture of errors shows of it.
const SHOWN_DECADES = [-3, 0];

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** A half float as a number. */
function halfToNumber(half) {
  const exponent = (half >> 10) & 31;
  const fraction = half & 1023;
  const size = exponent === 0 ? fraction * 2 ** -24 : (1024 + fraction) * 2 ** (exponent - 25);
  return half & 0x8000 ? -size : size;
}

/** The relative standard error that a byte stands for; null where there is none. */
function errorOf(byte) {
  const [low, high] = ERROR_DECADES;
  return byte === 0 ? null : 10 ** (low + ((byte - 1) / 254) * (high - low));
}

/** The maps of a page as textures, and what a texel holds. */
function makePage({ width, height, scale, light, info, charts }) {
  const bytes = bytesOf(light);
  const halves = new Uint16Array(bytes.buffer);
  const texels = new Uint16Array(4 * width * height);
  for (let texel = 0; texel < width * height; texel++) {
    for (let c = 0; c < 3; c++) texels[4 * texel + c] = halves[3 * texel + c];
    texels[4 * texel + 3] = 0x3c00; // one
  }
  const about = bytesOf(info);
  const page = { width, height, scale };
  page.light = new THREE.DataTexture(texels, width, height, THREE.RGBAFormat, THREE.HalfFloatType);
  page.info = new THREE.DataTexture(about, width, height, THREE.RGFormat, THREE.UnsignedByteType);
  page.info.unpackAlignment = 1;
  page.charts = new THREE.Texture();
  page.charts.generateMipmaps = false;
  page.charts.flipY = false;
  for (const texture of [page.info, page.charts]) {
    texture.minFilter = THREE.NearestFilter;
    texture.magFilter = THREE.NearestFilter;
  }
  page.light.minFilter = THREE.LinearFilter;
  page.light.magFilter = THREE.LinearFilter;
  page.light.needsUpdate = true;
  page.info.needsUpdate = true;
  page.loaded = new Promise((resolve) => {
    const image = new Image();
    image.onload = () => {
      page.charts.image = image;
      page.charts.needsUpdate = true;
      resolve();
    };
    image.onerror = resolve; // charts stay black, the rest can be seen
    image.src = `data:image/png;base64,${charts}`;
  });
  page.at = (column, row) => {
    const texel = row * width + column;
    return {
      value: [0, 1, 2].map((c) => halfToNumber(halves[3 * texel + c]) * scale),
      error: errorOf(about[2 * texel]),
      validity: about[2 * texel + 1],
    };
  };
  return page;
}

// `centroid`: beside an edge the middle of a pixel lies beyond the surface, in what may be another chart.
const VERTEX = `
attribute vec2 lightUv;
attribute vec2 mapUv;
attribute vec2 emissiveUv;
uniform mat3 mapTransform;
uniform mat3 emissiveTransform;
centroid varying vec2 vLightUv;
varying vec2 vMapUv;
varying vec2 vEmissiveUv;
varying vec3 vNormal;
varying vec3 vPlace;
void main() {
  vLightUv = lightUv;
  vMapUv = (mapTransform * vec3(mapUv, 1.0)).xy;
  vEmissiveUv = (emissiveTransform * vec3(emissiveUv, 1.0)).xy;
  mat4 world = modelMatrix;
  #ifdef USE_INSTANCING
    world = world * instanceMatrix;
  #endif
  // The inverse of the transpose, but for its length: instances may be scaled unevenly and mirrored.
  mat3 m = mat3(world);
  mat3 cofactors = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
  vNormal = cofactors * normal * sign(dot(m[0], cofactors[0]));
  vec4 place = world * vec4(position, 1.0);
  vPlace = place.xyz;
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const FRAGMENT = `
uniform int mode;
uniform float exposure;
uniform float toRadiance;
uniform vec2 size;
uniform bool hasLight;
uniform bool hasNormals;
uniform bool showsGrid;
uniform sampler2D light;
uniform sampler2D info;
uniform sampler2D charts;
uniform vec3 colour;
uniform bool hasMap;
uniform sampler2D map;
uniform vec3 emissive;
uniform bool hasEmissiveMap;
uniform sampler2D emissiveMap;
uniform float opacity;
uniform float alphaTest;
uniform vec2 errorRange;
uniform vec3 ramp[5];
centroid varying vec2 vLightUv;
varying vec2 vMapUv;
varying vec2 vEmissiveUv;
varying vec3 vNormal;
varying vec3 vPlace;

vec3 encoded(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

vec3 falseColour(float level) {
  float place = clamp(level, 0.0, 1.0) * 4.0;
  int below = int(min(floor(place), 3.0));
  return mix(ramp[below], ramp[below + 1], place - float(below));
}

// Stripes on the screen: there is nothing to show.
vec3 hatched() {
  return vec3(mod(floor((gl_FragCoord.x + gl_FragCoord.y) / 5.0), 2.0) < 0.5 ? 0.17 : 0.21);
}

// Light and dark texels in turn; grey where they are too small to be told apart.
float checker() {
  vec2 texel = vLightUv * size;
  vec2 cell = floor(texel);
  float fine = max(length(dFdx(texel)), length(dFdy(texel)));
  float sides = mod(cell.x + cell.y, 2.0) < 0.5 ? 1.0 : -1.0;
  return sides * (1.0 - smoothstep(0.35, 0.8, fine));
}

void main() {
  vec4 base = vec4(colour, opacity);
  if (hasMap) base *= texture2D(map, vMapUv);
  if (base.a < alphaTest) discard;
  vec3 flat_ = normalize(cross(dFdx(vPlace), dFdy(vPlace)));
  vec3 normal = hasNormals ? normalize(vNormal) : flat_;
  if (!gl_FrontFacing && hasNormals) normal = -normal;
  vec3 radiance = hasLight ? texture2D(light, vLightUv).rgb * toRadiance : vec3(0.0);
  vec2 about = texture2D(info, vLightUv).rg * 255.0;
  // Planes of one colour are told apart by how they are turned.
  float shade = 0.72 + 0.28 * abs(dot(normal, normalize(cameraPosition - vPlace)));
  vec3 shown;
  if (mode == 0) {
    vec3 own = emissive;
    if (hasEmissiveMap) own *= texture2D(emissiveMap, vEmissiveUv).rgb;
    shown = encoded((base.rgb * radiance + own) * exposure);
  } else if (mode == 2) {
    shown = encoded(base.rgb);
  } else if (mode == 3) {
    shown = 0.5 + 0.5 * normal;
  } else if (!hasLight) {
    shown = hatched();
  } else if (mode == 1) {
    shown = encoded(radiance * exposure);
  } else if (mode == 4) {
    shown = texture2D(charts, vLightUv).rgb * shade * (0.9 + 0.1 * checker());
  } else if (mode == 5) {
    shown = about.g > 200.0 ? vec3(0.27, 0.60, 0.56) : about.g > 64.0 ? vec3(0.93, 0.45, 0.16) : vec3(0.33, 0.30, 0.42);
    shown *= shade;
  } else {
    shown = about.r < 0.5 ? hatched() : falseColour(((about.r - 1.0) / 254.0 - errorRange.x) / (errorRange.y - errorRange.x));
  }
  if (showsGrid && hasLight && mode != 4) shown *= 0.92 + 0.08 * checker();
  gl_FragColor = vec4(shown, mode == 0 || mode == 2 ? base.a : 1.0);
}`;

/** Five colours from little to much, of which the legend is drawn too. */
const RAMP = ['#2b1055', '#3b528b', '#21918c', '#8fd05a', '#fdec6b'];

/** Uniforms that all surfaces share. */
function sharedUniforms() {
  const [low, high] = ERROR_DECADES;
  const range = SHOWN_DECADES.map((decade) => (decade - low) / (high - low));
  const channels = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);
  return {
    mode: { value: 0 },
    exposure: { value: 1 },
    showsGrid: { value: false },
    errorRange: { value: new THREE.Vector2(...range) },
    ramp: { value: RAMP.map((colour) => new THREE.Vector3(...channels(colour))) },
  };
}

/** Gives a mesh of the scene a material of the page's own, made of what the file says of it. */
function dress(mesh, page, shared) {
  const was = mesh.material;
  const { attributes } = mesh.geometry;
  const setOf = (texture) => attributes[texture.channel === 0 ? 'uv' : `uv${texture.channel}`];
  const uniforms = {
    ...shared,
    hasLight: { value: Boolean(page && attributes.uv1) },
    hasNormals: { value: Boolean(attributes.normal) },
    // A white surface sends out E / π.
    toRadiance: { value: page ? page.scale / Math.PI : 0 },
    size: { value: new THREE.Vector2(page?.width ?? 1, page?.height ?? 1) },
    light: { value: page?.light ?? null },
    info: { value: page?.info ?? null },
    charts: { value: page?.charts ?? null },
    colour: { value: was.color ?? new THREE.Color(1, 1, 1) },
    emissive: { value: (was.emissive ?? new THREE.Color(0, 0, 0)).clone().multiplyScalar(was.emissiveIntensity ?? 1) },
    opacity: { value: was.transparent ? was.opacity : 1 },
    alphaTest: { value: was.alphaTest ?? 0 },
  };
  if (attributes.uv1) mesh.geometry.setAttribute('lightUv', attributes.uv1);
  for (const name of ['map', 'emissiveMap']) {
    const texture = was[name] ?? null;
    const stem = name === 'map' ? 'map' : 'emissive';
    const isUsable = Boolean(texture && setOf(texture));
    if (isUsable) {
      texture.updateMatrix();
      mesh.geometry.setAttribute(`${stem}Uv`, setOf(texture));
    }
    uniforms[name] = { value: texture };
    uniforms[name === 'map' ? 'hasMap' : 'hasEmissiveMap'] = { value: isUsable };
    uniforms[`${stem}Transform`] = { value: texture?.matrix ?? new THREE.Matrix3() };
  }
  mesh.material = new THREE.ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms,
    side: was.side,
    transparent: was.transparent,
    depthWrite: was.depthWrite,
  });
  mesh.userData.side = was.side;
}
