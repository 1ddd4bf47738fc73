// Builds the page of `pages/views.tsx` from the sources, once, and serves it to a browser page.

import type { Page } from '@playwright/test';
import { fileURLToPath } from 'node:url';
import { build } from 'vite';

export const SITE = 'http://epirig.test';
const ROOT = fileURLToPath(new URL('../../', import.meta.url));
const TYPES: Record<string, string> = { js: 'text/javascript', css: 'text/css', html: 'text/html' };
const PAGE = `<!doctype html><html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>epirig</title>
<link rel="icon" href="data:,"><link rel="stylesheet" href="style.css"></head>
<body><div id="page"></div><script type="module" src="views.js"></script></body></html>`;

let built: Promise<Map<string, string>> | undefined;

async function make(): Promise<Map<string, string>> {
  const made = await build({
    root: ROOT,
    configFile: false,
    logLevel: 'error',
    build: {
      write: false,
      minify: false,
      target: 'es2022',
      cssCodeSplit: false,
      modulePreload: false,
      rollupOptions: {
        input: `${ROOT}tests/browser/pages/views.tsx`,
        output: { entryFileNames: 'views.js', chunkFileNames: '[name].js', assetFileNames: '[name].[ext]' },
      },
    },
  });
  const files = new Map([['', PAGE]]);
  for (const { output } of [made].flat() as {
    output: { fileName: string; code?: string; source?: unknown }[];
  }[]) {
    for (const { fileName, code, source } of output) files.set(fileName, code ?? String(source));
  }
  return files;
}

/** Answers requests for the page and its parts; what it does not know is left to other routes. */
export async function servePage(page: Page): Promise<void> {
  built ??= make();
  const files = await built;
  await page.route(`${SITE}/**`, async (route) => {
    const name = new URL(route.request().url()).pathname.slice(1);
    const body = files.get(name);
    const contentType = TYPES[name.split('.').pop() ?? ''] ?? 'text/html';
    await (body === undefined ? route.fulfill({ status: 404 }) : route.fulfill({ body, contentType }));
  });
}
