// The bodies: surfaces as the program packs them (see http/surface.rs), drawn by WebGL2 with flat light.

import { PARTS, ramp } from './colours.js';

const VERTEX = `#version 300 es
layout(location=0) in vec3 position; layout(location=1) in float value; layout(location=2) in float part;
layout(location=3) in vec2 corner;
uniform mat4 view; uniform vec3 mirror; out float v; out vec3 at; out vec2 uv; flat out int which;
void main() { v = value; at = position * mirror; uv = corner; which = int(part); gl_Position = view * vec4(at, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
in float v; in vec3 at; in vec2 uv; flat in int which; uniform vec3 eye; uniform sampler2D ramp; uniform float lines; uniform vec2 span;
uniform bool byPart; uniform vec3 parts[${PARTS.length}]; out vec4 colour;
void main() {
  vec3 n = normalize(cross(dFdx(at), dFdy(at)));
  float light = 0.45 + 0.55 * abs(dot(n, normalize(eye)));
  vec2 w = fwidth(uv) * 0.9;
  vec2 e = smoothstep(vec2(0.0), w, uv) * smoothstep(vec2(0.0), w, 1.0 - uv);
  float line = lines * (1.0 - e.x * e.y);
  float share = (v - span.x) / max(span.y - span.x, 1e-30);
  vec3 base = byPart ? parts[which % ${PARTS.length}] : texture(ramp, vec2(clamp(share, 0.002, 0.998), 0.5)).rgb;
  // Lines are darker than bright colours and brighter than dark ones, so that the mesh shows on all of a map.
  float bright = dot(base, vec3(0.3, 0.6, 0.1));
  vec3 other = bright < 0.33 ? base + 0.28 : base * 0.68;
  colour = vec4(mix(base, other, line) * light, 1.0);
}`;

/// Faces beyond which lines would cover everything.
const MOST_WITH_LINES = 60000;

export function unpack(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, false) !== 0x42534632) throw new Error('this is no surface; reload the page');
  const [nodes, faces, fields, words] = [4, 8, 12, 16].map(at => view.getUint32(at, true));
  const cycle = view.getFloat64(20, true), time = view.getFloat64(28, true);
  let at = 36;
  const ranges = [];
  for (let f = 0; f < fields; f++, at += 8) ranges.push([view.getFloat32(at, true), view.getFloat32(at + 4, true)]);
  const positions = new Float32Array(buffer, at, 3 * nodes);
  at += 12 * nodes;
  const quads = new Uint32Array(buffer, at, 4 * faces);
  at += 16 * faces;
  const values = [];
  for (let f = 0; f < fields; f++, at += 2 * faces) values.push(new Uint16Array(buffer, at, faces));
  const parts = new Uint16Array(buffer, at, faces);
  at += 2 * faces;
  const names = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, at, words)));
  return { nodes, faces, cycle, time, ranges, positions, quads, values, parts, fields: names };
}

/// The least and greatest corner of the box around a surface and its mirror images.
export function box(surface, mirrors) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], p = surface.positions;
  for (let i = 0; i < p.length; i++) { low[i % 3] = Math.min(low[i % 3], p[i]); high[i % 3] = Math.max(high[i % 3], p[i]); }
  mirrors.forEach((on, k) => { if (on) [low[k], high[k]] = [Math.min(low[k], -high[k]), Math.max(high[k], -low[k])]; });
  return [low, high];
}

