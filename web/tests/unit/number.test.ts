import assert from 'node:assert/strict';
import test from 'node:test';
import {
  count,
  interval,
  measured,
  percent,
  readNumber,
  significant,
  spoken,
} from '../../src/format/number';
import { lengthUnit } from '../../src/format/lengths';

test('sigma has two digits and the value the same place', () => {
  assert.equal(measured(0.20031, 0.00123, 'mm'), '0.2003 mm, sigma 0.0012');
  assert.equal(measured(20.44171, 0.00629, 'px'), '20.4417 px, sigma 0.0063');
  assert.equal(measured(1.23456, 0.0996, 'mm'), '1.23 mm, sigma 0.10');
  assert.equal(measured(12345.6, 123, 'DN'), '12350 DN, sigma 120');
  assert.equal(measured(9.96, 9.96, 'px'), '10 px, sigma 10');
});

test('only an interval has the sign for plus or minus', () => {
  assert.equal(interval(0.19966, 0.00787, 'mm'), '0.1997 ± 0.0079 mm');
  assert.equal(interval(0.19966, 0.00787, ''), '0.1997 ± 0.0079');
  assert.equal(interval(0.19966, null, 'mm'), '0.200 mm');
});

test('a sigma larger than the value is shown as it is', () => {
  assert.equal(measured(0.01, 0.5, 'mm'), '0.01 mm, sigma 0.50');
});

test('minus is a real minus, and zero has none', () => {
  assert.equal(measured(-0.2003, 0.0012, 'mm'), '\u22120.2003 mm, sigma 0.0012');
  assert.equal(measured(-0.0001, 0.01, 'mm'), '0.000 mm, sigma 0.010');
});

test('without sigma there are three digits and it says so', () => {
  assert.equal(measured(0.20031, null, 'mm'), '0.200 mm, sigma unknown');
});

test('spoken numbers are words', () => {
  assert.equal(spoken(0.2003, 0.0012, 'mm'), '0.2003 millimetres, sigma 0.0012');
  assert.equal(spoken(-0.2003, 0.0012, 'mm'), 'minus 0.2003 millimetres, sigma 0.0012');
});

test('per cent has two digits and never claims all or nothing', () => {
  assert.equal(percent(0.00412), '0.41 %');
  assert.equal(percent(0.784), '78 %');
  assert.equal(percent(0.9999), '99.9 %');
  assert.equal(percent(0.00001), '< 0.1 %');
  assert.equal(percent(0), '0 %');
});

test('other numbers', () => {
  assert.equal(count(1234567), '1\u2009234\u2009567');
  assert.equal(significant(0.00012345, 3), '0.000123');
  assert.equal(significant(0.0000123, 2), '1.2e\u22125');
  assert.equal(readNumber('\u22120,25'), -0.25);
  assert.equal(readNumber('x'), null);
});

test('small reliefs are in micrometres', () => {
  assert.equal(lengthUnit(-0.05, 0.02).label, 'µm');
  assert.equal(lengthUnit(-0.3, 0.02).label, 'mm');
});
