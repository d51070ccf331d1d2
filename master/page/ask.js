// Requests to the program behind the page, wherever in it the page stands.

/// The address below which the page and its API are.
export const root = new URL('.', import.meta.url);

export const address = path => new URL(path, root).href;

/// Asks; what is refused is thrown with the reason, and the faults of a deck with those.
export async function ask(path, options) {
  const answer = await fetch(address(path), options);
  if (answer.ok) return answer;
  const text = await answer.text();
  let body = { error: text.trim() || `the program answers ${answer.status}` };
  try { body = JSON.parse(text); } catch { /* A plain sentence. */ }
  throw Object.assign(new Error(body.error ?? 'the deck has faults'), { faults: body.faults });
}

export const json = async (path, options) => (await ask(path, options)).json();
