import assert from 'node:assert/strict';
import test from 'node:test';
import { Jog, KEEP_MS, type Held } from '../../src/rig/jog';

/** A stage that answers when it is told to, and a clock that is turned by hand. */
function bench() {
  const sent: string[] = [];
  const answers: { words: string; yes: () => void; no: (fault: Error) => void }[] = [];
  let now = 0;
  let act: (() => void) | null = null;
  let allowed = true;
  const shown: (Held | null)[] = [];
  const faults: unknown[] = [];
  const order = (words: string): Promise<unknown> => {
    sent.push(words);
    return new Promise((yes, no) => answers.push({ words, yes: () => yes(null), no }));
  };
  let first = 0;
  const name = (id: number): number => id - (first ||= id);
  const jog = new Jog(
    {
      jog: (id, direction, fast) => order(`jog ${name(id)} ${direction} ${fast ? 'fast' : 'slow'}`),
      keep: (id) => order(`keep ${name(id)}`),
      release: (id) => order(`release ${name(id)}`),
    },
    () => allowed,
    (held) => shown.push(held),
    (fault) => faults.push(fault),
    {
      now: () => now,
      every: (ms, tick) => {
        assert.equal(ms, KEEP_MS);
        act = tick;
        return () => (act = null);
      },
    },
  );
  return {
    jog,
    sent,
    answers,
    shown,
    faults,
    forbid: () => (allowed = false),
    /** Time goes on by `ms`, with the ticks that fall into it; `frozen` without them but the last. */
    wait: (ms: number, frozen = false) => {
      for (let passed = 0; passed < ms; passed += KEEP_MS) {
        now += KEEP_MS;
        if (!frozen || passed + KEEP_MS >= ms) act?.();
      }
    },
    settle: () => new Promise((resolve) => setImmediate(resolve)),
    ticking: () => act !== null,
  };
}

async function holding() {
  const b = bench();
  b.jog.hold(1, false);
  b.answers[0]!.yes();
  await b.settle();
  b.wait(200);
  assert.deepEqual(b.sent, ['jog 0 1 slow', 'keep 0', 'keep 0']);
  return b;
}

test('a hold is kept every 100 ms and released once', async () => {
  const b = await holding();
  b.jog.end();
  b.jog.end();
  b.wait(1000);
  assert.deepEqual(b.sent.slice(3), ['release 0']);
  assert.equal(b.shown.at(-1), null);
  assert.equal(b.ticking(), false);
});

test('nothing is kept before the jog is answered, and an early release is said again', async () => {
  const b = bench();
  b.jog.hold(-1, true);
  b.wait(300);
  b.jog.end();
  assert.deepEqual(b.sent, ['jog 0 -1 fast', 'release 0']);
  b.answers[0]!.yes();
  await b.settle();
  assert.deepEqual(b.sent.slice(2), ['release 0']);
});

test('a refused jog ends and tells why', async () => {
  const b = bench();
  b.jog.hold(1, false);
  b.answers[0]!.no(new Error('not connected'));
  await b.settle();
  assert.equal((b.faults[0] as Error).message, 'not connected');
  assert.equal(b.ticking(), false);
});

test('a refused keep ends the hold for good', async () => {
  const b = await holding();
  b.answers[2]!.no(new Error('at the limit'));
  await b.settle();
  b.wait(500);
  assert.deepEqual(b.sent.slice(3), ['release 0']);
  assert.equal(b.faults.length, 1);
});

test('what is not allowed any more ends, and what is not allowed does not begin', async () => {
  const b = await holding();
  b.forbid();
  b.wait(500);
  assert.deepEqual(b.sent.slice(3), ['release 0']);
  b.jog.hold(1, false);
  assert.equal(b.sent.length, 4);
});

test('a frozen page does not go on', async () => {
  const b = await holding();
  b.wait(2000, true);
  assert.deepEqual(b.sent.slice(3), ['release 0']);
});

test('a second hold ends the first and begins nothing', async () => {
  const b = await holding();
  b.jog.hold(-1, false);
  assert.deepEqual(b.sent.slice(3), ['release 0']);
  b.jog.hold(-1, false);
  assert.deepEqual(b.sent.slice(4), ['jog 1 -1 slow']);
});

test('answers of an old hold do not touch the new one', async () => {
  const b = await holding();
  b.jog.end();
  b.jog.hold(1, true);
  b.answers.find(({ words }) => words === 'keep 0')!.no(new Error('late'));
  await b.settle();
  assert.ok(b.ticking());
  assert.equal(b.faults.length, 0);
});
