// What all pages of a server have: the bar at the top, questions to the server, and news.

import { element } from "swarm/dom.js";

/** Where a page puts what it shows. */
export const main = document.getElementById("page");

/** Draws the bar, and sets the title. `current`: the path of this page's link. */
export function bar(title, current) {
  document.title = `${title} – swarmevo`;
  const link = (path, text) => element("a", { href: path, ...(path === current ? { "aria-current": "page" } : {}) }, text);
  const status = element("span", { id: "connection", className: "muted" });
  document.body.prepend(element("nav", {},
    element("a", { href: "/", className: "name" }, "swarmevo"),
    link("/", "Experiments"), link("/compare", "Compare"), link("/fleet", "Fleet"),
    element("span", { className: "space" }), status));
}

/** What a server says that cannot do what was asked. */
export class Refusal extends Error {}

/** Asks the server, and returns its answer. */
export async function ask(path, options = {}) {
  const response = await fetch(path, options);
  if (response.status === 401) {
    location.assign(`/login#${encodeURIComponent(location.pathname + location.search)}`);
    throw new Refusal("log in again");
  }
  if (!response.ok) {
    const { error } = await response.json().catch(() => ({ error: response.statusText }));
    throw new Refusal(error);
  }
  return response;
}

export async function askJson(path) {
  return (await ask(path)).json();
}

/** Has the server do something. */
export async function order(path, body = {}) {
  const headers = { "Content-Type": "application/json" };
  return ask(path, { method: "POST", headers, body: JSON.stringify(body) });
}

/** News from the server, whenever there are some; the browser connects again by itself, and
 *  says which event was the last. */
export function listen(path, onData) {
  let source = null;
  const connect = () => {
    source = new EventSource(path);
    source.onopen = () => setStatus("live", "");
    source.onmessage = (event) => onData(JSON.parse(event.data), event.lastEventId);
    source.onerror = () => {
      setStatus("connecting again", "bad");
      // After some answers a browser gives up; this does not.
      if (source.readyState === EventSource.CLOSED) setTimeout(connect, 2000);
    };
  };
  connect();
  addEventListener("pagehide", () => source.close());
  return () => source.close();
}

function setStatus(text, className) {
  const status = document.getElementById("connection");
  if (status) Object.assign(status, { textContent: `● ${text}`, className: className || "good" });
}

/** Shows that something went wrong, with what the server says. */
export function complain(error) {
  const box = document.getElementById("problem") ?? element("p", { id: "problem", role: "alert" });
  box.textContent = error.message;
  if (!box.isConnected) main.prepend(box);
}

/** "1 item", "2 items" */
export function counted(n, what) {
  return `${n} ${what}${n === 1 ? "" : "s"}`;
}

/** "3 s", "12 min", "4.2 h" */
export function span(ms) {
  const units = [[86_400_000, "d"], [3_600_000, "h"], [60_000, "min"], [1000, "s"]];
  for (const [unit, name] of units) {
    if (ms >= unit) return `${(ms / unit).toFixed(ms < 10 * unit && name !== "s" ? 1 : 0)} ${name}`;
  }
  return `${Math.round(ms)} ms`;
}

/** Milliseconds until an experiment has all its generations, at its latest pace. */
export function remaining(experiment, generations) {
  const durations = generations.slice(-20).map((row) => row[5]);
  if (experiment.state !== "running" || durations.length === 0) return null;
  const mean = durations.reduce((sum, ms) => sum + ms, 0) / durations.length;
  return mean * (experiment.generations - experiment.generations_done);
}

/** The state of an experiment, with its colour. */
export function stateMark(experiment) {
  return element("span", { className: `state ${experiment.state}`, title: experiment.reason }, experiment.state);
}
