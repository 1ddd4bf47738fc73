// What buttons and keys both do.

import { signal } from '@preact/signals';
import { api } from '../api';
import { refuse, say } from './notices';
import { link } from './selection';

export const keySheetOpen = signal(false);

export async function copyLink(): Promise<void> {
  const text = link();
  try {
    await navigator.clipboard.writeText(text);
    say('Link copied. It shows this view; it holds no token.');
  } catch {
    // Pages that are not on https or loopback may not write to the clipboard.
    prompt('Copy this link:', text);
  }
}

/** Opens the report of the results in a tab of its own. It comes by the page, since links cannot send the token. */
export async function openReport(): Promise<void> {
  // Opened at once: browsers allow no tab later than the click.
  const tab = open('', '_blank');
  try {
    const report = await api.download('surface/report.html');
    const address = URL.createObjectURL(new Blob([report], { type: 'text/html' }));
    if (tab) tab.location.href = address;
    else save(report, 'report.html');
  } catch (error) {
    tab?.close();
    refuse(error);
  }
}

/** Hands a blob to the browser's download. */
export function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  const anchor = document.createElement('a');
  anchor.href = address;
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
