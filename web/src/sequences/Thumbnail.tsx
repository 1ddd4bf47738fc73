import { useEffect, useState } from 'preact/hooks';
import type { SequenceEntry } from '../types';
import { pictureOf } from './pictures';

/** A small picture of a sequence: its heights, or a frame. The name beside it says whose it is. */
export function Thumbnail({ entry: { picture, state } }: { entry: SequenceEntry }) {
  const [address, setAddress] = useState<string | null>(null);
  useEffect(() => {
    if (picture === null) return undefined;
    const here = new AbortController();
    let made: string | null = null;
    void pictureOf(picture, here.signal).then((found) => {
      if (!found || here.signal.aborted) return;
      made = URL.createObjectURL(found);
      setAddress(made);
    });
    return () => {
      here.abort();
      if (made !== null) URL.revokeObjectURL(made);
      setAddress(null);
    };
  }, [picture]);
  const shows = state === 'matched' || state === 'measured' ? 'Heights' : 'Frame';
  return (
    <span class="thumbnail">{address !== null && <img src={address} alt={shows} draggable={false} />}</span>
  );
}
