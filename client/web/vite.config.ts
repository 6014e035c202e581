import { svelte } from "@sveltejs/vite-plugin-svelte";
import { defineConfig } from "vitest/config";
import { licences } from "./licences";

const named = licences();
export default defineConfig({
  plugins: [svelte(), named.main],
  // Relative, so that a server may have the page below any path.
  base: "./",
  build: {
    outDir: "../../build/web",
    emptyOutDir: true,
    // What tablets of the last years have.
    target: ["chrome100", "safari15.4", "firefox100"],
    modulePreload: { polyfill: false },
  },
  // 'npm run dev' has the page as it is being written; its calls go to a server's web listener.
  server: { proxy: { "^/vantage\\.v1\\.": process.env.VANTAGE_WEB ?? "http://127.0.0.1:7466" } },
  worker: { format: "es", plugins: () => [named.worker()] },
  test: { include: ["tests/unit/**/*.test.ts"], environment: "node" },
});
