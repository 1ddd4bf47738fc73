// A picture as it comes: a JSON head, then a byte for each block of pixels.

import type { PictureHead } from './api';

export interface LivePicture {
  head: PictureHead;
  /** 0: the block holds a dark sample; 255: a saturated one; between: grey. */
  bytes: Uint8Array;
  /** When it arrived, in ms of `performance.now()`. */
  arrived: number;
}

/** Takes a message apart; null if it is not whole. */
export function readPicture(message: ArrayBuffer, arrived: number): LivePicture | null {
  if (message.byteLength < 4) return null;
  const length = new DataView(message).getUint32(0, true);
  if (message.byteLength < 4 + length) return null;
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, length))) as PictureHead;
  const bytes = new Uint8Array(message, 4 + length);
  return bytes.length === head.rows * head.columns ? { head, bytes, arrived } : null;
}
