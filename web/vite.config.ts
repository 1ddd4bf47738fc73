import { readFileSync } from 'node:fs';
import { defineConfig, type Plugin } from 'vite';

const BUNDLED = ['preact', '@preact/signals', '@preact/signals-core', 'uplot', 'three'];

/** The licences of what is in the bundle ask to be passed on with it. */
function licences(): Plugin {
  const text = (name: string): string =>
    `${name}\n\n${readFileSync(`node_modules/${name}/LICENSE`, 'utf8').trim()}\n`;
  return {
    name: 'licences',
    generateBundle() {
      const source = BUNDLED.map(text).join(`\n${'-'.repeat(80)}\n\n`);
      this.emitFile({ type: 'asset', fileName: 'licences.txt', source });
    },
  };
}

// The server embeds the bundle, so names are fixed (no hashes) and the same sources give the same bytes.
export default defineConfig({
  base: './',
  plugins: [licences()],
  build: {
    outDir: '../crates/server/page',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    cssCodeSplit: false,
    modulePreload: false,
    reportCompressedSize: true,
    chunkSizeWarningLimit: 700,
    rollupOptions: {
      output: {
        entryFileNames: 'app.js',
        chunkFileNames: '[name].js',
        assetFileNames: 'app.[ext]',
      },
    },
  },
  server: {
    // `npm run dev` shows the page with data of `npm run mock` or of `epirig view`.
    proxy: { '/api': process.env.EPIRIG_API ?? 'http://127.0.0.1:8765' },
  },
});
