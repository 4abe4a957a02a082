// How a page from disk begins: reads its data, shows them or what is wrong with them.
import { render, type ComponentChild } from "preact";

/// `what` is it in words ("report"); `show` sets the title and gives the page. A page without a picture is `ready` at
/// once, one with a picture when that is drawn.
export function startPage<T>(what: string, read: (text: string) => T, show: (data: T) => ComponentChild, ready: "now" | "drawn"): void {
  const root = document.getElementById("page") as HTMLElement;
  const setReady = (): void => void (document.documentElement.dataset["ready"] = "yes");
  let data: T;
  try {
    data = read(document.getElementById("topple-data")?.textContent ?? "null");
  } catch (error) {
    render(
      <main class="layout">
        <section class="panel" role="alert" data-test="problem">
          <h1>{`This ${what} cannot be shown`}</h1>
          <p>{error instanceof Error ? error.message : String(error)}</p>
        </section>
      </main>,
      root,
    );
    setReady();
    return;
  }
  root.textContent = "";
  render(show(data), root);
  if (ready === "now") setReady();
}
