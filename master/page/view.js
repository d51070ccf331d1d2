// The panel of the bodies: which state of which runs is shown, how it is cut, mirrored and coloured.

import { ask } from './ask.js';
import { Bodies, box, unpack } from './bodies.js';
import { Camera, around, frames } from './camera.js';
import { MAPS, PARTS, ramp } from './colours.js';
import * as lists from './lists.js';

const $ = id => document.getElementById(id);
const NAMES = { von_mises: 'von Mises stress', plastic_strain: 'plastic strain', '': 'part' };
const named = name => NAMES[name] ?? name.replaceAll('_', ' ');
/// Surfaces that are kept.
const MOST = 100;

const camera = new Camera();
const canvases = [$('bodies'), $('other')].map(canvas => new Bodies(canvas, camera, () => canvases.forEach(one => one.draw())));
/// What is shown: the chosen run and the one beside it, each `{ job, sheet, surface }`.
let runs = [];
let follow = true;
/// Which runs the frames of the canvases take in, by their numbers; none if they are to be fitted again.
let fitted = '';
/// The boxes that they take in, by run.
const taken = new Map();
/// Drawings that have been overtaken by later ones are dropped.
let turn = 0;
const surfaces = new Map();
/// Ranges that have been seen, by field.
const seen = new Map();

/// Begins with another job.
export function open() {
  runs = [];
  follow = true;
  fitted = '';
  surfaces.clear();
  seen.clear();
  $('parts').replaceChildren($('parts').firstElementChild);
  $('beside').value = '';
  $('cut').value = '';
}

/// Shows the chosen run, and another one beside it or none, as their sheets say.
export async function update(chosen, beside) {
  const first = !runs.length;
  runs = [chosen, beside].filter(Boolean).map(run => ({ ...run, surface: runs.find(old => old.job === run.job)?.surface }));
  const { states, parts } = chosen.sheet, slider = $('state');
  slider.max = String(Math.max(0, states.length - 1));
  slider.disabled = $('play').disabled = states.length < 2;
  if (follow) slider.value = slider.max;
  if ($('parts').children.length - 1 !== parts.length) {
    const box = (name, index) => {
      const mark = lists.element('i');
      mark.style.background = `rgb(${PARTS[index % PARTS.length].join(' ')})`;
      const input = lists.element('input', { type: 'checkbox', checked: true, onchange: () => draw() });
      input.dataset.part = index;
      return lists.element('label', {}, input, mark, name);
    };
    $('parts').replaceChildren($('parts').firstElementChild, ...parts.map(box));
  }
  const symmetric = runs.some(run => run.sheet.mirrors.some(Boolean));
  if (first || $('mirror-box').hidden) $('mirror').checked = symmetric;
  $('mirror-box').hidden = !symmetric;
  $('other').hidden = runs.length < 2;
  await draw();
}

/// What the program is asked for beside the state.
function query() {
  const hidden = [...$('parts').querySelectorAll('input')].filter(input => !input.checked).map(input => input.dataset.part);
  const asked = new URLSearchParams();
  if ($('cut').value) {
    asked.set('cut', $('cut').value);
    asked.set('at', String($('cut-at').value / 100));
    asked.set('side', beyond() ? 'beyond' : 'below');
  }
  if (hidden.length) asked.set('hide', hidden.join(','));
  return asked.size ? `?${asked}` : '';
}

/// Whether what lies beyond the cut is left: as `bolide picture` has it, and the other half by a tick.
const beyond = () => ($('cut').value !== 'z') !== $('cut-side').checked;

async function load(run, index) {
  const state = run.sheet.states[index], asked = query();
  // States may be thinned out or taken back: the key, not the index, names one.
  const key = `${run.job}/${state.key}${asked}`;
  let kept = surfaces.get(key);
  if (!kept) {
    kept = unpack(await (await ask(`api/jobs/${run.job}/surface/${index}${asked}`)).arrayBuffer());
    surfaces.set(key, kept);
    if (surfaces.size > MOST) surfaces.delete(surfaces.keys().next().value);
  }
  return kept;
}

/// Seconds of the units of time.
const SECONDS = { s: 1, ms: 1e-3, us: 1e-6 };
/// The state of a run that is nearest to a time of the chosen run, which may have another unit.
function nearest(run, moment) {
  const units = [runs[0], run].map(one => SECONDS[one.sheet.units.time] ?? 1), time = moment * (units[0] / units[1]);
  let best = 0;
  run.sheet.states.forEach((state, i) => { if (Math.abs(state.time - time) < Math.abs(run.sheet.states[best].time - time)) best = i; });
  return best;
}

async function draw() {
  const mine = ++turn;
  if (!canvases[0].gl || !runs.length || !runs[0].sheet.states.length) return;
  const index = Math.min(Number($('state').value), runs[0].sheet.states.length - 1), { time } = runs[0].sheet.states[index];
  let drawn;
  try {
    drawn = await Promise.all(runs.map((run, i) => run.sheet.states.length ? load(run, i ? nearest(run, time) : index) : null));
  } catch (error) {
    if (mine === turn) $('at').textContent = error.message;
    return;
  }
  if (mine !== turn) return;
  runs.forEach((run, i) => { run.surface = drawn[i]; });
  fields();
  paint();
  const { units } = runs[0].sheet;
  $('at').textContent = `${lists.number(drawn[0].time, 4)} ${units.time}, cycle ${drawn[0].cycle}`;
  $('state').setAttribute('aria-valuetext', $('at').textContent);
}

function fields() {
  const select = $('field'), list = runs[0].surface.fields.map(field => field.name);
  if (select.dataset.list === list.join()) return;
  const before = select.value || 'speed';
  select.dataset.list = list.join();
  select.replaceChildren(new Option('part', ''), ...list.map(name => new Option(named(name), name)));
  select.value = list.includes(before) ? before : list.includes('speed') ? 'speed' : '';
}

