import { significant } from '../format/number';
import { rig, type Check, type Verdict } from './api';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { onlyWatches, order, rigState } from './store';
import { whyNoOrders } from './why';

/** From the best to the worst. */
const VERDICTS: Record<Verdict, [icon: string, word: string]> = {
  good: ['✓', 'ok'],
  unknown: ['?', 'not known'],
  warning: ['!', 'warning'],
  bad: ['✕', 'fault'],
};

/** Faults first; else in the order in which they were looked at. */
function worstFirst(checks: readonly Check[]): Check[] {
  const rank = ({ verdict }: Check): number => Object.keys(VERDICTS).indexOf(verdict);
  return [...checks].sort((one, other) => rank(other) - rank(one));
}

/** `9 ok, 1 warning`: the worst last, as it is what is looked for. */
export function summary(checks: readonly Check[]): string {
  const counted = (Object.keys(VERDICTS) as Verdict[]).flatMap((verdict) => {
    const count = checks.filter((check) => check.verdict === verdict).length;
    return count === 0 ? [] : [`${count} ${VERDICTS[verdict][1]}`];
  });
  return counted.join(', ') || 'no checks';
}

function CheckLine({ check }: { check: Check }) {
  const [icon, word] = VERDICTS[check.verdict];
  return (
    <li class={`verdict-${check.verdict}`}>
      <span class="verdict">
        <span aria-hidden="true">{icon}</span> {word}
      </span>
      <span>
        <strong>{check.name}</strong> {check.finding}
        {check.advice && <em>{check.advice}</em>}
      </span>
    </li>
  );
}

/** What stands against a good measurement, and what to do about it. */
export function DoctorPane() {
  const doctor = rigState.value?.doctor ?? null;
  const task = rigState.value?.task;
  const runs = task?.kind === 'doctor';
  if (onlyWatches.value && !doctor && !runs) return null;
  const title = runs ? 'Doctor: runs' : doctor ? `Doctor: ${summary(doctor.checks)}` : 'Doctor';
  return (
    <Section title={title}>
      <p class="buttons">
        <OrderButton act={() => void order(rig.doctor(true))} why={whyNoOrders.value}>
          Run short
        </OrderButton>
        <OrderButton act={() => void order(rig.doctor(false))} why={whyNoOrders.value}>
          Run whole
        </OrderButton>
        {doctor && !runs && (
          <span class="muted">
            {doctor.short ? 'short' : 'whole'} run, {doctor.at}
          </span>
        )}
      </p>
      {runs ? (
        <p role="status">{task.step ?? 'begins'} …</p>
      ) : (
        !onlyWatches.value && <p class="hint">It homes the stage and moves it within the plan.</p>
      )}
      {doctor && !runs && (
        <>
          <ul class="checks" aria-label="Checks">
            {worstFirst(doctor.checks).map((check) => (
              <CheckLine key={check.name} check={check} />
            ))}
          </ul>
          {doctor.predicted_mm !== null && (
            <p>
              predicted standard uncertainty of the height of a pixel:{' '}
              <strong>{significant(doctor.predicted_mm, 2)} mm</strong> (k = 1)
            </p>
          )}
        </>
      )}
    </Section>
  );
}
