import { useEffect, useRef, useState } from 'preact/hooks';
import { rigState } from '../rig/store';
import { openFeed } from '../rig/socket';
import { pageVisible } from './control';
import { readPicture, type LivePicture } from '../rig/picture_message';
import { drawPicture } from './picture';

const PIXELS = 120_000;

/** A small picture of the camera. It asks for none while the page is hidden. */
export function CameraPicture({ name, live }: { name: string; live: boolean }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [picture, setPicture] = useState<LivePicture | null>(null);
  const visible = pageVisible.value;
  useEffect(() => {
    if (!visible) return undefined;
    const feed = openFeed('api/rig/picture', (message) => {
      if (typeof message !== 'string') setPicture(readPicture(message, performance.now()));
    });
    feed.wish({ pixels: PIXELS, live });
    return () => feed.close();
  }, [visible, live]);
  const target = live ? rigState.value?.target : null;
  useEffect(() => {
    if (canvas.current && picture) drawPicture(canvas.current, picture, target?.corners ?? []);
  }, [picture, target]);
  return (
    <div class="camera-picture">
      <canvas ref={canvas} role="img" aria-label={name} hidden={picture === null} />
      {picture === null && <p class="hint">no picture yet</p>}
    </div>
  );
}