/// A canvas with bodies on it.
export class Bodies {
  /// `camera` may be that of other canvases, `frame` (see camera.js) is its own; `changed` is called when the user turns it.
  constructor(canvas, camera, changed) {
    this.canvas = canvas;
    this.camera = camera;
    this.frame = null;
    this.changed = changed;
    this.edges = true;
    this.mirrors = [false, false, false];
    this.map = 'viridis';
    this.gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) return;
    this.make();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener('webglcontextlost', event => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => { this.make(); this.fill(); this.draw(); });
  }

  make() {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    this.program = program;
    this.at = Object.fromEntries(['view', 'eye', 'lines', 'mirror', 'span', 'byPart', 'parts'].map(name => [name, gl.getUniformLocation(program, name)]));
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.buffers = [[0, 3], [1, 1], [2, 1], [3, 2]].map(([where, size]) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.enable(gl.DEPTH_TEST);
    this.colours(this.map);
  }

  colours(map) {
    const { gl } = this;
    this.map = map;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, ramp(map));
  }

  /// Shows a surface coloured by a field of it (an index; -1 by part) over a range of values.
  show(surface, field, range) {
    Object.assign(this, { surface, field, range });
    this.fill();
    this.draw();
  }

  fill() {
    if (!this.gl || !this.surface) return;
    const { faces, quads, positions, values, parts, ranges } = this.surface, gl = this.gl;
    const xyz = new Float32Array(18 * faces), value = new Float32Array(6 * faces), part = new Float32Array(6 * faces), corner = new Float32Array(12 * faces);
    const order = [0, 1, 2, 0, 2, 3], uv = [[0, 0], [1, 0], [1, 1], [0, 1]];
    const column = values[this.field], [low, high] = ranges[this.field] ?? [0, 0];
    for (let f = 0; f < faces; f++) {
      const v = column ? low + (high - low) * column[f] / 65535 : 0;
      for (let k = 0; k < 6; k++) {
        const node = quads[4 * f + order[k]], at = 6 * f + k;
        xyz.set(positions.subarray(3 * node, 3 * node + 3), 3 * at);
        value[at] = v;
        part[at] = parts[f];
        corner.set(uv[order[k]], 2 * at);
      }
    }
    [xyz, value, part, corner].forEach((data, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    });
  }

  draw() {
    if (!this.gl || !this.surface || !this.frame) return;
    const { gl, canvas, camera } = this, ratio = devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    const back = getComputedStyle(canvas).backgroundColor.match(/[\d.]+/g).map(Number);
    gl.clearColor(back[0] / 255, back[1] / 255, back[2] / 255, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const { matrix, light } = camera.look(width / height, this.frame);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.at.view, false, matrix);
    gl.uniform3fv(this.at.eye, light);
    gl.uniform1f(this.at.lines, this.edges && this.surface.faces < MOST_WITH_LINES ? 1 : 0);
    gl.uniform2fv(this.at.span, this.range);
    gl.uniform1i(this.at.byPart, this.field < 0 ? 1 : 0);
    gl.uniform3fv(this.at.parts, PARTS.flat().map(c => c / 255));
    gl.bindVertexArray(this.array);
    // Every mirror image, and those of images.
    let images = [[1, 1, 1]];
    this.mirrors.forEach((on, axis) => {
      if (on) images = images.flatMap(image => [image, image.map((s, k) => k === axis ? -s : s)]);
    });
    for (const image of images) {
      gl.uniform3fv(this.at.mirror, image);
      gl.drawArrays(gl.TRIANGLES, 0, 6 * this.surface.faces);
    }
    canvas.dataset.around = camera.around.toFixed(3);
    canvas.dataset.radius = this.frame.radius;
    canvas.dataset.cycle = this.surface.cycle;
    canvas.dataset.faces = this.surface.faces;
    canvas.dataset.images = images.length;
  }

  listen() {
    const { canvas, camera } = this, held = new Map();
    let spread = 0;
    canvas.addEventListener('pointerdown', event => { canvas.setPointerCapture(event.pointerId); held.set(event.pointerId, event); });
    const drop = event => { held.delete(event.pointerId); spread = 0; };
    canvas.addEventListener('pointerup', drop);
    canvas.addEventListener('pointercancel', drop);
    canvas.addEventListener('pointermove', event => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
      held.set(event.pointerId, event);
      if (held.size === 2) {
        const [a, b] = [...held.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (spread) camera.scale(now / spread);
        spread = now;
      } else if (event.shiftKey || event.buttons & 6) {
        camera.shift[0] += 2 * dx / canvas.clientWidth;
        camera.shift[1] -= 2 * dy / canvas.clientHeight;
      } else camera.rotate(dx * 0.008, dy * 0.008);
      this.changed();
    });
    canvas.addEventListener('wheel', event => {
      // Without a modifier the wheel belongs to the page unless the canvas has the focus.
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      camera.scale(Math.exp(-event.deltaY * 0.0015));
      this.changed();
    }, { passive: false });
    canvas.addEventListener('keydown', event => {
      const act = {
        ArrowLeft: () => camera.rotate(-0.12, 0), ArrowRight: () => camera.rotate(0.12, 0),
        ArrowUp: () => camera.rotate(0, -0.12), ArrowDown: () => camera.rotate(0, 0.12),
        '+': () => camera.scale(1.15), '=': () => camera.scale(1.15), '-': () => camera.scale(1 / 1.15), Home: () => camera.fit(),
      }[event.key];
      if (act && !event.ctrlKey && !event.metaKey) { event.preventDefault(); act(); this.changed(); }
    });
  }
}
