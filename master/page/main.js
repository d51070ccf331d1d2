// The page: hears the overview as a stream, asks for the chosen job's sheet and surfaces, hands both to what draws.

import * as files from './files.js';
import * as lists from './lists.js';
import * as curves from './curves.js';
import * as timeline from './timeline.js';
import { Bodies, ramp, unpack } from './bodies.js';

const $ = id => document.getElementById(id);
const SERIES = [
  { key: 'kinetic', name: 'kinetic', colour: '--c0' },
  { key: 'internal', name: 'internal', colour: '--c1' },
  { key: 'hourglass', name: 'hourglass', colour: '--c2', dash: [2, 3] },
  { key: 'contact', name: 'contact and friction', colour: '--c3', dash: [6, 3] },
  { key: 'eroded', name: 'eroded', colour: '--c5', dash: [10, 4] },
  { key: 'wall_loss', name: 'lost at walls', colour: '--c6', dash: [3, 6] },
  { key: 'total', name: 'sum', colour: '--c4', dash: [9, 3, 2, 3] },
];
const FIELD_NAMES = { von_mises: 'von Mises stress', plastic_strain: 'plastic strain', temperature: 'temperature (K)' };

const page = { overview: null, chosen: null, sheet: null, shown: null, follow: true, surfaces: new Map(), asking: false };
const bodies = new Bodies($('bodies'));
$('no-gl').hidden = Boolean(bodies.gl);
$('bodies').hidden = !bodies.gl;

async function ask(path, options) {
  const answer = await fetch(path, options);
  if (answer.ok) return answer;
  const text = await answer.text();
  let body = { error: text.trim() || `the master answers ${answer.status}` };
  try { body = JSON.parse(text); } catch { /* A plain sentence. */ }
  throw Object.assign(new Error(body.error ?? 'the deck has faults'), { faults: body.faults });
}

function link(words, lost) {
  if ($('link').textContent !== words) $('link').textContent = words;
  $('link').className = lost ? 'lost' : '';
}

function listen() {
  const stream = new EventSource('api/events');
  stream.addEventListener('overview', event => {
    page.overview = JSON.parse(event.data);
    link('live', false);
    overview();
  });
  stream.onerror = () => {
    link('the master does not answer; trying again', true);
    if (stream.readyState === EventSource.CLOSED) setTimeout(listen, 2000);
  };
}

const chosenJob = () => page.overview?.jobs.find(job => job.job === page.chosen);

function overview() {
  const { jobs, hosts, join } = page.overview;
  if (page.chosen === null && jobs.length) {
    const running = jobs.find(job => job.state === 'running');
    choose((running ?? jobs.at(-1)).job);
    return;
  }
  const count = state => hosts.filter(host => host.state === state).length;
  const lost = count('lost');
  const here = hosts.length - lost;
  $('counts').textContent = `${here} ${here === 1 ? 'host' : 'hosts'}${lost ? `, ${lost} lost` : ''}, ${jobs.filter(j => j.state === 'queued').length} queued`;
  lists.jobs($('jobs'), jobs, page.chosen, choose);
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
  job();
}

function choose(number) {
  page.chosen = number;
  page.sheet = page.shown = null;
  page.follow = true;
  page.surfaces.clear();
  $('panels').hidden = true;
  if (page.overview) overview();
  sheet();
}

function job() {
  const now = chosenJob();
  $('no-job').hidden = Boolean(now);
  $('view').hidden = !now;
  if (!now) return;
  const { brief } = now, running = now.state === 'running';
  const units = page.sheet?.units;
  $('title').textContent = `job ${now.job}: ${now.title}`;
  $('cancel').hidden = !(running || now.state === 'queued');
  $('progress').hidden = !running;
  $('progress').value = brief?.share ?? 0;
  const facts = [['state', running && now.waits_for ? `waits for ${now.waits_for}` : now.state === 'queued' && now.waits_for ? `queued, waits for ${now.waits_for}` : now.state]];
  if (running && brief) facts.push(['progress', `${(brief.share * 100).toFixed(1)} %`], ['time left', lists.seconds(brief.eta_s)], ['cycles/s', lists.number(brief.rate, 3)]);
  if (now.cycle) facts.push(['cycle', String(now.cycle)], ['time', `${lists.number(now.time, 5)} ${units?.time ?? ''}`]);
  if (running && brief?.dt) facts.push(['time step', `${lists.number(brief.dt, 3)} ${units?.time ?? ''}`]);
  if (brief) facts.push(['elements', brief.elements.toLocaleString('en')]);
  if (brief?.imbalance) facts.push(['imbalance, measured', brief.imbalance.toFixed(3)]);
  if (now.ended?.digest) facts.push(['digest', now.ended.digest]);
  lists.facts($('facts'), facts);
  $('failure').hidden = !now.ended?.failure;
  $('failure').textContent = now.ended?.failure ?? '';
}

