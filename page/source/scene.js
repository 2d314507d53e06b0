/* The tool path of a run in 3D with a box around it and marks; the user can turn, move and zoom it. */

import { OrthographicCamera, Scene, Vector3, WebGLRenderer, MOUSE, TOUCH } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { css, mixed } from "./colours.js";
import { chunks } from "./detail.js";
import { drawFlat } from "./flat.js";
import { drawFrame } from "./frame.js";
import { extent } from "./numbers.js";
import { COLOURS, Ribbon } from "./ribbon.js";
import { channels, onTheme, style } from "./theme.js";

/* For each view the direction from the middle of the path to the viewer. */
export const VIEWS = { xyz: [-1.1, -1.5, 1.1], xy: [0, -1e-6, 1], xz: [0, -1, 0], yz: [1, 0, 0] };
/* Greatest error of the drawn levels in pixels, at rest and while the view moves. */
const AT_REST = 0.25, MOVING = 1;
const REST = 160; // time without motion after which the view is at rest [ms]; longer if drawing is slow
/* A moving view is drawn coarser while drawing takes longer than SLOW, and finer if it takes less than QUICK [ms];
   its error is at most MOST times as large. */
const SLOW = 50, QUICK = 25, MOST = 16;
const SLICE = 20; // longest work between two reactions to the user [ms]
const ROOM = [78, 45]; // free pixels on both sides of the path, and above and below it
const NARROW = 560; // width in pixels below which names of axes are shorter
const NEAR = 14; // greatest distance in pixels between the pointer and its point

export class PathScene {
  #renderer = null;
  #scene = new Scene();
  #camera = new OrthographicCamera();
  #run = null;
  shown = []; // the levels that are drawn
  #ribbon = null;
  #mode = null;
  #frame = 0;
  #isStale = true; // whether the picture below the marks must be drawn again
  #movedAt = -Infinity;
  #coarse = 1;
  #isBusy = false; // whether a picture is not finished
  #chunks = [];
  #cutting = 0;
  #resting = 0;
  #size = [0, 0];
  #time = null;
  #hasTrail = false;

