import { defineConfig } from 'vite';

// The server embeds the bundle, so names are fixed (no hashes) and the same sources give the same bytes.
export default defineConfig({
  base: './',
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
