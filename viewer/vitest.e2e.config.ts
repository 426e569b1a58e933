// The checks that open the built page in a browser; run the build first (npm run e2e does both).
import { defineConfig } from "vitest/config";

export default defineConfig({
  test: { include: ["tests/*.e2e.ts"], testTimeout: 120_000, hookTimeout: 120_000, fileParallelism: false },
});
