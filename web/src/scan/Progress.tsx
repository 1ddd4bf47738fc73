interface Props {
  /** Its name, for example "Scan". */
  name: string;
  done: number | null;
  of: number | null;
  /** What is read out, and shown below. */
  words: string;
}

/** How far a work is; without numbers it only tells that it goes on. */
export function Progress({ name, done, of, words }: Props) {
  const known = done !== null && of !== null && of > 0;
  return (
    <div class="progress">
      <div
        role="progressbar"
        aria-label={name}
        aria-valuetext={words}
        {...(known ? { 'aria-valuemin': 0, 'aria-valuemax': of, 'aria-valuenow': done } : {})}
      >
        <span
          style={{ width: known ? `${Math.min(done / of, 1) * 100}%` : '100%' }}
          class={known ? '' : 'unknown'}
        />
      </div>
      <p aria-hidden="true">{words}</p>
    </div>
  );
}
