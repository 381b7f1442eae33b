// Asks for the token once; the server keeps it in a cookie that no script reads.

import { element } from "swarm/dom.js";
import { complain, main } from "swarm/page.js";

// This page replaces any other page but keeps its address, so that shared links survive the
// login.
const isStandIn = location.pathname !== "/login";
/** The token in the address that a program printed. */
const printed = isStandIn ? "" : decodeURIComponent(location.hash.slice(1));

async function login(token) {
  try {
    const response = await fetch("/login", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ token }),
    });
    if (response.ok) return isStandIn ? location.reload() : location.replace("/");
    const { error } = await response.json().catch(() => ({ error: `${response.status} ${response.statusText}` }));
    complain(new Error(error), "login");
  } catch {
    complain(new Error("the server does not answer"), "login");
  }
}

document.title = "Log in – swarmevo";
const field = element("input", { type: "password", id: "token", autocomplete: "current-password", "aria-label": "token", required: true });
const form = element("form", {
  className: "panel login",
  onsubmit: (event) => {
    event.preventDefault();
    login(field.value);
  },
},
  element("h1", {}, "swarmevo"),
  element("p", {}, "The part after # of the address that the program printed, or a coordinator's client token:"),
  field, element("button", { type: "submit" }, "Log in"));
main.replaceChildren(form);
field.focus();
if (printed) {
  history.replaceState(null, "", "/login");
  login(printed);
}
