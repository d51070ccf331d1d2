// The page: hears the overview as a stream, asks for the chosen job's sheet, and hands both to what draws.

import * as again from './again.js';
import { ask, behind, json, root } from './ask.js';
import * as deck from './deck.js';
import * as energies from './energies.js';
import * as facts from './facts.js';
import * as files from './files.js';
import * as history from './history.js';
import * as lists from './lists.js';
import * as outcome from './outcome.js';
import * as timeline from './timeline.js';
import * as view from './view.js';

const $ = id => document.getElementById(id);
/// Below this width lists begin closed, so that the job is on the first screen.
const NARROW = 860;
/// How often the history of a run under way is asked for (s).
const HISTORY_EVERY = 3;
/// The stream says something at least every 10 s; after so long without a word (s) the page says that.
const SILENCE = 25;

const page = { overview: null, chosen: null, sheet: null, beside: null, asking: false, ticks: 0, heard: Date.now() };

function link(words, lost) {
  if ($('link').textContent !== words) $('link').textContent = words;
  $('link').className = lost ? 'lost' : '';
}

function listen() {
  const stream = new EventSource(new URL('api/events', root));
  stream.addEventListener('overview', event => {
    page.overview = JSON.parse(event.data);
    if (page.overview.only_shows) behind.name = 'bolide report';
    heard();
    overview();
  });
  stream.addEventListener('alive', heard);
  stream.onerror = () => {
    link(`${behind.name} does not answer; trying again`, true);
    if (stream.readyState === EventSource.CLOSED) setTimeout(listen, 2000);
  };
}

/// Something came over the stream.
function heard() {
  page.heard = Date.now();
  if (page.overview) link(page.overview.only_shows ? 'results on this PC' : 'live', false);
}

/// A program that is stopped keeps its connections, so that nothing ends: only its silence shows.
function listenForSilence() {
  const silent = Math.round((Date.now() - page.heard) / 1e3);
  if (silent >= SILENCE && !(page.overview && $('link').textContent.endsWith('trying again'))) link(`no word from ${behind.name} for ${silent} s`, true);
}

const statusOf = number => page.overview?.jobs.find(job => job.job === number);
const addressOf = number => new URL(`jobs/${number}`, root).href;
/// The job that the address of the page names.
const named = () => Number(location.pathname.match(/\/jobs\/(\d+)$/)?.[1]) || null;

function overview() {
  const { jobs, hosts, join, only_shows: shows } = page.overview;
  if (page.chosen === null && jobs.length) {
    const running = jobs.find(job => job.state === 'running');
    choose(named() ?? (running ?? jobs.at(-1)).job, false);
    return;
  }
  $('submit-box').hidden = $('hosts-box').hidden = shows;
  const count = (rows, state) => rows.filter(row => row.state === state).length;
  // Of states that are rare only those that some are in.
  const rare = (rows, ...states) => states.filter(state => count(rows, state)).map(state => `, ${count(rows, state)} ${state}`).join('');
  const here = hosts.length - count(hosts, 'lost') - count(hosts, 'left');
  $('counts').textContent = shows ? `${jobs.length} ${jobs.length === 1 ? 'run' : 'runs'}`
    : `${here} ${here === 1 ? 'host' : 'hosts'}${rare(hosts, 'lost', 'left')}, ${count(jobs, 'running')} running, `
      + `${count(jobs, 'queued')} queued${rare(jobs, 'held')}`;
  lists.jobs($('jobs'), jobs, page.chosen, choose, addressOf);
  $('no-jobs').hidden = jobs.length > 0;
  lists.hosts($('hosts'), hosts);
  $('no-hosts').hidden = here > 0;
  $('hosts').closest('.scroll').hidden = hosts.length === 0;
  if ($('join').textContent !== join) {
    $('join').textContent = join;
    // Submitted jobs go to the master of this page, wherever it listens.
    const flags = (join.match(/--(master|certs) \S+/g) ?? []).join(' ');
    $('submit-line').textContent = `bolide submit DECK.toml ${flags}`.trim();
  }
  besides();
  job();
}

/// The runs that can be shown beside the chosen one.
function besides() {
  const select = $('beside'), list = page.overview.jobs.filter(job => job.job !== page.chosen && job.state !== 'queued');
  const keys = list.map(job => job.job).join();
  if (select.dataset.keys === keys) return;
  select.dataset.keys = keys;
  const before = select.value;
  select.replaceChildren(new Option('no other run', ''), ...list.map(job => new Option(`job ${job.job}: ${job.title}`, job.job)));
  select.value = before;
  select.parentElement.hidden = !list.length;
}

/// Shows a job; its address is that of the page from then on.
function choose(number, remember = true) {
  if (number !== named()) window.history[remember ? 'pushState' : 'replaceState'](null, '', addressOf(number));
  page.chosen = number;
  page.sheet = page.beside = null;
  page.ticks = 0;
  view.open();
  history.open();
  $('panels').hidden = true;
  $('outcome').hidden = true;
  if (innerWidth < NARROW) $('jobs-box').open = $('submit-box').open = false;
  if (page.overview) overview();
  sheet();
}

function job() {
  const now = statusOf(page.chosen);
  $('no-job').hidden = Boolean(now);
  $('no-job').firstChild.textContent = page.chosen && page.overview.jobs.length ? `There is no job ${page.chosen}.` : 'Nothing to show yet: no job has been chosen.';
  $('view').hidden = !now;
  if (now) facts.draw(now, page.sheet, page.overview);
}

const sheetOf = number => json(`api/jobs/${number}/sheet`);

