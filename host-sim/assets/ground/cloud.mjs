// The point cloud: one geometry whose places are the station's slots. A change uploads its own slots and no others, and colours
// are computed where they are drawn, so that another colouring uploads nothing.

import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Points, ShaderMaterial, Sphere, Vector3 } from './vendor/three.mjs';

const FIRST_CAPACITY = 1 << 14;
const NEAR_SLOTS = 256; // Runs as near as this go up in one piece.

export const COLOURINGS = ['height', 'age', 'probability', 'gmt', 'uav'];

// From low to high, or from old to new; light enough on dark ground and dark enough on light ground.
const RAMPS = {
  light: ['#2b3a9a', '#0b79b8', '#0f9a6c', '#c98a00', '#c4281c'],
  dark: ['#6a7cff', '#37b6ff', '#3fdc97', '#ffcf45', '#ff7a5c'],
};

/** Colour of a UAV or of a stop of the GMT by its number: neighbours differ. */
export function colourOf(index, dark) {
  const hue = (index * 137.508 + 205) % 360;
  return `hsl(${hue.toFixed(0)}, ${dark ? '80%, 66%' : '72%, 40%'})`;
}

const VERTEX = `
uniform float size, least, now, span, low, high, scale;
uniform int colouring;
uniform vec3 ramp[5];
uniform vec2 hue;
attribute float seen;
attribute vec4 tags;
varying vec3 tint;
vec3 along(float at) {
  float place = clamp(at, 0.0, 1.0) * 4.0;
  int k = int(min(place, 3.0));
  vec3 from = ramp[0], to = ramp[1];
  for (int j = 1; j < 4; j++) if (k == j) { from = ramp[j]; to = ramp[j + 1]; }
  return mix(from, to, place - float(k));
}
vec3 wheel(float index) {
  float h = fract((index * 137.508 + 205.0) / 360.0) * 6.0;
  vec3 full = clamp(vec3(abs(h - 3.0) - 1.0, 2.0 - abs(h - 2.0), 2.0 - abs(h - 4.0)), 0.0, 1.0);
  vec3 shade = vec3(hue.y) + hue.x * (full - 0.5) * (1.0 - abs(2.0 * hue.y - 1.0));
  return shade * shade;
}
void main() {
  vec4 eye = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * eye;
  gl_PointSize = clamp(size * scale / max(-eye.z, 0.01), least * size, 8.0 * size);
  if (colouring == 0) tint = along((position.z - low) / max(high - low, 0.1));
  else if (colouring == 1) tint = along(1.0 - (now - seen) / span);
  else if (colouring == 2) tint = along(tags.x * 2.0 - 1.0);
  else tint = wheel(floor((colouring == 3 ? tags.y : tags.z) * 255.0 + 0.5));
}`;

const FRAGMENT = `
varying vec3 tint;
void main() {
  vec2 off = gl_PointCoord - 0.5;
  if (dot(off, off) > 0.25) discard;
  gl_FragColor = vec4(tint, 1.0);
  #include <colorspace_fragment>
}`;

