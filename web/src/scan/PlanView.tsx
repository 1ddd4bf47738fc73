import { useEffect, useState } from 'preact/hooks';
import { rig, type Plan, type RigState, type SequenceEntry } from '../rig/api';
import { openSection } from '../rig/profile_changes';
import { onlyWatches, order } from '../rig/store';
import '../style/plan.css';
import { whyNotStart } from './control';
import { Order, Reason, putAside } from './JobCard';
import { MeasureTask } from './MeasureTask';
import { Sequences } from './Sequences';
import { DISK_WORDS, diskText, diskVerdict, duration, millimetres } from './words';

interface Asked<T> {
  value: T | null;
  error: string | null;
}

/** Asks at the beginning, and again whenever `when` is another one. */
function useAsked<T>(ask: () => Promise<T>, when: string): Asked<T> {
  const [answer, setAnswer] = useState<Asked<T>>({ value: null, error: null });
  useEffect(() => {
    let here = true;
    ask().then(
      (value) => here && setAnswer({ value, error: null }),
      (fault: unknown) =>
        here && setAnswer({ value: null, error: fault instanceof Error ? fault.message : String(fault) }),
    );
    return () => {
      here = false;
    };
  }, [when]);
  return answer;
}

/** "16 dark, 16 flat field, 20 chess-board". */
function calibration({ dark, flat, board }: Plan): string {
  const parts = [
    [dark, 'dark'],
    [flat, 'flat field'],
    [board, 'chess-board'],
  ] as const;
  const words = parts.filter(([count]) => count > 0).map(([count, name]) => `${count} ${name}`);
  return words.length > 0 ? words.join(', ') : 'none';
}

function PlanTable({ plan }: { plan: Plan }) {
  const verdict = diskVerdict(plan.needs_bytes, plan.free_bytes);
  const range = Math.abs(plan.end_mm - plan.start_mm);
  const rows: [string, string][] = [
    ['Frames', `${plan.frames}${plan.averaged > 1 ? `, each the mean of ${plan.averaged}` : ''}`],
    ['Step', `${millimetres(plan.step_mm)} mm`],
    [
      'Range',
      `${millimetres(range)} mm, from ${millimetres(plan.start_mm)} to ${millimetres(plan.end_mm)} mm`,
    ],
    ['Calibration frames', calibration(plan)],
    ['Time', plan.seconds === null ? 'not known' : duration(plan.seconds)],
  ];
  return (
    <table class="values plan-table">
      <tbody>
        {rows.map(([name, words]) => (
          <tr key={name}>
            <th scope="row">{name}</th>
            <td>{words}</td>
          </tr>
        ))}
        <tr>
          <th scope="row">Disk</th>
          <td class={`disk ${verdict}`}>
            {DISK_WORDS[verdict] && <b>{DISK_WORDS[verdict]} </b>}
            {diskText(plan.needs_bytes, plan.free_bytes)}
          </td>
        </tr>
        <tr>
          <th scope="row">Folder</th>
          <td class="plan-folder">{plan.folder}</td>
        </tr>
      </tbody>
    </table>
  );
}

function ToProfile() {
  return (
    <a href="#rig" onClick={() => (openSection.value = 'plan')}>
      Change the plan in the profile
    </a>
  );
}

/** A name becomes that of a folder: the server tells by which rule. */
function nameMistake(name: string, { names }: Plan, taken: SequenceEntry[]): string | null {
  if (!new RegExp(`^(?:${names.pattern})$`).test(name)) return names.words;
  return taken.some((entry) => entry.name === name) ? 'there is a sequence of this name' : null;
}

function Start({ plan, taken }: { plan: Plan; taken: SequenceEntry[] }) {
  const [typed, setTyped] = useState<string | null>(null);
  const name = (typed ?? plan.name).trim();
  const mistake = nameMistake(name, plan, taken);
  const full = diskVerdict(plan.needs_bytes, plan.free_bytes) === 'bad';
  const reason = whyNotStart.value ?? (full ? 'The disk has too little room for this plan.' : null);
  return (
    <div class="plan-start">
      <label>
        Name of the sequence
        <input
          value={typed ?? plan.name}
          spellcheck={false}
          autocomplete="off"
          aria-invalid={mistake !== null}
          aria-describedby="plan-name-mistake"
          onInput={(event) => setTyped(event.currentTarget.value)}
        />
      </label>
      <p id="plan-name-mistake" class="fault note">
        {mistake}
      </p>
      <div class="scan-buttons">
        <Order main reason={reason ?? mistake} onClick={() => void order(rig.startScan(name))}>
          Start
        </Order>
      </div>
      <Reason words={reason} />
    </div>
  );
}

/** Before a scan: what would be done, and what has been done. */
export function PlanView({ state }: { state: RigState }) {
  // When a task has ended, there may be other files and another profile.
  const when = state.task === null ? 'idle' : state.task.kind;
  const plan = useAsked(rig.plan, when);
  const sequences = useAsked(rig.sequences, when);
  return (
    <main class="scan-plan">
      <h1 class="unseen">Scan</h1>
      <section class="plan-card" aria-label="Plan">
        <h2>Plan</h2>
        {plan.error !== null && (
          <p class="fault" role="alert">
            {plan.error}
          </p>
        )}
        {plan.value ? <PlanTable plan={plan.value} /> : plan.error === null && <p class="hint">loading…</p>}
        {!onlyWatches.value && (
          <p>
            <ToProfile />
          </p>
        )}
        {plan.value && !onlyWatches.value && <Start plan={plan.value} taken={sequences.value ?? []} />}
        {state.scan && (
          <button type="button" class="plain" onClick={() => (putAside.value = null)}>
            Back to {state.scan.name}
          </button>
        )}
      </section>
      <section class="plan-card" aria-label="Sequences">
        <h2>Sequences</h2>
        <MeasureTask />
        {sequences.error !== null && <p class="fault">{sequences.error}</p>}
        {sequences.value ? (
          <Sequences entries={sequences.value.filter(({ state }) => state !== 'unreadable')} />
        ) : (
          sequences.error === null && <p class="hint">loading…</p>
        )}
      </section>
    </main>
  );
}
