// Curves over an axis, drawn when data or size change.

import { element, number } from './lists.js';

export const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export function prepare(canvas) {
  const ratio = devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = '11px system-ui, "DejaVu Sans", sans-serif';
  return { context, width, height };
}

// Round steps, about so many.
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough);
  const list = [];
  for (let t = Math.ceil(low / step) * step; t <= high + step * 1e-9; t += step) list.push(Math.abs(t) < step * 1e-9 ? 0 : t);
  return list;
}

// series: [{ name, colour, dash, y: [...], x: [...] }], those without an x of their own over x: [...]; null is a gap.
export function draw(canvas, { x, series, xName, yName, floor }) {
  const { context: c, width, height } = prepare(canvas);
  const soft = colour('--soft');
  if (x.length < 2 || width < 80) {
    c.fillStyle = soft;
    c.fillText('no points yet', 10, height / 2);
    return;
  }
  let [low, high] = floor ?? [0, 0];
  for (const { y } of series) for (const v of y) if (v !== null) { low = Math.min(low, v); high = Math.max(high, v); }
  if (!(high > low)) high = low + 1;
  high += (high - low) * 0.04;
  const rows = ticks(low, high, Math.max(2, height / 45));
  const labels = rows.map(t => number(t, 3));
  const left = Math.max(...labels.map(l => c.measureText(l).width)) + 10;
  const [top, right, bottom] = [16, width - 8, height - 20];
  const axes = series.map(s => s.x ?? x).filter(list => list.length);
  const [first, last] = [Math.min(...axes.map(list => list[0])), Math.max(...axes.map(list => list.at(-1)))];
  const px = v => left + (v - first) / (last - first || 1) * (right - left);
  const py = v => bottom - (v - low) / (high - low) * (bottom - top);
  c.lineWidth = 1;
  c.strokeStyle = colour('--line');
  c.fillStyle = soft;
  c.textAlign = 'right';
  c.textBaseline = 'middle';
  rows.forEach((t, i) => {
    const y = Math.round(py(t)) + 0.5;
    c.beginPath(); c.moveTo(left, y); c.lineTo(right, y); c.stroke();
    c.fillText(labels[i], left - 6, y);
  });
  c.textBaseline = 'alphabetic';
  const columns = ticks(first, last, Math.max(2, width / 90));
  columns.forEach(t => {
    const label = number(t, 3), half = c.measureText(label).width / 2;
    if (px(t) + half > right - c.measureText(xName).width - 8) return;
    c.textAlign = px(t) - half < left ? 'left' : 'center';
    c.fillText(label, px(t), height - 5);
  });
  c.textAlign = 'right';
  c.fillText(xName, right, height - 5);
  c.textAlign = 'left';
  c.fillText(yName, left, 9);
  c.lineWidth = 1.7;
  c.lineJoin = 'round';
  for (const { x: own = x, y, colour: stroke, dash } of series) {
    c.strokeStyle = colour(stroke);
    c.setLineDash(dash ?? []);
    c.beginPath();
    let on = false;
    y.forEach((v, i) => {
      if (v !== null) on ? c.lineTo(px(own[i]), py(v)) : c.moveTo(px(own[i]), py(v));
      on = v !== null;
    });
    c.stroke();
  }
  c.setLineDash([]);
}

/// Entries of a legend: `{ colour, dash, words }` each, and words behind them.
export function legend(parent, entries, more = '') {
  parent.querySelector('.more')?.remove();
  if (parent.children.length !== entries.length || [...parent.children].some((item, i) => item.dataset.look !== `${entries[i].colour} ${entries[i].dash}`)) {
    parent.replaceChildren(...entries.map(({ colour: stroke, dash }) => {
      const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      const line = document.createElementNS('http://www.w3.org/2000/svg', 'line');
      for (const [key, value] of Object.entries({ x1: 0, x2: 22, y1: 4, y2: 4, 'stroke-width': 2, 'stroke-dasharray': (dash ?? []).join(' ') })) line.setAttribute(key, value);
      line.style.stroke = `var(${stroke})`;
      svg.append(line);
      svg.setAttribute('aria-hidden', 'true');
      const item = element('li', {}, svg, element('span'));
      item.dataset.look = `${stroke} ${dash}`;
      return item;
    }));
  }
  entries.forEach(({ words }, i) => { if (parent.children[i].lastChild.textContent !== words) parent.children[i].lastChild.textContent = words; });
  if (more) parent.append(element('li', { className: 'more', textContent: more }));
}
