// The token comes in the fragment of the link that epirig prints. It must not stay in the address, since
// people copy addresses; a reload of the same tab finds it in sessionStorage.

const KEY = 'epirig-token';

/** Splits a fragment into the token, if it holds one, and the rest. */
export function splitToken(fragment: string): { token: string | null; rest: string } {
  const match = /(^#?|[&?])token=([^&]*)/.exec(fragment);
  if (!match) return { token: null, rest: fragment };
  const opener = match[1] === '?' ? '?' : '';
  const rest = fragment.replace(match[0], opener).replace('?&', '?').replace(/[?#]$/, '');
  return { token: decodeURIComponent(match[2] ?? ''), rest };
}

let kept = '';

/** Takes the token out of the address; call it before anything else reads the address. */
export function takeToken(): void {
  const { token, rest } = splitToken(location.hash);
  kept = token ?? sessionStorage.getItem(KEY) ?? '';
  if (token === null) return;
  sessionStorage.setItem(KEY, token);
  history.replaceState(null, '', location.pathname + location.search + rest);
}

/** The token, or '' if there is none. */
export function token(): string {
  return kept;
}
