import "../style.css";
import "./study.css";
import { render } from "preact";
import { readStudy, type Study } from "./data";
import { DebrisPlan, Fans, Memberships } from "./plots";
import { Runs } from "./runs";
import { makeState } from "./state";
import { Boxes, Drivers, Inputs, NotModelled, Notable, Origin } from "./tables";
import { Header, Outcomes } from "./verdict";

function Page(props: { study: Study }) {
  const state = makeState(props.study);
  return (
    <>
      <Header study={props.study} />
      <main class="study">
        <div class="pair">
          <Outcomes state={state} />
          <Inputs study={props.study} />
        </div>
        <div class="pair">
          <Fans state={state} />
          <DebrisPlan state={state} />
        </div>
        <Memberships state={state} />
        <Drivers state={state} />
        <Boxes state={state} />
        <Runs state={state} />
        <div class="pair">
          <Notable state={state} />
          <NotModelled study={props.study} />
        </div>
        <Origin study={props.study} />
      </main>
    </>
  );
}

function start(): void {
  const root = document.getElementById("page") as HTMLElement;
  root.textContent = "";
  try {
    const study = readStudy(document.getElementById("topple-data")?.textContent ?? "null");
    document.title = `${study.title || "Study"} – topple study`;
    render(<Page study={study} />, root);
  } catch (error) {
    render(
      <main class="study">
        <section class="panel" role="alert" data-test="problem">
          <h1>This study cannot be shown</h1>
          <p>{error instanceof Error ? error.message : String(error)}</p>
        </section>
      </main>,
      root,
    );
  }
  document.documentElement.dataset["ready"] = "yes";
}

start();
