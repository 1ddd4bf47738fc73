import { useSignal } from '@preact/signals';
import { NumberField } from '../components/NumberField';
import { refuse } from '../store/notices';
import { rig, type StageState } from './api';
import { HoldButton } from './HoldButton';
import { fast, held, jog } from './jogging';
import { OrderButton } from './OrderButton';
import { onlyWatches, order, rigState } from './store';
import { positionText, stepSize, stepText } from './texts';
import { useHold } from './useHold';
import { whyNoMove, whyNoStage } from './why';

const HOME_MS = 1000;

/** Where the stage is on its way, with the part that the plan uses. */
function Travel({ stage }: { stage: StageState }) {
  const at = (mm: number): string => `${Math.min(Math.max((mm / stage.travel_mm) * 100, 0), 100)}%`;
  const plan = stage.plan_mm;
  return (
    <div class="travel" aria-hidden="true">
      {plan && (
        <span
          class="travel-plan"
          style={{ left: at(Math.min(...plan)), right: `calc(100% - ${at(Math.max(...plan))})` }}
        />
      )}
      {stage.position_mm !== null && <span class="travel-mark" style={{ left: at(stage.position_mm) }} />}
    </div>
  );
}

function Position({ stage }: { stage: StageState }) {
  const { position_mm, steps_mm, plan_mm } = stage;
  return (
    <p class="position">
      <strong class="key-number" data-testid="position">
        {position_mm === null ? '\u2013' : positionText(position_mm, steps_mm)}
      </strong>
      <span class={stage.homed ? '' : 'amber'}>{stage.homed ? 'homed' : '! not homed'}</span>
      <span>{stage.moving ? 'moves' : 'still'}</span>
      {stage.at_limit && <span class="amber">! at a limit</span>}
      {plan_mm && (
        <span class="muted">
          plan {stepSize(plan_mm[0])} to {stepSize(plan_mm[1])} mm
        </span>
      )}
    </p>
  );
}

/** Big minus to big plus, in one row. */
function Steps({ stage }: { stage: StageState }) {
  const up = [...stage.steps_mm].sort((one, other) => one - other);
  const steps = [...up.map((step) => -step).reverse(), ...up];
  const whyNot = (step: number): string | null => {
    if (whyNoMove.value !== null) return whyNoMove.value;
    const to = (stage.position_mm ?? 0) + step;
    return to < -1e-9 || to > stage.travel_mm + 1e-9 ? 'beyond the travel' : null;
  };
  return (
    <div class="steps" role="group" aria-label="Steps in mm">
      {steps.map((step) => (
        <OrderButton
          key={step}
          act={() => void order(rig.step(step))}
          why={whyNot(step)}
          name={`Move ${step < 0 ? '-' : '+'}${stepSize(step)} mm`}
        >
          {stepText(step)}
        </OrderButton>
      ))}
      <span class="unit">mm</span>
    </div>
  );
}

function HoldToMove({ direction }: { direction: 1 | -1 }) {
  const mine = held.value?.direction === direction;
  // A jog is a task, too: what is held must not be off.
  const why = held.value !== null ? (mine ? null : 'the other direction is held') : whyNoMove.value;
  const begin = (): void => {
    // A second finger on the other button ends the hold; see Jog.
    if (held.peek() !== null || whyNoMove.peek() === null) {
      jog.hold(direction, fast.peek());
    }
  };
  const hold = useHold(begin, () => jog.end());
  return (
    <button
      type="button"
      class={`jog ${mine ? 'held' : ''}`}
      aria-label={`Hold to move ${direction < 0 ? 'left' : 'right'}`}
      aria-disabled={why !== null}
      title={why === null ? 'Moves while it is held' : `Off: ${why}`}
      {...hold}
    >
      {direction < 0 ? '◀ hold' : 'hold ▶'}
    </button>
  );
}

function Speed() {
  return (
    <fieldset class="speed">
      <legend class="unseen">Speed of hold to move</legend>
      {[false, true].map((quick) => (
        <label key={String(quick)} class="check">
          <input
            type="radio"
            name="speed"
            checked={fast.value === quick}
            onChange={() => (fast.value = quick)}
          />
          {quick ? 'fast' : 'slow'}
        </label>
      ))}
    </fieldset>
  );
}

/** Moves to a number, what a lost contact means, and the way home. */
function GoTo({ stage }: { stage: StageState }) {
  const wanted = useSignal<number | null>(null);
  const runsOn = stage.runs_on_mm[fast.value ? 1 : 0];
  const shown = wanted.value ?? stage.position_mm ?? 0;
  // A slip of a finger must not send the stage to its end, so what is typed is not cut to the travel.
  const whyBeyond = (mm: number): string | null =>
    mm < 0 || mm > stage.travel_mm ? `the stage goes from 0 to ${stage.travel_mm} mm` : null;
  const beyond = whyBeyond(shown);
  const go = (mm: number): void => {
    const why = whyNoMove.peek() ?? whyBeyond(mm);
    if (why === null) void order(rig.go(mm));
    else refuse(why);
  };
  return (
    <div class="go-to">
      <NumberField
        label="go to"
        unit="mm"
        value={Number(shown.toFixed(4))}
        disabled={whyNoMove.value !== null}
        onChange={(mm) => (wanted.value = mm)}
        onEnter={go}
      />
      <OrderButton act={() => go(shown)} why={whyNoMove.value ?? beyond}>
        Go
      </OrderButton>
      <p class={`runs-on note ${beyond ? 'amber' : 'muted'}`}>
        {beyond ?? `hold stops within ${stepSize(Number(runsOn.toPrecision(2)))} mm if contact is lost`}
      </p>
      {/* Apart from the rest: a slip must not home. */}
      <span class="home">
        <HoldButton title="Home" ms={HOME_MS} act={() => void order(rig.home())} why={whyNoStage.value} />
      </span>
    </div>
  );
}

/** Where the stage is, and what moves it. */
export function StagePane() {
  const stage = rigState.value?.stage;
  if (!stage) return null;
  return (
    <section class="stage-pane" aria-label="Stage">
      <h2>
        Stage <span class="muted">{stage.name}</span>
      </h2>
      <Position stage={stage} />
      <Travel stage={stage} />
      {!onlyWatches.value && (
        <>
          <Steps stage={stage} />
          <div class="jogs">
            <HoldToMove direction={-1} />
            <Speed />
            <HoldToMove direction={1} />
          </div>
          <GoTo stage={stage} />
        </>
      )}
    </section>
  );
}
