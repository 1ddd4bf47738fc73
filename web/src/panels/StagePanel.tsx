import { useMemo } from 'preact/hooks';
import { api, type StageInfo } from '../api';
import { CurvePanel, type Curve } from '../components/CurvePanel';
import { Key } from '../components/Key';
import { Loaded } from '../components/Loaded';
import { moment } from '../format/moment';

function Errors({ info }: { info: StageInfo }) {
  const x = useMemo(() => info.frames.map(({ index }) => index), [info]);
  const reported = useMemo<Curve[]>(
    () => [
      {
        label: 'reported minus planned',
        values: info.frames.map(({ error_um }) => error_um),
        tone: 'first',
        points: true,
      },
    ],
    [info],
  );
  const measured = useMemo<Curve[]>(
    () => [
      {
        label: 'measured in the images',
        values: info.frames.map(({ measured_error_px }) => measured_error_px),
        tone: 'second',
        dash: [6, 3],
        points: true,
      },
    ],
    [info],
  );
  const known = (curves: Curve[]): boolean => curves[0]!.values.some((value) => value !== null);
  if (!known(reported) && !known(measured)) return <p class="hint">No positions were recorded.</p>;
  return (
    <>
      {known(reported) && (
        <section>
          <h3>Positioning error reported by the stage</h3>
          <Key curves={reported} />
          <CurvePanel
            name="Positioning error of each frame, as the stage reported it"
            xLabel="frame"
            yLabel="error (µm)"
            x={x}
            curves={reported}
          />
        </section>
      )}
      {known(measured) && (
        <section>
          <h3>Positioning error measured in the images</h3>
          <Key curves={measured} />
          <CurvePanel
            name="Positioning error of each frame, as measured in the images"
            xLabel="frame"
            yLabel="error (px)"
            x={x}
            curves={measured}
          />
        </section>
      )}
    </>
  );
}

function Retakes({ info }: { info: StageInfo }) {
  return (
    <>
      <h3>Retakes</h3>
      {info.retakes.length === 0 ? (
        <p>No frame was taken again.</p>
      ) : (
        <ul>
          {info.retakes.map(({ frame, reason }, index) => (
            <li key={index}>
              frame {frame}: {reason}
            </li>
          ))}
        </ul>
      )}
      {info.events.length > 0 && (
        <>
          <h3>Log</h3>
          <ul class="log">
            {info.events.map(({ at, words }, index) => (
              <li key={index}>
                <time dateTime={at}>{moment(at)}</time> {words}
              </li>
            ))}
          </ul>
        </>
      )}
    </>
  );
}

/** How well the stage went where it was sent, and which frames were taken again. */
export function StagePanel() {
  return (
    <div>
      <h2>Stage</h2>
      <Loaded ask={api.stage}>
        {(info) => (
          <>
            <Errors info={info} />
            <Retakes info={info} />
          </>
        )}
      </Loaded>
    </div>
  );
}
