// The items between coordinator and workers, as a picture shows them at a moment.

/** The place of an item: on its way out, waiting at its worker, computed, or on its way back. */
export class Items {
  constructor() {
    this.expected = [];
    this.items = new Map();
  }

  /** Events from the fleet, in the order of time. */
  expect(events) {
    this.expected.push(...events.filter((event) => "assignment" in event || event.what === "given-up"));
  }

  /** Lets everything happen up to a time. */
  advance(now) {
    let n = 0;
    while (n < this.expected.length && this.expected[n].at <= now) this.happen(this.expected[n++]);
    this.expected.splice(0, n);
    // The result of a worker that hangs by then is lost, and never said to arrive.
    for (const [assignment, item] of this.items) if (item.place === "back" && item.until < now) this.items.delete(assignment);
  }

  /** A worker was killed: its items are gone. */
  lose(worker) {
    this.forget(worker);
    this.expected = this.expected.filter((event) => event.worker !== worker);
  }

  forget(worker) {
    for (const [assignment, item] of this.items) if (item.worker === worker) this.items.delete(assignment);
  }

  happen({ what, at, until, assignment, worker, purpose, individual }) {
    const item = this.items.get(assignment);
    if (what === "sent") this.items.set(assignment, { place: "out", from: at, until, worker, purpose, individual });
    else if (what === "given-up") this.forget(worker);
    else if (what === "arrived" || what === "dropped") this.items.delete(assignment);
    else if (item) Object.assign(item, { place: what === "began" ? "computed" : "back", from: at, until });
  }

  /** The items of a worker that it has, the computed one first. */
  at(worker, now) {
    const its = [...this.items.values()].filter((item) => item.worker === worker && (item.place === "computed" || (item.place === "out" && item.until <= now)));
    return its.sort((a, b) => (b.place === "computed") - (a.place === "computed") || a.from - b.from);
  }
}
