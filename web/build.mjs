// Builds dist/NAME.html for each page: one file with its script and style inside. A page without a server holds a marker
// where its data go.
import { createHash } from "node:crypto";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const offline = { marker: "<!--TOPPLE-DATA-->", connect: "'none'", noscript: "This page shows its content with JavaScript, which is switched off in this browser." };

const served = { connect: "'self'", noscript: "This page works with JavaScript, which is switched off in this browser." };

const pages = [
  { name: "report", entry: "src/main.tsx", title: "topple report", ...offline },
  { name: "steer", entry: "src/steer.tsx", title: "topple", ...served },
  { name: "compare", entry: "src/compare.tsx", title: "topple compare", ...offline },
  { name: "study", entry: "src/study/main.tsx", title: "topple study", ...offline },
];

const folder = import.meta.dirname ?? new URL(".", import.meta.url).pathname;
const template = await readFile(new URL("src/page.html", import.meta.url), "utf8");

/// The licences of the libraries that went into a script; they ask to go with every copy.
async function findNotices(inputs) {
  const names = new Set(inputs.map((path) => /^node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1]).filter(Boolean));
  const texts = [...names].sort().map(async (name) => {
    const folder = new URL(`node_modules/${name}/`, import.meta.url);
    const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
    if (file === undefined) throw new Error(`${name} has no licence`);
    return `${name}\n\n${(await readFile(new URL(file, folder), "utf8")).trim()}\n`;
  });
  return (await Promise.all(texts)).join("\n").replace(/</g, "&lt;");
}

async function makePage({ name, entry, title, marker, connect, noscript }) {
  const result = await build({
    absWorkingDir: folder,
    entryPoints: { [name]: entry },
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
  const text = (ending) => result.outputFiles.find((file) => file.path.endsWith(ending))?.text.trim() ?? "";
  const script = text(".js");
  // Only this very script may run and nothing may be fetched from elsewhere, whatever the text of a plan holds.
  const digest = createHash("sha256").update(script).digest("base64");
  const values = {
    policy: `default-src 'none'; script-src 'sha256-${digest}'; style-src 'unsafe-inline'; img-src data: blob:; media-src blob:; connect-src ${connect}`,
    title, noscript, script,
    style: text(".css"),
    data: marker ?? "",
    notices: await findNotices(Object.keys(result.metafile.inputs)),
  };
  const page = template.replace(/{{(\w+)}}/g, (_, key) => values[key]);
  if (marker !== undefined && page.split(marker).length !== 2) throw new Error(`${name}.html must hold ${marker} once`);
  if (script.includes("</script")) throw new Error(`the script of ${name} would end its own tag`);
  await writeFile(new URL(`dist/${name}.html`, import.meta.url), page);
  console.log(`dist/${name}.html: ${Math.round(page.length / 1024)} kB`);
}

await mkdir(new URL("dist/", import.meta.url), { recursive: true });
await Promise.all(pages.map(makePage));
