import assert from 'node:assert/strict';
import test from 'node:test';
import { changes, choicesOf, fileExists, sortMistakes, visibleKeys } from '../../src/rig/profile_changes';
import { PROFILE } from '../browser/fake_states';

test('only values that differ are changes', () => {
  assert.deepEqual(changes(PROFILE, {}), {});
  assert.deepEqual(changes(PROFILE, { 'plan.step': '0.5 mm', 'plan.start': '' }), {});
  assert.deepEqual(changes(PROFILE, { 'plan.step': ' 1 mm ', 'plan.start': '10 mm' }), {
    'plan.step': '1 mm',
    'plan.start': '10 mm',
  });
});

test('an empty text takes a value away', () => {
  assert.deepEqual(changes(PROFILE, { 'plan.step': ' ' }), { 'plan.step': '' });
});

test('mistakes go to their keys, the others stand alone', () => {
  const { at, other } = sortMistakes(PROFILE, [
    { key: 'plan.step', words: 'no unit' },
    { key: 'plan.step', words: 'too large' },
    { key: 'plan.unknown', words: 'no such key' },
    { key: null, words: 'no lens' },
  ]);
  assert.deepEqual([...at], [['plan.step', ['no unit', 'too large']]]);
  assert.deepEqual(other, ['no such key', 'no lens']);
});

test('keys without effect are hidden unless wanted, changed or wrong', () => {
  const { keys } = PROFILE.sections[0]!;
  const paths = (typed: Record<string, string>, at: Map<string, string[]>, all: boolean): string[] =>
    visibleKeys(keys, typed, at, all).map(({ path }) => path);
  assert.deepEqual(paths({}, new Map(), false), ['stage.driver', 'stage.relative']);
  assert.equal(paths({}, new Map(), true).length, 3);
  assert.equal(paths({ 'stage.port': 'x' }, new Map(), false).length, 3);
  assert.equal(paths({}, new Map([['stage.port', ['wrong']]]), false).length, 3);
});

test('true and false are chosen, quantities are typed', () => {
  const [stage, , plan] = PROFILE.sections;
  assert.deepEqual(choicesOf(stage!.keys[1]!), ['true', 'false']);
  assert.deepEqual(choicesOf(stage!.keys[0]!), ['native', 'grbl', 'zaber', 'sim']);
  assert.equal(choicesOf(plan!.keys[0]!), null);
});

test('a refusal to overwrite is told from others', () => {
  assert.ok(fileExists('/data/bench.toml exists already'));
  assert.ok(!fileExists('/data/bench.toml: no permission'));
});
