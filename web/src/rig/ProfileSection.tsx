import { useEffect, useRef, useState } from 'preact/hooks';
import type { Profile } from './api';
import { isChanged, openSection, visibleKeys, type Typed } from './profile_changes';
import { ProfileField } from './ProfileField';

interface Props {
  section: Profile['sections'][number];
  typed: Typed;
  mistakes: Map<string, string[]>;
  disabled: boolean;
  /** Controls of the camera, if this is its section. */
  controls: Profile['controls'];
  onType: (path: string, text: string) => void;
}

function Controls({ controls }: { controls: Profile['controls'] }) {
  return (
    <table class="list profile-controls">
      <caption>Controls of the camera; they are set in the rig view</caption>
      <tbody>
        {controls.map(([name, value]) => (
          <tr key={name}>
            <th scope="row">{name}</th>
            <td>{value}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** A section of the profile, folded until it is wanted. */
export function ProfileSection({ section, typed, mistakes, disabled, controls, onType }: Props) {
  const { name, meaning, keys } = section;
  const place = useRef<HTMLDetailsElement>(null);
  const [open, setOpen] = useState(false);
  const [all, setAll] = useState(false);
  const without = keys.filter(({ applies }) => !applies).length;
  const wrong = keys.filter(({ path }) => mistakes.has(path)).length;
  const changed = keys.filter((key) => isChanged(key, typed)).length;
  const wanted = openSection.value === name;
  useEffect(() => {
    if (!wanted) return;
    openSection.value = null;
    setOpen(true);
    place.current?.scrollIntoView({ block: 'start' });
    place.current?.querySelector('summary')?.focus();
  }, [wanted]);
  return (
    <details
      ref={place}
      class="profile-section"
      open={open}
      onToggle={(event) => setOpen(event.currentTarget.open)}
    >
      <summary>
        <h3>{name}</h3>
        <span class="muted">{meaning}</span>
        {changed > 0 && <span class="changed">{changed} changed</span>}
        {wrong > 0 && (
          <span class="fault">
            <span aria-hidden="true">✕ </span>
            {wrong} wrong
          </span>
        )}
      </summary>
      {open && (
        <div class="profile-keys">
          {visibleKeys(keys, typed, mistakes, all).map((key) => (
            <ProfileField
              key={key.path}
              field={key}
              typed={typed}
              mistakes={mistakes.get(key.path) ?? []}
              disabled={disabled}
              onType={onType}
            />
          ))}
          {without > 0 && (
            <label class="check">
              <input
                type="checkbox"
                checked={all}
                onChange={(event) => setAll(event.currentTarget.checked)}
              />
              show all ({without} without effect)
            </label>
          )}
          {controls.length > 0 && <Controls controls={controls} />}
        </div>
      )}
    </details>
  );
}
