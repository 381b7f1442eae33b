// The filter and the order of a list, which are part of the address.

/** The default of each part of an address. */
const USUAL = { q: "", sort: "-id", by: "", show: "", open: "", archived: "" };

export class ListView {
  /** `columns`: all columns. `onChange`: called after every change. */
  constructor(columns, onChange) {
    Object.assign(this, { columns, onChange, parts: { ...USUAL } });
    const words = new URLSearchParams(location.search);
    for (const name of Object.keys(USUAL)) this.parts[name] = words.get(name) ?? USUAL[name];
  }

  /** Changes parts of the view, and the address with it. */
  set(parts) {
    Object.assign(this.parts, parts);
    const words = new URLSearchParams(Object.entries(this.parts).filter(([name, value]) => value !== USUAL[name]));
    history.replaceState(null, "", `${location.pathname}${words.size ? `?${words}` : ""}`);
    this.onChange();
  }

  get shown() {
    const names = list(this.parts.show);
    return this.columns.filter((column) => (names.length ? names.includes(column.name) : column.isUsual));
  }

  showColumn(name, isShown) {
    const names = this.columns.filter((it) => (it.name === name ? isShown : this.shown.includes(it))).map((it) => it.name);
    const isUsual = this.columns.every((it) => names.includes(it.name) === Boolean(it.isUsual));
    // An empty list would mean the usual columns, so the last column stays.
    if (names.length) this.set({ show: isUsual ? "" : names.join(",") });
  }

  /** The column that sorts, and 1 or -1; the number of the experiment if the name is unknown. */
  get order() {
    const name = this.parts.sort.replace("-", "");
    return { name, sign: this.parts.sort.startsWith("-") ? -1 : 1 };
  }

  /** Sorts by a column; a second call reverses the order, a third one restores the default. */
  sortBy({ name, isGreatFirst }) {
    const [first, second] = isGreatFirst ? [`-${name}`, name] : [name, `-${name}`];
    this.set({ sort: { [first]: second, [second]: USUAL.sort }[this.parts.sort] ?? first });
  }

  /** The order of two experiments. */
  compare = (a, b) => {
    const { name, sign } = this.order;
    const value = this.columns.find((it) => it.name === name)?.value ?? ((it) => it.id);
    const [x, y] = [value(a), value(b)];
    // Experiments without a value are last in both directions.
    if (x === null || y === null) return (x === null) - (y === null) || b.id - a.id;
    const way = typeof x === "string" ? x.localeCompare(y, undefined, { numeric: true }) : x - y;
    return sign * way || b.id - a.id;
  };

  /** Whether to show an experiment. A word `name=value` must equal a property or a label; any other
   *  word must occur in its text. A `-` before a word negates it. */
  filter() {
    const words = this.parts.q.toLowerCase().split(/\s+/).filter(Boolean);
    return (it) => {
      if (it.archived && !this.parts.archived) return false;
      if (words.length === 0) return true;
      const said = wordsOf(it);
      const holds = (word) => (word.includes("=") ? said.includes(word) : said.some((one) => one.includes(word)));
      return words.every((word) => (word.startsWith("-") ? !holds(word.slice(1)) : holds(word)));
    };
  }

  isOpen(group) {
    return list(this.parts.open).includes(encodeURIComponent(group));
  }

  toggle(group) {
    const open = list(this.parts.open);
    // A comma within a name does not end the name.
    const name = encodeURIComponent(group);
    this.set({ open: (open.includes(name) ? open.filter((it) => it !== name) : [...open, name]).join(",") });
  }
}

const list = (text) => text.split(",").filter(Boolean);

/** The searchable text of an experiment. */
function wordsOf(it) {
  const properties = { id: it.id, name: it.name, group: it.group, variant: it.variant, algorithm: it.algorithm, state: it.state, seed: it.seed, ...it.labels };
  const pairs = Object.entries(properties).filter(([, value]) => value !== "").map(([name, value]) => `${name}=${value}`);
  return pairs.map((pair) => pair.toLowerCase());
}

/** The properties that can group a list: the name of each, and its value for an experiment. */
export function groupings(experiments) {
  const keys = new Set([...experiments].flatMap((it) => Object.keys(it.labels)));
  return {
    group: (it) => it.group, variant: (it) => [it.group, it.variant].filter(Boolean).join(" · "), name: (it) => it.name,
    algorithm: (it) => it.algorithm, state: (it) => it.state,
    ...Object.fromEntries([...keys].sort().map((key) => [`label ${key}`, (it) => it.labels[key] ?? ""])),
  };
}
