import type { Status } from "./data";
import { statusWord, wordsOfEvent, zoneStates, type ZoneStateWords } from "./vocabulary";

const paths: Record<string, string> = {
  circle: "M8 2.5a5.5 5.5 0 1 0 .01 0Z",
  triangle: "M8 1.8 14.6 13.8 1.4 13.8Z",
  down: "M8 14.2 1.4 2.2 14.6 2.2Z",
  diamond: "M8 1 15 8 8 15 1 8Z",
  square: "M3 3h10v10H3Z",
  cross: "M3.6 1.5 8 5.9l4.4-4.4 2.1 2.1L10.1 8l4.4 4.4-2.1 2.1L8 10.1l-4.4 4.4-2.1-2.1L5.9 8 1.5 3.6Z",
  ring: "M8 1.5a6.5 6.5 0 1 0 .01 0ZM8 4.3a3.7 3.7 0 1 1-.01 0Z",
  star: "M8 .8l1.9 5.1L15.2 8l-5.3 2.1L8 15.2l-1.9-5.1L.8 8l5.3-2.1Z",
};

/// A sign in front of its word; screen readers hear the word only.
export function Sign(props: { shape: string; colour: string; size?: number }) {
  const size = props.size ?? 12;
  return (
    <svg class="sign" width={size} height={size} viewBox="0 0 16 16" aria-hidden="true">
      <path d={paths[props.shape] ?? (paths["circle"] as string)} style={{ fill: props.colour }} />
    </svg>
  );
}

const statusPaths: Record<Status, string> = {
  info: "M7 6.6h2v5.6H7zM7 3.6h2v2H7z",
  good: "M3.9 8.3 5.3 6.9l1.9 1.9 3.9-4 1.4 1.4-5.3 5.4Z",
  warning: "M7.1 5.6h1.8v4.2H7.1zM7.1 10.9h1.8v1.8H7.1z",
  bad: "M4.4 5.8 5.8 4.4 8 6.6l2.2-2.2 1.4 1.4L9.4 8l2.2 2.2-1.4 1.4L8 9.4l-2.2 2.2-1.4-1.4L6.6 8Z",
  not_judged: "M5.2 6.2a2.8 2.8 0 1 1 4.1 2.5c-.6.3-.6.5-.6 1.1H7.2c0-1.2.2-1.7 1.2-2.3.6-.4.8-.7.8-1.2a1.2 1.2 0 0 0-2.4 0ZM7.2 10.8h1.6v1.7H7.2z",
};
const statusGround: Record<Status, string> = {
  info: "M8 0a8 8 0 1 0 .01 0Z",
  good: "M8 0a8 8 0 1 0 .01 0Z",
  warning: "M8 .6 16 15H0Z",
  bad: "M4.7 0h6.6L16 4.7v6.6L11.3 16H4.7L0 11.3V4.7Z",
  not_judged: "M0 0h16v16H0Z",
};

export function StatusSign(props: { status: Status; size?: number }) {
  const size = props.size ?? 18;
  return (
    <svg class={`status-sign ${props.status}`} width={size} height={size} viewBox="0 0 16 16" aria-hidden="true">
      <path d={statusGround[props.status]} fill="currentColor" />
      <path d={statusPaths[props.status]} fill="var(--on-status)" />
    </svg>
  );
}

export function StatusWord(props: { status: Status }) {
  return <span class={`status-word ${props.status}`}>{statusWord[props.status]}</span>;
}

export function ZoneSign(props: { words: ZoneStateWords }) {
  return <Sign shape={props.words.shape} colour={props.words.variable === undefined ? props.words.colour : `var(${props.words.variable})`} />;
}

export function ZoneStateWord(props: { state: number }) {
  const words = zoneStates[props.state];
  if (words === undefined) return <span>unknown</span>;
  return (
    <span class="with-sign">
      <ZoneSign words={words} /> {words.word}
    </span>
  );
}

export function EventSign(props: { kind: string; size?: number }) {
  const words = wordsOfEvent(props.kind);
  return <Sign shape={words.shape} colour={words.colour} {...(props.size === undefined ? {} : { size: props.size })} />;
}
