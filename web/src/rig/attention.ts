// What ends everything that a person holds: attention that went elsewhere.

const TYPED = 'input, select, textarea, [contenteditable]';

/** Whether the page has a person's attention: it is shown, in front, and no dialog is over it. */
export function attended(): boolean {
  if (document.visibilityState === 'hidden' || document.querySelector('dialog[open]')) return false;
  return !(document.activeElement instanceof HTMLElement && document.activeElement.matches(TYPED));
}

/** Calls `lost` whenever attention goes; returns how to end that. */
export function watchAttention(lost: () => void): () => void {
  const hidden = (): void => {
    if (document.visibilityState === 'hidden') lost();
  };
  const focused = (event: FocusEvent): void => {
    if (event.target instanceof HTMLElement && event.target.closest(TYPED)) lost();
  };
  addEventListener('blur', lost);
  addEventListener('pagehide', lost);
  document.addEventListener('visibilitychange', hidden);
  document.addEventListener('focusin', focused);
  return () => {
    removeEventListener('blur', lost);
    removeEventListener('pagehide', lost);
    document.removeEventListener('visibilitychange', hidden);
    document.removeEventListener('focusin', focused);
  };
}
