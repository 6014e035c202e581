// Whole jobs in a browser: a server of its own, Chromium. See tests/browser.
import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["tests/browser/**/*.test.ts"],
    environment: "node",
    // One browser at a time: the machine is a crew's laptop, or smaller.
    fileParallelism: false,
    testTimeout: 120_000,
    hookTimeout: 60_000,
  },
});
