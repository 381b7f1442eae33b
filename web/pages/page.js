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

/** What a server says that cannot do what was asked, and its status; 0: there was no answer. */
class Refusal extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** Asks the server, and returns its answer. */
export async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Refusal("the server does not answer", 0);
  }
  if (response.ok) return response;
  const { error } = await response.json().catch(() => ({ error: `${response.status} ${response.statusText}` }));
  // The server asks for the token in place of this page, whose address stays.
  if (response.status === 401) location.reload();
  throw new Refusal(error, response.status);
}

export async function askJson(path) {
  return (await ask(path)).json();
}

/** Has the server do something. */
export async function order(path, body = {}) {
  const headers = { "Content-Type": "application/json" };
  return ask(path, { method: "POST", headers, body: JSON.stringify(body) });
}

/** Time until a connection is tried again that the browser has given up, ms. */
const AGAIN_AFTER = 2000;

/** News from the server, whenever there are some; the browser connects again by itself, and
 *  says which event was the last. `onEnd(refusal)`: the server is there, and will not have more. */
export function listen(path, onData, onEnd = (refusal) => complain(refusal, "news")) {
  let source = null;
  let isOver = false;
  const connect = () => {
    if (isOver) return;
    source = new EventSource(path);
    source.onopen = () => setStatus("live", "");
    source.onmessage = (event) => onData(JSON.parse(event.data), event.lastEventId);
    source.onerror = () => {
      setStatus("connecting again", "bad");
      if (source.readyState === EventSource.CLOSED) look();
    };
  };
  // After some answers a browser gives up, without a word on the answer.
  const look = async () => {
    try {
      (await ask(path, { headers: { Accept: "text/event-stream" } })).body.cancel();
      connect();
    } catch (refusal) {
      const isFinal = refusal.status >= 400 && refusal.status < 500 && refusal.status !== 429;
      if (!isFinal) return void setTimeout(look, AGAIN_AFTER);
      isOver = true;
      setStatus("ended", "bad");
      onEnd(refusal);
    }
  };
  connect();
  // A page that comes back from the history of a browser goes on.
  addEventListener("pagehide", () => source.close());
  addEventListener("pageshow", (event) => event.persisted && connect());
  return () => {
    isOver = true;
    source.close();
  };
}

function setStatus(text, className) {
  const status = document.getElementById("connection");
  if (status) Object.assign(status, { textContent: `● ${text}`, className: className || "good" });
}

/** What is wrong, by what has gone wrong. */
const problems = new Map();

/** Shows that something went wrong, with what the server says, until it is resolved or somebody
 *  has read it. `what`: which attempt failed; its next success resolves it. */
export function complain(error, what = "page") {
  const text = error.message;
  const known = problems.get(what);
  if (known?.dataset.text === text) return;
  known?.remove();
  const close = element("button", { type: "button", title: "I have read it", "aria-label": "dismiss", onclick: () => resolve(what) }, "×");
  const line = element("p", { className: "problem" }, element("span", {}, text), element("span", { className: "space" }), close);
  line.dataset.text = text;
  problems.set(what, line);
  let box = document.getElementById("problem");
  if (!box) document.querySelector("main").before(box = element("div", { id: "problem", role: "alert" }));
  box.append(line);
}

/** What had gone wrong works again, or somebody has read of it. */
export function resolve(what) {
  problems.get(what)?.remove();
  problems.delete(what);
  if (problems.size === 0) document.getElementById("problem")?.remove();
}

/** Says in place of the page that what it shows is not there, and where to go on. */
export function endPage(title, text, ...links) {
  main.replaceChildren(element("section", { className: "panel end" }, element("h1", {}, title), element("p", {}, text),
    element("p", { className: "row" }, ...links.map(([href, name]) => element("a", { className: "play", href }, name)))));
}

/** Does one thing at a time: what is asked for meanwhile is done once more, after it. */
export function oneByOne(work) {
  let running = null;
  let isWanted = false;
  const run = async () => {
    do {
      isWanted = false;
      await work();
    } while (isWanted);
  };
  return () => {
    if (running) isWanted = true;
    else running = run().finally(() => (running = null));
    return running;
  };
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
