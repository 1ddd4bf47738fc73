import type { ProfileKey } from './api';
import { choicesOf, isChanged, shown, type Typed } from './profile_changes';

interface Props {
  field: ProfileKey;
  typed: Typed;
  mistakes: string[];
  disabled: boolean;
  onType: (path: string, text: string) => void;
}

function help({ allowed, default: usual, example }: ProfileKey): string {
  const parts = [`Value: ${allowed}`];
  if (usual !== null) parts.push(`default ${usual}`);
  else if (example) parts.push(`for example ${example}`);
  return parts.join('; ');
}

/** One key: its label, its field, what it means and what may be written, and what is wrong with it. */
export function ProfileField({ field, typed, mistakes, disabled, onType }: Props) {
  const { path, name, meaning, applies } = field;
  const id = `profile-${path.replace(/[^\w-]/g, '-')}`;
  const text = shown(field, typed);
  const choices = choicesOf(field);
  const wrong = mistakes.length > 0;
  const shared = {
    id,
    disabled,
    'aria-invalid': wrong,
    'aria-describedby': wrong ? `${id}-wrong ${id}-help` : `${id}-help`,
  };
  const usual = field.default === null ? 'not set' : `not set (default ${field.default})`;
  return (
    <div class={`profile-key ${applies ? '' : 'without-effect'} ${wrong ? 'wrong' : ''}`}>
      <label for={id}>
        {name}
        {isChanged(field, typed) && <span class="changed"> changed</span>}
      </label>
      {choices ? (
        <select {...shared} value={text} onChange={(event) => onType(path, event.currentTarget.value)}>
          <option value="">{usual}</option>
          {/* A value that is not among the choices must stay visible. */}
          {[...choices, ...(text === '' || choices.includes(text) ? [] : [text])].map((choice) => (
            <option key={choice} value={choice}>
              {choice}
            </option>
          ))}
        </select>
      ) : (
        <input
          {...shared}
          type="text"
          spellcheck={false}
          autocomplete="off"
          value={text}
          placeholder={field.default ?? 'not set'}
          onInput={(event) => onType(path, event.currentTarget.value)}
        />
      )}
      <p id={`${id}-help`} class="key-help">
        {meaning}. <span class="muted">{help(field)}.</span>
        {!applies && <b> No effect with this driver.</b>}
      </p>
      {wrong && (
        <p id={`${id}-wrong`} class="fault key-wrong">
          <span aria-hidden="true">✕ </span>
          {mistakes.join(' ')}
        </p>
      )}
    </div>
  );
}
