// Builds python/carom/page/report.html: one file, every script and style inside it, nothing fetched from anywhere.
import { readFileSync } from "node:fs";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

/** Puts the built script and style into the page itself, and the licences of what is inside into a comment at its head. */
function oneFile(): Plugin {
  return {
    name: "one-file",
    enforce: "post",
    generateBundle(_, bundle) {
      let script = "";
      let style = "";
      for (const [file, part] of Object.entries(bundle)) {
        if (part.type === "chunk") script += part.code;
        else if (file.endsWith(".css")) style += String(part.source);
        else continue;
        delete bundle[file];
      }
      const page = bundle["report.html"];
      if (page?.type !== "asset") this.error("report.html is not among the built files");
      // Inside <script>, "</script" and "<!--" would change how the browser reads the rest of the page.
      const safe = script.replaceAll("</script", "<\\/script").replaceAll("<!--", "\\x3C!--");
      const licences = ["three", "uplot"].map((name) => `${name}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}`);
      page.source = String(page.source)
        .replace(/\s*<script\b[^>]*\bsrc=[^>]*><\/script>/g, "")
        .replace(/\s*<link\b[^>]*\brel="(stylesheet|modulepreload)"[^>]*>/g, "")
        .replace("<head>", () => `<head>\n<!-- This page contains:\n\n${licences.join("\n\n")}\n-->`)
        .replace("</head>", () => `<style>${style.trim()}</style>\n</head>`)
        .replace("</body>", () => `<script type="module">${safe.trim()}</script>\n</body>`);
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [oneFile()],
  build: {
    outDir: "../python/carom/page",
    emptyOutDir: false,
    cssCodeSplit: false,
    modulePreload: false,
    chunkSizeWarningLimit: 2000,
    rolldownOptions: { input: "report.html" },
  },
  test: { include: ["tests/*.test.ts"] },
});
