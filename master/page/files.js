// Several dropped files as one text: a deck with its meshes and includes, as `bolide submit` sends it.

/// Every file of a drop, those of folders too: `{ path, text }`.
export async function dropped(transfer) {
  const entries = [...(transfer.items ?? [])].map(item => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.length) return read([...transfer.files]);
  return (await Promise.all(entries.map(entry => walk(entry, '')))).flat();
}

/// Chosen files: `{ path, text }`.
export function read(files) {
  return Promise.all(files.map(async file => ({ path: file.webkitRelativePath || file.name, text: await file.text() })));
}

async function walk(entry, folder) {
  const path = folder + entry.name;
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    return [{ path, text: await file.text() }];
  }
  const reader = entry.createReader();
  const inside = [];
  // A reader gives its entries in pieces, and none at the end.
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break;
    inside.push(...some);
  }
  return (await Promise.all(inside.map(one => walk(one, `${path}/`)))).flat();
}

/// What the lines below *INCLUDE of a keyword deck say.
function included(text) {
  return [...text.matchAll(/^\*include[^\n]*\n((?:[^*\n][^\n]*\n?)*)/gim)].map(found => found[1]).join('\n');
}

/// The deck among files: the TOML deck, or the keyword deck that no other one includes. Throws where that is not one.
export function deckOf(files) {
  const name = file => file.path.split('/').at(-1);
  let decks = files.filter(file => /\.toml$/i.test(file.path));
  // A study of the deck may lie beside it.
  if (decks.length > 1) decks = decks.filter(file => !/\.study\.toml$/i.test(file.path));
  if (!decks.length) {
    const keywords = files.filter(file => /^\s*[*$]/.test(file.text));
    decks = keywords.filter(file => !keywords.some(other => other !== file && included(other.text).includes(name(file))));
  }
  if (decks.length === 1) return decks[0];
  const found = decks.length ? `${decks.length} decks (${decks.map(name).join(', ')})` : 'no deck';
  throw new Error(`${files.length} files with ${found}: drop one deck with the files that it names`);
}

/// The path of a file as it is seen from the folder of the deck.
function seen(path, deck) {
  const [to, from] = [path.split('/'), deck.split('/').slice(0, -1)];
  while (from.length && to.length > 1 && to[0] === from[0]) {
    to.shift();
    from.shift();
  }
  return [...from.map(() => '..'), ...to].join('/');
}

const HEAD = '#bolide-bundle 1\n';
const bytes = words => new TextEncoder().encode(words).length;

/// Texts by name, the deck first, as one text. `options` are lines that a deck needs beside its files.
function joined(texts, options) {
  if (texts.size === 1 && !options.length) return [...texts.values()][0];
  const pieces = [...texts].map(([path, words]) => `file ${bytes(words)} ${path}\n${words}\n`);
  return `${HEAD}${options.map(line => `${line}\n`).join('')}${pieces.join('')}`;
}

/// The deck's name, the text to send, and the text of each file by its name there.
export function bundle(files) {
  const deck = files.length === 1 ? files[0] : deckOf(files);
  const named = [deck, ...files.filter(file => file !== deck)].map(file => [seen(file.path, deck.path), file.text]);
  const texts = new Map(named);
  return { name: named[0][0], text: joined(texts, []), texts, options: [] };
}

/// A text that was sent once, as `bundle` made it or `bolide submit`; `name` is that of a deck of one file.
export function opened(name, text) {
  if (!text.startsWith(HEAD)) return { name, text, texts: new Map([[name, text]]), options: [] };
  const all = new TextEncoder().encode(text), texts = new Map(), options = [];
  const decoder = new TextDecoder();
  let at = HEAD.length;
  while (at < all.length) {
    const end = all.indexOf(10, at), line = decoder.decode(all.subarray(at, end < 0 ? all.length : end)).trim();
    at = end < 0 ? all.length : end + 1;
    const [, length, path] = line.match(/^(?:file|outside) (\d+) (.*)$/) ?? [];
    if (path !== undefined) {
      texts.set(path, decoder.decode(all.subarray(at, at + Number(length))));
      at += Number(length);
    } else if (line) options.push(line);
  }
  return { name: [...texts.keys()][0], text, texts, options };
}

/// A deck with another text in place of its own, the files that it names as they were.
export function changed({ name, texts, options }, text) {
  const now = new Map([...texts].map(([path, words]) => [path, path === name ? text : words]));
  return { name, text: joined(now, options), texts: now, options };
}
