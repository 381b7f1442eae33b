// What happens to a fleet, in words.

import { decimals } from "swarm/dom.js";

/** Tells the events of a fleet. */
export class Words {
  constructor(names, generations) {
    this.names = names;
    this.generations = generations;
    this.n_links = 0;
    this.asked = new Map();
  }

  /** The visitor has changed the state of a worker, whose report was `was`. */
  treated(worker, health, was) {
    const name = this.names[worker];
    const had = was.n_items === 0 ? "nothing" : was.n_items === 1 ? "an item" : `${was.n_items} items`;
    return {
      killed: was.is_connected ? `You kill ${name}. It had ${had}; others get that.` : `You kill ${name}.`,
      hung: `You stop ${name}. Nobody tells the coordinator.`,
      slow: `You slow ${name} down.`,
      lying: `You make ${name} lie, in the ninth decimal.`,
      healthy: was.quarantined ? `You mend ${name}, and readmit it.` : was.health === "killed" ? `You start ${name} again.` : `You mend ${name}.`,
    }[health];
  }

  /** The lines about a report: time, text, and kind. */
  of(report) {
    const lines = [];
    for (const event of report.events) {
      const line = this.line(event);
      if (line) lines.push([event.at, ...line]);
    }
    for (const link of report.disturbed.links.slice(this.n_links)) {
      if (link.is_last) lines.push([report.now, `The run is over. Its champion is worth ${decimals(link.best, 3)}.`, "good"]);
      else lines.push([report.now, `Generation ${link.n_generations - 1} is complete: best fitness ${decimals(link.best, 3)}.`, "muted"]);
    }
    this.n_links = report.disturbed.links.length;
    return lines;
  }

  line({ what, worker, reason, question, individual, first, end }) {
    const name = this.names[worker];
    if (what === "given-up") return [`The coordinator gives ${name} up: ${reason}.`, "told"];
    if (what === "quarantined") return [`The coordinator puts ${name} in quarantine: ${reason}.`, "bad"];
    if (what === "asked") {
      const trials = end - first === 1 ? `trial ${first}` : `trials ${first} to ${end - 1}`;
      return [`The coordinator asks the referee to compute ${trials} of individual ${individual}.`, "told"];
    }
    if (what === "answered") return ["The referee answers.", "told"];
    return null;
  }
}