  /* `onHover(i, event)` gets the number of the point under the pointer, or -1; `onMove(scene)` follows each motion. */
  constructor(container, { onHover, onMove } = {}) {
    this.container = container;
    container.classList.add("scene");
    this.canvas = container.appendChild(document.createElement("canvas"));
    this.over = container.appendChild(document.createElement("canvas"));
    this.over.tabIndex = 0;
    this.over.setAttribute("role", "img");
    this.over.setAttribute("aria-label", "Tool path");
    try {
      this.#renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.#renderer.setClearColor(0, 0);
    } catch {
      this.#renderer = null; // there is no WebGL: `flat.js` draws
    }
    this.#camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.#camera, this.over);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => {
      this.#moved();
      onMove?.(this);
    });
    this.over.addEventListener("dblclick", () => this.look(this.view));
    this.over.addEventListener("pointermove", (event) => event.buttons === 0 && onHover?.(this.#under(event), event));
    this.over.addEventListener("pointerleave", (event) => onHover?.(-1, event));
    this.over.addEventListener("click", (event) => onHover?.(this.#under(event), event));
    new ResizeObserver(() => this.resize()).observe(container);
    onTheme(() => {
      this.resize();
      this.paint();
    });
    this.look("xyz");
  }

  /* Shows a run, coloured by a mode of `modes.js`. */
  show(run, mode) {
    this.#ribbon && this.#scene.remove(this.#ribbon.group);
    this.#ribbon?.dispose();
    const isOther = this.#run !== run;
    this.#run = run;
    const { path } = run;
    const ends = [path.x, path.y, path.z].map(extent);
    this.low = ends.map(([low]) => low);
    this.high = ends.map(([, high]) => high);
    this.#ribbon = null;
    this.#chunks = [];
    this.container.setAttribute("aria-busy", "true");
    if (this.#renderer) {
      this.#ribbon = new Ribbon(path, this.#centre());
      this.#scene.add(this.#ribbon.group);
    }
    clearTimeout(this.#cutting);
    this.#cut(chunks(path));
    this.colour(mode);
    if (isOther) this.look(this.#firstView());
  }

  /* Makes chunks for SLICE ms at a time, so that the page reacts in between, and draws those that are ready. */
  #cut(rest) {
    const end = performance.now() + SLICE;
    let next = rest.next();
    for (; !next.done && performance.now() < end; next = rest.next()) this.#chunks.push(next.value);
    if (next.done) this.container.removeAttribute("aria-busy");
    else {
      this.#chunks.push(next.value);
      this.#cutting = setTimeout(() => this.#cut(rest));
    }
    this.draw();
  }

  /* Sets the colour mode. */
  colour(mode) {
    this.#mode = mode;
    this.paint();
  }

  paint() {
    if (!this.#run) return;
    const { scale, colours: own } = this.#mode;
    this.colours = own ?? Array.from({ length: COLOURS }, (_, i) => mixed(scale, i / (COLOURS - 1)));
    this.#ribbon?.colour(this.#mode, this.colours, Boolean(own));
    const bright = (name) => channels(style(name)).map((value) => value / 255);
    this.#ribbon?.shade(bright("--rapid"), bright("--card"));
    this.drawNow();
  }

  /* Sets the view of that name and shows the whole path in it. */
  look(view) {
    this.view = view;
    const isFlat = view !== "xyz";
    this.controls.enableRotate = !isFlat;
    this.controls.mouseButtons = { LEFT: isFlat ? MOUSE.PAN : MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.touches = { ONE: isFlat ? TOUCH.PAN : TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    this.#camera.position.set(...VIEWS[view]).normalize().multiplyScalar(this.#far());
    this.controls.target.set(0, 0, 0);
    this.#camera.zoom = 1;
    this.controls.update();
    this.resize();
  }

  /* Sets the view of another scene. */
  lookLike(other) {
    if (this.view !== other.view) this.look(other.view);
    this.#camera.position.copy(other.#camera.position).normalize().multiplyScalar(this.#far());
    this.#camera.zoom = other.#camera.zoom;
    this.controls.target.copy(other.controls.target);
    this.#camera.position.add(this.controls.target);
    this.#camera.lookAt(this.controls.target);
    this.#camera.updateProjectionMatrix();
    this.#moved();
  }

  /* Marks the tool's position at a time [s]; with a trail, the path after it is faded. */
  mark(time, hasTrail = false) {
    const isNew = hasTrail || this.#hasTrail;
    this.#time = time;
    this.#hasTrail = hasTrail;
    if (isNew) this.#moved();
    else this.#drawSoon();
  }

  zoomBy(factor) {
    this.#camera.zoom *= factor;
    this.#camera.updateProjectionMatrix();
    this.#moved();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (!width || !height) return;
    this.#size = [width, height];
    const ratio = devicePixelRatio || 1;
    for (const canvas of [this.canvas, this.over]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    this.#renderer?.setSize(this.canvas.width, this.canvas.height, false);
    this.#fit(width, height);
    this.drawNow();
  }

  /* Sets the camera so that the whole path is in view at zoom 1. */
  #fit(width, height) {
    const camera = this.#camera;
    camera.updateMatrixWorld();
    const far = this.#far();
    let across = 1e-9, up = 1e-9;
    const corner = new Vector3();
    for (let n = 0; n < 8; n += 1) {
      [0, 1, 2].forEach((k) => corner.setComponent(k, (((n >> k) & 1) - 0.5) * ((this.high?.[k] ?? 1) - (this.low?.[k] ?? 0))));
      corner.applyQuaternion(camera.quaternion.clone().invert());
      across = Math.max(across, Math.abs(corner.x));
      up = Math.max(up, Math.abs(corner.y));
    }
    const beside = width < NARROW ? ROOM[0] / 2 : ROOM[0];
    const half = Math.max(across / Math.max(width / 2 - beside, 20), up / Math.max(height / 2 - ROOM[1], 20)) / 2; // half the width of a pixel [mm]
    Object.assign(camera, { left: -half * width, right: half * width, top: half * height, bottom: -half * height, near: 0.01 * far, far: 4 * far });
    camera.updateProjectionMatrix();
  }

  draw() {
    this.#isStale = true;
    this.#drawSoon();
  }

  /* Called when the view or its content moves: draws now, and again with less error when the view rests. */
  #moved() {
    this.#movedAt = performance.now();
    this.draw();
    clearTimeout(this.#resting);
    this.#resting = setTimeout(() => this.draw(), REST * this.#coarse);
  }

  #drawSoon() {
    if (!this.#frame && !this.#isBusy) this.#frame = requestAnimationFrame(() => this.#drawStale());
  }

  drawNow() {
    this.#isStale = true;
    this.#drawStale();
  }

  #drawStale() {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const context = this.over.getContext("2d");
    const ratio = devicePixelRatio || 1;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.over.width, this.over.height);
    if (!this.#run) return this.#renderer?.clear();
    this.#camera.updateMatrixWorld();
    const project = this.#projector();
    if (this.#isStale) this.#drawPath(project, ratio);
    this.#isStale = false;
    drawFrame(context, project, this.low, this.high, this.#size[0] < NARROW);
    this.#marks(context, project);
  }

  #drawPath(project, ratio) {
    this.shown = this.#inView(project, (this.#detail() * this.#pixel()) / ratio);
    if (this.#ribbon) {
      this.#ribbon.now = this.#hasTrail ? this.#time : null;
      this.#ribbon.show(this.shown, this.canvas.width, this.canvas.height, 2 * ratio);
      this.#renderer.render(this.#scene, this.#camera);
      this.#watch(this.#isMoving());
    } else {
      const flat = this.canvas.getContext("2d");
      flat.setTransform(ratio, 0, 0, ratio, 0, 0);
      flat.clearRect(0, 0, this.canvas.width, this.canvas.height);
      const mode = { values: this.#mode.values, isKind: Boolean(this.#mode.colours) };
      drawFlat(flat, this.#run.path, this.shown, project, mode, this.colours.map(css), style("--rapid"), 2);
    }
  }

  /* The allowed error in pixels now: smaller at rest, larger if drawing is slow. */
  #detail() {
    return this.#isMoving() ? MOVING * this.#coarse : Math.min(AT_REST * this.#coarse, MOVING);
  }

  #isMoving() {
    return performance.now() - this.#movedAt < REST * this.#coarse - 5;
  }

  /* Measures how long drawing takes and adapts `#coarse` while the view moves; the next picture waits for the end. */
  #watch(isMoving) {
    const gl = this.#renderer.getContext(), start = performance.now();
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.#isBusy = true;
    const look = () => {
      if (gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) return setTimeout(look, 2);
      gl.deleteSync(fence);
      const took = performance.now() - start;
      if (isMoving && took > SLOW) this.#coarse = Math.min(2 * this.#coarse, MOST);
      if (isMoving && took < QUICK) this.#coarse = Math.max(0.9 * this.#coarse, 1);
      this.#isBusy = false;
      if (this.#isStale) this.#drawSoon();
    };
    setTimeout(look);
  }

  /* For each chunk in view, its coarsest level within a tolerance [mm]. */
  #inView(project, tolerance) {
    const [width, height] = this.#size, pixel = this.#pixel();
    return this.#chunks.filter(({ centre, radius }) => {
      const [x, y] = project(centre), reach = radius / pixel + 2;
      return x + reach > 0 && x - reach < width && y + reach > 0 && y - reach < height;
    }).map(({ levels }) => levels.findLast((level) => level.tolerance <= tolerance) ?? levels[0]);
  }

  #marks(context, project) {
    const { path, count } = this.#run;
    const dot = ([x, y], size, fill, stroke) => {
      context.beginPath();
      context.arc(x, y, size, 0, 2 * Math.PI);
      context.fillStyle = fill;
      context.fill();
      context.lineWidth = 2;
      context.strokeStyle = stroke;
      context.stroke();
    };
    if (!count) return;
    const start = project([path.x[0], path.y[0], path.z[0]]);
    dot(start, 4, style("--card"), style("--ink"));
    context.fillStyle = style("--ink");
    context.textAlign = "left";
    context.fillText("start", start[0] + 8, start[1] - 8);
    for (const mark of path.marks) dot(project(mark), 6, style("--bad"), style("--card"));
    if (this.#time !== null) dot(project(this.#run.position(this.#time)), 6, style("--accent"), style("--card"));
  }

  /* The number of the drawn point that is nearest to the pointer. */
  #under(event) {
    if (!this.#run?.count) return -1;
    const [[a, b, c, d], [e, f, g, h]] = this.#rows();
    const { x, y, z } = this.#run.path;
    const box = this.over.getBoundingClientRect();
    const left = event.clientX - box.left, top = event.clientY - box.top;
    let best = -1, least = NEAR * NEAR;
    for (const { index } of this.shown) {
      for (let i = 0; i < index.length; i += 1) {
        const point = index[i], px = x[point], py = y[point], pz = z[point];
        const across = a * px + b * py + c * pz + d - left, down = e * px + f * py + g * pz + h - top;
        const square = across * across + down * down;
        if (square < least) [best, least] = [point, square];
      }
    }
    return best;
  }

  /* The map from points [mm] to pixels from the top left, and to depth. */
  #projector() {
    const rows = this.#rows();
    return ([x, y, z]) => rows.map(([a, b, c, d]) => a * x + b * y + c * z + d);
  }

  /* The coefficients of that map: a, b, c, d of a x + b y + c z + d, for each of the three results. */
  #rows() {
    const [width, height] = this.#size, centre = this.#centre();
    const m = this.#camera.projectionMatrix.clone().multiply(this.#camera.matrixWorldInverse).elements;
    return [[width / 2, width / 2], [-height / 2, height / 2], [1, 0]].map(([factor, shift], k) => {
      const [a, b, c] = [0, 4, 8].map((column) => factor * m[column + k]);
      return [a, b, c, factor * m[12 + k] + shift - a * centre[0] - b * centre[1] - c * centre[2]];
    });
  }

  /* The width of a pixel [mm]. */
  #pixel() {
    return (this.#camera.right - this.#camera.left) / this.#camera.zoom / (this.#size[0] || 1);
  }

  #centre() {
    return this.low ? this.low.map((low, k) => (low + this.high[k]) / 2) : [0, 0, 0];
  }

  #far() {
    return 2 * (this.low ? Math.hypot(...this.high.map((high, k) => high - this.low[k])) || 1 : 1);
  }

  #firstView() {
    const sizes = this.high.map((high, k) => high - this.low[k]);
    const whole = sizes[0] + sizes[1] + sizes[2];
    const flat = sizes.map((size) => size <= 1e-6 * whole);
    if (flat[2]) return "xy";
    if (flat[1]) return "xz";
    return flat[0] ? "yz" : "xyz";
  }
}
