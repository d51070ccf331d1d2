// The head of a job: its title, how it stands, what it can be asked.

import * as lists from './lists.js';

const $ = id => document.getElementById(id);

export function draw(now, sheet, { only_shows: shows }) {
  const { brief } = now, running = now.state === 'running', units = sheet?.units;
  document.title = `job ${now.job}: ${now.title}, Bolide`;
  $('title').textContent = `job ${now.job}: ${now.title}`;
  $('hold').hidden = !(running || now.state === 'queued');
  $('cancel').hidden = $('hold').hidden && now.state !== 'held';
  $('resume').hidden = !(now.state === 'held' || now.state === 'failed');
  $('again').hidden = shows || now.state === 'queued';
  $('progress').hidden = !running;
  $('progress').value = brief?.share ?? 0;
  const facts = [['state', running && now.waits_for ? `waits for ${now.waits_for}` : now.waits_for ? `${now.state}, waits for ${now.waits_for}` : now.state]];
  if (running && brief) facts.push(['time left', lists.seconds(brief.eta_s)], ['progress', `${(brief.share * 100).toFixed(1)} %`], ['cycles/s', lists.number(brief.rate, 3)]);
  if (now.cycle) facts.push(['cycle', String(now.cycle)], ['time', `${lists.number(now.time, 5)} ${units?.time ?? ''}`]);
  if (running && brief?.dt) facts.push(['time step', `${lists.number(brief.dt, 3)} ${units?.time ?? ''}`]);
  if (brief) facts.push(['elements', brief.elements.toLocaleString('en')]);
  if (brief?.imbalance) facts.push(['imbalance, measured', brief.imbalance.toFixed(3)]);
  if (now.ended?.digest) facts.push(['digest', now.ended.digest]);
  lists.facts($('facts'), facts);
  $('failure').hidden = !now.ended?.failure;
  $('failure').textContent = now.ended?.failure ?? '';
}
