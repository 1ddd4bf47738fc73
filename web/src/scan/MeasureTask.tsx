import { rigState } from '../rig/store';
import { Progress } from './Progress';
import { timeLeft } from './words';

/** The progress of a measurement, while there is one. */
export function MeasureTask() {
  const task = rigState.value?.task;
  if (task?.kind !== 'measuring') return null;
  const { step, done, of, seconds_left } = task;
  const counted = done !== null && of !== null ? `${done} of ${of}` : null;
  const left = seconds_left === null ? null : timeLeft(seconds_left);
  const words = [step ?? task.words, counted, left].filter((part) => part !== null).join(', ');
  return <Progress name="Measurement" done={done} of={of} words={words} />;
}
