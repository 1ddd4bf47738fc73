// The colours of both themes; contrasts are in the design reference, section 4.

export interface Palette {
  ground: string;
  raised: string;
  text: string;
  muted: string;
  accent: string;
  ok: string;
  warn: string;
  error: string;
  edge: string;
  hair: string;
  first: string;
  second: string;
}

export const PALETTES: Record<'dark' | 'light', Palette> = {
  dark: {
    ground: '#1a2026',
    raised: '#232b33',
    text: '#e8edf2',
    muted: '#a3afbb',
    accent: '#6cb6ff',
    ok: '#5cc98a',
    warn: '#f2b84b',
    error: '#ff8a80',
    edge: '#5f6b77',
    hair: '#38424c',
    first: '#56b4e9',
    second: '#e69f00',
  },
  light: {
    ground: '#ffffff',
    raised: '#f2f5f8',
    text: '#16202a',
    muted: '#52606d',
    accent: '#0b5cad',
    ok: '#1b6e3c',
    warn: '#8a5300',
    error: '#b3261e',
    edge: '#7a8793',
    hair: '#d5dce3',
    first: '#0072b2',
    second: '#d55e00',
  },
};
