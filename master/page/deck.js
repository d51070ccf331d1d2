// A deck before it runs: what it describes, what in it is doubtful, how it looks, its text to change.

import { ask, json } from './ask.js';
import { Bodies, box, unpack } from './bodies.js';
import { Camera, frame } from './camera.js';
import * as files from './files.js';
import * as lists from './lists.js';

const $ = id => document.getElementById(id);
/// Elements beyond which bodies are not drawn before they run.
const MOST_DRAWN = 400000;
/// Bytes of a text beyond which a browser edits it badly.
const MOST_EDITED = 4e6;
/// Ends of runs (s) beyond which they end by their cycles.
const MOST_TIME = 1e60;

let canvas;
/// The deck on the table: `{ name, text, texts }` as files.bundle makes it.
let deck = null;
let ran = () => {};

const fault = error => {
  const box = $('faults');
  if (error.faults) lists.faults(box, deck?.name ?? '', error.faults, deck?.texts ?? new Map());
  else lists.say(box, [deck?.name, error.message].filter(Boolean).join(': '));
  if (error.faults && !$('deck').hidden) outdate();
  $('submit-box').open = true;
};

/// The text in the editor has faults: what the card told is of the text before.
function outdate() {
  $('doubts').replaceChildren(lists.element('li', { className: 'bad' }, lists.element('b', { textContent: 'faults' }), ' in the text as it is now, at the lines that are listed under Submit'));
  $('forecast').textContent = '';
  lists.table($('deck-parts'), []);
  $('deck-bodies').hidden = true;
}

/// A whole number that stands in a field, or null. Throws where it is none.
function whole(id, what) {
  const field = $(id);
  if (!field.checkValidity()) {
    field.focus();
    throw new Error(`${what} is ${field.value || 'no number'}: expected a whole number from ${field.min} to ${Number(field.max).toLocaleString('en')}`);
  }
  return field.value === '' ? null : Number(field.value);
}

/// Looks at a deck that has come, a promise of files.
export async function take(coming) {
  // The card of the deck before it would run that one.
  close();
  try {
    await look(files.bundle(await coming));
  } catch (error) {
    fault(error);
  }
  $('file').value = '';
}

/// The deck of a job, to change and run again.
export async function again(number) {
  close();
  try {
    const [text, status] = await Promise.all([ask(`api/jobs/${number}/files/input.deck`).then(answer => answer.text()), json(`api/jobs/${number}`)]);
    const name = status.ended?.summary?.origin?.deck?.split(/[/\\]/).at(-1) || 'deck.toml';
    await look(files.opened(name, text));
    $('deck-edit').open = true;
    $('deck-text').focus();
  } catch (error) {
    fault(error);
  }
}

async function look(found) {
  deck = found;
  const name = encodeURIComponent(deck.name);
  const { forecast, reading } = await json(`api/check?name=${name}`, { method: 'POST', body: deck.text });
  // Another one has come meanwhile.
  if (deck !== found) return;
  const { title, parts, warnings, elements, cycles, first_step_s: step, end_time_s: end, memory_bytes: memory, thread_s: takes } = forecast;
  $('deck').hidden = false;
  $('h-deck').textContent = `${deck.name}: ${title}`;
  const doubts = [...reading, ...warnings];
  $('doubts').replaceChildren(...doubts.map(words => lists.element('li', { className: 'look' }, lists.element('b', { textContent: 'look' }), ` ${words}`)));
  if (!doubts.length) $('doubts').append(lists.element('li', { className: 'good' }, lists.element('b', { textContent: 'no fault' }), ' and nothing doubtful'));
  $('forecast').textContent = [
    // A run of a count of cycles has no end in time.
    `${elements.toLocaleString('en')} elements${end <= MOST_TIME ? `, to ${lists.number(end * 1e3, 3)} ms` : ''}`,
    step && `first step ${lists.number(step * 1e9, 3)} ns, ${cycles.toLocaleString('en')} cycles`,
    takes != null && `${takes < 1 ? 'less than 1 s' : lists.seconds(takes)} on one thread`, `${lists.bytes(memory)} of memory`,
  ].filter(Boolean).join('; ');
  lists.table($('deck-parts'), parts.map(part => [part.name, part.material, part.elements.toLocaleString('en'), lists.number(part.mass_kg, 4), lists.number(part.speed_m_s, 4), lists.number(part.least_cell_m * 1e3, 3)]));
  const text = deck.texts.get(deck.name);
  $('deck-edit').hidden = text.length > MOST_EDITED;
  $('deck-text').value = text.length > MOST_EDITED ? '' : text;
  $('run').focus();
  $('deck').scrollIntoView({ block: 'nearest' });
  await drawn(elements);
}

/// Draws the bodies as a run would begin.
async function drawn(elements) {
  const canDraw = Boolean(canvas.gl) && elements <= MOST_DRAWN;
  $('deck-bodies').hidden = !canDraw;
  if (!canDraw) return;
  const mine = deck;
  try {
    const answer = await ask(`api/check/surface?name=${encodeURIComponent(deck.name)}`, { method: 'POST', body: deck.text });
    const surface = unpack(await answer.arrayBuffer());
    if (mine !== deck) return;
    canvas.camera.fit();
    canvas.frame = frame(box(surface, [false, false, false]));
    canvas.show(surface, -1, [0, 1]);
  } catch {
    // The deck has been looked at: without a picture it runs all the same.
    $('deck-bodies').hidden = true;
  }
}

/// The deck with the text that stands in the editor.
function changed() {
  const text = $('deck-text').value;
  return $('deck-edit').hidden || text === deck.texts.get(deck.name) ? deck : files.changed(deck, text);
}

async function run() {
  // A second click would submit the deck twice.
  if (!deck || $('run').disabled) return;
  $('run').disabled = $('discard').disabled = true;
  try {
    const workers = whole('min-workers', 'the number of workers to start with') ?? 1, cycles = whole('cycles', 'the number of cycles');
    deck = changed();
    const query = new URLSearchParams({ name: deck.name, min_workers: workers });
    if (cycles !== null) query.set('cycles', cycles);
    $('faults').hidden = true;
    const { job } = await json(`api/jobs?${query}`, { method: 'POST', body: deck.text });
    close();
    await ran(job);
  } catch (error) {
    fault(error);
  } finally {
    $('run').disabled = $('discard').disabled = false;
  }
}

function close() {
  $('deck').hidden = true;
  $('deck-edit').open = false;
  $('faults').hidden = true;
  deck = null;
}

/// Listens; `then` is told the number of a job that was submitted.
export function start(then) {
  ran = then;
  canvas = new Bodies($('deck-bodies'), new Camera(), () => canvas.draw());
  $('run').addEventListener('click', run);
  $('discard').addEventListener('click', close);
  $('look').addEventListener('click', async () => {
    $('faults').hidden = true;
    try { await look(changed()); } catch (error) { fault(error); }
  });
}
