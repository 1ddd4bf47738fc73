// The title of the page, which tells tabs, prints and bookmarks apart.

import type { ViewName } from '../store/route';

/** What of the rig a title tells. */
export interface Told {
  rig: string;
  scan: { name: string; done: number; planned: number; state: string } | null;
}

/** `37/101 - tile-0042 - epirig` while a scan runs, on every view: what one waits for is said first. */
export function titleOf(shown: ViewName | null, sequence: string | null, rig: Told | null): string {
  const scan = rig?.scan;
  const runs = scan && ['running', 'pausing', 'paused'].includes(scan.state);
  const first = runs ? `${scan.done}/${scan.planned}${scan.state === 'paused' ? ' paused' : ''}` : null;
  const of = {
    rig: [runs ? scan.name : null, 'rig', rig?.rig ?? null],
    scan: [scan?.name ?? null, 'scan'],
    sequences: [runs ? scan.name : null, 'sequences'],
    results: [runs && scan.name !== sequence ? scan.name : null, sequence, 'results'],
  }[shown ?? 'results'];
  return [first, ...of, 'epirig'].filter(Boolean).join(' - ');
}
