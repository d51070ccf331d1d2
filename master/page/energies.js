// The panels of energies and of the imbalance.

import * as curves from './curves.js';
import * as lists from './lists.js';

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

export function draw(sheet) {
  const { energies, imbalance, units } = sheet;
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
  curves.legend($('legend'), series.map(s => ({ ...s, words: latest ? `${s.name} ${lists.number(latest[s.key], 3)}` : s.name })));
  // Of a job that is over no second point comes.
  const hidden = imbalance.length < (sheet.final ? 2 : 1);
  $('balance').parentElement.hidden = hidden;
  if (hidden) return;
  curves.draw($('balance'), {
    x: imbalance.map(p => p[0]), xName: 'cycle', yName: '', floor: [1, 1.2],
    series: [{ colour: '--c0', y: runningMedian(imbalance.map(p => p[1])) }],
  });
  const ratio = sheet.brief.imbalance ?? imbalance.at(-1)[1];
  $('balance').setAttribute('aria-label', ratio ? `Imbalance over ${imbalance.length} cycles, lately ${ratio.toFixed(3)}` : 'Imbalance: no points yet');
}

// Medians of five: single cycles are ruled by whatever else the machines do.
function runningMedian(list) {
  return list.map((_, i) => list.slice(Math.max(0, i - 2), i + 3).sort((a, b) => a - b)).map(w => w[w.length >> 1]);
}
