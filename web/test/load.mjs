// A source of the page as a module for Node.
import { build } from "esbuild";

export async function load(file) {
  const result = await build({
    entryPoints: [new URL(`../src/${file}`, import.meta.url).pathname],
    bundle: true, write: false, format: "esm", jsx: "automatic", jsxImportSource: "preact", logLevel: "error",
    external: [], loader: { ".css": "empty" },
  });
  return import(`data:text/javascript;base64,${Buffer.from(result.outputFiles[0].text).toString("base64")}`);
}
