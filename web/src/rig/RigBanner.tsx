import type { ComponentChildren } from 'preact';
import { api } from '../api';
import { Seconds } from '../components/Seconds';
import { lostSince } from '../store/contact';
import { showView } from '../store/selection';
import { view } from '../store/route';
import { rig, type RigState } from './api';
import { OrderButton } from './OrderButton';
import { stop, stopSent } from './stopping';
import { onlyWatches, order, rigState, tries } from './store';
import { diskText } from './texts';
import { whyNoOrders } from './why';

function Banner(props: { kind: 'error' | 'warn' | 'blue' | 'plain'; children: ComponentChildren }) {
  const { kind } = props;
  const icon = { error: '✕', warn: '!', blue: 'Ⅱ', plain: '…' }[kind];
  return (
    <div class={`banner ${kind}`} role={kind === 'error' ? 'alert' : 'status'}>
      <span aria-hidden="true">{icon}</span>
      {props.children}
    </div>
  );
}

function Reconnect() {
  return (
    <OrderButton act={() => void order(rig.reconnect())} why={whyNoOrders.value}>
      Reconnect
    </OrderButton>
  );
}

function lost(name: string, error: string | null) {
  return (
    <Banner kind="error">
      <span>
        The {name} is lost{error ? `: ${error}` : ''}. It is looked for again and again.
      </span>
      <Reconnect />
    </Banner>
  );
}

function disk({ scan, free_bytes }: RigState) {
  const need = scan?.needs_bytes ?? null;
  const free = scan?.free_bytes ?? free_bytes;
  const over = scan?.state === 'done' || scan?.state === 'failed';
  if (need === null || free === null || over || free >= 1.5 * need) return null;
  return (
    <Banner kind={free < need ? 'error' : 'warn'}>
      <span>
        The disk {free < need ? 'is too full' : 'is nearly full'}: the scan needs {diskText(need)} more,{' '}
        {diskText(free)} are free.
      </span>
    </Banner>
  );
}

function paused({ scan }: RigState) {
  if (scan?.state !== 'paused') return null;
  const holders = scan.held_by.length > 0 ? `, held by: ${scan.held_by.join(', ')}` : '';
  return (
    <Banner kind="blue">
      <span>
        Scan paused at frame {scan.done} of {scan.planned}
        {holders}
        {scan.reason ? `. ${scan.reason}` : ''}
      </span>
      {view.value !== 'scan' && (
        <button type="button" onClick={() => showView('scan')}>
          Show scan
        </button>
      )}
    </Banner>
  );
}

/** What is wrong with the rig, the worst first; null if nothing is. */
export function rigBanner() {
  if (stopSent.value === 'failing') {
    return (
      <Banner kind="error">
        <span>STOP has not reached the rig. Use its hardware switch.</span>
        <button type="button" onClick={() => void stop()}>
          Send again
        </button>
      </Banner>
    );
  }
  if (tries.value > 0) {
    const since = lostSince.value;
    return (
      <Banner kind="error">
        <span>
          Server gone: no contact
          {since !== null && (
            <>
              {' '}
              for <Seconds since={since} /> s
            </>
          )}
          . <span aria-hidden="true">Try {tries.value}. </span>
          What is loaded stays readable; a scan may go on without this page.
        </span>
        <button type="button" onClick={() => void api.about().catch(() => undefined)}>
          Retry
        </button>
      </Banner>
    );
  }
  const state = rigState.value;
  if (!state) {
    return (
      <Banner kind="plain">
        <span>Connecting to the rig.</span>
      </Banner>
    );
  }
  if (state.camera.state === 'lost') return lost('camera', state.camera.error);
  if (state.stage.state === 'lost') return lost('stage', state.stage.error);
  const held = disk(state) ?? paused(state);
  if (held) return held;
  // A scan homes the stage by itself, so its view has nothing to tell.
  if (view.value === 'rig' && state.stage.state === 'ready' && !state.stage.homed && state.task === null) {
    return (
      <Banner kind="warn">
        <span>
          Not homed: the position is not known.
          {onlyWatches.value ? '' : ' Hold Home for 1 s; a scan homes by itself.'}
        </span>
      </Banner>
    );
  }
  return null;
}