export class Cloud {
  constructor() {
    this.material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        size: { value: 1 }, least: { value: 4 }, scale: { value: 120 }, now: { value: 0 }, span: { value: 60 }, low: { value: 0 }, high: { value: 10 },
        colouring: { value: 0 }, ramp: { value: [] }, hue: { value: { x: 0.75, y: 0.4 } },
      },
    });
    this.object = new Points(new BufferGeometry(), this.material);
    this.object.frustumCulled = false;
    this.clear();
    this.theme(false);
  }

  /** Forgets every point. */
  clear() {
    this.total = 0;
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    this.room(FIRST_CAPACITY, false);
  }

  /** Makes room for at least `capacity` points. */
  room(capacity, keep = true) {
    const attribute = (kind, size, normalized) => {
      const made = new BufferAttribute(new kind(size * capacity), size, normalized);
      made.setUsage(DynamicDrawUsage);
      // The first upload takes the whole: what came before it needs no second one.
      made.onUpload(() => made.clearUpdateRanges());
      return made;
    };
    const old = this.object.geometry;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', attribute(Float32Array, 3, false));
    geometry.setAttribute('seen', attribute(Float32Array, 1, false));
    geometry.setAttribute('tags', attribute(Uint8Array, 4, true));
    if (keep) for (const name of ['position', 'seen', 'tags']) geometry.attributes[name].array.set(old.attributes[name].array);
    geometry.boundingSphere = new Sphere(new Vector3(), Infinity);
    old.dispose();
    this.object.geometry = geometry;
    this.capacity = capacity;
    geometry.setDrawRange(0, this.total);
  }

  /** Takes in a message of points. */
  take({ total, runs, floats, bytes }) {
    const last = runs.reduce((most, run) => Math.max(most, run.first + run.count), 0);
    // By powers of two, whatever came at once: a room that just fits would be too small, and all be uploaded again, with the next point.
    if (last > this.capacity) this.room(2 ** Math.ceil(Math.log2(last)));
    const { position, seen, tags } = this.object.geometry.attributes;
    let piece = null;
    const upload = () => {
      if (!piece) return;
      for (const attribute of [position, seen, tags]) {
        attribute.addUpdateRange(attribute.itemSize * piece[0], attribute.itemSize * (piece[1] - piece[0]));
      }
    };
    for (const { first, count, at } of runs) {
      for (let k = 0, from = at, slot = first; k < count; k += 1, from += 5, slot += 1) {
        for (let axis = 0; axis < 3; axis += 1) {
          const value = floats[from + axis];
          position.array[3 * slot + axis] = value;
          if (value < this.low[axis]) this.low[axis] = value;
          if (value > this.high[axis]) this.high[axis] = value;
        }
        seen.array[slot] = floats[from + 3];
        for (let tag = 0; tag < 4; tag += 1) tags.array[4 * slot + tag] = bytes[4 * (from + 4) + tag];
      }
      if (piece && first - piece[1] <= NEAR_SLOTS) piece[1] = Math.max(piece[1], first + count);
      else { upload(); piece = [first, first + count]; }
    }
    upload();
    // Without a range the whole would be uploaded.
    if (runs.length) for (const attribute of [position, seen, tags]) attribute.needsUpdate = true;
    if (total < this.total) this.bound(position.array, total);
    this.total = total;
    this.object.geometry.setDrawRange(0, this.total);
    // Few points are drawn large enough to be seen, many small enough to be told apart.
    this.material.uniforms.least.value = Math.min(4.5, Math.max(1.5, 6 - Math.log10(this.total + 1)));
    [this.material.uniforms.low.value, this.material.uniforms.high.value] = [this.low[2], this.high[2]];
  }

  /** Finds the bounds of the first `total` points anew: some have left. */
  bound(places, total) {
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    for (let at = 0; at < 3 * total; at += 1) {
      const axis = at % 3;
      if (places[at] < this.low[axis]) this.low[axis] = places[at];
      if (places[at] > this.high[axis]) this.high[axis] = places[at];
    }
  }

  colouring(name) { this.material.uniforms.colouring.value = COLOURINGS.indexOf(name); }

  theme(dark) {
    this.material.uniforms.ramp.value = RAMPS[dark ? 'dark' : 'light'].map((c) => new Color(c));
    this.material.uniforms.hue.value = dark ? { x: 0.8, y: 0.66 } : { x: 0.72, y: 0.4 };
  }

  /** Ends and colours of the scale, for the legend. */
  scale(dark) {
    const gradient = `linear-gradient(90deg, ${RAMPS[dark ? 'dark' : 'light'].join(', ')})`;
    const { colouring, span, low, high } = this.material.uniforms;
    const metres = (value) => (Number.isFinite(value) ? `${value.toFixed(1).replace(/^-0\.0$/, '0.0')} m` : '');
    const name = COLOURINGS[colouring.value];
    if (name === 'height') return [metres(low.value), gradient, metres(high.value)];
    if (name === 'age') return [`${span.value} s old`, gradient, 'now'];
    if (name === 'probability') return ['0.5', gradient, '1'];
    const stops = [0, 1, 2, 3, 4, 5].map((k) => `${colourOf(k, dark)} ${16.7 * k}% ${16.7 * (k + 1)}%`);
    return [name === 'gmt' ? 'stop 0' : 'UAV 0', `linear-gradient(90deg, ${stops.join(', ')})`, '5 ...'];
  }
}