async function sheet() {
  const number = page.chosen, now = chosenJob();
  if (number === null || page.asking) return;
  if (!now || now.state === 'queued') {
    $('panels').hidden = true;
    $('unkept').hidden = !now;
    $('unkept').textContent = 'Curves and bodies come when the job runs.';
    return;
  }
  if (page.sheet && page.sheet.final) return;
  const final = now.state !== 'running';
  page.asking = true;
  try {
    const sheet = await (await ask(`api/jobs/${number}/sheet`)).json();
    if (number !== page.chosen) return;
    sheet.final = final;
    page.sheet = sheet;
    $('panels').hidden = false;
    $('unkept').hidden = true;
    fields();
    job();
    panels();
    await states();
  } catch (error) {
    if (number !== page.chosen) return;
    $('unkept').hidden = false;
    $('unkept').textContent = error.message;
  } finally {
    page.asking = false;
    if (number !== page.chosen) sheet();
  }
}

function fields() {
  const select = $('field');
  if (select.options.length) return;
  page.sheet.fields.forEach((name, i) => select.append(new Option(FIELD_NAMES[name] ?? name, i)));
  select.value = String(Math.max(0, page.sheet.fields.indexOf('speed')));
}

function panels() {
  const { energies, imbalance, units, workers, phases } = page.sheet;
  const latest = energies.at(-1);
  // All shares of the sum; where nothing erodes or strikes a wall one is zero throughout.
  const series = SERIES.filter(s => !['eroded', 'wall_loss'].includes(s.key) || energies.some(p => p[s.key]));
  curves.draw($('energies'), {
    x: energies.map(p => p.time), xName: `time (${units.time})`, yName: units.energy,
    series: series.map(s => ({ ...s, y: energies.map(p => p[s.key]) })),
  });
  $('energies').setAttribute('aria-label', latest
    ? `Energies in ${units.energy} at ${lists.number(latest.time)} ${units.time}: ${series.map(s => `${s.name} ${lists.number(latest[s.key], 3)}`).join(', ')}`
    : 'Energies: no points yet');
  legend(series, latest);
  const smooth = runningMedian(imbalance.map(p => p[1]));
  curves.draw($('balance'), {
    x: imbalance.map(p => p[0]), xName: 'cycle', yName: '', floor: [1, 1.2],
    series: [{ colour: '--c0', y: smooth }],
  });
  const ratio = page.sheet.brief.imbalance;
  $('balance').setAttribute('aria-label', ratio ? `Imbalance over ${imbalance.length} cycles, lately ${ratio.toFixed(3)}` : 'Imbalance: no points yet');
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

// Medians of five: single cycles are ruled by whatever else the machines do.
function runningMedian(list) {
  return list.map((_, i) => list.slice(Math.max(0, i - 2), i + 3).sort((a, b) => a - b)).map(w => w[w.length >> 1]);
}

function legend(series, latest) {
  const parent = $('legend');
  if (parent.children.length !== series.length) {
    parent.replaceChildren();
    for (const { name, colour, dash } of series) {
      const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      const line = document.createElementNS('http://www.w3.org/2000/svg', 'line');
      for (const [key, value] of Object.entries({ x1: 0, x2: 22, y1: 4, y2: 4, 'stroke-width': 2, 'stroke-dasharray': (dash ?? []).join(' ') })) line.setAttribute(key, value);
      line.style.stroke = `var(${colour})`;
      svg.append(line);
      parent.append(lists.element('li', {}, svg, lists.element('span', { textContent: name })));
    }
  }
  series.forEach(({ key, name }, i) => {
    parent.children[i].lastChild.textContent = latest ? `${name} ${lists.number(latest[key], 3)}` : name;
  });
}

async function states() {
  const { states } = page.sheet, slider = $('state');
  slider.max = String(Math.max(0, states.length - 1));
  slider.disabled = $('play').disabled = states.length < 2;
  if (page.follow) slider.value = slider.max;
  await surface();
}

async function surface() {
  if (!bodies.gl || !page.sheet?.states.length) return;
  const number = page.chosen, index = Number($('state').value), state = page.sheet.states[index];
  if (!state) return;
  // States may be thinned out or taken back: the cycle, not the index, names one.
  let kept = page.surfaces.get(state.cycle);
  if (!kept) {
    try {
      kept = unpack(await (await ask(`api/jobs/${number}/surface/${index}`)).arrayBuffer());
    } catch (error) {
      $('at').textContent = error.message;
      return;
    }
    if (number !== page.chosen) return;
    page.surfaces.set(kept.cycle, kept);
    if (page.surfaces.size > 100) page.surfaces.delete(page.surfaces.keys().next().value);
  }
  const { units } = page.sheet, field = Number($('field').value);
  bodies.show(kept, field, page.shown === null);
  page.shown = kept.cycle;
  const [low, high] = kept.ranges[field];
  $('low').textContent = lists.number(low, 3);
  $('high').textContent = lists.number(high, 3);
  $('at').textContent = `${lists.number(kept.time, 4)} ${units.time}, cycle ${kept.cycle}`;
  $('state').setAttribute('aria-valuetext', $('at').textContent);
}

/// Submits a deck, which may come with the files that it names.
async function submit(coming) {
  const box = $('faults');
  box.hidden = true;
  let deck = { name: '', text: '', texts: new Map() };
  try {
    deck = files.bundle(await coming);
    const { name, text } = deck;
    const query = new URLSearchParams({ name, min_workers: $('min-workers').value || '1' });
    if ($('cycles').value) query.set('cycles', $('cycles').value);
    const { job } = await (await ask(`api/jobs?${query}`, { method: 'POST', body: text })).json();
    page.overview = await (await ask('api/overview')).json();
    choose(job);
    if (innerWidth < 860) $('job').scrollIntoView();
  } catch (error) {
    if (error.faults) lists.faults(box, deck.name, error.faults, deck.texts);
    else lists.say(box, [deck.name, error.message].filter(Boolean).join(': '));
  }
  $('file').value = '';
}

function start() {
  const drop = $('drop');
  const image = new ImageData(new Uint8ClampedArray(ramp()), 256, 1);
  [$('ramp').width, $('ramp').height] = [256, 1];
  $('ramp').getContext('2d').putImageData(image, 0, 0);
  // A file that misses the box must not replace the page.
  for (const kind of ['dragover', 'drop']) addEventListener(kind, event => event.preventDefault());
  addEventListener('dragover', () => drop.classList.add('over'));
  addEventListener('dragleave', event => event.relatedTarget ?? drop.classList.remove('over'));
  addEventListener('drop', event => {
    drop.classList.remove('over');
    // What is dropped is to be taken before this call ends.
    if (event.dataTransfer.files.length) submit(files.dropped(event.dataTransfer));
  });
  $('file').addEventListener('change', event => event.target.files.length && submit(files.read([...event.target.files])));
  $('field').addEventListener('change', surface);
  $('reset').addEventListener('click', () => bodies.fit());
  $('state').addEventListener('input', () => {
    page.follow = $('state').value === $('state').max;
    surface();
  });
  let playing = null;
  $('play').addEventListener('click', () => {
    const stop = () => { clearInterval(playing); playing = null; $('play').textContent = '▶'; $('play').ariaLabel = 'Play the states'; };
    if (playing) return stop();
    const slider = $('state');
    if (slider.value === slider.max) slider.value = '0';
    $('play').textContent = '⏸';
    $('play').ariaLabel = 'Pause';
    playing = setInterval(async () => {
      if (slider.value === slider.max) return stop();
      slider.value = String(Number(slider.value) + 1);
      page.follow = slider.value === slider.max;
      await surface();
    }, 200);
  });
  // One click asks, a second one within five seconds ends the job.
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
    try {
      await ask(`api/jobs/${page.chosen}/cancel`, { method: 'POST' });
    } catch (error) {
      lists.say($('faults'), error.message);
    }
  });
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
  const redraw = () => { if (page.sheet && !$('panels').hidden) { panels(); bodies.draw?.(); } };
  addEventListener('resize', redraw);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
  listen();
  setInterval(() => document.hidden || sheet(), 1000);
}

start();
