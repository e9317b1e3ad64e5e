// Makes the page that the program embeds from src/: script and style inline, allowed by their hashes and nothing else,
// so that the page can ask for nothing. Usage: node build.mjs OUT.html; scripts/viewer runs this.
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync } from "node:fs";
import * as esbuild from "esbuild";

const folder = new URL(".", import.meta.url).pathname;
const read = (name) => readFileSync(folder + name, "utf8");

const built = await esbuild.build({
  absWorkingDir: folder,
  entryPoints: ["src/main.ts", "src/style.css"],
  outdir: "dist",
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: ["chrome111", "firefox113", "safari16.4"],
  legalComments: "none", // the licences are in the page
  charset: "utf8",
});
const output = (end) => built.outputFiles.find((file) => file.path.endsWith(end)).text.trim();
const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");

const script = output(".js").replaceAll("</script", "<\\/script");
const style = output(".css");
const parts = {
  policy: `default-src 'none'; script-src ${hash(script)}; style-src ${hash(style)}; base-uri 'none'; ` +
    "form-action 'none'",
  style,
  licence: escaped(read("node_modules/three/LICENSE").trim()),
  script,
};
const page = read("src/page.html").replace(/\{\{(\w+)\}\}/g, (mark, name) => parts[name] ?? mark);
writeFileSync(process.argv[2], page);
