import type { ComponentChildren } from 'preact';
import { useState } from 'preact/hooks';

/** A part of the column that folds; on narrow screens folded at first, unless `open` says so. */
export function Section(props: { title: string; open?: boolean; children: ComponentChildren }) {
  const [open] = useState(() => props.open ?? innerWidth > 700);
  return (
    <details class="section" open={open}>
      <summary>{props.title}</summary>
      {props.children}
    </details>
  );
}
