import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vite";

// Where a bf edit is that answers a page which is being developed.
const service = process.env.BF_SERVICE ?? "http://127.0.0.1:8000";

// Those browsers know light-dark(); for others it would become the system's colours, whatever a person has chosen.
const cssTarget = ["chrome123", "firefox120", "safari17.5"];
const build = { chunkSizeWarningLimit: 800, target: "es2022", cssTarget, assetsInlineLimit: 0, modulePreload: { polyfill: false },
  license: { fileName: "licences.md" } }; // of all packages whose code is in the page
// Browsers load no modules and no fonts from the file system, so a published page is one classic script and one style sheet.
const published = {
  ...build, cssCodeSplit: false, assetsInlineLimit: 65536,
  rolldownOptions: { input: "src/published.ts", output: { format: "iife" as const, codeSplitting: false, entryFileNames: "page.js", assetFileNames: "page[extname]" } },
};

// The service allows nothing but files of its own: no inline script or style, no address elsewhere.
export default defineConfig(({ mode }) => ({
  plugins: [svelte()],
  base: "./",
  // three.js comes alone, when the robot is looked at.
  build: mode === "published" ? published : build,
  server: { proxy: { "/images": service, "/meshes": service, "/recordings": service, "/socket": { target: service, ws: true, changeOrigin: true, headers: { Origin: service } } } },
}));
