import { useEffect, useRef, useState } from 'preact/hooks';
import { say } from '../store/notices';
import '../style/main_button.css';
import '../style/profile.css';
import { rig, type Profile, type ProfileMistake } from './api';
import { changes, fileExists, sortMistakes, type Typed } from './profile_changes';
import { ProfileSection } from './ProfileSection';
import { mayControl, onlyWatches, rigState } from './store';

const PAUSE_MS = 300;

function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** What is wrong with values; a check that fails is a mistake, too. */
async function checked(values: Record<string, string>): Promise<ProfileMistake[]> {
  try {
    return await rig.checkProfile(values);
  } catch (error) {
    return [{ key: null, words: `The values were not checked: ${wordsOf(error)}` }];
  }
}

/** Checks values when nothing was typed for a moment; only the newest answer counts. */
function useCheck(values: Record<string, string>): { mistakes: ProfileMistake[]; checking: boolean } {
  const [mistakes, setMistakes] = useState<ProfileMistake[]>([]);
  const [checking, setChecking] = useState(false);
  const key = JSON.stringify(values);
  useEffect(() => {
    if (key === '{}') {
      setMistakes([]);
      setChecking(false);
      return undefined;
    }
    let newest = true;
    setChecking(true);
    const timer = setTimeout(() => {
      void checked(values).then((found) => {
        if (!newest) return;
        setMistakes(found);
        setChecking(false);
      });
    }, PAUSE_MS);
    return () => {
      newest = false;
      clearTimeout(timer);
    };
  }, [key]);
  return { mistakes, checking };
}

/** Why values cannot be used or saved; null if they can. */
function whyNot(checking: boolean, mistakes: ProfileMistake[]): string | null {
  if (!mayControl.value) return 'This page has no control of the rig.';
  if (checking) return 'The values are being checked.';
  return mistakes.length > 0 ? 'Mend the mistakes first.' : null;
}

interface FormProps {
  profile: Profile;
  reload: () => Promise<void>;
}

function Form({ profile, reload }: FormProps) {
  const [typed, setTyped] = useState<Typed>({});
  const [replacing, setReplacing] = useState<string | null>(null);
  const [refusal, setRefusal] = useState<string | null>(null);
  const yes = useRef<HTMLButtonElement>(null);
  const values = changes(profile, typed);
  const count = Object.keys(values).length;
  const { mistakes, checking } = useCheck(values);
  const { at, other } = sortMistakes(profile, mistakes);
  const [first] = [...at.values()].flat();
  const reason = whyNot(checking, mistakes);
  const task = rigState.value?.task;
  const busy = reason === null && task ? `Not now: ${task.words}.` : null;
  useEffect(() => {
    if (replacing !== null) yes.current?.focus();
  }, [replacing]);
  useEffect(() => {
    // The bar below has grown; the field and what is wrong with it stay in sight.
    document.activeElement?.closest('.profile-key')?.scrollIntoView({ block: 'nearest' });
  }, [first]);

  const type = (path: string, text: string): void => {
    setRefusal(null);
    setReplacing(null);
    setTyped((before) => ({ ...before, [path]: text }));
  };
  const use = async (): Promise<void> => {
    try {
      await rig.useProfile(values);
      await reload();
      setTyped({});
      setRefusal(null);
      say('The rig uses these values now.');
    } catch (error) {
      setRefusal(wordsOf(error));
    }
  };
  const save = async (overwrite: boolean): Promise<void> => {
    setReplacing(null);
    setRefusal(null);
    try {
      const { file } = await rig.saveProfile(values, overwrite);
      say(`Saved to ${file}.`);
      await reload();
    } catch (error) {
      const words = wordsOf(error);
      if (!overwrite && fileExists(words)) setReplacing(words);
      else setRefusal(words);
    }
  };

  return (
    <>
      <p class="note muted profile-source">from {profile.source}</p>
      {profile.sections.map((section) => (
        <ProfileSection
          key={section.name}
          section={section}
          typed={typed}
          mistakes={at}
          disabled={!mayControl.value}
          controls={section.name === 'camera' ? profile.controls : []}
          onType={type}
        />
      ))}
      <div class="profile-end">
        {[...other, ...(refusal === null ? [] : [refusal])].map((words) => (
          <p key={words} class="fault" role="alert">
            <span aria-hidden="true">✕ </span>
            {words}
          </p>
        ))}
        {/* The field may be out of sight, or below this bar. */}
        {first && (
          <p class="fault note" aria-hidden="true">
            ✕ {first}
          </p>
        )}
        <p class="note" role="status" hidden={onlyWatches.value}>
          {count === 0 ? 'no changes' : `${count} changed`}
          {checking ? ', checking…' : count > 0 && mistakes.length === 0 && ', no mistakes'}
        </p>
        {onlyWatches.value ? null : replacing === null ? (
          <div class="fields">
            <button
              type="button"
              class="main"
              disabled={reason !== null || busy !== null || count === 0}
              title={reason ?? busy ?? undefined}
              onClick={() => void use()}
            >
              Use now
            </button>
            <button
              type="button"
              disabled={reason !== null}
              title={reason ?? undefined}
              onClick={() => void save(false)}
            >
              Save to {profile.file}
            </button>
            <button type="button" disabled={count === 0} onClick={() => setTyped({})}>
              Undo changes
            </button>
          </div>
        ) : (
          <div
            class="profile-replace"
            role="alertdialog"
            aria-label="Replace the file?"
            aria-describedby="replace-why"
          >
            <p id="replace-why">
              {replacing} <b>Replace it?</b>
            </p>
            <div class="fields">
              <button ref={yes} type="button" onClick={() => void save(true)}>
                Replace
              </button>
              <button type="button" onClick={() => setReplacing(null)}>
                Keep the file
              </button>
            </div>
          </div>
        )}
        {(reason ?? busy) !== null && !onlyWatches.value && <p class="hint note">{reason ?? busy}</p>}
      </div>
    </>
  );
}

/** The profile of the rig as a form, checked as typed. */
export function ProfileForm() {
  const [profile, setProfile] = useState<Profile | null>(null);
  const [error, setError] = useState<string | null>(null);
  const reload = async (): Promise<void> => {
    try {
      setProfile(await rig.profile());
      setError(null);
    } catch (fault) {
      setError(wordsOf(fault));
    }
  };
  useEffect(() => void reload(), []);
  return (
    <section class="profile-form" aria-label="Profile">
      <h2>Profile</h2>
      {error !== null && (
        <p class="fault" role="alert">
          {error}{' '}
          <button type="button" onClick={() => void reload()}>
            Retry
          </button>
        </p>
      )}
      {profile ? (
        <Form profile={profile} reload={reload} />
      ) : (
        error === null && <p class="hint">loading…</p>
      )}
    </section>
  );
}
