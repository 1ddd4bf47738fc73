// A small server with the interface of `epirig view`, for tests of the page without the program.

import { readFile } from 'node:fs/promises';
import { createServer, type IncomingMessage, type Server, type ServerResponse } from 'node:http';
import { fileURLToPath } from 'node:url';
import { regionInNumbers } from './levelling';
import * as replies from './replies';
import { pictureOf, SEQUENCES, sequenceList, trendOf } from './sequences';
import { frameAt } from './truth';
import type { TrendQuestion } from '../../src/api';

export const TOKEN = 'mock-token-1234';
/** EPIRIG_PAGE is a folder with another build, such as one that is not committed yet. */
const PAGE = process.env.EPIRIG_PAGE
  ? `${process.env.EPIRIG_PAGE}/`
  : fileURLToPath(new URL('../../../crates/server/page/', import.meta.url));
const POLICY =
  "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; worker-src 'self' blob:";
const TYPES: Record<string, string> = { html: 'text/html', js: 'text/javascript', css: 'text/css' };

function sendJson(reply: ServerResponse, value: unknown, status = 200): void {
  const text = JSON.stringify(value, (_key, one: unknown) =>
    typeof one === 'number' && !Number.isFinite(one) ? null : one,
  );
  reply.writeHead(status, { 'content-type': 'application/json' }).end(text);
}

function sendBytes(reply: ServerResponse, bytes: Uint8Array, type = 'application/octet-stream'): void {
  reply.writeHead(200, { 'content-type': type }).end(bytes);
}

function sendFramed(reply: ServerResponse, [head, values]: [object, Float32Array]): void {
  let text = JSON.stringify(head);
  while ((4 + Buffer.byteLength(text)) % 4 !== 0) text += ' ';
  const length = Buffer.alloc(4);
  length.writeUInt32LE(Buffer.byteLength(text));
  sendBytes(reply, Buffer.concat([length, Buffer.from(text), Buffer.from(values.buffer)]));
}

function sendTile(reply: ServerResponse, values: Float32Array | null): void {
  if (values) sendBytes(reply, Buffer.from(values.buffer));
  else sendJson(reply, { error: { message: 'There is no such map.' } }, 404);
}

/** What was asked for, or why there is none. */
function sendFound(reply: ServerResponse, found: unknown, none: string): void {
  if (found) sendJson(reply, found);
  else sendJson(reply, { error: { message: none } }, 400);
}

// The smallest PNG: one grey pixel.
const PNG = Buffer.from(
  'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg==',
  'base64',
);

/** Sequences that tests ask about: those of the server, and a great many. */
const MANY = sequenceList(1000);

function answerOfSequences(name: string | undefined, asked: unknown, reply: ServerResponse): void {
  if (name === undefined) return sendJson(reply, SEQUENCES);
  if (name === 'trend') {
    const question = asked as TrendQuestion;
    const few = new Set(SEQUENCES.map((entry) => entry.name));
    const list = question.sequences.some((one) => !few.has(one)) ? MANY : SEQUENCES;
    return sendJson(reply, trendOf(question, list));
  }
  if (name === 'compare') {
    const [head, values] = replies.compare();
    const scan = { shift_px: [1.42, -0.61], turn_deg: 0.012, places: 2 };
    return sendFramed(reply, [{ ...head, scan }, values]);
  }
  reply.setHeader('cache-control', 'private, max-age=31536000, immutable');
  sendBytes(reply, pictureOf(name), 'image/png');
}

