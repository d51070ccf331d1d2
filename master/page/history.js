// The panel of the history: curves of gauges, parts, walls and sections, those of another run beside them.

import { json } from './ask.js';
import * as curves from './curves.js';
import { number } from './lists.js';

const $ = id => document.getElementById(id);
/// Curves that are told apart at a time.
const MOST = 7;
/// Quantities that people look for first.
const FIRST = ['vz', 'vx', 'vy', 'pressure', 'fz', 'kinetic', 'momentum_z'];

/// `rear:vz [mm/ms]` as owner, quantity and unit.
function parsed(column) {
  const at = column.lastIndexOf(' [');
  const [bare, unit] = at > 0 && column.endsWith(']') ? [column.slice(0, at), column.slice(at + 2, -1)] : [column, ''];
  const colon = bare.lastIndexOf(':');
  return { owner: colon > 0 ? bare.slice(0, colon) : '', what: colon > 0 ? bare.slice(colon + 1) : bare, unit };
}

/// Columns of one quantity: its label, and the owner and index of each.
function quantities(columns) {
  const found = new Map();
  columns.forEach((column, index) => {
    const { owner, what, unit } = parsed(column);
    if (['cycle', 'time'].includes(what) && !owner) return;
    const key = `${owner ? '' : 'whole:'}${what}`;
    if (!found.has(key)) found.set(key, { what, unit, whole: !owner, curves: [] });
    found.get(key).curves.push({ owner: owner || what, index });
  });
  return found;
}

let drawn = null;
let busy = false;
/// What was asked for while the last answer was on its way.
let next = null;

export function open() {
  drawn = null;
  next = null;
  $('quantity').replaceChildren();
  $('no-history').hidden = true;
}

function fill(found) {
  const select = $('quantity');
  if (select.dataset.keys === [...found.keys()].join() && select.options.length) return;
  select.dataset.keys = [...found.keys()].join();
  const group = (label, whole) => {
    const made = document.createElement('optgroup');
    made.label = label;
    for (const [key, { what, unit, whole: is }] of found) if (is === whole) made.append(new Option(what.replaceAll('_', ' ') + (unit ? ` (${unit})` : ''), key));
    return made;
  };
  select.replaceChildren(...[group('of gauges, parts, walls', false), group('of the whole', true)].filter(made => made.children.length));
  const usual = FIRST.find(key => found.has(key));
  if (usual) select.value = usual;
}

/// Asks for the chosen quantity of a job and of the one beside it, and draws it.
export async function update(job, beside) {
  if (busy) {
    next = [job, beside];
    return;
  }
  busy = true;
  try {
    const runs = await Promise.all([job, beside].filter(Boolean).map(async number => {
      const { columns } = await json(`api/jobs/${number}/history`);
      return { number, columns, found: quantities(columns) };
    }));
    fill(runs[0].found);
    const key = $('quantity').value, series = [];
    for (const [place, run] of runs.entries()) {
      const { curves: list = [], unit } = run.found.get(key) ?? {};
      const chosen = list.slice(0, MOST), time = run.columns.findIndex(column => /^time( |$)/.test(column));
      if (place && chosen.length && (unit !== drawn.unit || parsed(run.columns[time]).unit !== drawn.time)) {
        drawn.note = `job ${run.number} has other units, so its curves are left out`;
        continue;
      }
      const { values } = await json(`api/jobs/${run.number}/history?columns=${[time, ...chosen.map(curve => curve.index)].join(',')}`);
      chosen.forEach((curve, i) => series.push({
        name: runs.length > 1 ? `${curve.owner}, job ${run.number}` : curve.owner,
        colour: `--c${i % 7}`, dash: place ? [5, 3] : undefined, x: values[0], y: values[i + 1],
      }));
      if (!place) drawn = { series, left: list.length - chosen.length, unit: run.found.get(key)?.unit, time: parsed(run.columns[time]).unit };
    }
    $('no-history').hidden = true;
    draw();
  } catch (error) {
    $('no-history').textContent = error.message;
    $('no-history').hidden = false;
  } finally {
    busy = false;
  }
  if (next) {
    const asked = next;
    next = null;
    await update(...asked);
  }
}

export function draw() {
  if (!drawn) return;
  const { series, unit, time, left, note } = drawn;
  curves.draw($('history'), { x: series[0]?.x ?? [], xName: `time (${time})`, yName: unit ?? '', series });
  const last = s => s.y.findLast(v => v !== null);
  const words = s => `${s.name}${last(s) === undefined ? '' : ` ${number(last(s), 4)}`}`;
  const beside = [left > 0 && `and ${left} more in history.csv`, note].filter(Boolean).join('; ');
  curves.legend($('history-legend'), series.map(s => ({ ...s, words: words(s) })), beside);
  const name = $('quantity').selectedOptions[0]?.textContent ?? '';
  $('history').setAttribute('aria-label', `${name} over time, last: ${series.map(words).join(', ')}`);
}

export function start(changed) {
  $('quantity').addEventListener('change', changed);
}
