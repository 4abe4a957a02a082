// Draws the sequence of each report that script/gallery made and writes gallery.md: node gallery.mjs WORK FOLDER
import { readFile, writeFile } from "node:fs/promises";
import { openPage } from "./test/browser.mjs";
import { closeAll } from "./test/harness.mjs";

const [work, folder] = process.argv.slice(2);
const list = (await readFile(`${work}/list`, "utf8")).trim().split("\n").map((line) => line.split("\t"));
let page = `# Gallery

Every template and every example, run as it is, and the sequence of its report. Made by \`script/gallery\`.
`;
for (const [name, from] of list) {
  const { page: tab, close } = await openPage(`${work}/${name}/report.html`, { viewport: { width: 1180, height: 900 }, colorScheme: "light" });
  await tab.addStyleTag({ content: ".still-row { grid-template-columns: repeat(3, minmax(0, 1fr)) !important; }" });
  const picture = tab.locator(".stills .still-row");
  await picture.screenshot({ path: `${folder}/images/gallery-${name}.png` });
  const title = (await tab.textContent("h1")).trim();
  const verdict = (await tab.textContent("[data-test=verdict]")).trim();
  await close();
  page += `
## ${title}

\`${from}\`

${verdict}

![${title}, from before the first charge to the end](images/gallery-${name}.png)
`;
}
page += `
## What a zone resists

\`topple rcc examples/rcc/zone_I.toml --normal-force "3.7 MN" --normal-force 0 -o zone\`

![Moment over rotation of a zone for two normal forces](images/gallery-zone.png)
`;
await writeFile(`${folder}/gallery.md`, page);
await closeAll();
process.exit(0);
