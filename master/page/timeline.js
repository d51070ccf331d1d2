// The space-time diagram: a row for each host, time to the right, phases as bars, cycles as ticks.

import { colour, prepare } from './curves.js';

const ROW = 22;

export function draw(canvas, workers, phases) {
  const rows = workers.filter(worker => worker.spans.length);
  canvas.hidden = rows.length === 0;
  if (!rows.length) return;
  canvas.style.height = `${rows.length * ROW + 26}px`;
  const { context: c, width, height } = prepare(canvas);
  // Reports come at different instants; the newest stretch that all have seen is shown.
  const ends = rows.map(w => w.spans.at(-1)[2] + w.spans.at(-1)[3]);
  const starts = rows.map(w => w.spans[0][2]);
  let to = Math.min(...ends), from = Math.max(...starts);
  if (to <= from) { to = Math.max(...ends); from = Math.min(...starts); }
  const widest = Math.max(...rows.map(w => c.measureText(w.name).width));
  const left = Math.min(widest + 10, width * 0.3), right = width - 6;
  const px = t => left + (t - from) / (to - from || 1) * (right - left);
  c.textBaseline = 'middle';
  rows.forEach((worker, row) => {
    const y = row * ROW + 2;
    c.fillStyle = colour('--ink');
    let name = worker.name;
    while (name.length > 3 && c.measureText(name).width > left - 8) name = name.slice(0, -2) + '…';
    c.fillText(name, 0, y + ROW / 2 - 1);
    c.fillStyle = colour('--fill');
    c.fillRect(left, y, right - left, ROW - 4);
    let cycle = null;
    for (const [phase, at, start, length] of worker.spans) {
      const a = Math.max(left, px(start)), b = Math.min(right, px(start + length));
      if (b <= left || a >= right) continue;
      c.fillStyle = colour(`--p${phase}`);
      c.fillRect(a, y, Math.max(b - a, 0.6), ROW - 4);
      if (cycle !== null && at !== cycle && a > left + 1) {
        c.fillStyle = colour('--ink');
        c.fillRect(a, y, 1, ROW - 4);
      }
      cycle = at;
    }
  });
  const span = to - from, y = rows.length * ROW;
  const rough = span / Math.max(2, width / 110), power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough);
  const [unit, by] = step >= 1e6 ? ['ms', 1e6] : ['µs', 1e3];
  c.fillStyle = colour('--soft');
  c.textAlign = 'center';
  for (let t = 0; t <= span; t += step) {
    const x = left + t / span * (right - left);
    c.fillRect(x, y, 1, 4);
    c.textAlign = x > right - 24 ? 'right' : t ? 'center' : 'left';
    c.fillText(`${Number((t / by).toPrecision(6))}${t ? '' : ` ${unit}`}`, x, y + 13);
  }
  c.textAlign = 'left';
  const cycles = rows.flatMap(w => w.spans.map(s => s[1]));
  canvas.setAttribute('aria-label',
    `Phases (${phases.join(', ')}) of ${rows.length} hosts, cycles ${Math.min(...cycles)} to ${Math.max(...cycles)}`);
}
