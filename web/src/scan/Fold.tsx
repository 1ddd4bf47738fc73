import type { ComponentChildren } from 'preact';
import { useState } from 'preact/hooks';

interface Props {
  title: string;
  /** A few words beside the title, to be read while it is folded. */
  brief?: string;
  children: ComponentChildren;
}

/** A section that folds; on small screens it begins folded. What is folded is not drawn. */
export function Fold({ title, brief, children }: Props) {
  const [open, setOpen] = useState(innerWidth > 700);
  return (
    <details class="fold" open={open} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>
        <h3>{title}</h3>
        {brief && <span class="muted">{brief}</span>}
      </summary>
      {open && <div>{children}</div>}
    </details>
  );
}
