// What a run came to: the verdict on its quality, its measures, those of another run beside them, and its files.

import { address, json } from './ask.js';
import * as lists from './lists.js';

const $ = id => document.getElementById(id);
/// What the well-known files are.
const KINDS = {
  'report.html': 'report, opens here', 'summary.json': 'the numbers of the run', 'history.csv': 'curves, a row for every few cycles',
  'input.deck': 'the deck with all that it names', 'results.pvd': 'opens all states in ParaView', 'checksums.json': 'for bolide verify',
  'trace.json': 'what the workers did, for Perfetto',
};

/// The summary of a job that is over; null where it has none.
async function summary(number) {
  return (await json(`api/jobs/${number}`)).ended?.summary ?? null;
}

const norm = v => Math.hypot(...v);

/// Rows of a table: a name, its unit by the units of a run (null without one), and how a summary tells it.
function rows(summaries) {
  const parts = [...new Set(summaries.flatMap(s => s.energies.parts.map(part => part.name)))].slice(0, 12);
  const of = (s, name) => s.energies.parts.find(part => part.name === name);
  const speed = part => part?.mass > 0 ? norm(part.momentum) / part.mass : undefined;
  const energy = u => u.energy, length = u => u.length, time = u => u.time, mass = u => u.mass, speeds = u => `${length(u)}/${time(u)}`;
  return [
    ['cycles', null, s => s.cycles], ['end', time, s => s.end_time], ['elements', null, s => s.elements], ['eroded elements', null, s => s.eroded_elements],
    ['kinetic energy', energy, s => s.energies.kinetic], ['internal energy', energy, s => s.energies.internal],
    ['hourglass energy', energy, s => s.energies.hourglass], ['contact and friction', energy, s => s.energies.contact],
    ['eroded energy', energy, s => s.eroded_energy], ['energy error (%)', null, s => 100 * s.energies.error],
    ['worst depth of contact (gaps)', null, s => s.worst_penetration],
    ...parts.map(name => [`${name}: mean speed`, speeds, s => speed(of(s, name))]),
    ...parts.map(name => [`${name}: mass`, mass, s => of(s, name)?.mass]),
    ...parts.map(name => [`${name}: internal energy`, energy, s => of(s, name)?.internal]),
    ['time of the run (s)', null, s => s.wall_s],
  ];
}

/// Shows a job that is over, beside another one or none: `{ job, sheet }` each.
export async function draw(chosen, beside) {
  const number = chosen.job, [one, other] = await Promise.all([chosen, beside].filter(Boolean).map(run => summary(run.job)));
  $('outcome').hidden = !one;
  if (!one) return;
  const { quality, warnings, origin } = one;
  // Numbers in other units are not compared: each stands with its unit.
  const alike = !other || JSON.stringify(chosen.sheet.units) === JSON.stringify(beside.sheet.units);
  // Of a run that could not begin nothing can be judged.
  const grade = quality.measures.length ? quality.grade : '';
  $('verdict').textContent = { good: 'good', look: 'look at some measures', bad: 'doubtful' }[grade] ?? 'not computed';
  $('verdict').className = grade;
  $('measures').replaceChildren(
    ...quality.measures.map(({ grade, name, words, advice }) => lists.element('li', { className: grade },
      lists.element('b', { textContent: grade }), ` ${name}: ${words}${advice ? `. ${advice}` : ''}`)),
    ...warnings.map(words => lists.element('li', { className: 'look' }, lists.element('b', { textContent: 'warning' }), ` ${words}`)),
    ...alike ? [] : [lists.element('li', { className: 'look' }, lists.element('b', { textContent: 'look' }),
      ` job ${beside.job} has other units than job ${number}, so what is not in the same unit is not compared`)],
    lists.element('li', { textContent: `bolide ${origin.version}, ${origin.date}, ${origin.deck}, on ${origin.machine}` }));
  const tell = v => v === undefined ? '–' : lists.number(v, 6);
  const list = rows([one, other].filter(Boolean)).map(([name, unit, of]) => {
    const values = [one, other].filter(Boolean).map(of);
    const own = unit && other && [chosen, beside].map(run => unit(run.sheet.units));
    if (own && own[0] !== own[1]) return [name, ...values.map((v, i) => v === undefined ? tell(v) : `${tell(v)} ${own[i]}`), ''];
    const heading = unit ? `${name} (${unit(chosen.sheet.units)})` : name;
    if (!other) return [heading, tell(values[0])];
    const [a, b] = values, change = a === b ? 'equal' : a && b !== undefined ? `${lists.number(100 * (b - a) / Math.abs(a), 3)} %` : '';
    return [heading, tell(a), tell(b), change];
  });
  if (other) list.push(['digest', one.digest, other.digest, one.digest === other.digest ? 'equal' : 'differs']);
  lists.table($('measured-head'), [other ? ['measure', `job ${number}`, `job ${beside.job}`, 'change'] : ['measure', `job ${number}`]], 'th');
  lists.table($('measured'), list);
}

/// Lists the files of a job.
export async function files(number) {
  const parent = $('files');
  $('all-files').href = address(`api/jobs/${number}/results.tar`);
  let list;
  try {
    list = await json(`api/jobs/${number}/files`);
  } catch (error) {
    parent.replaceChildren(lists.element('li', { textContent: error.message }));
    $('all-files').hidden = true;
    return;
  }
  $('all-files').hidden = !list.length;
  const states = list.filter(file => /^(state|contact)-\d+\.vt[up]$/.test(file.name)), others = list.filter(file => !states.includes(file));
  const item = ({ name, bytes }) => {
    const link = lists.element('a', { href: address(`api/jobs/${number}/files/${name}`), textContent: name });
    if (name === 'report.html') link.target = '_blank';
    else link.setAttribute('download', name);
    return lists.element('li', {}, link, ` ${lists.bytes(bytes)}`, lists.element('small', { textContent: KINDS[name] ? `, ${KINDS[name]}` : '' }));
  };
  const made = others.map(item);
  if (states.length) {
    const inside = lists.element('ul', {}, ...states.map(item));
    const total = lists.bytes(states.reduce((sum, file) => sum + file.bytes, 0));
    made.push(lists.element('li', {}, lists.element('details', {}, lists.element('summary', { textContent: `${states.length} ${states.length === 1 ? 'file' : 'files'} of states, ${total}` }), inside)));
  }
  // Rebuilding would close what is open and take the focus away.
  const now = list.map(({ name, bytes }) => `${number}/${name}/${bytes}`).join();
  if (parent.dataset.list === now) return;
  parent.dataset.list = now;
  const open = parent.querySelector('details')?.open;
  parent.replaceChildren(...made);
  if (open && parent.querySelector('details')) parent.querySelector('details').open = true;
}
