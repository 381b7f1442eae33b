// Creates elements of a page, each in one line.

/** An element with properties, attributes (data-..., aria-...) and children. */
export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "id" && !value) continue;
    if (name.includes("-")) node.setAttribute(name, value);
    else node[name] = value;
  }
  node.append(...children.filter((child) => child !== null && child !== undefined));
  return node;
}

/** The value of a custom property of the style, such as `--accent`. */
export function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Calls back when the page changes between dark and light, before canvases are drawn again. */
export function onTheme(changed) {
  themed.push(changed);
}

const themed = [];
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const changed of themed) changed();
  // A search of the page, because a list would keep removed canvases in memory.
  for (const node of document.querySelectorAll("canvas")) node.redraw?.();
});

/** A canvas that fills its parent, in pixels of the device; draws whenever its size changes. It
 *  draws nothing while it has no size, as in a hidden frame or after it was removed, so `draw` gets
 *  a width and a height of at least one pixel. Without a label, the surrounding elements must
 *  describe it. */
export function canvas(draw, label) {
  const node = element("canvas", label ? { "aria-label": label, role: "img" } : { "aria-hidden": "true" });
  let size = null;
  node.redraw = () => {
    if (size) draw(node.getContext("2d"), ...size);
  };
  new ResizeObserver(() => {
    const ratio = devicePixelRatio || 1;
    const { width, height } = node.getBoundingClientRect();
    size = width >= 1 && height >= 1 ? [width, height] : null;
    if (!size) return;
    node.width = Math.round(width * ratio);
    node.height = Math.round(height * ratio);
    node.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
    node.redraw();
  }).observe(node);
  return node;
}

/** Lets keys act on an element that has the focus. `actionsOf(by)`: the action of each key, nothing
 *  while there is nothing to act on; `by`: 10 with Shift, otherwise 1. */
export function onKeys(node, actionsOf) {
  node.addEventListener("keydown", (event) => {
    // The browser's own shortcuts stay.
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const action = actionsOf(event.shiftKey ? 10 : 1)?.[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

/** A number with a number of decimals, and a true minus sign. Tiny and huge numbers get a power of
 *  ten. */
export function decimals(value, n) {
  if (!Number.isFinite(value)) return "–";
  const isPlain = n <= 12 && Math.abs(value) < 1e9;
  return (isPlain ? value.toFixed(n) : value.toExponential(3)).replaceAll("-", "−");
}
