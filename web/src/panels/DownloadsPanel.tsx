import { useSignal } from '@preact/signals';
import { api, type Download } from '../api';
import { Loaded } from '../components/Loaded';
import { bytes } from '../format/number';
import { save } from '../store/actions';
import { refuse } from '../store/notices';

function Item({ item }: { item: Download }) {
  const busy = useSignal(false);
  const fetchAndSave = async (): Promise<void> => {
    busy.value = true;
    try {
      save(await api.download(item.name), item.name.split('/').pop() ?? item.name);
    } catch (fault) {
      refuse(fault);
    }
    busy.value = false;
  };
  return (
    <li>
      <button type="button" disabled={busy.value} onClick={() => void fetchAndSave()}>
        {busy.value ? 'loading…' : 'Save'}
      </button>
      <span>
        {item.title}
        <br />
        <small class="muted">
          {item.name}, {bytes(item.bytes)}
        </small>
      </span>
    </li>
  );
}

/** Files of the results. They are fetched by the page, since links cannot send the token. */
export function DownloadsPanel() {
  return (
    <div>
      <h2>Downloads</h2>
      <Loaded ask={api.downloads}>
        {(items) =>
          items.length === 0 ? (
            <p class="hint">There are no files.</p>
          ) : (
            <ul class="downloads">
              {items.map((item) => (
                <Item key={item.name} item={item} />
              ))}
            </ul>
          )
        }
      </Loaded>
      <p class="hint">
        Maps and points for other programs, in their formats: <code>epirig export</code> writes them.
      </p>
    </div>
  );
}
