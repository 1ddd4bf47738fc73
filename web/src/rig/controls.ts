// Order and allowed values of the camera's controls.

import type { Control } from './api';

/** Exposure and gain are needed all the time; all else comes after. */
export function sorted(list: readonly Control[]): { first: Control[]; more: Control[] } {
  const rank = ({ name, kind }: Control): number => {
    if (/exposure/.test(name)) return kind === 'integer' ? 0 : 2;
    return /gain/.test(name) && kind === 'integer' ? 1 : 3;
  };
  const order = [...list].sort((one, other) => rank(one) - rank(other));
  return { first: order.filter((one) => rank(one) < 3), more: order.filter((one) => rank(one) === 3) };
}

/** The nearest value that the control accepts. */
export function onGrid({ minimum, maximum, step }: Control, value: number): number {
  const size = Math.max(step, 1);
  const near = minimum + Math.round((value - minimum) / size) * size;
  const last = minimum + Math.floor((maximum - minimum) / size) * size;
  return Math.min(Math.max(near, minimum), last);
}
