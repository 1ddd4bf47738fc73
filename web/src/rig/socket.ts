// A feed of the server: messages over a WebSocket, each acknowledged, so that a slow page gets fewer of
// them and the server never has to wait.

import { signal, type ReadonlySignal } from '@preact/signals';
import { token } from '../store/token';

export interface Feed {
  /** Tells the server what this page wants of the feed; told again after each new connection. */
  wish: (wish: object) => void;
  /** How often it was tried in vain since it was last connected; 0 while it is connected. */
  tries: ReadonlySignal<number>;
  close: () => void;
}

const LONGEST_PAUSE_MS = 4000;

/** Connects to `path`, again and again; `take` gets each message. */
export function openFeed(path: string, take: (message: string | ArrayBuffer) => void): Feed {
  const tries = signal(0);
  let socket: WebSocket | null = null;
  let wished: object | null = null;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let closed = false;

  const connect = (): void => {
    const address = new URL(path, location.href);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    address.hash = '';
    const made = new WebSocket(address, token() ? ['epirig', `token.${token()}`] : ['epirig']);
    made.binaryType = 'arraybuffer';
    socket = made;
    made.onopen = () => {
      tries.value = 0;
      if (wished) made.send(JSON.stringify(wished));
    };
    made.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      take(data);
      if (made.readyState === WebSocket.OPEN) made.send('ok');
    };
    made.onclose = () => {
      if (closed || socket !== made) return;
      tries.value += 1;
      timer = setTimeout(connect, Math.min(500 * tries.peek(), LONGEST_PAUSE_MS));
    };
  };
  connect();
  return {
    wish: (wish) => {
      wished = wish;
      if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(wish));
    },
    tries,
    close: () => {
      closed = true;
      clearTimeout(timer);
      socket?.close();
    },
  };
}
