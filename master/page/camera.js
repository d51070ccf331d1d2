// From where the bodies are seen: two angles, a zoom and a shift, which several pictures may share, and the matrix of a parallel projection
// for a frame, which each picture may have for itself. z of the deck points up.

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

/// Seen from the front left and above.
const START = { around: -0.7, up: 0.45 };

/// How many times the smaller radius a common frame may have.
const ALIKE = 2;

/// The frame of a box (its least and greatest corner): centre and radius of what a picture takes in before it is zoomed.
export function frame([low, high]) {
  return { centre: low.map((l, k) => (l + high[k]) / 2), radius: Math.hypot(...low.map((l, k) => high[k] - l)) / 2 || 1 };
}

/// The box around boxes.
export const around = boxes =>
  [0, 1].map(end => boxes[0][end].map((_, k) => (end ? Math.max : Math.min)(...boxes.map(box => box[end][k]))));

/// Frames of pictures that stand beside each other: one for all, so that they have one scale, unless a body would be small in it.
export function frames(boxes) {
  const own = boxes.map(frame);
  const all = frame(around(boxes));
  return all.radius <= ALIKE * Math.min(...own.map(one => one.radius)) ? own.map(() => all) : own;
}

export class Camera {
  constructor() {
    this.fit();
  }

  fit() {
    Object.assign(this, START, { zoom: 1, shift: [0, 0] });
  }

  /// Whether the user has looked nearer, or elsewhere.
  isNear() {
    return this.zoom !== 1 || this.shift.some(Boolean);
  }

  /// Looks at a side that was cut open across an axis (0 to 2), of which those beyond the plane are left, or those below it.
  face(axis, beyond) {
    const quarter = Math.PI / 2;
    // The eye is at (-sin around, -cos around) times the cosine of `up`: opposite to what is left, a little to the side.
    if (axis === 0) this.around = (beyond ? quarter : -quarter) - 0.5;
    if (axis === 1) this.around = (beyond ? 0 : Math.PI) - 0.5;
    this.up = axis === 2 ? (beyond ? -0.75 : 0.75) : 0.45;
    this.shift = [0, 0];
  }

  rotate(around, up) {
    this.around += around;
    this.up = Math.min(1.55, Math.max(-1.55, this.up + up));
  }

  scale(by) {
    this.zoom = Math.min(50, Math.max(0.2, this.zoom * by));
  }

  /// The matrix for a picture of this width over height and this frame, and from where light falls.
  look(aspect, { centre, radius: r }) {
    const [ca, sa, cu, su] = [Math.cos(this.around), Math.sin(this.around), Math.cos(this.up), Math.sin(this.up)];
    const right = [ca, -sa, 0], eye = [-sa * cu, -ca * cu, su];
    const up = [eye[1] * right[2] - eye[2] * right[1], eye[2] * right[0] - eye[0] * right[2], eye[0] * right[1] - eye[1] * right[0]];
    const [x, y, z] = centre;
    const dot = a => -(a[0] * x + a[1] * y + a[2] * z);
    const turn = new Float32Array([right[0], up[0], eye[0], 0, right[1], up[1], eye[1], 0, right[2], up[2], eye[2], 0, dot(right), dot(up), dot(eye), 1]);
    const s = this.zoom / (r * 1.02);
    const [sx, sy] = aspect > 1 ? [s / aspect, s] : [s, s * aspect];
    const flat = new Float32Array([sx, 0, 0, 0, 0, sy, 0, 0, 0, 0, -1 / (20 * r), 0, this.shift[0], this.shift[1], 0, 1]);
    return { matrix: multiply(flat, turn), light: [0, 1, 2].map(i => eye[i] + 0.3 * right[i] + 0.35 * up[i]), axes: [right, up] };
  }
}
