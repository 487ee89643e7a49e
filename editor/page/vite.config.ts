import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vite";

// Where a bf edit is that answers a page which is being developed.
const service = process.env.BF_SERVICE ?? "http://127.0.0.1:8000";

// The service allows nothing but files of its own: no inline script or style, no address elsewhere.
export default defineConfig({
  plugins: [svelte()],
  base: "./",
  // three.js comes alone, when the robot is looked at.
  build: { chunkSizeWarningLimit: 800, target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  server: { proxy: { "/meshes": service, "/recordings": service, "/socket": { target: service, ws: true, changeOrigin: true, headers: { Origin: service } } } },
});
