// Builds dist/report.html: one page with its script and style inside and a marker where the data of a run goes.
import { createHash } from "node:crypto";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const marker = "<!--TOPPLE-DATA-->";

const result = await build({
  absWorkingDir: import.meta.dirname ?? new URL(".", import.meta.url).pathname,
  entryPoints: { report: "src/main.tsx" },
  outdir: "dist",
  bundle: true,
  minify: true,
  write: false,
  metafile: true,
  format: "iife",
  target: ["es2020", "chrome100", "firefox100"],
  charset: "utf8",
  legalComments: "none",
  jsx: "automatic",
  jsxImportSource: "preact",
  logLevel: "warning",
});

const text = (ending) => result.outputFiles.find((file) => file.path.endsWith(ending)).text.trim();
const script = text(".js");
const style = text(".css");
// Only this very script may run and nothing may be fetched, whatever the text of a plan holds.
const digest = createHash("sha256").update(script).digest("base64");
const policy = `default-src 'none'; script-src 'sha256-${digest}'; style-src 'unsafe-inline'; img-src data: blob:`;

/// The licences of the libraries that went into the script; they ask to go with every copy.
async function findNotices() {
  const inputs = Object.keys(result.metafile.inputs);
  const names = new Set(inputs.map((path) => /^node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1]).filter(Boolean));
  const texts = [...names].sort().map(async (name) => {
    const folder = new URL(`node_modules/${name}/`, import.meta.url);
    const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
    if (file === undefined) throw new Error(`${name} has no licence`);
    return `${name}\n\n${(await readFile(new URL(file, folder), "utf8")).trim()}\n`;
  });
  return (await Promise.all(texts)).join("\n").replace(/</g, "&lt;");
}
const notices = await findNotices();

const template = await readFile(new URL("src/report.html", import.meta.url), "utf8");
const page = template
  .replace("{{policy}}", () => policy)
  .replace("{{style}}", () => style)
  .replace("{{notices}}", () => notices)
  .replace("{{script}}", () => script);

if (page.split(marker).length !== 2) throw new Error(`report.html must hold ${marker} once`);
if (script.includes("</script")) throw new Error("the script would end its own tag");
await mkdir(new URL("dist/", import.meta.url), { recursive: true });
await writeFile(new URL("dist/report.html", import.meta.url), page);
console.log(`dist/report.html: ${Math.round(page.length / 1024)} kB`);
