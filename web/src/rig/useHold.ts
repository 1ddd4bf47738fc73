import type { ButtonHTMLAttributes } from 'preact';
import { useRef } from 'preact/hooks';

type Handlers = Pick<
  ButtonHTMLAttributes<HTMLButtonElement>,
  | 'onPointerDown'
  | 'onPointerUp'
  | 'onPointerCancel'
  | 'onLostPointerCapture'
  | 'onKeyDown'
  | 'onKeyUp'
  | 'onBlur'
  | 'onContextMenu'
>;

const isHoldKey = (key: string): boolean => key === ' ' || key === 'Enter';

/** A button that acts while it is held, by finger, mouse or key. */
export function useHold(begin: () => void, end: () => void): Handlers {
  // A key or finger that did not begin a hold does not end one.
  const by = useRef<number | string | null>(null);
  const finish = (what: number | string): void => {
    if (by.current !== what) return;
    by.current = null;
    end();
  };
  return {
    onPointerDown: (event) => {
      if (event.button !== 0) return;
      const button = event.currentTarget;
      // Some browsers leave the focus where it was: in a text field, say, which would end the hold.
      button.focus();
      button.setPointerCapture(event.pointerId);
      by.current = event.pointerId;
      begin();
    },
    onPointerUp: (event) => finish(event.pointerId),
    onPointerCancel: (event) => finish(event.pointerId),
    onLostPointerCapture: (event) => finish(event.pointerId),
    onKeyDown: (event) => {
      if (!isHoldKey(event.key)) return;
      // No click at the end, and no scrolling.
      event.preventDefault();
      if (event.repeat || by.current !== null) return;
      by.current = event.key;
      begin();
    },
    onKeyUp: (event) => {
      if (isHoldKey(event.key)) event.preventDefault();
      finish(event.key);
    },
    onBlur: () => {
      by.current = null;
      end();
    },
    // A long press of a finger is no question for a menu.
    onContextMenu: (event) => event.preventDefault(),
  };
}
