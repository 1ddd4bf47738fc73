import type { ComponentChildren } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { StopButton } from '../rig/StopButton';
import { mode } from '../store/route';

/** A native dialog: it keeps the focus, and Esc closes it. What moves can be stopped from within. */
export function Dialog(props: { title: string; close: () => void; children: ComponentChildren }) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => dialog.current?.showModal(), []);
  return (
    <dialog ref={dialog} aria-label={props.title} onClose={props.close}>
      <h2>{props.title}</h2>
      {props.children}
      <form method="dialog">
        <button>Close</button>
        {mode.value === 'ui' && <StopButton />}
      </form>
    </dialog>
  );
}
