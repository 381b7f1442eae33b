// The common parts of all pages of a server: the bar at the top, requests to the server,
// and news.

import { element } from "swarm/dom.js";
import { COLUMN } from "swarm/generation-row.js";

/** The place for the content of a page. */
export const main = document.getElementById("page");

/** Draws the bar, and sets the title. `current`: the path of this page's link. */
export function bar(title, current) {
  document.title = `${title} – swarmevo`;
  const link = (path, text) => element("a", { href: path, ...(path === current ? { "aria-current": "page" } : {}) }, text);
  const status = element("span", { id: "connection", className: "muted" });
  document.body.prepend(element("nav", {},
    element("a", { href: "/", className: "name" }, "swarmevo"),
    link("/", "Experiments"), link("/compare", "Compare"), link("/fleet", "Fleet"), link("/verify", "Verify"), link("/demo", "Demo"),
    element("span", { className: "space" }), status));
}

/** The message and the status of a failed request; 0: no answer. */
class Refusal extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** Sends a request to the server, and returns its answer. */
export async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Refusal("the server does not answer", 0);
  }
  if (response.ok) return response;
  const { error } = await response.json().catch(() => ({ error: `${response.status} ${response.statusText}` }));
  // The server shows the login in place of this page, at the same address.
  if (response.status === 401) location.reload();
  throw new Refusal(error, response.status);
}

export async function askJson(path) {
  return (await ask(path)).json();
}

/** Sends an action to the server. */
export async function order(path, body = {}) {
  const headers = { "Content-Type": "application/json" };
  return ask(path, { method: "POST", headers, body: JSON.stringify(body) });
}

/** Time between two requests of `askDuringRun`, ms: the server repeats generations for each. */
const ASK_EVERY = 5000;

/** Requests what `details` show while they are open, and again as evolution goes on. `take(answer)`
 *  draws it; `note`: the place for errors; `isDone()`: false if the answer lacks what the end of a
 *  run adds. The details get `update(n_generations, isOver)`: the number of generations, and whether
 *  no more follow. */
export function askDuringRun(details, path, { take, note, isDone }) {
  let n_generations = 0;
  let isAsking = false;
  let askedAt = -Infinity;
  const request = oneByOne(async () => {
    if (!details.open || details.hidden || n_generations === 0) return;
    isAsking = true;
    askedAt = performance.now();
    try {
      take(await askJson(path));
    } catch (error) {
      note.textContent = error.message;
    }
    isAsking = false;
  });
  details.ontoggle = request;
  details.update = (n, isOver) => {
    // An answer that is under way lacks what the end of a run adds.
    const isNew = n !== n_generations || (isOver && (isAsking || !isDone()));
    n_generations = n;
    if (isNew && (isOver || performance.now() - askedAt > ASK_EVERY)) request();
  };
}

/** Time until the page retries a failed request, or a connection that the browser gave up, ms. */
export const AGAIN_AFTER = 2000;

/** News from the server; the browser reconnects by itself, and sends the id of its last event.
 *  `onEnd(refusal)`: the server refuses to send more. */
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
  // After some answers a browser gives up, without telling which answer it was.
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
  // A page that returns from the history of a browser continues.
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

/** The present errors, by failed attempt. */
const problems = new Map();

/** Shows an error with the server's message, until it is resolved or the user has read it. `what`:
 *  the failed attempt; its next success resolves the error. */
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

/** Removes an error that is resolved, or that the user has read. */
export function resolve(what) {
  problems.get(what)?.remove();
  problems.delete(what);
  if (problems.size === 0) document.getElementById("problem")?.remove();
}

/** Replaces the page by a message that its subject does not exist, with a link. */
export function endPage(title, text, ...links) {
  main.replaceChildren(element("section", { className: "panel end" }, element("h1", {}, title), element("p", {}, text),
    element("p", { className: "row" }, ...links.map(([href, name]) => element("a", { className: "play", href }, name)))));
}

/** Does one thing at a time: requests during a run lead to one more run after it. */
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
  const durations = generations.slice(-20).map((row) => row[COLUMN.ms]);
  if (experiment.state !== "running" || durations.length === 0) return null;
  const mean = durations.reduce((sum, ms) => sum + ms, 0) / durations.length;
  return mean * (experiment.generations - experiment.generations_done);
}

/** The state of an experiment, with its colour. */
export function stateMark(experiment) {
  return element("span", { className: `state ${experiment.state}`, title: experiment.reason }, experiment.state);
}
