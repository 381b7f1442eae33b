// Elements of a page, made in one line each.

/** An element with properties, attributes (data-..., aria-...) and children. */
export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
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

/** Calls back when the page changes between dark and light. */
export function onTheme(changed) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
}

/** A canvas that fills its parent, in pixels of the device; draws whenever its size changes. */
export function canvas(draw, label) {
  const node = element("canvas", { "aria-label": label, role: "img" });
  const fit = () => {
    const ratio = devicePixelRatio || 1;
    const { width, height } = node.getBoundingClientRect();
    node.width = Math.max(1, Math.round(width * ratio));
    node.height = Math.max(1, Math.round(height * ratio));
    const context = node.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw(context, width, height);
  };
  new ResizeObserver(fit).observe(node);
  node.redraw = () => {
    const ratio = devicePixelRatio || 1;
    draw(node.getContext("2d"), node.width / ratio, node.height / ratio);
  };
  return node;
}

/** A number with so many decimals, and a true minus sign. */
export function decimals(value, n) {
  if (!Number.isFinite(value)) return "–";
  return value.toFixed(n).replace("-", "−");
}
