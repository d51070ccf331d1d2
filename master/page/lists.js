// Jobs, hosts and the facts of a job: tables of text. Nothing from the server is ever read as markup.

export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

export function seconds(s) {
  if (s == null || !isFinite(s)) return '–';
  if (s < 90) return `${s.toFixed(0)} s`;
  if (s < 5400) return `${(s / 60).toFixed(0)} min`;
  return `${(s / 3600).toFixed(1)} h`;
}

export function number(value, digits = 4) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(digits))) : value.toExponential(digits - 1);
}

// Rebuilding would take the focus away: children are kept by key and only changed.
function keyed(parent, list, key, make, update) {
  const have = new Map([...parent.children].map(child => [child.dataset.key, child]));
  list.forEach((item, index) => {
    const name = String(key(item));
    let child = have.get(name);
    if (!child) {
      child = make(item);
      child.dataset.key = name;
    }
    have.delete(name);
    update(child, item);
    if (parent.children[index] !== child) parent.insertBefore(child, parent.children[index] ?? null);
  });
  for (const child of have.values()) child.remove();
}

function set(target, property, value) {
  if (target[property] !== value) target[property] = value;
}

/// Jobs, the newest first; each is a link to its address, which a click follows within the page.
export function jobs(parent, list, chosen, choose, href) {
  keyed(parent, [...list].reverse(), job => job.job, job => {
    const follow = event => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      choose(job.job);
    };
    const button = element('a', { href: href(job.job), className: 'job', onclick: follow },
      element('span', { className: 'top' }, element('b'), element('span')),
      element('span', { className: 'name' }),
      element('progress', { max: 1, 'aria-hidden': 'true' }));
    return element('li', {}, button);
  }, (item, job) => {
    const button = item.firstChild;
    const [name, state] = button.firstChild.children;
    const running = job.state === 'running';
    const eta = running && job.brief?.eta_s != null ? `, ${seconds(job.brief.eta_s)} left` : '';
    set(name, 'textContent', `job ${job.job}`);
    set(state, 'textContent', (running && job.waits_for ? 'waiting' : job.state) + eta);
    set(state, 'className', job.state);
    set(button.children[1], 'textContent', job.title);
    set(button.children[1], 'title', job.title);
    set(button.children[2], 'hidden', !running);
    set(button.children[2], 'value', job.brief?.share ?? 0);
    if (job.job === chosen) button.setAttribute('aria-current', 'page');
    else button.removeAttribute('aria-current');
  });
}

export function hosts(parent, list) {
  keyed(parent, list, host => host.host, () => {
    const row = element('tr');
    for (let i = 0; i < 8; i++) row.append(element('td', { className: i === 2 || i === 4 ? 'n' : '' }));
    row.children[3].append(element('progress', { className: 'load', max: 1, 'aria-hidden': 'true' }), element('span'));
    return row;
  }, (row, host) => {
    const cells = row.children;
    set(cells[0], 'textContent', host.name);
    set(cells[1], 'textContent', host.state);
    set(cells[1], 'className', host.state);
    set(cells[2], 'textContent', number(host.speed, 3));
    set(cells[3].firstChild, 'hidden', host.load == null);
    set(cells[3].firstChild, 'value', host.load ?? 0);
    set(cells[3].lastChild, 'textContent', host.load == null ? '–' : `${Math.round(host.load * 100)} %`);
    set(cells[4], 'textContent', String(host.threads));
    set(cells[5], 'textContent', host.lanes);
    set(cells[6], 'textContent', host.address);
    set(cells[7], 'textContent', host.note);
  });
}

export function facts(parent, pairs) {
  keyed(parent, pairs, pair => pair[0],
    pair => element('div', {}, element('dt', { textContent: pair[0] }), element('dd')),
    (item, [name, value]) => {
      set(item.lastChild, 'textContent', value);
      set(item.lastChild, 'className', name === 'digest' ? name : '');
    });
}

/// Faults of a deck, `name`, at their lines; `texts` has each of its files by name.
export function faults(box, name, list, texts) {
  const items = list.map(fault => {
    const lines = (texts.get(fault.file) ?? '').split('\n');
    const line = lines[fault.line - 1] ?? '';
    const at = Math.max(0, [...line].slice(0, fault.column - 1).join('').length);
    const word = (line.slice(at).match(/^("[^"]*"|[^\s,\]}]+)/) ?? [''])[0];
    const where = fault.file === name ? '' : `${fault.file}, `;
    return element('li', {},
      element('b', { textContent: `${where}line ${fault.line}, column ${fault.column}` }),
      element('pre', {}, line.slice(0, at), element('mark', { textContent: word }), line.slice(at + word.length)),
      `read ${fault.read}; expected ${fault.expected}; ${fault.advice}`);
  });
  const title = `${name}: ${list.length} ${list.length === 1 ? 'fault' : 'faults'}; it cannot run`;
  box.replaceChildren(element('h4', { textContent: title }), element('ol', {}, ...items));
  box.hidden = false;
  box.focus();
}

/// A table of text: rows of cells. What begins like a number, and every heading above such, stands at the right.
export function table(body, rows, kind = 'td') {
  body.replaceChildren(...rows.map(cells => element('tr', {}, ...cells.map((cell, i) => {
    const made = element(kind, { textContent: cell, className: i && (kind === 'th' || /^[-–\d]/.test(cell)) ? 'n' : '' });
    if (kind === 'th') made.setAttribute('scope', 'col');
    return made;
  }))));
}

export function bytes(n) {
  if (n < 1e3) return `${n} B`;
  if (n < 1e6) return `${(n / 1e3).toFixed(1)} kB`;
  if (n < 1e9) return `${(n / 1e6).toFixed(1)} MB`;
  return `${(n / 1e9).toFixed(2)} GB`;
}

export function say(box, words) {
  box.replaceChildren(element('h4', { textContent: words }));
  box.hidden = false;
}
