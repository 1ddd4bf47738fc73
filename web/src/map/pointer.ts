// Mouse, pen and fingers on the map, told apart here and handed on as intentions.

export interface Intentions {
  /** `clicked` is false while a finger drags it. */
  pin: (x: number, y: number, clicked: boolean) => void;
  hover: (at: { x: number; y: number } | null) => void;
  pan: (dx: number, dy: number) => void;
  zoom: (factor: number, x: number, y: number) => void;
  draw: (kind: 'line' | 'region', from: { x: number; y: number }, to: { x: number; y: number }) => void;
  /** The drawing is finished. */
  drawn: (kind: 'line' | 'region') => void;
  /** Where the loupe is wanted; null when the finger has left. */
  loupe: (at: { x: number; y: number } | null) => void;
  tool: () => 'pin' | 'line' | 'region' | 'points';
  /** What one finger does; on a map it moves the pin. */
  finger?: 'pan';
}

type Point = { x: number; y: number };
type Drag = { kind: 'pan' | 'pin' | 'line' | 'region'; from: Point; last: Point; moved: boolean };

const SLACK_PX = 4;

export function listenToPointers(element: HTMLElement, offset: () => Point, to: Intentions): void {
  const fingers = new Map<number, Point>();
  let drag: Drag | null = null;
  let spread: { distance: number; centre: Point } | null = null;

  const place = (event: PointerEvent | WheelEvent): Point => {
    const box = element.getBoundingClientRect();
    return { x: event.clientX - box.left - offset().x, y: event.clientY - box.top - offset().y };
  };

  const spreadOf = (): { distance: number; centre: Point } => {
    const [one, other] = [...fingers.values()];
    if (!one || !other) return { distance: 1, centre: { x: 0, y: 0 } };
    return {
      distance: Math.max(Math.hypot(one.x - other.x, one.y - other.y), 1),
      centre: { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 },
    };
  };

  const kindOf = (event: PointerEvent): Drag['kind'] => {
    if (to.finger === 'pan') return 'pan';
    if (event.shiftKey || to.tool() === 'line') return 'line';
    if (event.altKey || to.tool() === 'region') return 'region';
    return event.pointerType === 'touch' ? 'pin' : 'pan';
  };

  const endDrawing = (): void => {
    if (drag?.moved && (drag.kind === 'line' || drag.kind === 'region')) to.drawn(drag.kind);
  };

  element.addEventListener('pointerdown', (event) => {
    if (event.pointerType === 'mouse' && event.button !== 0) return;
    element.setPointerCapture(event.pointerId);
    const at = place(event);
    fingers.set(event.pointerId, at);
    if (fingers.size === 2) {
      endDrawing();
      drag = null;
      spread = spreadOf();
      to.loupe(null);
      return;
    }
    drag = { kind: kindOf(event), from: at, last: at, moved: false };
  });

  element.addEventListener('pointermove', (event) => {
    const at = place(event);
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, at);
    if (spread && fingers.size === 2) {
      const now = spreadOf();
      to.pan(now.centre.x - spread.centre.x, now.centre.y - spread.centre.y);
      to.zoom(now.distance / spread.distance, now.centre.x, now.centre.y);
      spread = now;
      return;
    }
    if (!drag) {
      if (event.pointerType !== 'touch') to.hover(at);
      return;
    }
    if (!drag.moved && Math.hypot(at.x - drag.from.x, at.y - drag.from.y) < SLACK_PX) return;
    drag.moved = true;
    if (drag.kind === 'pan') to.pan(at.x - drag.last.x, at.y - drag.last.y);
    else if (drag.kind === 'pin') {
      to.pin(at.x, at.y, false);
      to.loupe(at);
    } else to.draw(drag.kind, drag.from, at);
    drag.last = at;
  });

  const end = (event: PointerEvent): void => {
    if (drag && event.type === 'pointerup' && !drag.moved) to.pin(drag.from.x, drag.from.y, true);
    endDrawing();
    fingers.delete(event.pointerId);
    drag = null;
    spread = null;
    to.loupe(null);
  };
  element.addEventListener('pointerup', end);
  element.addEventListener('pointercancel', end);
  element.addEventListener('pointerleave', () => to.hover(null));
  element.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const at = place(event);
      to.zoom(Math.exp(-Math.max(Math.min(event.deltaY, 120), -120) / 400), at.x, at.y);
    },
    { passive: false },
  );
}
