/* A polyline for three.js: each segment is a rectangle of some pixels width, coloured by a value at its ends.
   Segments come in chunks, so that those outside of the view cost nothing. */

import {
  Box3, BufferAttribute, DataTexture, Group, InstancedBufferGeometry, InstancedInterleavedBuffer,
  InterleavedBufferAttribute, LinearFilter, Mesh, NearestFilter, ShaderMaterial, Sphere, Vector2, Vector3,
} from "three";

const SEGMENTS = 8192; // of a chunk
const COLOURS = 256;
const CORNERS = new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]); // along the segment, and across it

const VERTEX = `
attribute vec3 from, to;
attribute float valueFrom, valueTo, timeTo;
uniform vec2 resolution;
uniform float width, isKind;
varying float value, time, light;
void main() {
  vec4 a = projectionMatrix * modelViewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to, 1.0);
  vec2 way = (b.xy - a.xy) * resolution;
  float length_ = length(way);
  vec2 along = length_ > 0.0 ? way / length_ : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  bool isNone = valueTo < -0.5;
  vec4 place = mix(a, b, position.x);
  // Half a width beyond both ends: no gaps at corners.
  place.xy += (across * position.y + along * (2.0 * position.x - 1.0)) * (isNone ? 0.5 : 1.0) * width / resolution;
  place.z += isNone ? 1e-4 : 0.0;
  value = isNone || isKind > 0.5 ? valueTo : mix(max(valueFrom, 0.0), valueTo, position.x);
  time = timeTo;
  // Light from above: what leans is a little darker, so that surfaces of many passes show their form.
  vec3 run = to - from;
  float rise = dot(run, run) > 0.0 ? run.z / length(run) : 0.0;
  light = 1.0 - 0.3 * rise * rise;
  gl_Position = place;
}`;

const FRAGMENT = `
uniform sampler2D colours;
uniform vec3 none, later;
uniform float count, now;
varying float value, time, light;
void main() {
  vec3 colour = value < -0.5 ? none : texture2D(colours, vec2(count > 0.5 ? (value + 0.5) / count : value, 0.5)).rgb * light;
  gl_FragColor = vec4(time > now ? mix(colour, later, 0.82) : colour, 1.0);
}`;

export class Ribbon {
  group = new Group();
  #levels = [];
  #material = new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      resolution: { value: new Vector2(1, 1) },
      width: { value: 2 },
      colours: { value: null },
      none: { value: new Vector3() },
      later: { value: new Vector3() },
      count: { value: 0 },
      isKind: { value: 0 },
      now: { value: Infinity },
    },
  });

  /* `levels` are those of `detail.js`; places are counted from `centre`. */
  constructor(path, levels, centre) {
    const corners = new BufferAttribute(CORNERS, 3);
    const order = new BufferAttribute(new Uint16Array([0, 1, 2, 0, 2, 3]), 1);
    for (const { tolerance, index } of levels) {
      const level = { tolerance, index, group: new Group(), values: new Float32Array(index.length) };
      const places = new Float32Array(3 * index.length), times = new Float32Array(index.length);
      index.forEach((point, i) => {
        places[3 * i] = path.x[point] - centre[0];
        places[3 * i + 1] = path.y[point] - centre[1];
        places[3 * i + 2] = path.z[point] - centre[2];
        times[i] = path.time[point];
      });
      const shared = [new InstancedInterleavedBuffer(places, 3), new InstancedInterleavedBuffer(level.values, 1), new InstancedInterleavedBuffer(times, 1)];
      level.buffer = shared[1];
      for (let first = 0; first + 1 < index.length; first += SEGMENTS) {
        const count = Math.min(SEGMENTS, index.length - 1 - first);
        level.group.add(this.#chunk(corners, order, shared, places, first, count));
      }
      level.group.visible = false;
      this.group.add(level.group);
      this.#levels.push(level);
    }
  }

  #chunk(corners, order, [places, values, times], list, first, count) {
    const geometry = new InstancedBufferGeometry();
    const view = (buffer, size, offset) => new InterleavedBufferAttribute(buffer, size, offset);
    geometry.setIndex(order);
    geometry.setAttribute("position", corners);
    geometry.setAttribute("from", view(places, 3, 3 * first));
    geometry.setAttribute("to", view(places, 3, 3 * first + 3));
    geometry.setAttribute("valueFrom", view(values, 1, first));
    geometry.setAttribute("valueTo", view(values, 1, first + 1));
    geometry.setAttribute("timeTo", view(times, 1, first + 1));
    geometry.instanceCount = count;
    const box = new Box3(), place = new Vector3();
    for (let i = first; i <= first + count; i += 1) box.expandByPoint(place.fromArray(list, 3 * i));
    geometry.boundingSphere = box.getBoundingSphere(new Sphere());
    return new Mesh(geometry, this.#material);
  }

  /* Colours by a mode of `modes.js`; `colours` are red, green, blue for each step of its scale or kind. */
  colour({ values }, colours, isKind) {
    for (const level of this.#levels) {
      level.index.forEach((point, i) => (level.values[i] = values[point]));
      level.buffer.needsUpdate = true;
    }
    const { uniforms } = this.#material;
    uniforms.colours.value?.dispose();
    const texture = new DataTexture(Uint8Array.from(colours.flatMap((colour) => [...colour, 255])), colours.length, 1);
    texture.magFilter = texture.minFilter = isKind ? NearestFilter : LinearFilter;
    texture.needsUpdate = true;
    uniforms.colours.value = texture;
    uniforms.isKind.value = isKind ? 1 : 0;
    uniforms.count.value = isKind ? colours.length : 0;
  }

  /* The colours [0, 1] of what has no value, and of what fades after the time `now`. */
  shade(none, later) {
    this.#material.uniforms.none.value.fromArray(none);
    this.#material.uniforms.later.value.fromArray(later);
  }

  set now(time) {
    this.#material.uniforms.now.value = time ?? Infinity;
  }

  /* Shows the coarsest level within a tolerance [mm], on a canvas of this size, and answers with it. */
  show(tolerance, width, height, pixels) {
    const level = this.#levels.findLast((one) => one.tolerance <= tolerance) ?? this.#levels[0];
    for (const one of this.#levels) one.group.visible = one === level;
    this.#material.uniforms.resolution.value.set(width, height);
    this.#material.uniforms.width.value = pixels;
    return level;
  }

  dispose() {
    for (const { group } of this.#levels) for (const mesh of group.children) mesh.geometry.dispose();
    this.#material.uniforms.colours.value?.dispose();
    this.#material.dispose();
  }
}

export { COLOURS };