/// Colours and draws what has been loaded.
function paint() {
  const shown = runs.filter(run => run.surface);
  if (!shown.length) return;
  const name = $('field').value, index = run => run.surface.fields.findIndex(field => field.name === name);
  const unitOf = run => run.surface.fields[index(run)]?.unit;
  // A run in other units has a range of its own: numbers of the two are not comparable.
  const alike = run => !runs[0].surface || unitOf(run) === unitOf(runs[0]);
  const ranges = shown.filter(run => index(run) >= 0 && run.surface.faces && alike(run)).map(run => run.surface.ranges[index(run)]);
  let range = [Math.min(...ranges.map(r => r[0])), Math.max(...ranges.map(r => r[1]))];
  if (!ranges.length) range = [0, 1];
  else {
    const before = seen.get(name) ?? range;
    seen.set(name, [Math.min(before[0], range[0]), Math.max(before[1], range[1])]);
    if ($('one-range').checked) range = seen.get(name);
  }
  if ($('map').value === 'cool to warm') {
    // Zero is in the middle of this map, where the values have two signs.
    const most = Math.max(...range.map(Math.abs));
    if (range[0] < 0) range = [-most, most];
  }
  if ($('from').value !== '') range = [Number($('from').value), range[1]];
  if ($('to').value !== '') range = [range[0], Number($('to').value)];
  if (fitted !== shown.map(run => run.job).join()) fit();
  // Bodies that fly out of the picture are followed, unless the user looks at a detail.
  else if (!camera.isNear()) takeIn();
  canvases.forEach((canvas, i) => {
    const run = runs[i];
    if (!run?.surface) return;
    Object.assign(canvas, { mirrors: mirrorsOf(run), edges: $('edges').checked });
    if (canvas.map !== $('map').value) canvas.colours($('map').value);
    canvas.show(run.surface, index(run), alike(run) || index(run) < 0 ? range : run.surface.ranges[index(run)]);
  });
  const unit = runs[0].surface.fields.find(field => field.name === name)?.unit;
  const byPart = index(runs[0]) < 0;
  $('low').textContent = byPart ? '' : lists.number(range[0], 3);
  $('high').textContent = byPart ? '' : lists.number(range[1], 3);
  $('what').textContent = byPart ? 'coloured by part' : named(name) + (unit ? ` (${unit})` : '')
    + (shown.every(run => index(run) < 0 || alike(run)) ? '' : '; the other run has other units, and colours over its own range');
  $('ramp').hidden = byPart;
}

/// The axes across which a run is shown mirrored: its own planes of symmetry.
const mirrorsOf = run => run.sheet.mirrors.map(on => on && $('mirror').checked);

/// Takes in what is shown, and nothing else.
function fit() {
  taken.clear();
  takeIn();
}

/// Takes in what is shown beside what was.
function takeIn() {
  const shown = runs.filter(run => run.surface), full = shown.filter(run => run.surface.faces);
  if (!full.length) return;
  const fits = frames(full.map(run => {
    const now = box(run.surface, mirrorsOf(run));
    taken.set(run.job, taken.has(run.job) ? around([taken.get(run.job), now]) : now);
    return taken.get(run.job);
  }));
  runs.forEach((run, i) => { canvases[i].frame = fits[full.indexOf(run)] ?? canvases[i].frame; });
  $('scales').hidden = fits.every(one => one === fits[0]);
  fitted = shown.map(run => run.job).join();
}

function bar() {
  const image = new ImageData(new Uint8ClampedArray(ramp($('map').value)), 256, 1);
  [$('ramp').width, $('ramp').height] = [256, 1];
  $('ramp').getContext('2d').putImageData(image, 0, 0);
}

/// Draws again what is there: the size or the colours of the page have changed.
export const redraw = () => canvases.forEach(canvas => canvas.draw());

let later;
/// The program is asked once somebody has stopped to move a slider.
function soon() {
  clearTimeout(later);
  later = setTimeout(draw, 120);
}

function cut() {
  if ($('cut').value) camera.face('xyz'.indexOf($('cut').value), beyond());
  // What is left fills the picture.
  fitted = '';
  draw();
}

let playing = null;
function play() {
  const stop = () => { clearInterval(playing); playing = null; $('play').textContent = '▶'; $('play').ariaLabel = 'Play the states'; };
  if (playing) return stop();
  const slider = $('state');
  if (slider.value === slider.max) slider.value = '0';
  $('play').textContent = '⏸';
  $('play').ariaLabel = 'Pause';
  playing = setInterval(async () => {
    if (slider.value === slider.max) return stop();
    slider.value = String(Number(slider.value) + 1);
    follow = slider.value === slider.max;
    await draw();
  }, 200);
}

export function start() {
  $('no-gl').hidden = Boolean(canvases[0].gl);
  $('stage').hidden = !canvases[0].gl;
  $('map').append(...Object.keys(MAPS).map(name => new Option(name, name)));
  bar();
  $('map').addEventListener('change', () => { bar(); paint(); });
  for (const id of ['field', 'edges', 'from', 'to', 'one-range']) $(id).addEventListener('change', paint);
  $('mirror').addEventListener('change', () => { fit(); paint(); });
  $('cut').addEventListener('change', cut);
  $('cut-side').addEventListener('change', cut);
  $('cut-at').addEventListener('input', soon);
  $('reset').addEventListener('click', () => { camera.fit(); fit(); redraw(); });
  $('state').addEventListener('input', () => {
    follow = $('state').value === $('state').max;
    draw();
  });
  $('play').addEventListener('click', play);
}
