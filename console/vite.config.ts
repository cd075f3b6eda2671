import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vite";

export default defineConfig({
  // The gateway may stand behind a proxy at a sub-path.
  base: "./",
  plugins: [svelte()],
  // The client's sources are taken as they are; what they need stands in our own lock file.
  resolve: { dedupe: ["openapi-fetch"] },
  build: { outDir: "../api/console/built", emptyOutDir: true, target: "es2023", assetsInlineLimit: 0 },
});
