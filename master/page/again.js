// A block of the newest checkpoint, computed a third time: by this browser, after a worker and the master.

import { address, ask, json } from './ask.js';
import { element, number } from './lists.js';
import { recompute } from './recompute.mjs';

const $ = id => document.getElementById(id);
/// The job that the words are of, and whether a block is being computed.
let shown = null, computing = false;

/// Offers the newest block of a job; `proved` is what the sheet says of it, if there is one.
export function offer(job, proved) {
  $('again-box').hidden = !proved;
  if (!proved || computing && job === shown) return;
  $('again-file').href = address(`api/jobs/${job}/sample`);
  $('again-run').onclick = () => compare(job, proved);
  // What was computed stays until it is asked for again, or another job is chosen.
  if (job === shown && $('again-hashes').children.length) return;
  shown = job;
  const { worker, part, cycle, elements } = proved;
  $('again-of').textContent = `${elements} elements of part ${part}, as worker ${worker} computed them in cycle ${cycle}. ` +
    'The checkpoint has their state; this browser computes what they come to, with the same physics, and believes no other machine.';
  $('again-hashes').replaceChildren();
  say('', '');
}

async function compare(job, offered) {
  computing = true;
  $('again-run').disabled = true;
  say('computing', '');
  try {
    const [module, block] = await Promise.all(['recompute.wasm', `api/jobs/${job}/sample`].map(async path => (await ask(path)).arrayBuffer()));
    const from = performance.now();
    const { cycle, elements, hash } = await recompute(module, block);
    const took = performance.now() - from;
    // The run went on meanwhile: what the master says of the block that it gave.
    const proved = cycle === offered.cycle ? offered : (await json(`api/jobs/${job}/sheet`)).proved;
    if (cycle !== proved?.cycle) throw new Error('another block came meanwhile: compute again');
    if (job !== shown) return;
    $('again-of').textContent = `${elements} elements of part ${proved.part} in cycle ${cycle}, in ${number(took, 3)} ms here.`;
    $('again-hashes').replaceChildren(...[[`worker ${proved.worker}, master`, proved.hash], ['this browser', hash]].flatMap(
      ([who, text]) => [element('dt', { textContent: who }), element('dd', {}, element('code', { textContent: text }))]));
    if (hash === proved.hash) say('the same bits', 'good');
    else say('OTHER BITS: keep out that worker, or this browser', 'bad');
  } catch (error) {
    if (job === shown) say(error.message, 'bad');
  } finally {
    computing = false;
    $('again-run').disabled = false;
  }
}

function say(words, grade) {
  $('again-verdict').textContent = words;
  $('again-verdict').className = grade;
}
