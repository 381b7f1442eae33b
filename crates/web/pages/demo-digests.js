// Two chains of digests, one above the other: a stripe for each generation, with a colour that its
// digest determines.

import { element } from "swarm/dom.js";

/** The colour of a digest. */
function stripeColor(digest) {
  const part = (from) => parseInt(digest.slice(from, from + 4), 16) / 0xffff;
  return `hsl(${Math.round(360 * part(0))} ${45 + Math.round(35 * part(4))}% ${42 + Math.round(26 * part(8))}%)`;
}

/** Whether two links are the same. */
const isSame = (a, b) => a.digest === b.digest && a.is_last === b.is_last;

/** The chains of a run; `show(report)` draws them. */
export function digests(generations) {
  const rows = [["undisturbed", "Nobody touches this fleet"], ["disturbed", "Your fleet"]].map(([run, name]) => {
    const stripes = Array.from({ length: generations + 1 }, () => element("i"));
    const text = element("code", { className: "digest" });
    const done = element("span", { className: "muted small" });
    const strip = element("div", { className: "stripes", "aria-hidden": "true" }, ...stripes);
    return { run, name, stripes, text, done, strip };
  });
  const verdict = element("p", { id: "verdict", className: "verdict", role: "status" });
  const node = element("section", { className: "panel digests" },
    ...rows.flatMap(({ run, name, text, done, strip }) => [element("div", { className: "of", id: run }, element("b", {}, name), done, text), strip]), verdict);
  let said = "";

  function show(report) {
    const chains = rows.map(({ run }) => report[run].links);
    const n_common = Math.min(...chains.map((links) => links.length));
    const differs = chains[0].slice(0, n_common).findIndex((link, i) => !isSame(link, chains[1][i]));
    rows.forEach(({ run, stripes, text, done }, row) => {
      const links = chains[row];
      stripes.forEach((stripe, i) => {
        stripe.style.background = links[i] ? stripeColor(links[i].digest) : "";
        stripe.className = differs >= 0 && i >= differs && i < n_common ? "differs" : "";
      });
      const latest = links.at(-1);
      text.textContent = latest ? `${latest.digest.slice(0, 12)}…` : "–";
      text.title = latest?.digest ?? "";
      const over = report[run].over_at;
      done.textContent = over === null ? `${links.length} of ${generations} generations` : `done after ${(over / 1000).toFixed(0)} s`;
    });
    say(report, n_common, differs);
  }

  function say(report, n_common, differs) {
    const { disturbed, undisturbed } = report;
    const isOver = disturbed.over_at !== null && undisturbed.over_at !== null;
    let text = "The first generation is on its way.";
    if (differs >= 0) text = `Since generation ${differs}, the digests differ: a lie that nobody audited is in the result.`;
    else if (isOver) text = `Not a bit has moved: ${disturbed.links.at(-1).digest}, which swarmctl run --example quickstart prints on every machine. Your faults cost ${Math.max(0, (disturbed.over_at - undisturbed.over_at) / 1000).toFixed(0)} s.`;
    else if (n_common > 0) text = `${n_common} ${n_common === 1 ? "generation" : "generations"}, and not a bit differs.`;
    if (text === said) return;
    said = text;
    verdict.textContent = `${differs >= 0 ? "≠" : n_common > 0 ? "=" : "…"} ${text}`;
    verdict.className = `verdict ${differs >= 0 ? "bad" : n_common > 0 ? "good" : "muted"}`;
    // Screen readers hear every tenth generation, and the end.
    verdict.setAttribute("aria-live", differs >= 0 || isOver || n_common % 10 === 0 ? "polite" : "off");
  }

  return { node, show };
}
