import { useEffect, useState } from 'preact/hooks';
import { api, type CalibrationInfo } from '../api';
import { Loaded } from '../components/Loaded';
import { withMinus } from '../format/number';

/** A picture of the server; an `img` cannot send the token, so it is fetched. */
function Figure({ name, title }: { name: string; title: string }) {
  const [address, setAddress] = useState<string | null>(null);
  const [fault, setFault] = useState<string | null>(null);
  useEffect(() => {
    let made: string | null = null;
    let here = true;
    api
      .calibrationFigure(name)
      .then((blob) => {
        made = URL.createObjectURL(blob);
        if (here) setAddress(made);
        else URL.revokeObjectURL(made);
      })
      .catch((error: unknown) => setFault(error instanceof Error ? error.message : String(error)));
    return () => {
      here = false;
      if (made) URL.revokeObjectURL(made);
    };
  }, [name]);
  return (
    <figure>
      {address && <img src={address} alt={title} />}
      {fault && <p class="fault">{fault}</p>}
      <figcaption>{title}</figcaption>
    </figure>
  );
}

/** Numbers of the calibration, whatever the server tells: names are its keys, in words. */
function Numbers({ info }: { info: CalibrationInfo }) {
  const groups = Object.entries(info).filter(
    (entry): entry is [string, Record<string, unknown>] =>
      typeof entry[1] === 'object' && entry[1] !== null && !Array.isArray(entry[1]),
  );
  const words = (key: string): string => key.replace(/_/g, ' ');
  const text = (value: unknown): string => {
    if (typeof value === 'number') return withMinus(String(Number(value.toPrecision(6))));
    if (Array.isArray(value)) return value.map(text).join(', ');
    return value === null || value === undefined ? 'unknown' : String(value);
  };
  return (
    <>
      {groups.map(([group, values]) => (
        <table class="list" key={group}>
          <caption>{words(group)}</caption>
          <tbody>
            {Object.entries(values)
              .filter(([, value]) => typeof value !== 'object' || value === null || Array.isArray(value))
              .map(([key, value]) => (
                <tr key={key}>
                  <th scope="row">{words(key)}</th>
                  <td>{text(value)}</td>
                </tr>
              ))}
          </tbody>
        </table>
      ))}
    </>
  );
}

function Remarks({ title, of }: { title: string; of: string[] | undefined }) {
  if (!of || of.length === 0) return null;
  return (
    <>
      <h3>{title}</h3>
      <ul>
        {of.map((remark) => (
          <li key={remark}>{remark}</li>
        ))}
      </ul>
    </>
  );
}

export function CalibrationPanel() {
  return (
    <div>
      <h2>Calibration</h2>
      <Loaded ask={api.calibration}>
        {(info) =>
          info === null ? (
            <p class="hint">These results were matched without a calibration.</p>
          ) : (
            <>
              <Remarks title="Notes" of={info.notes} />
              <Remarks title="What is missing" of={info.needs} />
              <Numbers info={info} />
              {info.figures.map(({ name, title }) => (
                <Figure key={name} name={name} title={title} />
              ))}
            </>
          )
        }
      </Loaded>
    </div>
  );
}
