// Requests to the program behind the page, wherever in it the page stands.

/// The address below which the page and its API are.
export const root = new URL('.', import.meta.url);

export const address = path => new URL(path, root).href;

/// What is behind the page, in words; `bolide report` serves it too.
export const behind = { name: 'the master' };

/// The longest (ms) until an answer begins, and more for a deck, which has to arrive and waits for others that are read: by its characters.
const ANSWER_LIMIT = 30e3, DECK_LIMIT = 120e3, MS_OF_A_CHARACTER = 0.01;

/// Asks, and gives up when no answer begins in time; what is sent may have been taken all the same.
async function begin(path, options) {
  const text = options?.body, limit = text === undefined ? ANSWER_LIMIT : DECK_LIMIT + text.length * MS_OF_A_CHARACTER;
  const giveUp = new AbortController(), timer = setTimeout(() => giveUp.abort(), limit);
  try {
    return await fetch(address(path), { ...options, signal: giveUp.signal });
  } catch {
    const words = giveUp.signal.aborted ? ` within ${Math.round(limit / 1e3)} s` : '';
    throw new Error(`${behind.name} does not answer${words}${options?.method === 'POST' ? '; look at the list of jobs before you try again' : ''}`);
  } finally {
    clearTimeout(timer);
  }
}

/// Asks; what is refused is thrown with the reason, and the faults of a deck with those.
export async function ask(path, options) {
  const answer = await begin(path, options);
  if (answer.ok) return answer;
  const text = await answer.text();
  let body = { error: text.trim() || `the program answers ${answer.status}` };
  try { body = JSON.parse(text); } catch { /* A plain sentence. */ }
  throw Object.assign(new Error(body.error ?? 'the deck has faults'), { faults: body.faults });
}

export const json = async (path, options) => (await ask(path, options)).json();