async function sheet() {
  const number = page.chosen, now = statusOf(number);
  if (number === null || page.asking) return;
  if (!now || now.state === 'queued') {
    $('panels').hidden = true;
    $('unkept').hidden = !now;
    $('unkept').textContent = 'Curves and bodies come when the job runs.';
    return;
  }
  // One that was held or has failed may be resumed, and goes on.
  if (page.sheet?.final && now.state !== 'running') return;
  const final = now.state !== 'running';
  page.asking = true;
  try {
    const found = await sheetOf(number);
    if (number !== page.chosen) return;
    page.sheet = Object.assign(found, { final });
    $('panels').hidden = false;
    $('unkept').hidden = true;
    if (!final) $('outcome').hidden = true;
    job();
    panels();
    const due = final || page.ticks++ % HISTORY_EVERY === 0;
    await Promise.all([bodies(), due && history.update(number, page.beside?.job), due && outcome.files(number), final && ended()]);
  } catch (error) {
    if (number !== page.chosen) return;
    $('unkept').hidden = false;
    $('unkept').textContent = error.message;
  } finally {
    page.asking = false;
    if (number !== page.chosen) sheet();
  }
}

const bodies = () => view.update({ job: page.chosen, sheet: page.sheet }, page.beside);

/// What is there once a job is over.
const ended = () => outcome.draw({ job: page.chosen, sheet: page.sheet }, page.beside);

function panels() {
  const { workers, phases } = page.sheet;
  energies.draw(page.sheet);
  again.offer(page.chosen, page.overview.recomputes && page.sheet.proved);
  $('phases').closest('section').hidden = !phases.length;
  if (!phases.length) return;
  timeline.draw($('phases'), workers, phases);
  const any = workers.some(worker => worker.spans.length);
  $('no-phases').hidden = any;
  $('phase-legend').hidden = !any;
  if (!$('phase-legend').children.length) {
    $('phase-legend').append(...phases.map((name, i) => {
      const box = lists.element('i');
      box.style.background = `var(--p${i})`;
      return lists.element('li', {}, box, name);
    }));
  }
}

/// Another run is put beside the chosen one, or taken away.
async function beside() {
  const number = Number($('beside').value), of = page.chosen;
  page.beside = null;
  try {
    if (number) page.beside = { job: number, sheet: await sheetOf(number) };
  } catch (error) {
    $('beside').value = '';
    $('at').textContent = error.message;
  }
  if (of !== page.chosen || !page.sheet) return;
  await Promise.all([bodies(), history.update(of, page.beside?.job), page.sheet.final && ended()]);
}

/// A job was submitted here.
async function ran(number) {
  page.overview = await json('api/overview');
  choose(number);
  $('job').focus({ preventScroll: true });
  if (innerWidth < NARROW) $('job').scrollIntoView();
}

function drops() {
  const drop = $('drop');
  // A file that misses the box must not replace the page.
  for (const kind of ['dragover', 'drop']) addEventListener(kind, event => event.preventDefault());
  addEventListener('dragover', () => drop.classList.add('over'));
  addEventListener('dragleave', event => event.relatedTarget ?? drop.classList.remove('over'));
  addEventListener('drop', event => {
    drop.classList.remove('over');
    // What is dropped is to be taken before this call ends.
    if (event.dataTransfer.files.length && !page.overview?.only_shows) deck.take(files.dropped(event.dataTransfer));
  });
  $('file').addEventListener('change', event => event.target.files.length && deck.take(files.read([...event.target.files])));
}

/// One click asks, a second one within five seconds ends the job.
function cancels() {
  let asked;
  const calm = () => {
    clearTimeout(asked);
    asked = undefined;
    $('cancel').textContent = 'Cancel';
  };
  $('cancel').addEventListener('blur', calm);
  $('cancel').addEventListener('click', async () => {
    if (asked === undefined) {
      $('cancel').textContent = 'End this job?';
      asked = setTimeout(calm, 5000);
      return;
    }
    calm();
    await act('cancel');
  });
  for (const name of ['hold', 'resume']) $(name).addEventListener('click', () => act(name));
}

/// Asks the master for a change of the chosen job.
async function act(name) {
  // A second click would ask again.
  $(name).disabled = true;
  try {
    await ask(`api/jobs/${page.chosen}/${name}`, { method: 'POST' });
  } catch (error) {
    lists.say($('faults'), error.message);
    // In a narrow window the box is closed, and far from the button.
    $('submit-box').open = true;
    $('faults').focus();
  } finally {
    $(name).disabled = false;
  }
}

function copies() {
  $('copy').addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText($('join').textContent);
      $('copy').textContent = 'Copied';
    } catch {
      getSelection().selectAllChildren($('join'));
      $('copy').textContent = 'Selected';
    }
    setTimeout(() => { $('copy').textContent = 'Copy'; }, 1500);
  });
}

function start() {
  if (innerWidth < NARROW) $('jobs-box').open = $('submit-box').open = false;
  view.start();
  history.start(() => history.update(page.chosen, page.beside?.job));
  deck.start(ran);
  drops();
  cancels();
  copies();
  $('again').addEventListener('click', () => deck.again(page.chosen));
  $('beside').addEventListener('change', beside);
  addEventListener('popstate', () => named() && choose(named(), false));
  const redraw = () => { if (page.sheet && !$('panels').hidden) { panels(); history.draw(); view.redraw(); } };
  addEventListener('resize', redraw);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  listen();
  setInterval(() => document.hidden || sheet(), 1000);
  setInterval(listenForSilence, 1000);
}

start();
