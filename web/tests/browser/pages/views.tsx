// A page of the test alone: one view of `epirig ui`, without bar and routing. `?view=profile`, `#rig`, or the scan.

import { signal } from '@preact/signals';
import { render } from 'preact';
import { ProfileForm } from '../../../src/rig/ProfileForm';
import { followRig } from '../../../src/rig/store';
import { ScanView } from '../../../src/scan/ScanView';
import { Notices } from '../../../src/components/Notices';
import { followUse } from '../../../src/store/notices';
import { applyTheme } from '../../../src/store/settings';
import { takeToken } from '../../../src/store/token';
import '../../../src/style/base.css';
import '../../../src/style/components.css';
import '../../../src/style/map.css';
import '../../../src/style/results.css';

const profileAsked = signal(new URLSearchParams(location.search).get('view') === 'profile');
addEventListener('hashchange', () => (profileAsked.value = location.hash === '#rig'));

function View() {
  const profile = profileAsked.value;
  return (
    <>
      <header class="bar">
        <strong>epirig</strong>
      </header>
      <Notices />
      {profile ? (
        <main
          style={{ flex: 1, minHeight: 0, overflowY: 'auto', padding: '8px 12px 0', maxWidth: '640px' }}
        >
          <ProfileForm />
        </main>
      ) : (
        <ScanView />
      )}
    </>
  );
}

takeToken();
applyTheme();
followRig();
followUse();
const page = document.getElementById('page');
if (page) render(<View />, page);
