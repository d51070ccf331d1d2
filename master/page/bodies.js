// The bodies: surfaces as the server packs them (see http/surface.rs), drawn by WebGL2 with flat light.

const VERTEX = `#version 300 es
layout(location=0) in vec3 position; layout(location=1) in float value; layout(location=2) in float edge;
layout(location=3) in vec2 corner;
uniform mat4 view; out float v; out vec3 at; out vec2 uv;
void main() { v = value; at = position; uv = corner; gl_Position = view * vec4(position, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
in float v; in vec3 at; in vec2 uv; uniform vec3 eye; uniform sampler2D ramp; uniform float lines; out vec4 colour;
void main() {
  vec3 n = normalize(cross(dFdx(at), dFdy(at)));
  float light = 0.45 + 0.55 * abs(dot(n, normalize(eye)));
  vec2 w = fwidth(uv) * 0.9;
  vec2 e = smoothstep(vec2(0.0), w, uv) * smoothstep(vec2(0.0), w, 1.0 - uv);
  float line = mix(1.0, mix(0.72, 1.0, e.x * e.y), lines);
  colour = vec4(texture(ramp, vec2(clamp(v, 0.002, 0.998), 0.5)).rgb * light * line, 1.0);
}`;

// Black-blue to yellow with even steps of lightness, readable without colour vision.
const RAMP = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];

export function ramp() {
  const bytes = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) {
    const at = i / 255 * (RAMP.length - 1), low = Math.min(Math.floor(at), RAMP.length - 2), part = at - low;
    for (let k = 0; k < 3; k++) bytes[4 * i + k] = RAMP[low][k] * (1 - part) + RAMP[low + 1][k] * part;
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

export function unpack(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, false) !== 0x42534631) throw new Error('this is no surface; reload the page');
  const [nodes, faces, fields] = [4, 8, 12].map(at => view.getUint32(at, true));
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
  return { nodes, faces, cycle, time, ranges, positions, quads, values };
}

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

export class Bodies {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) return;
    this.turn = { around: -0.7, up: 0.45, zoom: 1, shift: [0, 0] };
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
    this.at = Object.fromEntries(['view', 'eye', 'lines'].map(name => [name, gl.getUniformLocation(program, name)]));
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.buffers = [3, 1, 2].map((size, i) => {
      const buffer = gl.createBuffer(), where = [0, 1, 3][i];
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, ramp());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.enable(gl.DEPTH_TEST);
  }

  // Shows a surface; the first of a job is fitted.
  show(surface, field, fit) {
    this.surface = surface;
    this.field = field;
    if (fit || !this.centre) this.measure();
    this.fill();
    this.draw();
  }

  measure() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const p = this.surface.positions;
    for (let i = 0; i < p.length; i++) { low[i % 3] = Math.min(low[i % 3], p[i]); high[i % 3] = Math.max(high[i % 3], p[i]); }
    this.centre = low.map((l, k) => (l + high[k]) / 2);
    this.radius = Math.hypot(...low.map((l, k) => high[k] - l)) / 2 || 1;
  }

  fit() {
    if (!this.surface) return;
    this.turn = { around: -0.7, up: 0.45, zoom: 1, shift: [0, 0] };
    this.measure();
    this.draw();
  }

  fill() {
    if (!this.gl || !this.surface) return;
    const { faces, quads, positions, values } = this.surface, gl = this.gl;
    const xyz = new Float32Array(18 * faces), value = new Float32Array(6 * faces), corner = new Float32Array(12 * faces);
    const order = [0, 1, 2, 0, 2, 3], uv = [[0, 0], [1, 0], [1, 1], [0, 1]];
    const column = values[this.field];
    for (let f = 0; f < faces; f++) {
      const v = column[f] / 65535;
      for (let k = 0; k < 6; k++) {
        const node = quads[4 * f + order[k]], at = 6 * f + k;
        xyz.set(positions.subarray(3 * node, 3 * node + 3), 3 * at);
        value[at] = v;
        corner.set(uv[order[k]], 2 * at);
      }
    }
    [xyz, value, corner].forEach((data, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    });
  }

  draw() {
    if (!this.gl || !this.surface) return;
    const { gl, canvas, turn } = this, ratio = devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    const back = getComputedStyle(canvas).backgroundColor.match(/[\d.]+/g).map(Number);
    gl.clearColor(back[0] / 255, back[1] / 255, back[2] / 255, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [ca, sa, cu, su] = [Math.cos(turn.around), Math.sin(turn.around), Math.cos(turn.up), Math.sin(turn.up)];
    // Rows: right, up, towards the eye; z of the deck points up.
    const right = [ca, -sa, 0], eye = [sa * cu, ca * cu, su].map((v, i) => i < 2 ? -v : v);
    const up = [eye[1] * right[2] - eye[2] * right[1], eye[2] * right[0] - eye[0] * right[2], eye[0] * right[1] - eye[1] * right[0]];
    const [x, y, z] = this.centre, r = this.radius;
    const dot = a => -(a[0] * x + a[1] * y + a[2] * z);
    const look = new Float32Array([right[0], up[0], eye[0], 0, right[1], up[1], eye[1], 0, right[2], up[2], eye[2], 0, dot(right), dot(up), dot(eye), 1]);
    const s = turn.zoom / (r * 1.02), aspect = width / height;
    const [sx, sy] = aspect > 1 ? [s / aspect, s] : [s, s * aspect];
    const flat = new Float32Array([sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, -1 / (20 * r), 0, turn.shift[0], turn.shift[1], 0, 1]);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.at.view, false, multiply(flat, look));
    gl.uniform3fv(this.at.eye, [eye[0] + 0.3 * right[0] + 0.35 * up[0], eye[1] + 0.3 * right[1] + 0.35 * up[1], eye[2] + 0.3 * right[2] + 0.35 * up[2]]);
    gl.uniform1f(this.at.lines, this.surface.faces < 60000 ? 1 : 0);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * this.surface.faces);
    canvas.dataset.around = turn.around.toFixed(3);
    canvas.dataset.cycle = this.surface.cycle;
  }

  listen() {
    const { canvas } = this, held = new Map();
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
        if (spread) this.scale(now / spread);
        spread = now;
      } else if (event.shiftKey || event.buttons & 6) {
        this.turn.shift[0] += 2 * dx / canvas.clientWidth;
        this.turn.shift[1] -= 2 * dy / canvas.clientHeight;
        this.draw();
      } else this.rotate(dx * 0.008, dy * 0.008);
    });
    canvas.addEventListener('wheel', event => {
      // Without a modifier the wheel belongs to the page unless the canvas has the focus.
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.scale(Math.exp(-event.deltaY * 0.0015));
    }, { passive: false });
    canvas.addEventListener('keydown', event => {
      const act = {
        ArrowLeft: () => this.rotate(-0.12, 0), ArrowRight: () => this.rotate(0.12, 0),
        ArrowUp: () => this.rotate(0, -0.12), ArrowDown: () => this.rotate(0, 0.12),
        '+': () => this.scale(1.15), '=': () => this.scale(1.15), '-': () => this.scale(1 / 1.15), Home: () => this.fit(),
      }[event.key];
      if (act) { event.preventDefault(); act(); }
    });
  }

  rotate(around, up) {
    this.turn.around += around;
    this.turn.up = Math.min(1.55, Math.max(-1.55, this.turn.up + up));
    this.draw();
  }

  scale(by) {
    this.turn.zoom = Math.min(50, Math.max(0.2, this.turn.zoom * by));
    this.draw();
  }
}
