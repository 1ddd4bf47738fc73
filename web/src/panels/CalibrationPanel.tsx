import { useEffect, useState } from 'preact/hooks';
import { api } from '../api';
import { Loaded } from '../components/Loaded';

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

function Remarks({ title, of }: { title: string; of: string[] }) {
  if (of.length === 0) return null;
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
