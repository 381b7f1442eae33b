// Asks for the token once; the server keeps it in a cookie that no script reads.

import { element } from "swarm/dom.js";
import { complain, main } from "swarm/page.js";

const hash = decodeURIComponent(location.hash.slice(1));
// What follows # is where to go then, or a token from the address that a program printed.
const target = hash.startsWith("/") && !hash.startsWith("//") ? hash : "/";

async function login(token) {
  const response = await fetch("/login", {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ token }),
  });
  if (response.ok) return location.replace(target);
  const { error } = await response.json().catch(() => ({ error: response.statusText }));
  complain(new Error(error));
}

document.title = "Log in – swarmevo";
const field = element("input", { type: "password", id: "token", autocomplete: "current-password", required: true });
const form = element("form", {
  className: "panel login",
  onsubmit: (event) => {
    event.preventDefault();
    login(field.value);
  },
},
  element("h1", {}, "swarmevo"),
  element("p", {}, "The token that clients of this coordinator use:"),
  field, element("button", { type: "submit" }, "Log in"));
main.replaceChildren(form);
field.focus();
if (hash && !hash.startsWith("/")) {
  history.replaceState(null, "", "/login");
  login(hash);
}
