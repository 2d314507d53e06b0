/* A polyline for three.js: each segment is a rectangle of a few pixels' width, coloured by the values at its ends.
   It draws levels of `detail.js`; a level gets its textures when it is first shown.
   
   The vertex shader finds the corners of a rectangle from the number of the vertex and the points in a texture.
   Instances of one rectangle would be slower: without a graphics processor each costs as much as a draw call. */

import { BufferGeometry, DataTexture, FloatType, Group, LinearFilter, Mesh, NearestFilter, RedFormat, RGBAFormat, ShaderMaterial, Vector2, Vector3 } from "three";

const COLOURS = 256;
const WIDTH = 256; // width of the textures that hold the points

const VERTEX = `
uniform highp sampler2D points, values;
uniform vec2 resolution;
uniform float width, isKind;
varying float value, time, light;
ivec2 at(int point) { return ivec2(point % ${WIDTH}, point / ${WIDTH}); }
void main() {
  // Two triangles: coordinate 0 or 1 along the segment, -1 or 1 across it.
  int segment = gl_VertexID / 6, corner = gl_VertexID % 6;
  float part = corner == 1 || corner == 2 || corner == 4 ? 1.0 : 0.0;
  float side = corner == 2 || corner == 4 || corner == 5 ? 1.0 : -1.0;
  vec4 from = texelFetch(points, at(segment), 0), to = texelFetch(points, at(segment + 1), 0);
  float valueFrom = texelFetch(values, at(segment), 0).r, valueTo = texelFetch(values, at(segment + 1), 0).r;
  vec4 a = projectionMatrix * modelViewMatrix * vec4(from.xyz, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to.xyz, 1.0);
  vec2 screen = (b.xy - a.xy) * resolution;
  float length_ = length(screen);
  vec2 along = length_ > 0.0 ? screen / length_ : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  bool isNone = valueTo < -0.5;
  vec4 vertex = mix(a, b, part);
  // Half a width longer at both ends, so that corners have no gaps.
  vertex.xy += (across * side + along * (2.0 * part - 1.0)) * (isNone ? 0.5 : 1.0) * width / resolution;
  vertex.z += isNone ? 1e-4 : 0.0;
  value = isNone || isKind > 0.5 ? valueTo : mix(max(valueFrom, 0.0), valueTo, part);
  time = to.w;
  // Light from above: sloping segments are darker, which shows the form of surfaces of many passes.
  vec3 run = to.xyz - from.xyz;
  float rise = dot(run, run) > 0.0 ? run.z / length(run) : 0.0;
  light = 1.0 - 0.3 * rise * rise;
  gl_Position = vertex;
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
  #path;
  #centre;
  #meshes = new Map(); // level → mesh
  #values = null;
  #uniforms = {
    resolution: { value: new Vector2(1, 1) },
    width: { value: 2 },
    colours: { value: null },
    none: { value: new Vector3() },
    later: { value: new Vector3() },
    count: { value: 0 },
    isKind: { value: 0 },
    now: { value: Infinity },
  };

  /* Coordinates in the textures are relative to `centre`. */
  constructor(path, centre) {
    this.#path = path;
    this.#centre = centre;
  }

  #mesh({ index }) {
    const { x, y, z, time } = this.#path, [cx, cy, cz] = this.#centre;
    const height = Math.ceil(index.length / WIDTH);
    const coordinates = new Float32Array(4 * WIDTH * height);
    for (let i = 0; i < index.length; i += 1) {
      const point = index[i];
      coordinates[4 * i] = x[point] - cx;
      coordinates[4 * i + 1] = y[point] - cy;
      coordinates[4 * i + 2] = z[point] - cz;
      coordinates[4 * i + 3] = time[point];
    }
    const points = new DataTexture(coordinates, WIDTH, height, RGBAFormat, FloatType);
    const values = new DataTexture(new Float32Array(WIDTH * height), WIDTH, height, RedFormat, FloatType);
    points.needsUpdate = true;
    const geometry = new BufferGeometry();
    geometry.setDrawRange(0, 6 * (index.length - 1));
    const uniforms = { ...this.#uniforms, points: { value: points }, values: { value: values } };
    const mesh = new Mesh(geometry, new ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms }));
    mesh.frustumCulled = false; // `show` gets only levels that are in view
    mesh.userData = { index, points, values, painted: null };
    this.group.add(mesh);
    return mesh;
  }

  #paint(mesh) {
    const { index, values, painted } = mesh.userData, own = values.image.data, all = this.#values;
    if (painted === all) return;
    for (let i = 0; i < index.length; i += 1) own[i] = all[index[i]];
    values.needsUpdate = true;
    mesh.userData.painted = all;
  }

  /* Colours the path by a mode of `modes.js`; `colours` are red, green, blue for each step of the scale or each kind. */
  colour({ values }, colours, isKind) {
    this.#values = values;
    const uniforms = this.#uniforms;
    uniforms.colours.value?.dispose();
    const texture = new DataTexture(Uint8Array.from(colours.flatMap((colour) => [...colour, 255])), colours.length, 1);
    texture.magFilter = texture.minFilter = isKind ? NearestFilter : LinearFilter;
    texture.needsUpdate = true;
    uniforms.colours.value = texture;
    uniforms.isKind.value = isKind ? 1 : 0;
    uniforms.count.value = isKind ? colours.length : 0;
  }

  /* Sets the colours [0, 1] of points without a value, and of points after the time `now`. */
  shade(none, later) {
    this.#uniforms.none.value.fromArray(none);
    this.#uniforms.later.value.fromArray(later);
  }

  set now(time) {
    this.#uniforms.now.value = time ?? Infinity;
  }

  /* Shows these levels on a canvas of this size, with lines `pixels` wide. */
  show(levels, width, height, pixels) {
    for (const mesh of this.#meshes.values()) mesh.visible = false;
    for (const level of levels) {
      if (!this.#meshes.has(level)) this.#meshes.set(level, this.#mesh(level));
      const mesh = this.#meshes.get(level);
      mesh.visible = true;
      this.#paint(mesh);
    }
    this.#uniforms.resolution.value.set(width, height);
    this.#uniforms.width.value = pixels;
  }

  dispose() {
    for (const { geometry, material, userData } of this.#meshes.values()) {
      for (const one of [geometry, material, userData.points, userData.values]) one.dispose();
    }
    this.#uniforms.colours.value?.dispose();
  }
}

export { COLOURS };
