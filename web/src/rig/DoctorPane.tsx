import { significant } from '../format/number';
import { rig, type Check, type Verdict } from './api';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { order, rigState } from './store';
import { whyNoOrders } from './why';

const VERDICTS: Record<Verdict, [icon: string, word: string]> = {
  good: ['✓', 'ok'],
  unknown: ['?', 'not known'],
  warning: ['!', 'warning'],
  bad: ['✕', 'fault'],
};

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
  return (
    <Section title={doctor ? `Doctor: ${summary(doctor.checks)}` : 'Doctor'}>
      <p class="buttons">
        <OrderButton act={() => void order(rig.doctor(true))} why={whyNoOrders.value}>
          Run short
        </OrderButton>
        <OrderButton act={() => void order(rig.doctor(false))} why={whyNoOrders.value}>
          Run whole
        </OrderButton>
        {doctor && (
          <span class="muted">
            {doctor.short ? 'short' : 'whole'} run, {doctor.at}
          </span>
        )}
      </p>
      <p class="hint">It homes the stage and moves it within the plan.</p>
      {doctor && (
        <>
          <ul class="checks" aria-label="Checks">
            {doctor.checks.map((check) => (
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