function answer(path: string, query: URLSearchParams, asked: unknown, reply: ServerResponse): void {
  const number = (name: string): number => Number(query.get(name));
  const parts = path.split('/').slice(2);
  const numbers = parts.map(Number);
  const by = query.get('levelled_by');
  switch (parts[0]) {
    case 'about': {
      // As `epirig ui` says it, for tests with a rig of their own: `?mode=ui`, and `&sequence=` for none.
      const ui = query.get('mode') === 'ui';
      return sendJson(reply, {
        program: 'epirig',
        version: '0.0.0',
        mode: ui ? 'ui' : 'view',
        rig: ui,
        may_control: ui,
        results: 'mock',
        sequence: query.has('sequence') ? query.get('sequence') || null : 'mock-0042',
      });
    }
    case 'results':
      return sendJson(reply, replies.results());
    case 'maps':
      return sendTile(reply, replies.mapTile(parts[1]!, numbers[2]!, numbers[3]!, numbers[4]!, by));
    case 'frames': {
      const at = (x: number, y: number): number => frameAt(numbers[1]!, x, y);
      return sendTile(reply, replies.tile(at, false, numbers[2]!, numbers[3]!, numbers[4]!));
    }
    case 'pixel':
      return sendFramed(reply, replies.pixel(number('x'), number('y'), by));
    case 'value': {
      const value = replies.value(query);
      if (value) return sendJson(reply, value);
      return sendJson(reply, { error: { message: 'There is no such map.' } }, 404);
    }
    case 'row-cost':
      return sendFramed(reply, replies.rowCost(number('y')));
    case 'line':
      return sendJson(reply, replies.line(query));
    case 'line.csv': {
      const info = replies.line(query);
      return sendBytes(reply, Buffer.from(replies.lineCsv(info)), 'text/csv');
    }
    case 'levelled':
      return sendFound(reply, by && replies.levelled(by), 'The three points lie in a line.');
    case 'region': {
      const corners = ['x0', 'y0', 'x1', 'y1'].map(number) as [number, number, number, number];
      return sendFound(reply, regionInNumbers(corners, by), 'The pixels of the region determine no plane.');
    }
    case 'surface':
      return sendJson(reply, replies.SURFACE);
    case 'trends':
      return sendJson(reply, [
        { name: 'constant', title: 'level' },
        { name: 'plane', title: 'level and tilt' },
        { name: 'quadric', title: 'level, tilt and bow' },
      ]);
    case 'mesh':
      return sendFramed(reply, replies.mesh(by));
    case 'compare':
      return sendFramed(reply, replies.compare());
    case 'sequences':
      return answerOfSequences(parts[1], asked, reply);
    case 'stage':
      return sendJson(reply, replies.stage());
    case 'calibration':
      if (parts[1]) return sendBytes(reply, PNG, 'image/png');
      return sendJson(reply, replies.CALIBRATION);
    case 'downloads':
      return sendJson(reply, [
        { name: 'height.tiff', title: 'Height map, float TIFF', bytes: 1228800 },
        { name: 'match.json', title: 'Settings and results in numbers', bytes: 5120 },
      ]);
    case 'download':
      return sendBytes(reply, Buffer.from(`contents of ${parts[1]}`));
    default:
      return sendJson(reply, { error: { message: `There is no ${path}.` } }, 404);
  }
}

async function sendPage(path: string, reply: ServerResponse): Promise<void> {
  const name = path === '/' ? 'index.html' : path.slice(1);
  const type = TYPES[name.split('.').pop() ?? ''];
  if (!type || name.includes('/')) {
    reply.writeHead(404).end();
    return;
  }
  try {
    const bytes = await readFile(PAGE + name);
    reply.writeHead(200, { 'content-type': type, 'content-security-policy': POLICY }).end(bytes);
  } catch {
    reply.writeHead(404).end();
  }
}

function handle(request: IncomingMessage, reply: ServerResponse): void {
  const address = new URL(request.url ?? '/', 'http://mock');
  if (!address.pathname.startsWith('/api/')) {
    void sendPage(address.pathname, reply);
    return;
  }
  if (request.headers['x-epirig-token'] !== TOKEN) {
    sendJson(
      reply,
      { error: { message: 'The token is missing. Open the link that epirig printed.' } },
      401,
    );
    return;
  }
  // As the program, it decodes nothing.
  const pairs = address.search
    .slice(1)
    .split('&')
    .filter((pair) => pair.includes('='));
  const query = new URLSearchParams(pairs.map((pair) => pair.split('=', 2)));
  const parts: Buffer[] = [];
  request.on('data', (part: Buffer) => parts.push(part));
  request.on('end', () => {
    const text = Buffer.concat(parts).toString();
    answer(address.pathname, query, text ? JSON.parse(text) : null, reply);
  });
}

export function startMock(port: number): Promise<Server> {
  const server = createServer(handle);
  return new Promise((resolve) => server.listen(port, '127.0.0.1', () => resolve(server)));
}
