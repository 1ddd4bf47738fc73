// The mask of the surface: a picture that a person chose. It is too long for the address.

import { signal } from '@preact/signals';
import type { MaskFile } from '../api';

export const mask = signal<MaskFile | null>(null);

/** Why the chosen file is not the mask; null if it is, or none was chosen. */
export const maskFault = signal<string | null>(null);

let newest = 0;

/** The bytes of a file, as text. */
function base64Of(file: File): Promise<string> {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    // What stands before the comma names the type.
    reader.onload = () => resolve(String(reader.result).replace(/^[^,]*,/, ''));
    reader.onerror = () => reject(reader.error ?? new Error('unknown reason'));
    reader.readAsDataURL(file);
  });
}

/** Takes a file as mask, or none. Of files chosen one after the other the last one counts. */
export async function chooseMask(file: File | null): Promise<void> {
  const mine = (newest += 1);
  maskFault.value = null;
  if (!file) {
    mask.value = null;
    return;
  }
  try {
    const base64 = await base64Of(file);
    if (mine === newest) mask.value = { name: file.name, base64 };
  } catch (error) {
    if (mine !== newest) return;
    mask.value = null;
    const reason = error instanceof Error ? error.message : String(error);
    maskFault.value = `${file.name} cannot be read: ${reason}; choose it again`;
  }
}
