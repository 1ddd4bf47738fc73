import { defineConfig } from '@playwright/test';
import { existsSync } from 'node:fs';

// With EPIRIG_URL (the link that `epirig view` prints) the tests run against the real program.
const real = process.env.EPIRIG_URL;

// Another port, if the usual one is taken.
const port = process.env.PORT ?? '8765';

// The same engine without windows takes about half the time of the whole browser.
const SHELL = '/usr/bin/chromium-headless-shell';
const CHROMIUM = process.env.CHROMIUM ?? (existsSync(SHELL) ? SHELL : '/usr/bin/chromium');

export default defineConfig({
  testDir: 'tests/browser',
  workers: 1,
  // Only what hangs waits as long as this: else the speed of the machine would decide.
  timeout: 240_000,
  expect: { timeout: 90_000 },
  reporter: 'list',
  use: {
    actionTimeout: 60_000,
    viewport: { width: 1280, height: 720 },
    colorScheme: 'dark',
    contextOptions: { reducedMotion: 'reduce' },
    launchOptions: {
      executablePath: CHROMIUM,
      args: [
        '--no-sandbox',
        '--use-gl=angle',
        '--use-angle=swiftshader',
        // WebGL needs the emulated graphics card; all else is drawn faster without it.
        '--disable-gpu-compositing',
        '--disable-background-networking',
        '--disable-component-update',
        '--disable-sync',
        '--no-first-run',
      ],
    },
  },
  webServer: real
    ? undefined
    : { command: 'npm run mock', url: `http://127.0.0.1:${port}/`, reuseExistingServer: true },
});
